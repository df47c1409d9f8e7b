#include "bsp2/geometry/surface/boundary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {

TriangleSurface triangulate(const HyperplaneTable<3>& table, Skin skin, const ToldShare& told,
                            unsigned threads) {
  return triangulated(table, std::move(skin), told, threads).surface;
}

double TriangleSurface::area() const {
  long double sum = 0;
  for (const auto& [a, b, c] : triangles) {
    std::array<double, 3> u, v;
    for (int k = 0; k < 3; ++k) {
      u[k] = points[b][k] - points[a][k];
      v[k] = points[c][k] - points[a][k];
    }
    const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
    sum += std::sqrt(x * x + y * y + z * z) / 2;
  }
  return static_cast<double>(sum);
}

double TriangleSurface::volume() const {
  if (points.empty()) return 0;
  long double sum = 0;
  const auto& o = points[0];  // near the solid, wherever that is
  for (const auto& [a, b, c] : triangles) {
    std::array<std::array<long double, 3>, 3> p;
    for (int k = 0; k < 3; ++k)
      p[k] = {static_cast<long double>(points[a][k]) - o[k], static_cast<long double>(points[b][k]) - o[k],
              static_cast<long double>(points[c][k]) - o[k]};
    sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
           p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
           p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return static_cast<double>(sum / 6);
}

Moments<3> TriangleSurface::moments() const {
  using Sum = long double;
  Moments<3> moments;
  if (points.empty()) return moments;
  const auto& o = points[0];  // near the solid, wherever that is
  Sum volume = 0;
  std::array<Sum, 3> first{};
  std::array<std::array<Sum, 3>, 3> second{};
  for (const auto& triangle : triangles) {
    std::array<std::array<Sum, 3>, 3> p;
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (std::size_t k = 0; k < 3; ++k) p[corner][k] = static_cast<Sum>(points[triangle[corner]][k]) - o[k];
    const Sum determinant = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                            p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                            p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    std::array<Sum, 3> sum;
    for (std::size_t k = 0; k < 3; ++k) sum[k] = p[0][k] + p[1][k] + p[2][k];
    volume += determinant;
    for (std::size_t i = 0; i < 3; ++i) {
      first[i] += determinant * sum[i];
      for (std::size_t j = i; j < 3; ++j)
        second[i][j] +=
            determinant * (sum[i] * sum[j] + p[0][i] * p[0][j] + p[1][i] * p[1][j] + p[2][i] * p[2][j]);
    }
  }
  volume /= 6;
  moments.integral[0] = static_cast<double>(volume);
  for (int i = 0; i < 3; ++i) {
    const Sum of_i = first[i] / 24;
    moments.integral[Moments<3>::index(0, i + 1)] = static_cast<double>(of_i + o[i] * volume);
    for (int j = i; j < 3; ++j)
      moments.integral[Moments<3>::index(i + 1, j + 1)] = static_cast<double>(
          second[i][j] / 120 + o[i] * (first[j] / 24) + o[j] * of_i + static_cast<Sum>(o[i]) * o[j] * volume);
  }
  return moments;
}

bool TriangleSurface::is_closed() const {
  // The sides by their lower end; one is written as its upper end and its direction.
  std::vector<std::uint32_t> begin(points.size() + 1, 0);
  const auto for_each_side = [&](const auto& see) {
    for (const auto& triangle : triangles)
      for (int k = 0; k < 3; ++k)
        if (const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3]; from != to)
          see(std::min(from, to), std::max(from, to), from < to);
  };
  for_each_side([&](std::uint32_t low, std::uint32_t, bool) { ++begin[low + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  std::vector<std::pair<std::uint32_t, bool>> sides(begin.back());
  for_each_side([&](std::uint32_t low, std::uint32_t high, bool upwards) {
    sides[next[low]++] = {high, upwards};
  });
  for (std::size_t low = 0; low < points.size(); ++low) {
    const std::span at_low(sides.data() + begin[low], begin[low + 1] - begin[low]);
    std::sort(at_low.begin(), at_low.end());
    for (std::size_t i = 0; i < at_low.size();) {
      const std::uint32_t high = at_low[i].first;
      std::ptrdiff_t sum = 0;
      for (; i < at_low.size() && at_low[i].first == high; ++i) sum += at_low[i].second ? 1 : -1;
      if (sum != 0) return false;
    }
  }
  return true;
}

}  // namespace bsp2::geometry
