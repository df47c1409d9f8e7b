/* BSPlib: bulk synchronous parallel programs in C.
 *
 * The interface of J. M. D. Hill et al., "BSPlib: The BSP programming library", Parallel Computing 24 (1998), on MPI.
 * What a function promises is said in the manual, docs/bsplib.md. Any mistake ends all processes with one message
 * that names the function, the process and the superstep.
 *
 * Dialects: sizes and process numbers are int, as in the paper. With BSP2_MULTICORE_BSP defined before the inclusion
 * they are size_t and unsigned int, as in MulticoreBSP for C (BSPONMPI_MCBSP_COMPAT, the name that BSPonMPI gives to
 * this, does the same). Both dialects may meet in one program. Programs that use bsp_pid_t, bsp_nprocs_t and
 * bsp_size_t compile in both.
 */
#ifndef BSP2_BSP_H
#define BSP2_BSP_H

#include <stdarg.h>
#include <stddef.h>

#if defined(BSPONMPI_MCBSP_COMPAT) && !defined(BSP2_MULTICORE_BSP)
#define BSP2_MULTICORE_BSP
#endif

#ifdef BSP2_MULTICORE_BSP
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

/* --- Processes ---------------------------------------------------------------------------------------------- */

/* Says which function holds bsp_begin ... bsp_end, if main does something before. First statement of main. Processes
 * other than 0 run it from here and leave the program in here. */
void bsp_init(void (*spmd)(void), int argc, char** argv);
/* Starts the parallel part with at most so many processes (what process 0 says counts); the others leave the program.
 * Collective, once. */
void bsp_begin(bsp_nprocs_t maxprocs);
/* Ends it. Collective: an error if other processes still synchronize. */
void bsp_end(void);
/* Ends all processes at once, from anywhere, with a message as printf makes it. */
void bsp_abort(const char* format, ...) BSP2_PRINTF(1, 2);
void bsp_abort_va(const char* format, va_list arguments);
void bsp_vabort(const char* format, va_list arguments);

bsp_nprocs_t bsp_nprocs(void); /* outside the parallel part: how many there can be */
bsp_pid_t bsp_pid(void);
double bsp_time(void); /* seconds since bsp_begin, on this process's clock */

/* Ends the superstep. Collective. Order: gets read; gets write; puts write, by process number and then in the order of
 * the calls; registrations and the tag size change; messages are there. */
void bsp_sync(void);

/* --- Remote memory ------------------------------------------------------------------------------------------- */

/* Makes memory accessible under its address, from the next sync on. Collective; sizes may differ; NULL: no access. */
void bsp_push_reg(const void* address, bsp_size_t nbytes);
/* Takes back the newest registration of an address, at the next sync. Collective. */
void bsp_pop_reg(const void* address);

/* Writes to process pid, at the memory that it registered together with our dst. The source is read now. */
void bsp_put(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes);
/* Reads what will be at process pid, when all have called bsp_sync. */
void bsp_get(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes);
/* The same without buffers: source and destination must be left alone until the sync is over. */
void bsp_hpput(bsp_pid_t pid, const void* src, const void* dst, bsp_size_t offset, bsp_size_t nbytes);
void bsp_hpget(bsp_pid_t pid, const void* src, bsp_size_t offset, void* dst, bsp_size_t nbytes);

/* --- Messages ------------------------------------------------------------------------------------------------ */

/* Sets the size of tags, from the next superstep on. Collective. The size set before comes back. */
void bsp_set_tagsize(bsp_size_t* tag_nbytes);
void bsp_send(bsp_pid_t pid, const void* tag, const void* payload, bsp_size_t payload_nbytes);
/* Messages left in the queue, and the bytes of their payloads. */
void bsp_qsize(bsp_nprocs_t* nmessages, bsp_size_t* accum_nbytes);
/* Size of the first message's payload, -1 if there is none, and its tag. */
void bsp_get_tag(bsp_size_t* status, void* tag);
/* Copies at most so much of the first message's payload and removes the message. */
void bsp_move(void* payload, bsp_size_t reception_nbytes);
/* The same without a copy: where tag and payload are, until the next sync. -1 if there is no message. */
bsp_size_t bsp_hpmove(void** tag, void** payload);

#ifdef __cplusplus
}
#endif

#endif
