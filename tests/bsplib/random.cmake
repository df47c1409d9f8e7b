# Random programs against the sequential model: with shared staging memory, with messages only, and with little of it. As many as those
# within which each defect below must be found.
add_library(bsplib_random_programs OBJECT random_test.cpp)
target_link_libraries(bsplib_random_programs PRIVATE bsp2::bsplib bsp2_test_options)
add_executable(bsplib_random $<TARGET_OBJECTS:bsplib_random_programs>)
target_link_libraries(bsplib_random PRIVATE bsp2::bsplib)
foreach(ranks 1 2 3 4)
  bsplib_run(bsplib.random.shared.${ranks} RANKS ${ranks} COMMAND bsplib_random 1 2000 TIMEOUT 900)
  if(ranks EQUAL 1)
    continue()  # it has nobody to share memory with, so the modes are the same
  endif()
  bsplib_run(bsplib.random.messages.${ranks} RANKS ${ranks} COMMAND bsplib_random 10001 2000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=0)
  bsplib_run(bsplib.random.mixed.${ranks} RANKS ${ranks} COMMAND bsplib_random 20001 2000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=2048)
endforeach()

# A deliberately broken copy of the layer: the random programs must catch each defect, and agree with the model where none is chosen.
get_target_property(BSPLIB_DIR bsp2_bsplib SOURCE_DIR)
get_target_property(bsplib_sources bsp2_bsplib SOURCES)
list(FILTER bsplib_sources INCLUDE REGEX "[.]cpp$")
list(TRANSFORM bsplib_sources PREPEND ${BSPLIB_DIR}/)
add_executable(bsplib_defective $<TARGET_OBJECTS:bsplib_random_programs> ${bsplib_sources})
set(dialects ${bsplib_sources})
list(FILTER dialects INCLUDE REGEX "/classic/classic[_a-z0-9]*[.]cpp$")
set_source_files_properties(${dialects} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)  # which define the same functions
set_target_properties(bsplib_defective PROPERTIES UNITY_BUILD_BATCH_SIZE 0)
target_include_directories(bsplib_defective PRIVATE ${BSPLIB_DIR}/include ${BSPLIB_DIR}/src)
target_compile_definitions(bsplib_defective PRIVATE BSP2_BSPLIB_DEFECTS)
target_link_libraries(bsplib_defective PRIVATE bsp2_test_options MPI::MPI_CXX Boost::mpi Boost::serialization)
bsplib_run(bsplib.defect.none RANKS 2 COMMAND bsplib_defective 1 300)
set(number 0)
foreach(defect drop_put gets_after_puts swap_messages forget_pop late_put early_tagsize early_registration puts_in_reverse merge_wrongly
        lose_message)
  math(EXPR number "${number} + 1")
  bsplib_run(bsplib.defect.${defect} RANKS 2 COMMAND bsplib_defective 1 2000
    FAILS "MISMATCH seed|bsp_[a-z_/]*: " TIMEOUT 120 ENVIRONMENT BSP2_BSPLIB_DEFECT=${number})
endforeach()
