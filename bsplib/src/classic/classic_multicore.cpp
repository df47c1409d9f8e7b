// The dialect of MulticoreBSP for C: size_t and unsigned int.
#define BSP2_MULTICORE_BSP
#define BSP2_NO_INLINE
#define BSP2_NO_PLACES
#include "bsp.h"
#include "classic/classic_api.hpp"
#include "classic/classic_dialect.hpp"
