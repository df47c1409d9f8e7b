/* The name under which programs of MulticoreBSP for C include their BSPlib: <bsp.h> in their dialect (size_t
 * and unsigned int), or in that of the paper if they define MCBSP_COMPATIBILITY_MODE. */
#ifndef BSP2_MCBSP_H
#define BSP2_MCBSP_H

#if !defined(MCBSP_COMPATIBILITY_MODE) && !defined(BSP2_MULTICORE_BSP)
#define BSP2_MULTICORE_BSP
#endif

#include "bsp.h"

#define MCBSP_PROCESSOR_INDEX_DATATYPE bsp_pid_t
#define MCBSP_NUMMSG_TYPE bsp_nprocs_t
#define MCBSP_BYTESIZE_TYPE bsp_size_t

#endif
