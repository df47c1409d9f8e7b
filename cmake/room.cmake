# A room is a static library `bsp2::<name>`. Its public headers live in include/ (each is verified to compile
# alone by the target `verify_headers`), private ones beside the sources. It sees only what it links.
#
#   bsp2_room(<name> [PRECOMPILED] SOURCES ... [HEADERS ...] [PUBLIC targets...] [PRIVATE targets...])
include_guard()

add_library(bsp2_options INTERFACE)
target_compile_features(bsp2_options INTERFACE cxx_std_20)
target_compile_options(bsp2_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wno-missing-field-initializers -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual>
  # GCC 12 at -O3 warns of accesses out of bounds, in std::string and fixed arrays, that cannot happen.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>,$<CONFIG:Release>>:-Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-restrict>
  $<$<BOOL:${BSP2_WARNINGS_AS_ERRORS}>:-Werror>)
if(BSP2_SANITIZE)
  target_compile_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE})
endif()
# The rounding error bounds of the kernel assume plain IEEE arithmetic.
target_compile_options(bsp2_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)

# Headers of others that nearly every room includes are parsed once: bsp2_precompiled for the rooms, and with GoogleTest
# bsp2_precompiled_tests. Each source still includes what it uses (`-DBSP2_PRECOMPILE=OFF` proves it).
option(BSP2_PRECOMPILE "Parse the headers of the standard library and of Boost once" ON)
set(BSP2_PRECOMPILED_HEADERS
  <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <random> <span> <sstream> <string>
  <unordered_map> <variant> <vector>
  <boost/archive/binary_iarchive.hpp> <boost/archive/binary_oarchive.hpp> <boost/multiprecision/cpp_int.hpp>
  <boost/serialization/vector.hpp>)

function(bsp2_precompiled_headers name)
  cmake_parse_arguments(HEADERS "" "" "LINK;HEADERS" ${ARGN})
  file(WRITE ${CMAKE_BINARY_DIR}/${name}.cpp "")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE bsp2_options Threads::Threads Boost::serialization ${HEADERS_LINK})
  target_precompile_headers(${name} PRIVATE ${BSP2_PRECOMPILED_HEADERS} ${HEADERS_HEADERS})
endfunction()

# bsp2_reuse_precompiled(<target> <bsp2_precompiled | bsp2_precompiled_tests>)
function(bsp2_reuse_precompiled target headers)
  if(BSP2_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${headers})
    target_compile_definitions(${target} PRIVATE BOOST_SERIALIZATION_DYN_LINK)  # as the headers were parsed
  endif()
endfunction()

function(bsp2_room name)
  cmake_parse_arguments(ROOM "PRECOMPILED" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  add_library(bsp2_${name} STATIC ${ROOM_SOURCES})
  add_library(bsp2::${name} ALIAS bsp2_${name})
  set_target_properties(bsp2_${name} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(bsp2_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ROOM_HEADERS})
  target_link_libraries(bsp2_${name} PUBLIC ${ROOM_PUBLIC} PRIVATE $<BUILD_INTERFACE:bsp2_options> ${ROOM_PRIVATE})
  target_compile_features(bsp2_${name} PUBLIC cxx_std_20)
  if(ROOM_PRECOMPILED)
    bsp2_reuse_precompiled(bsp2_${name} bsp2_precompiled)
  endif()
endfunction()

# The modules (bsp2/geometry/module.hpp): in build folders as in installations they are found from the program's folder.
include(GNUInstallDirs)
file(RELATIVE_PATH BSP2_MODULES_FROM_PROGRAM ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/bsp2)
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
# need not be position-independent. After bsp2_module_layout.
function(bsp2_module room name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;LINK" ${ARGN})
  set(target bsp2_module_${name})
  add_library(${target} MODULE ${MODULE_SOURCES})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME bsp2-${name} LIBRARY_OUTPUT_DIRECTORY ${BSP2_BUILT_MODULES}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_include_directories(${target} PRIVATE $<TARGET_PROPERTY:bsp2_${room},INTERFACE_INCLUDE_DIRECTORIES>
    $<TARGET_PROPERTY:bsp2_geometry,INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target} PRIVATE BSP2_MODULE_LAYOUT="${BSP2_MODULE_LAYOUT}")
  target_link_libraries(${target} PRIVATE bsp2_options Boost::headers ${MODULE_LINK})
  target_link_options(${target} PRIVATE -Wl,-z,now)  # what its library lacks is told when it is loaded, not in its midst
  if(NOT BSP2_SANITIZE)  # the sanitizers' own symbols are in the program
    target_link_options(${target} PRIVATE -Wl,--no-undefined)
  endif()
  add_dependencies(bsp2_${room} ${target})
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/bsp2 COMPONENT bsp2)
endfunction()
