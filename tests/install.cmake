# Installs the program, moves the installation, and runs it: with the modules that came with it, never with those of the build.
#   cmake -DBUILD=... -DWORK=... -DMODEL=... -P install.cmake
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --component bsp2 --prefix ${WORK}/installed COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
file(RENAME ${WORK}/installed ${WORK}/moved)
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_DEBUG=libs ${WORK}/moved/bin/bsp2 run ${MODEL} -o ${WORK}/out
  COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET ERROR_VARIABLE libraries)
foreach(module bsp2-vtk.so bsp2-hdf5.so bsp2-cairo.so)
  string(REGEX MATCHALL "calling init: [^\n]*/${module}" found "${libraries}")
  string(FIND "${found}" "calling init: ${WORK}/moved/" place)
  if(NOT place EQUAL 0 OR found MATCHES ";")
    message(FATAL_ERROR "The installed program loads '${found}'")
  endif()
endforeach()
# The page of `bsp2 view`, where it could be made.
file(GLOB_RECURSE page RELATIVE ${BUILD} ${BUILD}/lib*/bsp2/view/view.js)
if(page AND NOT EXISTS ${WORK}/moved/${page})
  message(FATAL_ERROR "The page is not installed as ${page}")
endif()
# Neither it nor that of the build looks for libraries in the current directory.
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_DEBUG=libs ${BUILD}/bin/bsp2 --version COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET ERROR_VARIABLE built)
if("${libraries}${built}" MATCHES "trying file=([^/][^\n]*)")
  message(FATAL_ERROR "A library is looked for in the current directory: '${CMAKE_MATCH_1}'")
endif()
# What text() and packed files need comes with it, too.
file(WRITE ${WORK}/text.csg "linear_extrude(height = 1) { text(text = \"b\"); }\n")
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_DEBUG=libs ${WORK}/moved/bin/bsp2 run ${WORK}/text.csg
  COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET ERROR_VARIABLE libraries)
if(NOT libraries MATCHES "calling init: ${WORK}/moved/[^\n]*/bsp2-text.so")
  message(FATAL_ERROR "The installed program draws text without its module")
endif()
file(WRITE ${WORK}/packed/solid.amf "<amf unit=\"millimeter\"><object id=\"0\"><mesh><vertices>"
  "<vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex><vertex><coordinates><x>1</x><y>0</y><z>0</z></coordinates></vertex>"
  "<vertex><coordinates><x>0</x><y>1</y><z>0</z></coordinates></vertex><vertex><coordinates><x>0</x><y>0</y><z>1</z></coordinates></vertex></vertices>"
  "<volume><triangle><v1>0</v1><v2>2</v2><v3>1</v3></triangle><triangle><v1>0</v1><v2>1</v2><v3>3</v3></triangle>"
  "<triangle><v1>1</v1><v2>2</v2><v3>3</v3></triangle><triangle><v1>0</v1><v2>3</v2><v3>2</v3></triangle></volume></mesh></object></amf>\n")
execute_process(COMMAND ${CMAKE_COMMAND} -E tar cf ../packed.amf --format=zip solid.amf WORKING_DIRECTORY ${WORK}/packed COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${WORK}/packed.csg "import(file = \"packed.amf\");\n")
execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_DEBUG=libs ${WORK}/moved/bin/bsp2 run ${WORK}/packed.csg
  COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET ERROR_VARIABLE libraries)
if(NOT libraries MATCHES "calling init: ${WORK}/moved/[^\n]*/bsp2-zip.so")
  message(FATAL_ERROR "The installed program opens a package without its module")
endif()
foreach(reader bsp2-read-cad bsp2-read-vtk)
  file(GLOB_RECURSE found ${WORK}/moved/${reader})
  if(NOT found)
    message(FATAL_ERROR "${reader} is not installed")
  endif()
endforeach()
foreach(file solid.pvtu snapshot.h5 report.json view.png)
  if(NOT EXISTS ${WORK}/out/${file})
    message(FATAL_ERROR "The installed program has not written ${file}")
  endif()
endforeach()
# Without its modules it does not take those of the build.
file(GLOB_RECURSE module RELATIVE ${WORK} ${WORK}/moved/*/bsp2-vtk.so)
cmake_path(GET module PARENT_PATH modules)
file(REMOVE_RECURSE ${WORK}/${modules})
execute_process(COMMAND ${WORK}/moved/bin/bsp2 run ${MODEL} -o ${WORK}/without OUTPUT_QUIET ERROR_VARIABLE message RESULT_VARIABLE code)
if(NOT code EQUAL 2 OR NOT message MATCHES "^bsp2: cannot load [^\n]*${modules}[^\n]*\n$")
  message(FATAL_ERROR "Without its modules the program ends with ${code}: ${message}")
endif()
