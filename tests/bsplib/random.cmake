# Random programs against the sequential model: with shared staging memory, with messages only, and with little of it.
add_library(bsplib_random_programs OBJECT random_test.cpp)
target_link_libraries(bsplib_random_programs PRIVATE bsp2::bsplib bsp2_test_options)
add_executable(bsplib_random $<TARGET_OBJECTS:bsplib_random_programs>)
target_link_libraries(bsplib_random PRIVATE bsp2::bsplib)
foreach(ranks 1 2 3 4)
  bsplib_run(bsplib.random.shared.${ranks} RANKS ${ranks} COMMAND bsplib_random 1 5000 TIMEOUT 900)
  if(ranks EQUAL 1)
    continue()  # it has nobody to share memory with, so the modes are the same
  endif()
  bsplib_run(bsplib.random.messages.${ranks} RANKS ${ranks} COMMAND bsplib_random 10001 3000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=0)
  bsplib_run(bsplib.random.mixed.${ranks} RANKS ${ranks} COMMAND bsplib_random 20001 3000 TIMEOUT 900
    ENVIRONMENT BSP2_STAGING_BYTES=2048)
endforeach()

# Deliberately broken copies of the layer: the random programs must catch each of them. Only the files that contain a
# defect are compiled again (with inline functions of outbox.hpp, all that call them); the rest is the library's.
set(defects "drop_put:engine/inbox" "gets_after_puts:engine/delivery" "swap_messages:engine/inbox" "forget_pop:memory/registry"
    "late_put:engine/access,engine/engine" "early_tagsize:engine/access" "early_registration:memory/registry" "puts_in_reverse:engine/delivery"
    "merge_wrongly:engine/access,classic/classic,classic/classic_multicore,engine/outbox,engine/world" "lose_message:engine/inbox")
get_target_property(BSPLIB_DIR bsp2_bsplib SOURCE_DIR)
set(number 0)
foreach(entry ${defects})
  math(EXPR number "${number} + 1")
  string(REGEX MATCH "^([a-z_]+):(.*)$" matched ${entry})
  set(defect ${CMAKE_MATCH_1})
  string(REGEX REPLACE "([a-z_/0-9]+)" "${BSPLIB_DIR}/src/\\1.cpp" files ${CMAKE_MATCH_2})
  string(REPLACE "," ";" files "${files}")
  add_executable(bsplib_defect_${defect} $<TARGET_OBJECTS:bsplib_random_programs> ${files})
  target_include_directories(bsplib_defect_${defect} PRIVATE ${BSPLIB_DIR}/include ${BSPLIB_DIR}/src)
  target_compile_definitions(bsplib_defect_${defect} PRIVATE BSP2_BSPLIB_DEFECT=${number})
  target_link_libraries(bsplib_defect_${defect} PRIVATE bsp2_test_options bsp2::bsplib)
  bsplib_run(bsplib.defect.${defect} RANKS 2 COMMAND bsplib_defect_${defect} 1 2000
    FAILS "MISMATCH seed|bsp_[a-z_/]*: " TIMEOUT 120)
endforeach()
