# A room is a static library `bsp2::<name>`. Its public headers live in include/ (each is verified to compile
# alone by the target `verify_headers`), private ones beside the sources. It sees only what it links.
#
#   bsp2_room(<name> SOURCES ... [HEADERS ...] [PUBLIC targets...] [PRIVATE targets...])
include_guard()

add_library(bsp2_options INTERFACE)
target_compile_features(bsp2_options INTERFACE cxx_std_20)
target_compile_options(bsp2_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wno-missing-field-initializers -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual>
  $<$<BOOL:${BSP2_WARNINGS_AS_ERRORS}>:-Werror>)
if(BSP2_SANITIZE)
  target_compile_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(bsp2_options INTERFACE -fsanitize=${BSP2_SANITIZE})
endif()
# The rounding error bounds of the kernel assume plain IEEE arithmetic.
target_compile_options(bsp2_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)

function(bsp2_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  add_library(bsp2_${name} STATIC ${ROOM_SOURCES})
  add_library(bsp2::${name} ALIAS bsp2_${name})
  set_target_properties(bsp2_${name} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(bsp2_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ROOM_HEADERS})
  target_link_libraries(bsp2_${name} PUBLIC ${ROOM_PUBLIC} PRIVATE $<BUILD_INTERFACE:bsp2_options> ${ROOM_PRIVATE})
  target_compile_features(bsp2_${name} PUBLIC cxx_std_20)
endfunction()
