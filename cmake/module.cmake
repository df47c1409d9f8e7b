# The modules, see docs/modules.md: in build folders as in installations they are found from the program's folder.
include_guard()
include(GNUInstallDirs)
file(RELATIVE_PATH BSP2_MODULES_FROM_PROGRAM ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/bsp2)
set(BSP2_MODULES_FROM_LIBRARY bsp2)  # beside libbsp2.so
set(BSP2_MODULES_AT_ONCE "" CACHE STRING "Modules and readers to build with the program; empty: all. The others are built by the target bsp2_modules")
add_custom_target(bsp2_modules ALL)

# bsp2_with_room(<room> <name> <target>): the module or reader is built with the room, or later on. Then it is installed only if it is there.
function(bsp2_with_room room name target)
  add_dependencies(bsp2_modules ${target})
  if(NOT BSP2_MODULES_AT_ONCE OR name IN_LIST BSP2_MODULES_AT_ONCE)
    add_dependencies(bsp2_${room} ${target})
    set(optional "" PARENT_SCOPE)
  else()
    set(optional OPTIONAL PARENT_SCOPE)
  endif()
endfunction()
cmake_path(ABSOLUTE_PATH BSP2_MODULES_FROM_PROGRAM BASE_DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} NORMALIZE OUTPUT_VARIABLE BSP2_BUILT_MODULES)

# bsp2_module_layout(<room> <private headers...>): gives a room BSP2_MODULE_LAYOUT, a digest of what the program and the room's modules must
# have in common: all headers whose types may pass between them, those of the room and of geometry and the private ones that are named, and
# what else decides how a type lies in memory. It is found when CMake runs, so that runs when one of them has changed.
function(bsp2_module_layout room)
  get_target_property(geometry_headers bsp2_geometry HEADER_SET)
  get_target_property(room_headers bsp2_${room} HEADER_SET)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  set(layout "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}} ${BSP2_SANITIZE}")
  foreach(header ${geometry_headers} ${room_headers} ${ARGN})
    cmake_path(ABSOLUTE_PATH header)
    file(SHA256 ${header} digest)
    string(APPEND layout " ${digest}")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
  endforeach()
  string(SHA256 layout "${layout}")
  target_compile_definitions(bsp2_${room} PRIVATE BSP2_MODULE_LAYOUT="${layout}")
  set(BSP2_MODULE_LAYOUT ${layout} PARENT_SCOPE)
endfunction()

# bsp2_module(<room> <name> SOURCES ... LINK ...): what needs one library. It takes nothing from the rooms but their headers, so these
# may be compiled differently. After bsp2_module_layout.
function(bsp2_module room name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;LINK" ${ARGN})
  set(target bsp2_module_${name})
  add_library(${target} MODULE ${MODULE_SOURCES})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME bsp2-${name} LIBRARY_OUTPUT_DIRECTORY ${BSP2_BUILT_MODULES}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_include_directories(${target} PRIVATE src $<TARGET_PROPERTY:bsp2_${room},INTERFACE_INCLUDE_DIRECTORIES>
    $<TARGET_PROPERTY:bsp2_geometry,INTERFACE_INCLUDE_DIRECTORIES> $<TARGET_PROPERTY:bsp2_meshing,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target} PRIVATE BSP2_MODULE_LAYOUT="${BSP2_MODULE_LAYOUT}")
  target_link_libraries(${target} PRIVATE bsp2_options Boost::headers ${MODULE_LINK})
  target_link_options(${target} PRIVATE -Wl,-z,now)  # what its library lacks is told when it is loaded, not in its midst
  if(NOT BSP2_SANITIZE)  # the sanitizers' own symbols are in the program
    target_link_options(${target} PRIVATE -Wl,--no-undefined)
  endif()
  bsp2_with_room(${room} ${name} ${target})
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/bsp2 COMPONENT bsp2 ${optional})
endfunction()

# bsp2_reader(<room> <name> SOURCES ... LINK ...): a program that reads files for a room, in a process of its own; it lies among the modules.
# It takes nothing from the rooms but their headers either. After bsp2_module_layout.
function(bsp2_reader room name)
  cmake_parse_arguments(READER "" "" "SOURCES;LINK" ${ARGN})
  set(target bsp2_reader_${name})
  add_executable(${target} ${READER_SOURCES})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME bsp2-read-${name} RUNTIME_OUTPUT_DIRECTORY ${BSP2_BUILT_MODULES})
  target_include_directories(${target} PRIVATE src $<TARGET_PROPERTY:bsp2_${room},INTERFACE_INCLUDE_DIRECTORIES>
    $<TARGET_PROPERTY:bsp2_geometry,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target} PRIVATE BSP2_MODULE_LAYOUT="${BSP2_MODULE_LAYOUT}")
  target_link_libraries(${target} PRIVATE bsp2_options Boost::headers ${READER_LINK})
  bsp2_with_room(${room} read-${name} ${target})
  install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_LIBDIR}/bsp2 COMPONENT bsp2 ${optional})
endfunction()
