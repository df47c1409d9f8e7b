/* bsp_init: process 0 runs main before and after the parallel part, the others only the parallel part, and
 * fewer processes than there are take part. With OWN_MPI the program has started MPI before, and ends it
 * where it comes back. */
#include <bsp.h>
#ifdef OWN_MPI
#include <mpi.h>
#endif
#include <stdio.h>
#include <stdlib.h>

static int wanted; /* only process 0 knows it */

static void check(int condition, const char* what) {
  if (!condition) bsp_abort("classic_init_test: %s", what);
}

static void spmd(void) {
  int sum = 0, t, ones[8] = {0}, one = 1;
  double start;
  bsp_begin(wanted);
  start = bsp_time();
  check(start >= 0.0 && start < 60.0, "bsp_time counts from bsp_begin");
  bsp_push_reg(ones, sizeof ones);
  bsp_sync();
  for (t = 0; t < (int)bsp_nprocs(); ++t) bsp_put(t, &one, ones, (int)(bsp_pid() * sizeof one), sizeof one);
  bsp_sync();
  for (t = 0; t < 8; ++t) sum += ones[t];
  check(sum == (int)bsp_nprocs(), "every process has put its one");
  check(bsp_time() >= start, "bsp_time grows");
  bsp_end();
}

#ifdef OWN_MPI
static int came_back;

static void end_mpi(void) {
  if (came_back) MPI_Finalize();
}
#endif

int main(int argc, char** argv) {
  int available;
#ifdef OWN_MPI
  MPI_Init(&argc, &argv);
  atexit(end_mpi);
#endif
  bsp_init(spmd, argc, argv);
#ifdef OWN_MPI
  came_back = 1;
#endif
  available = bsp_nprocs();
  wanted = available > 1 ? available - 1 : 1;
  spmd();
  if (bsp_nprocs() != wanted) return 1;
  printf("%d of %d processes took part\n", wanted, available);
  return 0;
}
