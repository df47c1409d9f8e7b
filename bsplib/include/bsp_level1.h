/* Collective functions for programs in C, with the names and signatures of the level 1 library of the Oxford
 * BSP toolset.
 *
 * All processes call them, with the same size, operator and root: if they do not, all end with one message,
 * as always. Each ends the superstep: communication that was asked for before is complete afterwards, too,
 * and messages that were not read are gone. No memory need be registered. Sizes are those of one value, in
 * bytes; source and destination may be the same memory.
 *
 * With p processes and values of n bytes h is given for each. Where there are two algorithms, one and two
 * supersteps, the cheaper one is taken: by g and l as bsp2-probe measured them, else by those of bsp_g() and
 * bsp_l() of a machine that was not measured.
 */
#ifndef BSP2_BSP_LEVEL1_H
#define BSP2_BSP_LEVEL1_H

#include "bsp.h"

#ifdef __cplusplus
extern "C" {
#endif

/* op(result, left, right, &nbytes): an associative operator. Its arguments never overlap, and are aligned for
 * every type. It need not commute: left is always the value of the lower processes. In C before C23 it may be
 * declared with pointers to any type. */
#if defined(__cplusplus) || (defined(__STDC_VERSION__) && __STDC_VERSION__ >= 202311L)
#define BSP2_OPERATOR(op) void (*op)(void*, void*, void*, int*)
#else
#define BSP2_OPERATOR(op) void (*op)()
#endif

/* src of the root to dst of all. One superstep, h = (p-1) n, or two, h = 2 (p-1)/p n. */
void bsp_bcast(int root, void* src, void* dst, int nbytes);
/* src of all to dst of the root, by process number. One superstep, h = (p-1) n. dst counts at the root only.
 */
void bsp_gather(int root, void* src, void* dst, int nbytes);
/* p values at src of the root, one to dst of each process. One superstep, h = (p-1) n. src counts at the root
 * only. */
void bsp_scatter(int root, void* src, void* dst, int nbytes);
/* Value i of src to process i, which puts it at place bsp_pid() of the sender in its dst. One superstep, h =
 * (p-1) n. */
void bsp_total_exchange(void* src, void* dst, int nbytes);
/* op over src of all, to dst of all. One superstep, h = (p-1) n, or two, h = about 2 sqrt(p) n. */
void bsp_fold(BSP2_OPERATOR(op), void* src, void* dst, int nbytes);
void bsp_reduce(BSP2_OPERATOR(op), void* src, void* dst, int nbytes); /* its name in older toolsets */
/* op over src of the processes 0 to bsp_pid(). One superstep, h = (p-1) n, or two, h = about 2 sqrt(p) n. */
void bsp_scan(BSP2_OPERATOR(op), void* src, void* dst, int nbytes);

/* Folds and scans of one number: I int, R float, D double. */
int bsp_all(int x); /* whether it is true everywhere; somewhere; the same everywhere */
int bsp_any(int x);
int bsp_constantI(int x);
int bsp_sumI(int x);
float bsp_sumR(float x);
double bsp_sumD(double x);
int bsp_productI(int x);
float bsp_productR(float x);
double bsp_productD(double x);
int bsp_minI(int x);
float bsp_minR(float x);
double bsp_minD(double x);
int bsp_maxI(int x);
float bsp_maxR(float x);
double bsp_maxD(double x);
int bsp_sumI_prefix(int x);
float bsp_sumR_prefix(float x);
double bsp_sumD_prefix(double x);
int bsp_productI_prefix(int x);
float bsp_productR_prefix(float x);
double bsp_productD_prefix(double x);
int bsp_minI_prefix(int x);
float bsp_minR_prefix(float x);
double bsp_minD_prefix(double x);
int bsp_maxI_prefix(int x);
float bsp_maxR_prefix(float x);
double bsp_maxD_prefix(double x);

/* The machine of process 0, in the units of the toolset: s in flop/s, l in flop, g in flop a word of 32 bits,
 * and the words of a message that takes as long as a superstep. Guesses if bsp2-probe never ran. */
double bsp_s(void);
double bsp_l(void);
double bsp_g(void);
int bsp_nhalf(void);

#ifdef __cplusplus
}
#endif

#ifdef BSP2_HERE
#define bsp_bcast(...) (BSP2_HERE, bsp_bcast(__VA_ARGS__))
#define bsp_gather(...) (BSP2_HERE, bsp_gather(__VA_ARGS__))
#define bsp_scatter(...) (BSP2_HERE, bsp_scatter(__VA_ARGS__))
#define bsp_total_exchange(...) (BSP2_HERE, bsp_total_exchange(__VA_ARGS__))
#define bsp_fold(...) (BSP2_HERE, bsp_fold(__VA_ARGS__))
#define bsp_reduce(...) (BSP2_HERE, bsp_reduce(__VA_ARGS__))
#define bsp_scan(...) (BSP2_HERE, bsp_scan(__VA_ARGS__))
#endif

#endif
