/* Runs: the newest put, hpput, get and hpget to a rank, as long as the next call can continue them.
 *
 * A loop over neighbouring places is one access in many calls. What continues a run is compiled into the
 * program, from here; everything else goes to the library, which ends the run and begins another one. Not an
 * interface for programs. */
#ifndef BSP2_BSPLIB_RUN_H
#define BSP2_BSPLIB_RUN_H

#include <stddef.h>

#ifdef __GNUC__
#define BSP2_INLINE extern __inline__ __attribute__((__always_inline__, __gnu_inline__))
#define BSP2_COPY __builtin_memcpy
#else
#include <string.h>
#define BSP2_INLINE static inline
#define BSP2_COPY memcpy
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Of buffered puts: each call appends its bytes to the stream. Where they go follows from the offset alone,
 * so calls do not wait for each other. */
struct bsp2_put_run {
  const void* name; /* the address by which a classic program knows the memory; NULL: none */
  unsigned slot;    /* number of its registration; all ones: there is no run */
  size_t next;      /* where the run ends in the registration */
  size_t end;       /* how far it may go */
  size_t origin;    /* address in the stream that offset 0 would have */
};

/* Of the others: nothing is copied before the run ends, calls only prolong it. */
struct bsp2_reference_run {
  const void* name;
  unsigned slot;
  size_t next;
  size_t end;
  char* local;  /* where it ends in the memory of this rank */
  size_t first; /* where it began in the registration */
};

struct bsp2_runs {
  struct bsp2_put_run put;
  struct bsp2_reference_run hpput, get, hpget;
};

/* Both return whether the call is done. The caller has compared the name or the slot. */
BSP2_INLINE int bsp2_continue_put(struct bsp2_put_run* run, size_t offset, const void* source, size_t bytes) {
  char* place;
  if (offset != run->next || bytes > run->end - offset) return 0;
  place = (char*)(run->origin + offset);
  if (bytes == 8) {
    BSP2_COPY(place, source, 8);
  } else {
    BSP2_COPY(place, source, bytes);
  }
  run->next = offset + bytes;
  return 1;
}

BSP2_INLINE int bsp2_continue_reference(struct bsp2_reference_run* run, size_t offset, const void* local,
                                        size_t bytes) {
  if (offset != run->next || local != run->local || bytes > run->end - offset) return 0;
  run->next = offset + bytes;
  run->local = (char*)local + bytes;
  return 1;
}

#ifdef __cplusplus
}
#endif

#endif
