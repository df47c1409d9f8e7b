#pragma once

/// The dimensions in which the engine works.
#define BSP2_FOR_EACH_DIMENSION(macro) macro(1) macro(2) macro(3) macro(4) macro(5) macro(6)
