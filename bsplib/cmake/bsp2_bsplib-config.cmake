# find_package(bsp2_bsplib) gives the target bsp2::bsplib.
include(CMakeFindDependencyMacro)
find_dependency(MPI COMPONENTS CXX)
find_dependency(Boost 1.74 COMPONENTS mpi serialization)
include(${CMAKE_CURRENT_LIST_DIR}/bsp2_bsplib-targets.cmake)
