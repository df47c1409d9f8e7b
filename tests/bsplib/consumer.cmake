# Installs the layer, builds the consumer against the installation alone, and runs it.
#   cmake -DBUILD=... -DSOURCE=... -DWORK=... -DMPIEXEC=... -P consumer.cmake
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --component bsplib --prefix ${WORK}/installed)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/installed -DCMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build ${WORK}/build)
foreach(program classic typed)
  run(${MPIEXEC} --oversubscribe -n 2 ${WORK}/build/${program})
endforeach()
run(${MPIEXEC} --oversubscribe -n 2 ${WORK}/installed/bin/bsp2-probe -o ${WORK}/machine.json)
file(READ ${WORK}/machine.json machine)
if(NOT machine MATCHES "g_seconds_per_byte")
  message(FATAL_ERROR "bsp2-probe stored no machine: ${machine}")
endif()
