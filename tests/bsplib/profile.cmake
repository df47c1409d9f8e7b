# BSP2_PROFILE and bsp2-profile.
add_executable(bsplib_unbalanced examples/unbalanced.c)
target_link_libraries(bsplib_unbalanced PRIVATE bsp2::bsplib)
find_program(python3 python3)
foreach(ranks 1 2 3 4)
  add_test(NAME bsplib.profile.${ranks} COMMAND ${CMAKE_COMMAND} -DRANKS=${ranks} -DMPIEXEC=${MPIEXEC_EXECUTABLE} -DPYTHON=${python3}
    -DPROGRAM=$<TARGET_FILE:bsplib_unbalanced> -DTOOL=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/bsp2-profile
    -DWORK=${CMAKE_CURRENT_BINARY_DIR}/profile${ranks} -P ${CMAKE_CURRENT_SOURCE_DIR}/profile_run.cmake)
  set_tests_properties(bsplib.profile.${ranks} PROPERTIES TIMEOUT 120
    ENVIRONMENT "${BSPLIB_MPI_ENVIRONMENT}")
endforeach()
if(python3)
  add_test(NAME bsplib.profile.drawing COMMAND ${python3} ${CMAKE_CURRENT_SOURCE_DIR}/profile_test.py
    ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/bsp2-profile ${CMAKE_CURRENT_BINARY_DIR}/profile_drawing)
  set_tests_properties(bsplib.profile.drawing PROPERTIES TIMEOUT 120)
endif()
