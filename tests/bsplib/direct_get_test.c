/* bsp_direct_get: it reads in the middle of a superstep, from processes that wait, that compute and that ask
 * each other. */
#include <bsp.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                              \
  do {                                                                                                \
    if (!(condition))                                                                                 \
      bsp_abort("%s:%d: not true on process %d: %s", __FILE__, __LINE__, (int)bsp_pid(), #condition); \
  } while (0)

enum { many = 300000 };
static int p, me, x[4], *large;

static void compute_for(double seconds) {
  const double begin = bsp_time();
  while (bsp_time() - begin < seconds) continue;
}

/* One process asks all, and these are elsewhere. */
static void test_one_asks(void) {
  int t, i, got[4], *all;
  for (i = 0; i < 4; ++i) x[i] = 10 * me + i;
  bsp_sync();
  if (me == 0) {
    all = malloc(many * sizeof *all);
    for (t = p - 1; t >= 0; --t) {
      memset(got, 0, sizeof got);
      bsp_direct_get((bsp_pid_t)t, x, 4, got, 8);
      CHECK(got[0] == 10 * t + 1 && got[1] == 10 * t + 2 && got[2] == 0);
      bsp_direct_get((bsp_pid_t)t, large, 0, all, many * sizeof *all);
      for (i = 0; i < many; ++i) CHECK(all[i] == t + i);
    }
    free(all);
  } else if (me % 2) {
    compute_for(0.02);
  }
  bsp_sync();
}

/* All ask all at once; meanwhile puts are under way, which none sees. */
static void test_all_ask(void) {
  int round, t, v, got;
  for (round = 0; round < 15; ++round) {
    x[0] = 100 * round + me;
    bsp_sync();
    v = -1;
    bsp_put((bsp_pid_t)((me + 1) % p), &v, x, 0, sizeof v);
    for (t = 0; t < p; ++t) {
      got = 0;
      bsp_direct_get((bsp_pid_t)((me + t) % p), x, 0, &got, sizeof got);
      CHECK(got == 100 * round + (me + t) % p);
    }
    bsp_direct_get(0, x, 0, NULL, 0);
    bsp_sync();
    CHECK(x[0] == -1);
  }
}

/* The last superstep: the others are in bsp_end. */
static void test_at_the_end(void) {
  int got = 0;
  x[1] = me + 7;
  bsp_sync();
  if (me == 0) {
    bsp_direct_get((bsp_pid_t)(p - 1), x, 4, &got, sizeof got);
    CHECK(got == p + 6);
  }
}

int main(void) {
  int i;
  bsp_begin(bsp_nprocs());
  p = (int)bsp_nprocs();
  me = (int)bsp_pid();
  large = malloc(many * sizeof *large);
  for (i = 0; i < many; ++i) large[i] = me + i;
  bsp_push_reg(x, sizeof x);
  bsp_push_reg(large, many * sizeof *large);
  bsp_sync();
  test_one_asks();
  test_all_ask();
  test_at_the_end();
  bsp_end();
  free(large);
  return 0;
}
