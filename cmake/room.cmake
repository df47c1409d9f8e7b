# A room is a static library `bsp2::<name>`. Its public headers live in include/ (each is verified to compile
# alone by the target `verify_headers`), private ones beside the sources. It sees only what it links. Where CMAKE_UNITY_BUILD is on, the
# sources of a folder are compiled as one: what they include and instantiate is compiled once, in half the time.
#
#   bsp2_room(<name> [PRECOMPILED] [HOT] SOURCES ... [COLD folders...] [HEADERS ...] [PUBLIC targets...] [PRIVATE targets...])
#
# COLD folders of src/ do nothing that takes time: they are optimized less, and a build is done sooner. Under the sanitizers only HOT rooms
# are optimized at all.
include_guard()

add_library(bsp2_options INTERFACE)
target_compile_features(bsp2_options INTERFACE cxx_std_20)
target_compile_options(bsp2_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wno-missing-field-initializers -Wpedantic -Wnon-virtual-dtor -Woverloaded-virtual>
  # In a unity build a name may be that of something in another source.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:$<BOOL:${CMAKE_UNITY_BUILD}>>>:-Wshadow>
  # GCC 12 at -O3 warns of accesses out of bounds, in std::string and fixed arrays, that cannot happen.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>,$<CONFIG:Release>>:-Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-restrict>
  $<$<BOOL:${BSP2_WARNINGS_AS_ERRORS}>:-Werror>)
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # It takes a source that another one includes for a header, and warns of what a class hides in it.
  target_compile_options(bsp2_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
endif()
find_program(BSP2_MOLD mold)
if(BSP2_SANITIZE)
  target_compile_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE})
  if(BSP2_MOLD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # These programs are ten times as large as others, and it links them in a third of the time.
    target_link_options(bsp2_options INTERFACE -fuse-ld=mold)
  endif()
  if(BSP2_SANITIZE MATCHES "undefined" AND BSP2_SANITIZE MATCHES "address" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Each access would be looked at twice: where a pointer they doubt is used, AddressSanitizer stops too. They take a fifth of the build;
    # so does alignment, for which no processor that we build for asks, but for vectors: with these the release build would stop. Long
    # functions call AddressSanitizer rather than hold what it does: a fifth again, and the tests take as long.
    target_compile_options(bsp2_options INTERFACE -fno-sanitize=null,object-size,pointer-overflow,alignment
      --param=asan-instrumentation-with-call-threshold=60)
  endif()
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # It would look for unused memory of its own a hundred times a source. Not to do so takes an eighth off the build, and a third more memory.
  target_compile_options(bsp2_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-expand=300 --param=ggc-min-heapsize=524288>)
endif()
# What takes no time when it runs shall take none to compile.
add_library(bsp2_cold_options INTERFACE)
if(BSP2_SANITIZE)
  target_compile_options(bsp2_cold_options INTERFACE -O0)
else()
  target_compile_options(bsp2_cold_options INTERFACE $<$<CONFIG:Release>:-Og>)
endif()
# The rounding error bounds of the kernel assume plain IEEE arithmetic.
target_compile_options(bsp2_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)

# Headers of others that nearly every room includes are parsed once: bsp2_precompiled for the rooms, bsp2_precompiled_cold for what is
# not optimized under the sanitizers, where GCC takes no header that is, and with GoogleTest bsp2_precompiled_tests. Each source still
# includes what it uses (`-DBSP2_PRECOMPILE=OFF` proves it).
option(BSP2_PRECOMPILE "Parse the headers of the standard library and of Boost once" ON)
set(BSP2_PRECOMPILED_HEADERS
  <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <random> <span> <sstream> <string>
  <unordered_map> <variant> <vector>
  <boost/archive/binary_iarchive.hpp> <boost/archive/binary_oarchive.hpp> <boost/multiprecision/cpp_int.hpp>
  <boost/serialization/vector.hpp>)

# What a target is compiled for: programs as well as the one shared library that is made of all rooms, which exports what its public header
# declares and nothing else. Hidden symbols are bound when it is linked, so position-independent code costs what that of a program does.
function(bsp2_for_library target)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
endfunction()

function(bsp2_precompiled_headers name)
  cmake_parse_arguments(HEADERS "" "" "LINK;HEADERS" ${ARGN})
  file(WRITE ${CMAKE_BINARY_DIR}/${name}.cpp "")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE bsp2_options Threads::Threads Boost::serialization ${HEADERS_LINK})
  target_precompile_headers(${name} PRIVATE ${BSP2_PRECOMPILED_HEADERS} ${HEADERS_HEADERS})
endfunction()

# bsp2_reuse_precompiled(<target> <bsp2_precompiled | bsp2_precompiled_cold | bsp2_precompiled_tests>)
function(bsp2_reuse_precompiled target headers)
  if(BSP2_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${headers})
    target_compile_definitions(${target} PRIVATE BOOST_SERIALIZATION_DYN_LINK)  # as the headers were parsed
  endif()
endfunction()

# What lies in one folder is one unit of a unity build.
function(bsp2_unity_by_folder target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  foreach(source ${ARGN})
    cmake_path(GET source PARENT_PATH folder)
    string(MAKE_C_IDENTIFIER "${folder}" group)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${group}")
  endforeach()
endfunction()

# What the objects of a room are compiled with. The room's headers come first, before those that it links.
function(bsp2_compile_for_room target name)
  cmake_parse_arguments(ROOM "" "PRECOMPILED" "SOURCES;LINK" ${ARGN})
  if(NOT name STREQUAL bsplib)  # which decides for itself what it exports
    bsp2_for_library(${target})
  endif()
  target_include_directories(${target} PRIVATE src)
  bsp2_unity_by_folder(${target} ${ROOM_SOURCES})
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:bsp2_options> ${ROOM_LINK})
  if(ROOM_PRECOMPILED)
    bsp2_reuse_precompiled(${target} ${ROOM_PRECOMPILED})
  endif()
endfunction()

function(bsp2_room name)
  cmake_parse_arguments(ROOM "PRECOMPILED;HOT" "" "SOURCES;COLD;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  set(cold)
  if(ROOM_COLD)
    set(cold ${ROOM_SOURCES})
    list(JOIN ROOM_COLD "|" folders)
    list(FILTER cold INCLUDE REGEX "^src/(${folders})/")
    list(REMOVE_ITEM ROOM_SOURCES ${cold})
  endif()
  set(precompiled)
  if(ROOM_PRECOMPILED)
    set(precompiled PRECOMPILED bsp2_precompiled)
  endif()
  set(precompiled_cold ${precompiled})
  if(ROOM_PRECOMPILED AND BSP2_SANITIZE)
    set(precompiled_cold PRECOMPILED bsp2_precompiled_cold)
  endif()
  if(BSP2_SANITIZE AND NOT ROOM_HOT)
    list(APPEND ROOM_PRIVATE $<BUILD_INTERFACE:bsp2_cold_options>)
    set(precompiled ${precompiled_cold})
  endif()
  add_library(bsp2_${name} STATIC ${ROOM_SOURCES})
  add_library(bsp2::${name} ALIAS bsp2_${name})
  set_target_properties(bsp2_${name} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(bsp2_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ROOM_HEADERS})
  target_link_libraries(bsp2_${name} PUBLIC ${ROOM_PUBLIC})
  target_compile_features(bsp2_${name} PUBLIC cxx_std_20)
  bsp2_compile_for_room(bsp2_${name} ${name} ${precompiled} SOURCES ${ROOM_SOURCES} LINK ${ROOM_PRIVATE})
  if(cold)
    set(target bsp2_${name}_cold)
    add_library(${target} OBJECT ${cold})
    bsp2_compile_for_room(${target} ${name} ${precompiled_cold} SOURCES ${cold}
      LINK bsp2_cold_options ${ROOM_PUBLIC} ${ROOM_PRIVATE})
    # What the room is given later on as well.
    target_include_directories(${target} PRIVATE $<TARGET_PROPERTY:bsp2_${name},INCLUDE_DIRECTORIES>)
    target_compile_definitions(${target} PRIVATE $<TARGET_PROPERTY:bsp2_${name},COMPILE_DEFINITIONS>)
    target_sources(bsp2_${name} PRIVATE $<TARGET_OBJECTS:${target}>)
  endif()
endfunction()
