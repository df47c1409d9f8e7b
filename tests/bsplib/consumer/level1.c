/* As programs for the Oxford toolset call its collectives, with operators of typed pointers: level1
 * <processes>. */
#include <bsp_level1.h>
#include <stdio.h>
#include <stdlib.h>

static void add(int* result, int* left, int* right, int* nbytes) {
  *result = 0;
  *result = *left + *right;
  (void)nbytes;
}

int main(int argc, char** argv) {
  int sum = 0, mine, got = 0;
  bsp_begin(bsp_nprocs());
  mine = (int)bsp_pid() + 1;
  bsp_push_reg(&mine, sizeof mine);
  bsp_sync();
  bsp_fold(add, &mine, &sum, sizeof sum);
  bsp_direct_get(0, &mine, 0, &got, sizeof got);
  if (argc != 2 || (int)bsp_nprocs() != atoi(argv[1])) bsp_abort("there are %d processes", (int)bsp_nprocs());
  if (sum != (int)(bsp_nprocs() * (bsp_nprocs() + 1) / 2) || got != 1) bsp_abort("the sum is %d", sum);
  bsp_end();
  return 0;
}
