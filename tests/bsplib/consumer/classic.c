#include <bsp.h>
#include <stdio.h>

int main(void) {
  int sum = 0, i, x[64] = {0}, mine;
  bsp_begin(2);
  mine = bsp_pid() + 1;
  bsp_push_reg(x, sizeof x);
  bsp_sync();
  for (i = 0; i < bsp_nprocs(); ++i) bsp_put(i, &mine, x, (int)(bsp_pid() * sizeof mine), sizeof mine);
  bsp_sync();
  for (i = 0; i < bsp_nprocs(); ++i) sum += x[i];
  if (sum != 3) bsp_abort("the sum is %d", sum);
  if (bsp_pid() == 0) printf("sum %d\n", sum);
  bsp_end();
  return 0;
}
