# find_package(bsp2_bsplib) gives the target bsp2::bsplib.
if(NOT CMAKE_CXX_COMPILER_LOADED)
  set(${CMAKE_FIND_PACKAGE_NAME}_FOUND FALSE)
  set(${CMAKE_FIND_PACKAGE_NAME}_NOT_FOUND_MESSAGE
    "bsp2_bsplib is a C++ library, which programs in C are linked with by the C++ compiler: say project(... LANGUAGES C CXX)")
  return()
endif()
include(CMakeFindDependencyMacro)
find_dependency(MPI COMPONENTS CXX)
find_dependency(Boost 1.74 COMPONENTS mpi serialization)
include(${CMAKE_CURRENT_LIST_DIR}/bsp2_bsplib-targets.cmake)
