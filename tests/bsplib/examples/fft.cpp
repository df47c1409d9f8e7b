#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <vector>

#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/spmd.hpp"

using namespace bsp2::bsplib;
using Complex = std::complex<double>;

Complex root(double k, double n) { return std::polar(1.0, -2 * std::numbers::pi * k / n); }

/// Fourier transform of x[0], x[stride], ... into y, recursively; n is a power of 2.
void fft(std::size_t n, const Complex* x, std::size_t stride, Complex* y) {
  if (n == 1) {
    y[0] = x[0];
    return;
  }
  fft(n / 2, x, 2 * stride, y);
  fft(n / 2, x + stride, 2 * stride, y + n / 2);
  for (std::size_t k = 0; k < n / 2; ++k) {
    const Complex even = y[k], odd = root(static_cast<double>(k), static_cast<double>(n)) * y[k + n / 2];
    y[k] = even + odd;
    y[k + n / 2] = even - odd;
  }
}

/// n = m p numbers, cyclically distributed: transform locally, twiddle, put element k to rank k mod p, and
/// transform over the ranks' contributions. Rank s ends with X[k + m t] for its k = s modulo p and all t.
int main(int argc, char** argv) {
  return spmd(argc, argv, [](World& world) {
    const std::size_t m = 64, p = static_cast<std::size_t>(world.nprocs()),
                      s = static_cast<std::size_t>(world.pid());
    const auto n = static_cast<double>(m * p);
    std::vector<Complex> x(m), y(m);
    for (std::size_t j = 0; j < m; ++j) x[j] = std::sin(static_cast<double>(j * p + s));
    fft(m, x.data(), 1, y.data());

    Array<Complex> z(world, (m / p + 1) * p);
    for (std::size_t k = 0; k < m; ++k)
      z.put(static_cast<int>(k % p), y[k] * root(static_cast<double>(k * s), n), k / p * p + s);
    world.sync();

    double error = 0.0;
    for (std::size_t k = s, row = 0; k < m; k += p, ++row)
      for (std::size_t t = 0; t < p; ++t) {
        Complex result = 0, truth = 0;
        for (std::size_t j = 0; j < p; ++j)
          result += z[row * p + j] * root(static_cast<double>(j * t), static_cast<double>(p));
        for (std::size_t j = 0; j < m * p; ++j)
          truth += std::sin(static_cast<double>(j)) * root(static_cast<double>(j * (k + m * t)), n);
        error = std::max(error, std::abs(result - truth));
      }
    if (error > 1e-9) world.fail("the error is " + std::to_string(error));
    std::printf("rank %zu: error %.1e\n", s, error);
  });
}
