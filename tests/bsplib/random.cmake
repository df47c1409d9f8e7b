# Random programs against the sequential model: with shared staging memory, with messages only, and with little of it.
add_library(bsplib_random_programs OBJECT random_test.cpp)
target_link_libraries(bsplib_random_programs PRIVATE bsp2::bsplib bsp2_options)
add_executable(bsplib_random $<TARGET_OBJECTS:bsplib_random_programs>)
target_link_libraries(bsplib_random PRIVATE bsp2::bsplib)
foreach(ranks 1 2 3 4)
  bsplib_run(bsplib.random.shared.${ranks} RANKS ${ranks} COMMAND bsplib_random 1 5000 TIMEOUT 900)
  bsplib_run(bsplib.random.messages.${ranks} RANKS ${ranks} COMMAND bsplib_random 10001 3000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=0)
  bsplib_run(bsplib.random.mixed.${ranks} RANKS ${ranks} COMMAND bsplib_random 20001 3000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=2048)
endforeach()

# Deliberately broken copies of the layer: the random programs must catch each of them.
get_target_property(BSPLIB_SOURCES bsp2_bsplib SOURCES)
get_target_property(BSPLIB_DIR bsp2_bsplib SOURCE_DIR)
list(FILTER BSPLIB_SOURCES INCLUDE REGEX "^src/.*[.]cpp$")
list(FILTER BSPLIB_SOURCES EXCLUDE REGEX "/(cost|error)[.]cpp$")  # nothing to break there; they come from the library
list(TRANSFORM BSPLIB_SOURCES PREPEND ${BSPLIB_DIR}/)

set(defects drop_put gets_after_puts swap_messages forget_pop late_put early_tagsize early_registration puts_in_reverse
    merge_wrongly)
set(number 0)
foreach(defect ${defects})
  math(EXPR number "${number} + 1")
  add_executable(bsplib_defect_${defect} $<TARGET_OBJECTS:bsplib_random_programs> ${BSPLIB_SOURCES})
  target_include_directories(bsplib_defect_${defect} PRIVATE ${BSPLIB_DIR}/include ${BSPLIB_DIR}/src)
  target_compile_definitions(bsplib_defect_${defect} PRIVATE BSP2_BSPLIB_DEFECT=${number})
  target_link_libraries(bsplib_defect_${defect} PRIVATE bsp2_options bsp2::bsplib)
  set_target_properties(bsplib_defect_${defect} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
  set_source_files_properties(${BSPLIB_DIR}/src/classic.cpp ${BSPLIB_DIR}/src/classic_multicore.cpp
    PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  bsplib_run(bsplib.defect.${defect} RANKS 2 COMMAND bsplib_defect_${defect} 1 2000
    FAILS "MISMATCH seed|bsp_[a-z_/]*: " TIMEOUT 120)
endforeach()
