#include <bsp.h>
#include <stdio.h>
#include <stdlib.h>

static int compare(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

/* Sorts n random numbers a process: local sort, p samples of each to all, splitters, one message a pair of
 * processes. */
int main(void) {
  enum { n = 10000 };
  int p, s, i, t, begin, count, bytes, tag, size = sizeof(int), total = 0;
  double *x = malloc(n * sizeof(double)), *samples, *sorted, last = -1.0;
  bsp_begin(bsp_nprocs());
  p = bsp_nprocs();
  s = bsp_pid();
  samples = malloc(p * p * sizeof(double));
  bsp_push_reg(samples, p * p * (int)sizeof(double));
  bsp_set_tagsize(&size);
  bsp_sync();

  srand(s + 1);
  for (i = 0; i < n; i++) x[i] = rand() / (RAND_MAX + 1.0);
  qsort(x, n, sizeof(double), compare);
  for (i = 0; i < p; i++)
    for (t = 0; t < p; t++)
      bsp_put(t, &x[i * (n / p)], samples, (s * p + i) * (int)sizeof(double), sizeof(double));
  bsp_sync();

  qsort(samples, p * p, sizeof(double), compare); /* every p-th sample is a splitter */
  for (t = 0, begin = 0; t < p; t++, begin = i) {
    for (i = begin; i < n && (t == p - 1 || x[i] < samples[(t + 1) * p]);) i++;
    tag = i - begin;
    bsp_send(t, &tag, x + begin, tag * (int)sizeof(double));
  }
  bsp_sync();

  bsp_qsize(&count, &bytes);
  sorted = malloc(bytes + 1);
  for (; count > 0; count--) {
    bsp_get_tag(&bytes, &tag);
    bsp_move(sorted + total, bytes);
    total += tag;
  }
  qsort(sorted, total, sizeof(double), compare);
  for (i = 0; i < total; last = sorted[i++])
    if (sorted[i] < last || (s > 0 && sorted[i] < samples[s * p]) ||
        (s < p - 1 && sorted[i] >= samples[(s + 1) * p]))
      bsp_abort("not sorted at %d", i);
  printf("process %d has %d numbers\n", s, total);
  bsp_pop_reg(samples);
  bsp_end();
  free(sorted);
  free(samples);
  free(x);
  return 0;
}
