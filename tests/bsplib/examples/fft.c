#include <bsp.h>
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

/* Fourier transform of x[0], x[stride], ... into y, recursively; n is a power of 2. */
static void fft(int n, const double complex* x, int stride, double complex* y) {
  int k;
  if (n == 1) {
    y[0] = x[0];
    return;
  }
  fft(n / 2, x, 2 * stride, y);
  fft(n / 2, x + stride, 2 * stride, y + n / 2);
  for (k = 0; k < n / 2; k++) {
    const double complex even = y[k], odd = cexp(-2 * I * pi * k / n) * y[k + n / 2];
    y[k] = even + odd;
    y[k + n / 2] = even - odd;
  }
}

/* n = m p numbers, cyclically distributed. In: x[j p + s] is our j-th. Out: X[k + m t], k = s modulo p, is at
 * y[..].
 * 1. each process transforms its m numbers and twiddles; 2. one put an element: the k-th goes to process k
 * mod p;
 * 3. transforms of length p over the processes' contributions. */
int main(void) {
  enum { m = 64, word = sizeof(double complex) };
  int p, s, j, k, t, mine = 0;
  double complex x[m], y[m], *z, *out, sum;
  double error = 0.0;
  bsp_begin(bsp_nprocs());
  p = bsp_nprocs();
  s = bsp_pid();
  z = malloc((m / p + 1) * p * word);
  out = malloc(p * word);
  bsp_push_reg(z, (m / p + 1) * p * word);
  bsp_sync();

  for (j = 0; j < m; j++) x[j] = sin(j * p + s);
  fft(m, x, 1, y);
  for (k = 0; k < m; k++) {
    y[k] *= cexp(-2 * I * pi * k * s / (m * p));
    bsp_put(k % p, &y[k], z, ((k / p) * p + s) * word, word);
  }
  bsp_sync();

  for (k = s; k < m; k += p, mine++) {
    for (t = 0; t < p; t++)
      for (out[t] = 0, j = 0; j < p; j++) out[t] += z[mine * p + j] * cexp(-2 * I * pi * j * t / p);
    for (t = 0; t < p; t++) { /* compare X[k + m t] with the definition */
      for (sum = 0, j = 0; j < m * p; j++)
        sum += sin(j) * cexp(-2 * I * pi * j * (k + (double)m * t) / (m * p));
      error = fmax(error, cabs(sum - out[t]));
    }
  }
  if (error > 1e-9) bsp_abort("the error is %g", error);
  printf("process %d: %d numbers, error %.1e\n", s, mine * p, error);
  bsp_pop_reg(z);
  bsp_end();
  free(out);
  free(z);
  return 0;
}
