/* Every function of the classic interface, in both dialects (BSP2_MULTICORE_BSP). */
#include <bsp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                              \
  do {                                                                                                \
    if (!(condition))                                                                                 \
      bsp_abort("%s:%d: not true on process %d: %s", __FILE__, __LINE__, (int)bsp_pid(), #condition); \
  } while (0)

enum { big = 300000 };

static int me, p, next, previous;

static void test_put_is_buffered(void) {
  int x = -1, source = me;
  bsp_push_reg(&x, sizeof x);
  bsp_sync();
  bsp_put(next, &source, &x, 0, sizeof x);
  source = 1000;
  CHECK(x == -1);
  bsp_sync();
  CHECK(x == previous);
  bsp_pop_reg(&x);
  bsp_sync();
}

static void test_get_reads_before_put_writes(void) {
  int x = me, got = -1, fresh = 100 + me;
  bsp_push_reg(&x, sizeof x);
  bsp_sync();
  bsp_put(next, &fresh, &x, 0, sizeof x);
  bsp_get(next, &x, 0, &got, sizeof x);
  x = 10 + me; /* a get reads what is there at the sync */
  bsp_sync();
  CHECK(got == 10 + next);
  CHECK(x == 100 + previous);
  bsp_pop_reg(&x);
  bsp_sync();
}

static void test_overlapping_puts_in_order_of_processes(void) {
  int x[3] = {-1, -1, -1}, mine[2];
  mine[0] = me;
  mine[1] = me + 50;
  bsp_push_reg(x, sizeof x);
  bsp_sync();
  bsp_put(0, mine, x, sizeof(int), 2 * sizeof(int));
  bsp_put(0, mine, x, 0, sizeof(int));
  bsp_sync();
  if (me == 0) CHECK(x[0] == p - 1 && x[1] == p - 1 && x[2] == p + 49);
  bsp_pop_reg(x);
  bsp_sync();
}

static void test_big_and_unbuffered(void) {
  char *a = malloc(big), *b = malloc(big), *c = malloc(big);
  memset(a, 'a' + me, big);
  memset(b, '.', big);
  memset(c, '.', big);
  bsp_push_reg(a, big);
  bsp_push_reg(b, big);
  bsp_sync();
  bsp_put(next, a, b, 0, big / 2);
  bsp_hpput(next, a + big / 2, b, big / 2, big / 2);
  bsp_hpget(previous, a, 0, c, big / 2);
  bsp_get(previous, a, big / 2, c + big / 2, big / 2);
  bsp_sync();
  CHECK(b[0] == 'a' + previous && b[big / 2] == 'a' + previous && memcmp(b, b + 1, big - 1) == 0);
  CHECK(c[0] == 'a' + previous && memcmp(c, c + 1, big - 1) == 0);
  bsp_pop_reg(b);
  bsp_pop_reg(a);
  bsp_sync();
  free(a);
  free(b);
  free(c);
}

static void test_registrations_in_sequence(void) {
  int x[4] = {0, 0, 0, 0}, v = 7;
  bsp_push_reg(x, 4 * sizeof(int));
  bsp_sync();
  bsp_push_reg(x, sizeof(int)); /* smaller, but not yet in effect */
  bsp_put(next, &v, x, 3 * sizeof(int), sizeof(int));
  bsp_sync();
  CHECK(x[3] == 7);
  bsp_pop_reg(x); /* the small one; it is still in effect */
  bsp_put(next, &v, x, 0, sizeof(int));
  bsp_sync();
  CHECK(x[0] == 7);
  bsp_put(next, &v, x, 2 * sizeof(int), sizeof(int)); /* the first one again */
  bsp_pop_reg(x);
  bsp_sync();
  CHECK(x[2] == 7);
  bsp_push_reg(me == 0 ? NULL : x, me == 0 ? 0 : sizeof x); /* process 0 gives no access */
  bsp_sync();
  bsp_pop_reg(me == 0 ? NULL : x);
  bsp_sync();
}

static void test_messages(void) {
  bsp_size_t tag_size = sizeof(int), status, bytes;
  bsp_nprocs_t count;
  int t, tag, i;
  char text[8], *payload;
  int* tag_at;
  bsp_set_tagsize(&tag_size);
  CHECK(tag_size == 0);
  bsp_sync();
  for (t = 0; t < p; ++t)
    for (i = 0; i < 2; ++i) {
      tag = 10 * me + i;
      bsp_send(t, &tag, "abcdef", (bsp_size_t)(i + 2));
      tag = -1;
    }
  bsp_sync();
  bsp_qsize(&count, &bytes);
  CHECK((int)count == 2 * p && (int)bytes == 5 * p);
#ifdef BSP2_MULTICORE_BSP
  count = 0;
  bsp_qsize(&count, NULL);
  CHECK((int)count == 2 * p);
#endif
  for (t = p - 1; t >= 0; --t) {
    bsp_get_tag(&status, &tag);
    CHECK(status == 2 && tag == 10 * t);
    memset(text, 0, sizeof text);
    bsp_move(text, 1); /* less than there is */
    CHECK(strcmp(text, "a") == 0);
    CHECK(bsp_hpmove((void**)&tag_at, (void**)&payload) == 3);
    CHECK(*tag_at == 10 * t + 1 && memcmp(payload, "abc", 3) == 0);
  }
  bsp_qsize(&count, &bytes);
  CHECK(count == 0 && bytes == 0);
  bsp_get_tag(&status, &tag);
  CHECK(status == (bsp_size_t)-1);
  CHECK(bsp_hpmove((void**)&tag_at, (void**)&payload) == (bsp_size_t)-1);
  tag_size = 0;
  bsp_set_tagsize(&tag_size);
  CHECK(tag_size == sizeof(int));
  bsp_send(next, &tag, NULL, 0); /* the old tag size counts */
  bsp_sync();
  bsp_sync();
  bsp_qsize(&count, &bytes);
  CHECK(count == 0); /* what is not read by the next sync is gone */
}

static void test_many_small_puts(void) {
  enum { n = 5000 };
  static double x[n];
  int i;
  bsp_push_reg(x, sizeof x);
  bsp_sync();
  for (i = 0; i < n; ++i) {
    double v = i + me;
    bsp_put((me + i) % p, &v, x, (bsp_size_t)(i * sizeof v), sizeof v);
  }
  bsp_sync();
  for (i = 0; i < n; ++i) CHECK(x[i] == i + ((me - i) % p + p) % p);
  bsp_pop_reg(x);
  bsp_sync();
}

/* More than one record of the layer can count, in three sizes, and taken in different ways. */
static void test_many_messages(void) {
  enum { n = 70000 };
  bsp_size_t tag_size = sizeof(short), status, bytes;
  bsp_nprocs_t count;
  int i;
  double got, *at;
  short tag, *tag_at;
  bsp_set_tagsize(&tag_size);
  bsp_sync();
  for (i = 0; i < n; ++i) {
    double v = i + me;
    tag = (short)(i % 1000);
    bsp_send(next, &tag, &v, sizeof v);
  }
  tag = 7;
  bsp_send(next, &tag, "abc", 3);
  bsp_send(next, &tag, NULL, 0);
  bsp_send(next, &tag, NULL, 0);
  bsp_sync();
  bsp_qsize(&count, &bytes);
  CHECK((int)count == n + 3 && (size_t)bytes == n * sizeof(double) + 3);
  for (i = 0; i < n; ++i) {
    got = -1.0;
    tag = -1;
    bsp_get_tag(&status, &tag);
    CHECK((size_t)status == sizeof got && tag == i % 1000);
    if (i % 3 == 0) {
      bsp_move(&got, sizeof got);
    } else if (i % 3 == 1) {
      CHECK((size_t)bsp_hpmove((void**)&tag_at, (void**)&at) == sizeof got);
      CHECK(*tag_at == tag);
      got = *at;
    } else {
      bsp_move(&got, 0); /* nothing of it */
      CHECK(got == -1.0);
      got = i + previous;
    }
    CHECK(got == i + previous);
    if (i % 1000 == 0) {
      bsp_qsize(&count, &bytes);
      CHECK((int)count == n + 2 - i && (size_t)bytes == (size_t)(n - 1 - i) * sizeof got + 3);
    }
  }
  bsp_get_tag(&status, &tag);
  CHECK(status == 3 && tag == 7);
  bsp_move(&got, 3);
  bsp_move(NULL, 0);
  bsp_qsize(&count, &bytes);
  CHECK(count == 1 && bytes == 0);
  tag_size = 0;
  bsp_set_tagsize(&tag_size);
  bsp_sync();
}

/* Single words, forwards with gaps, and backwards, where each continues none: the later one wins. */
static void test_scattered_words(void) {
  enum { n = 4000 };
  static double x[2 * n], y[n];
  const double before = -1.0;
  int i;
  bsp_push_reg(x, sizeof x);
  bsp_push_reg(y, sizeof y);
  bsp_sync();
  for (i = n - 1; i >= 0; --i) {
    double v = i + me;
    bsp_put(next, &before, x, (bsp_size_t)(2 * i * sizeof v), sizeof v);
    bsp_put(next, &v, x, (bsp_size_t)(2 * i * sizeof v), sizeof v);
    v = 0.0;
  }
  for (i = 0; i < n; i += 2) {
    x[2 * i + 1] = i - me;
    bsp_hpput(next, &x[2 * i + 1], y, (bsp_size_t)(i * sizeof(double)), sizeof(double));
  }
  bsp_sync();
  for (i = 0; i < n; ++i) CHECK(x[2 * i] == i + previous && y[i] == (i % 2 == 0 ? i - previous : 0.0));
  bsp_pop_reg(y);
  bsp_pop_reg(x);
  bsp_sync();
}

int main(void) {
  bsp_begin(bsp_nprocs());
  me = (int)bsp_pid();
  p = (int)bsp_nprocs();
  next = (me + 1) % p;
  previous = (me + p - 1) % p;
  test_put_is_buffered();
  test_get_reads_before_put_writes();
  test_overlapping_puts_in_order_of_processes();
  test_big_and_unbuffered();
  test_registrations_in_sequence();
  test_messages();
  test_many_small_puts();
  test_many_messages();
  test_scattered_words();
  bsp_end();
  return 0;
}
