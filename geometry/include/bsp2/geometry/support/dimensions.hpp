#pragma once

/// The dimensions in which everything works. `macro(D)` instantiates a room's templates for one of them:
///
///   #define BSP2_INSTANTIATE(D) template class Splitter<D>;
///   BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
///   #undef BSP2_INSTANTIATE
#define BSP2_FOR_EACH_DIMENSION(macro) macro(1) macro(2) macro(3) macro(4) macro(5) macro(6)
