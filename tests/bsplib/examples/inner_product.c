#include <bsp.h>
#include <stdio.h>

/* Inner product of x = y = (1, ..., n), distributed cyclically: every process sends its part to all. */
int main(void) {
  int n = 1000, p, s, i, t;
  double part = 0.0, sum = 0.0, parts[64];
  bsp_begin(bsp_nprocs() < 64 ? bsp_nprocs() : 64);
  p = bsp_nprocs();
  s = bsp_pid();
  bsp_push_reg(parts, p * (int)sizeof(double));
  bsp_sync();
  for (i = s; i < n; i += p) part += (i + 1.0) * (i + 1.0);
  for (t = 0; t < p; t++) bsp_put(t, &part, parts, s * (int)sizeof(double), sizeof(double));
  bsp_sync();
  for (t = 0; t < p; t++) sum += parts[t];
  bsp_pop_reg(parts);
  if (sum != n * (n + 1.0) * (2 * n + 1.0) / 6) bsp_abort("wrong sum %f", sum);
  if (s == 0) printf("sum = %.0f\n", sum);
  bsp_end();
  return 0;
}
