/* BSPlib: bulk synchronous parallel programs in C.
 *
 * The interface of J. M. D. Hill et al., "BSPlib: The BSP programming library", Parallel Computing 24 (1998),
 * on MPI. What a function promises is said in the manual, docs/bsplib.md. Any mistake ends all processes with
 * one message that names the function, the process and the superstep.
 *
 * Dialects: sizes and process numbers are int, as in the paper. With BSP2_MULTICORE_BSP defined before the
 * inclusion they are size_t and unsigned int, as in MulticoreBSP for C (BSPONMPI_MCBSP_COMPAT, the name that
 * BSPonMPI gives to this, does the same). Both dialects may meet in one program. Programs that use bsp_pid_t,
 * bsp_nprocs_t and bsp_size_t compile in both.
 */
#ifndef BSP2_BSP_H
#define BSP2_BSP_H

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h> /* programs written for the Oxford BSP toolset count on it */

#include "bsp2/bsplib/run.h"

#if defined(BSPONMPI_MCBSP_COMPAT) && !defined(BSP2_MULTICORE_BSP)
#define BSP2_MULTICORE_BSP
#endif

#ifdef BSP2_MULTICORE_BSP
#include <stdint.h> /* as programs for MulticoreBSP expect */
typedef unsigned int bsp_pid_t;
typedef unsigned int bsp_nprocs_t;
typedef size_t bsp_size_t;
#define bsp_begin mcbsp_begin
#define bsp_nprocs mcbsp_nprocs
#define bsp_pid mcbsp_pid
#define bsp_push_reg mcbsp_push_reg
#define bsp_put mcbsp_put
#define bsp_get mcbsp_get
#define bsp_hpput mcbsp_hpput
#define bsp_hpget mcbsp_hpget
#define bsp_direct_get mcbsp_direct_get
#define bsp_set_tagsize mcbsp_set_tagsize
#define bsp_send mcbsp_send
#define bsp_qsize mcbsp_qsize
#define bsp_get_tag mcbsp_get_tag
#define bsp_move mcbsp_move
#define bsp_hpmove mcbsp_hpmove
#define bsp_hpsend mcbsp_send
#else
typedef int bsp_pid_t;
typedef int bsp_nprocs_t;
typedef int bsp_size_t;
#endif

#ifdef __GNUC__
#define BSP2_PRINTF(text, values) __attribute__((__format__(__printf__, text, values)))
#else
#define BSP2_PRINTF(text, values)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* --- Processes -------------------------------------------------------------------------------- */

/* Says which function holds bsp_begin ... bsp_end, if main does something before. First statement of main.
 * Processes other than 0 run it from here and leave the program in here. */
void bsp_init(void (*spmd)(void), int argc, char** argv);
/* Starts the parallel part with at most so many processes (what process 0 says counts); the others leave the
 * program. Collective, once. */
void bsp_begin(bsp_nprocs_t maxprocs);
/* Ends it. Collective: an error if other processes still synchronize. */
void bsp_end(void);
/* Ends all processes at once, from anywhere, with a message as printf makes it. */
void bsp_abort(const char* format, ...) BSP2_PRINTF(1, 2);
void bsp_abort_va(const char* format, va_list arguments);
void bsp_vabort(const char* format, va_list arguments);

bsp_nprocs_t bsp_nprocs(void); /* before bsp_begin: how many there can be; afterwards how many take part */
bsp_pid_t bsp_pid(void);
double bsp_time(void); /* seconds since bsp_begin, on this process's clock */

/* Ends the superstep. Collective. Order: gets read; gets write; puts write, by process number and then in the
 * order of the calls; registrations and the tag size change; messages are there. */
void bsp_sync(void);

/* --- Remote memory ---------------------------------------------------------------------------- */

/* Makes memory accessible under its address, from the next sync on. Collective; sizes may differ; NULL: no
 * access. */
void bsp_push_reg(const void* address, bsp_size_t nbytes);
/* Takes back the newest registration of an address, at the next sync. Collective. */
void bsp_pop_reg(const void* address);

/* Writes to process pid, at the memory that it registered together with our dst. The source is read now. An
 * access of no bytes, here and below, looks at no memory, but the process must exist. */
void bsp_put(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes);
/* Reads what will be at process pid, when all have called bsp_sync. */
void bsp_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes);
/* The same without buffers: source and destination must be left alone until the sync is over. */
void bsp_hpput(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes);
void bsp_hpget(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes);

/* As MulticoreBSP for C has it: reads now, in the middle of the superstep, memory that was registered in an
 * earlier one, and returns when it is there. Not collective. Another process is read when it comes to
 * bsp_sync, bsp_end, or a bsp_direct_get of its own: what it writes there before that is read, what this
 * superstep puts there is not. */
void bsp_direct_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes);

/* --- Messages --------------------------------------------------------------------------------- */

/* Sets the size of tags, from the next superstep on. Collective. The size set before comes back. */
void bsp_set_tagsize(bsp_size_t* tag_nbytes);
void bsp_send(bsp_pid_t pid, const void* tag, const void* payload, bsp_size_t payload_nbytes);
/* Messages left in the queue, and the bytes of their payloads. With BSP2_MULTICORE_BSP the second pointer may
 * be NULL. */
void bsp_qsize(bsp_nprocs_t* nmessages, bsp_size_t* accum_nbytes);
/* Size of the first message's payload, -1 if there is none, and its tag. */
void bsp_get_tag(bsp_size_t* status, void* tag);
/* Copies at most so much of the first message's payload and removes the message. */
void bsp_move(void* payload, bsp_size_t reception_nbytes);
/* The same without a copy: where tag and payload are, until the next sync. -1 if there is no message. */
bsp_size_t bsp_hpmove(void** tag, void** payload);

/* --- Places --------------------------------------------------------------------------------------
 */

/* Where a superstep ends, for the profile (BSP2_PROFILE): the call leaves it here. Not an interface.
 * BSP2_NO_PLACES switches it off. */
struct bsp2_place {
  const char* file;
  int line;
};
extern struct bsp2_place bsp2_here;

/* --- Speed ------------------------------------------------------------------------------------ */

#ifdef __GNUC__
/* The runs (run.h) of the program, for processes with smaller numbers; not an interface. */
#define BSP2_RUNS 256
extern struct bsp2_put_run bsp2_classic_puts[BSP2_RUNS];
extern struct bsp2_reference_run bsp2_classic_hpputs[BSP2_RUNS];
extern struct bsp2_reference_run bsp2_classic_gets[BSP2_RUNS];
extern struct bsp2_reference_run bsp2_classic_hpgets[BSP2_RUNS];
extern struct bsp2_message_run bsp2_classic_sends[BSP2_RUNS];
extern struct bsp2_messages bsp2_classic_messages;
#endif

#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(BSP2_NO_INLINE)
/* A call that continues a run (run.h), or takes a message from one, is compiled into the program. Any other,
 * and the address of a function, is that of the library: the functions below only stand in for it. */
#define BSP2_TEXT_OF(name) #name
#define BSP2_TEXT(name) BSP2_TEXT_OF(name)
#define BSP2_LIBRARY(function) __asm__(BSP2_TEXT(__USER_LABEL_PREFIX__) BSP2_TEXT(function))
#define BSP2_STAND_IN extern __inline__ __attribute__((__always_inline__, __gnu_inline__))

void bsp2_library_put(bsp_pid_t, const void*, const void*, bsp_size_t, bsp_size_t) BSP2_LIBRARY(bsp_put);
void bsp2_library_hpput(bsp_pid_t, const void*, const void*, bsp_size_t, bsp_size_t) BSP2_LIBRARY(bsp_hpput);
void bsp2_library_get(bsp_pid_t, const void*, bsp_size_t, void*, bsp_size_t) BSP2_LIBRARY(bsp_get);
void bsp2_library_hpget(bsp_pid_t, const void*, bsp_size_t, void*, bsp_size_t) BSP2_LIBRARY(bsp_hpget);
void bsp2_library_send(bsp_pid_t, const void*, const void*, bsp_size_t) BSP2_LIBRARY(bsp_send);
void bsp2_library_get_tag(bsp_size_t*, void*) BSP2_LIBRARY(bsp_get_tag);
void bsp2_library_move(void*, bsp_size_t) BSP2_LIBRARY(bsp_move);
bsp_size_t bsp2_library_hpmove(void**, void**) BSP2_LIBRARY(bsp_hpmove);

BSP2_STAND_IN void bsp_put(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset,
                           bsp_size_t nbytes) {
  if (BSP2_RARELY((unsigned)pid >= BSP2_RUNS)) {
    bsp2_library_put(pid, src, dst, offset, nbytes);
  } else {
    struct bsp2_put_run* run = &bsp2_classic_puts[pid];
    if (BSP2_RARELY(
            !bsp2_continue_put(run, (size_t)run->name, (size_t)dst, (size_t)offset, src, (size_t)nbytes)) &&
        !bsp2_scatter_put(run, (size_t)run->name, (size_t)dst, (size_t)offset, src, (size_t)nbytes))
      bsp2_library_put(pid, src, dst, offset, nbytes);
  }
}

/* One that continues nothing is a put: the order among unbuffered ones is free. */
BSP2_STAND_IN void bsp_hpput(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset,
                             bsp_size_t nbytes) {
  if (BSP2_RARELY((unsigned)pid >= BSP2_RUNS)) {
    bsp2_library_hpput(pid, src, dst, offset, nbytes);
  } else {
    struct bsp2_reference_run* run = &bsp2_classic_hpputs[pid];
    struct bsp2_put_run* puts = &bsp2_classic_puts[pid];
    if (BSP2_RARELY(!bsp2_continue_reference(run, (size_t)run->name, (size_t)dst, (size_t)offset, src,
                                             (size_t)nbytes)) &&
        (run->first != run->next ||
         !bsp2_scatter_put(puts, (size_t)puts->name, (size_t)dst, (size_t)offset, src, (size_t)nbytes)))
      bsp2_library_hpput(pid, src, dst, offset, nbytes);
  }
}

BSP2_STAND_IN void bsp_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes) {
  if (BSP2_RARELY((unsigned)pid >= BSP2_RUNS ||
                  !bsp2_continue_reference(&bsp2_classic_gets[pid], (size_t)bsp2_classic_gets[pid].name,
                                           (size_t)src, (size_t)offset, dst, (size_t)nbytes)))
    bsp2_library_get(pid, src, offset, dst, nbytes);
}

BSP2_STAND_IN void bsp_hpget(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst,
                             bsp_size_t nbytes) {
  if (BSP2_RARELY((unsigned)pid >= BSP2_RUNS ||
                  !bsp2_continue_reference(&bsp2_classic_hpgets[pid], (size_t)bsp2_classic_hpgets[pid].name,
                                           (size_t)src, (size_t)offset, dst, (size_t)nbytes)))
    bsp2_library_hpget(pid, src, offset, dst, nbytes);
}

BSP2_STAND_IN void bsp_send(bsp_pid_t pid, const void* tag, const void* payload, bsp_size_t nbytes) {
  if (BSP2_RARELY((unsigned)pid >= BSP2_RUNS ||
                  !bsp2_continue_messages(&bsp2_classic_sends[pid], tag, payload, (size_t)nbytes)))
    bsp2_library_send(pid, tag, payload, nbytes);
}

/* The last message of each size is left to the library, which then looks for those of the next. */
BSP2_STAND_IN void bsp_get_tag(bsp_size_t* status, void* tag) {
  const struct bsp2_messages* queue = &bsp2_classic_messages;
  if (BSP2_RARELY(queue->place == queue->last || !status || (!tag && queue->tag > 0))) {
    bsp2_library_get_tag(status, tag);
  } else {
    const char* place = queue->place;
    const size_t tag_bytes = queue->tag;
    *status = (bsp_size_t)queue->payload;
    if (tag_bytes > 0) bsp2_copy_part((char*)tag, place, tag_bytes);
  }
}

BSP2_STAND_IN void bsp_move(void* payload, bsp_size_t nbytes) {
  struct bsp2_messages* queue = &bsp2_classic_messages;
  if (BSP2_RARELY(queue->place == queue->last || (size_t)nbytes != queue->payload || !payload)) {
    bsp2_library_move(payload, nbytes);
  } else {
    const char* place = queue->place + queue->tag_room;
    if (!bsp2_is_ahead(queue->ahead, &place, payload)) queue->ahead = (size_t)place - (size_t)payload;
    queue->place = place + queue->payload_room;
    bsp2_copy_part((char*)payload, place, (size_t)nbytes);
  }
}

BSP2_STAND_IN bsp_size_t bsp_hpmove(void** tag, void** payload) {
  struct bsp2_messages* queue = &bsp2_classic_messages;
  if (BSP2_RARELY(queue->place == queue->last || !tag || !payload)) return bsp2_library_hpmove(tag, payload);
  {
    char* place = (char*)queue->place;
    *tag = place;
    *payload = place += queue->tag_room;
    queue->place = place + queue->payload_room;
    return (bsp_size_t)queue->payload;
  }
}
#endif

#ifdef __cplusplus
}
#endif

#if !defined(BSP2_NO_PLACES) && \
    (defined(__cplusplus) || (defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L))
#define BSP2_HERE bsp2_here.file = __FILE__, bsp2_here.line = __LINE__
#define bsp_sync() (BSP2_HERE, bsp_sync())
#endif

#endif
