/* A program that loses its balance in one of its two loops, for its profile. */
#include <bsp.h>

static double work(int units) {
  double x = 1.0;
  int i;
  for (i = 0; i < units * 1000; ++i) x = x * 0.999 + 0.5;
  return x;
}

int main(void) {
  static double all[64][1000];
  double mine[1000] = {0};
  int i, t, p, s;
  bsp_begin(bsp_nprocs());
  p = bsp_nprocs();
  s = bsp_pid();
  bsp_push_reg(all, sizeof all);
  bsp_sync();
  for (i = 0; i < 10; ++i) {
    mine[0] += work(500);
    for (t = 0; t < p; ++t) bsp_put(t, mine, all, s * (int)sizeof mine, sizeof mine);
    bsp_sync(); /* balanced */
  }
  for (i = 0; i < 10; ++i) {
    mine[0] += work(s == p - 1 ? 2000 : 200);
    bsp_put((s + 1) % p, mine, all, 0, 8);
    bsp_sync(); /* the last process lets the others wait */
  }
  bsp_end();
  return mine[0] < 0.0;
}
