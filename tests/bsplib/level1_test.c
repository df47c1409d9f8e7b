/* The collectives of bsp_level1.h against loops over what each process must have, with sizes and a machine
 * for which they take one superstep, and two. Random sizes and values, from a seed that is printed where
 * something is wrong. */
#include <bsp_level1.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                                     \
  do {                                                                                                       \
    if (!(condition))                                                                                        \
      bsp_abort("%s:%d: not true on process %d, seed %u, %d bytes: %s", __FILE__, __LINE__, bsp_pid(), seed, \
                n, #condition);                                                                              \
  } while (0)

static unsigned seed;
static int p, me, n;

static unsigned char byte_of(int process, int i) {
  unsigned x = seed * 2654435761u + (unsigned)process * 40503u + (unsigned)i * 2246822519u;
  x ^= x >> 15;
  x *= 2246822519u;
  return (unsigned char)(x >> 24);
}

static void fill(unsigned char* memory, int process, int from) {
  int i;
  for (i = 0; i < n; ++i) memory[i] = byte_of(process, from + i);
}

/* Associative, but it does not commute: maps i -> a i + b modulo 251, byte pairs (a, b), one after the other.
 */
static void compose(void* result, void* left, void* right, int* nbytes) {
  unsigned char *r = result, *f = left, *g = right;
  int i;
  for (i = 0; i + 1 < *nbytes; i += 2) r[i] = r[i + 1] = 0; /* nothing overlaps */
  for (i = 0; i + 1 < *nbytes; i += 2) {
    r[i] = (unsigned char)(f[i] * g[i] % 251);
    r[i + 1] = (unsigned char)((g[i] * f[i + 1] + g[i + 1]) % 251);
  }
  if (*nbytes % 2) r[*nbytes - 1] = g[*nbytes - 1]; /* the last one: associative, too */
}

static void map_of(unsigned char* memory, int process) {
  int i;
  fill(memory, process, 0);
  for (i = 0; i < n; ++i) memory[i] = (unsigned char)(memory[i] % 251);
}

/* The maps of the processes from 0 to last, composed in their order. */
static void composed(unsigned char* result, int last) {
  unsigned char *next = malloc((size_t)n + 1), *before = malloc((size_t)n + 1);
  int process;
  map_of(result, 0);
  for (process = 1; process <= last; ++process) {
    memcpy(before, result, (size_t)n);
    map_of(next, process);
    compose(result, before, next, &n);
  }
  free(next);
  free(before);
}

static void test_one_size(void) {
  const size_t room = (size_t)n * (size_t)p + 16;
  unsigned char *src = malloc(room), *dst = malloc(room), *expected = malloc(room);
  int root, i;
  for (root = 0; root < p; ++root) {
    fill(src, me, 0);
    memset(dst, 170, room);
    bsp_bcast(root, src, dst, n);
    fill(expected, root, 0);
    CHECK(memcmp(dst, expected, (size_t)n) == 0 && dst[n] == 170);
    bsp_bcast(root, src, src, n); /* in place */
    CHECK(memcmp(src, expected, (size_t)n) == 0);

    fill(src, me, 0);
    memset(dst, 170, room);
    bsp_gather(root, src, me == root ? dst : NULL, n);
    if (me == root)
      for (i = 0; i < p; ++i) {
        fill(expected, i, 0);
        CHECK(memcmp(dst + (size_t)i * (size_t)n, expected, (size_t)n) == 0);
      }
    CHECK(dst[me == root ? (size_t)n * (size_t)p : 0] == 170);

    for (i = 0; i < p; ++i) fill(src + (size_t)i * (size_t)n, me, i);
    memset(dst, 170, room);
    bsp_scatter(root, me == root ? src : NULL, dst, n);
    fill(expected, root, me);
    CHECK(memcmp(dst, expected, (size_t)n) == 0 && dst[n] == 170);
  }
  for (i = 0; i < p; ++i) fill(src + (size_t)i * (size_t)n, me, i);
  bsp_total_exchange(src, src, n);
  for (i = 0; i < p; ++i) {
    fill(expected, i, me);
    CHECK(memcmp(src + (size_t)i * (size_t)n, expected, (size_t)n) == 0);
  }
  map_of(src, me);
  memset(dst, 170, room);
  bsp_fold(compose, src, dst, n);
  composed(expected, p - 1);
  CHECK(memcmp(dst, expected, (size_t)n) == 0 && dst[n] == 170);
  bsp_scan(compose, src, dst, n);
  composed(expected, me);
  CHECK(memcmp(dst, expected, (size_t)n) == 0 && dst[n] == 170);
  bsp_reduce(compose, src, src, n); /* in place */
  composed(expected, p - 1);
  CHECK(memcmp(src, expected, (size_t)n) == 0);
  free(src);
  free(dst);
  free(expected);
}

static void test_single_numbers(void) {
  int i, sum = 0, product = 1;
  for (i = 0; i < p; ++i) {
    sum += i + 1;
    product *= i + 1;
    if (i == me)
      CHECK(bsp_sumI_prefix(me + 1) == sum);
    else
      bsp_sumI_prefix(me + 1);
    if (i == me)
      CHECK(bsp_productD_prefix(me + 1.0) == product);
    else
      bsp_productD_prefix(me + 1.0);
  }
  CHECK(bsp_sumI(me + 1) == sum && bsp_sumR((float)me + 1) == (float)sum && bsp_sumD(me + 1.0) == sum);
  CHECK(bsp_productI(me + 1) == product && bsp_productR((float)me + 1) == (float)product);
  CHECK(bsp_minI(-me) == 1 - p && bsp_minD(me + 0.5) == 0.5 && bsp_maxI(me) == p - 1 &&
        bsp_maxR((float)me) == (float)(p - 1));
  CHECK(bsp_minI_prefix(-me) == -me && bsp_maxD_prefix(-me + 0.5) == 0.5);
  CHECK(bsp_all(1) && bsp_all(me != p - 1) == 0 && bsp_any(me == p - 1) && !bsp_any(0));
  CHECK(bsp_constantI(7) && bsp_constantI(me) == (p == 1));
  CHECK(bsp_s() > 0 && bsp_l() > 0 && bsp_g() > 0 && bsp_nhalf() >= 1);
}

/* What was asked for before is complete after the call, however many supersteps it takes: messages of two
 * sizes are there with the tags that they were sent with, and the next ones have other tags. */
static void test_beside_other_communication(void) {
  int x = -1, v = me + 1, tag = 5 * me, sum, left = (me + p - 1) % p, i;
  short longer[3] = {1, 2, 3}, got[3];
  bsp_nprocs_t count;
  bsp_size_t bytes, size = sizeof tag;
  bsp_push_reg(&x, sizeof x);
  bsp_set_tagsize(&size);
  bsp_sync();
  bsp_put((me + 1) % p, &v, &x, 0, sizeof v);
  for (i = 0; i < 3; ++i) bsp_send((me + 1) % p, &tag, &v, sizeof v);
  bsp_send((me + 1) % p, &tag, longer, sizeof longer);
  size = 0;
  bsp_set_tagsize(&size);
  sum = bsp_sumI(me);
  CHECK(sum == p * (p - 1) / 2 && x == left + 1);
  bsp_qsize(&count, &bytes);
  CHECK(count == 4 && bytes == 3 * sizeof v + sizeof longer);
  for (i = 0; i < 3; ++i) {
    bsp_get_tag(&size, &tag);
    CHECK(size == sizeof v && tag == 5 * left);
    bsp_move(&v, sizeof v);
    CHECK(v == left + 1);
  }
  bsp_get_tag(&size, &tag);
  CHECK(size == sizeof longer && tag == 5 * left);
  bsp_move(got, sizeof got);
  CHECK(memcmp(got, longer, sizeof got) == 0);
  bsp_send((me + 1) % p, NULL, &v, sizeof v);
  bsp_pop_reg(&x);
  bsp_sync();
  bsp_qsize(&count, &bytes);
  CHECK(count == 1 && bytes == sizeof v);
}

int main(int argc, char** argv) {
  const int sizes[] = {0, 1, 2, 7, 8, 63, 1000, 40000, 300000};
  int round;
  seed = argc > 1 ? (unsigned)atoi(argv[1]) : 1;
  bsp_begin(bsp_nprocs());
  p = bsp_nprocs();
  me = bsp_pid();
  for (round = 0; round < (int)(sizeof sizes / sizeof *sizes); ++round) {
    n = sizes[round];
    test_one_size();
  }
  srand(seed); /* the same on all */
  for (round = 0; round < 20; ++round) {
    n = rand() % (round % 2 ? 200 : 20000);
    test_one_size();
  }
  test_single_numbers();
  test_beside_other_communication();
  bsp_end();
  return 0;
}
