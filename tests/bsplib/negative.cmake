# Types that cannot travel must not compile, and the compiler must say why.
set(compile ${CMAKE_CXX_COMPILER} -std=c++20 -I${CMAKE_SOURCE_DIR}/bsplib/include)
foreach(directory ${MPI_CXX_INCLUDE_DIRS})
  list(APPEND compile -isystem ${directory})
endforeach()
# What all cases include is parsed once; a tenth of the time is left of each.
set(parsed ${CMAKE_CURRENT_BINARY_DIR}/parsed)
file(MAKE_DIRECTORY ${parsed})
add_test(NAME bsplib.compile.headers
  COMMAND ${compile} -x c++-header ${CMAKE_CURRENT_SOURCE_DIR}/does_not_compile.hpp -o ${parsed}/does_not_compile.hpp.gch)
set_tests_properties(bsplib.compile.headers PROPERTIES TIMEOUT 300 FIXTURES_SETUP bsplib_parsed)
list(APPEND compile -fsyntax-only -I${parsed} -I${CMAKE_CURRENT_SOURCE_DIR})
set(pointers "static assertion failed: bsp2: pointers, references, and views, arrays, pairs or tuples")
set(trivially "static assertion failed: bsp2: only trivially copyable types travel by put and get")
foreach(entry nothing
    "put_string:${trivially}" "put_pointer:${pointers}" "put_view:${pointers}" "put_reference_wrapper:${pointers}"
    "put_array_of_pointers:${pointers}" "put_nested_pointers:${pointers}" "registered_pointers:${pointers}"
    "array_of_vector:${trivially}"
    "queue_pointer:${pointers}" "queue_reference:${pointers}" "queue_reference_wrapper:${pointers}"
    "queue_array_of_pointers:${pointers}" "queue_pair_of_pointers:${pointers}" "queue_tuple_of_pointers:${pointers}"
    "queue_vector_of_pointers:${pointers}" "collectives_pair_of_pointers:${pointers}"
    "queue_without_default:static assertion failed: bsp2: a message that is archived needs a default constructor"
    "queue_without_serialize:no member named .*serialize" "broadcast_pointers:no matching function|constraint"
    "span_of_other_type:no matching function" "world_of_queue:use of deleted function|no matching function")
  string(REGEX MATCH "^[^:]+" case "${entry}")
  string(REGEX REPLACE "^([^:]+):?(.*)$" "\\2" expected "${entry}")
  string(TOUPPER ${case} macro)
  set(command ${compile} -DCASE_${macro} ${CMAKE_CURRENT_SOURCE_DIR}/does_not_compile.cpp)
  if(NOT case STREQUAL nothing)
    string(REPLACE ";" "|" joined "${command}")
    set(command ${CMAKE_COMMAND} "-DCOMMAND=${joined}" "-DEXPECT=${expected}"
        -P ${CMAKE_CURRENT_SOURCE_DIR}/expect_failure.cmake)
  endif()
  add_test(NAME bsplib.compile.${case} COMMAND ${command})
  set_tests_properties(bsplib.compile.${case} PROPERTIES TIMEOUT 120 FIXTURES_REQUIRED bsplib_parsed)
endforeach()
