# Installs the program, moves the installation, and runs it: with the modules that came with it, not with those of the build.
#   cmake -DBUILD=... -DWORK=... -DMODEL=... -P install.cmake
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --component bsp2 --prefix ${WORK}/installed COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
file(RENAME ${WORK}/installed ${WORK}/moved)
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_DEBUG=libs ${WORK}/moved/bin/bsp2 run ${MODEL} -o ${WORK}/out
  COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET ERROR_VARIABLE libraries)
foreach(module bsp2-vtk.so bsp2-hdf5.so)
  string(REGEX MATCHALL "calling init: [^\n]*/${module}" found "${libraries}")
  string(FIND "${found}" "calling init: ${WORK}/moved/" place)
  if(NOT place EQUAL 0 OR found MATCHES ";")
    message(FATAL_ERROR "The installed program loads '${found}'")
  endif()
endforeach()
foreach(file solid.pvtu snapshot.h5 report.json)
  if(NOT EXISTS ${WORK}/out/${file})
    message(FATAL_ERROR "The installed program has not written ${file}")
  endif()
endforeach()
