#include "bsp2/geometry/families/torus_family.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::geometry {
namespace {

constexpr double unit = 0x1p44, margin = 0x1p-38;

}  // namespace

TorusFamily::TorusFamily(double minor, std::uint64_t limit) : minor_(minor) {
  lag_ = static_cast<std::uint32_t>(std::max(0.0, std::floor(-std::log2(minor) / 2)));
  std::uint64_t size = 0;
  for (std::uint32_t level = 0; level <= most_levels; ++level) {
    size += (std::uint64_t{4} << level) * (std::uint64_t{4} << arc_level(level)) * 2;
    if (level > 0 && size > limit) break;
    first_of_level_[level + 1] = static_cast<std::uint32_t>(size);
    levels_ = level;
  }
}

std::array<double, 2> TorusFamily::direction(const Wedge& wedge) {
  const double n = std::ldexp(1.0, static_cast<int>(wedge.level)),
               across = 2 * static_cast<double>(wedge.at[0]) + 1 - n;
  return wedge.axis() == 0 ? std::array{wedge.sign() * n, across} : std::array{across, wedge.sign() * n};
}

/// rho >= d.x / |d|, and rho <= d.x / min d.v / |v| over the wedge's two corners v. Sums are exact in
/// doubles.
TorusFamily::Span TorusFamily::span(const Wedge& wedge) {
  const double n = std::ldexp(1.0, static_cast<int>(wedge.level)),
               across = 2 * static_cast<double>(wedge.at[0]) + 1 - n;
  double least = 2 * n;
  for (const double v : {across - 1, across + 1})
    least = std::min(least, (n * n + across * v) / std::sqrt(n * n + v * v));
  return {(1 - 0x1p-50) / std::sqrt(n * n + across * across), (1 + 0x1p-50) / least};
}

TorusFamily::Arc TorusFamily::arc_towards(std::uint32_t wedge_level, double rho, double z) const {
  const double x = rho - 1;
  const bool upright = std::fabs(z) > std::fabs(x);
  const double along = upright ? z : x, across = upright ? x : z;
  const double n = std::ldexp(1.0, static_cast<int>(arc_level(wedge_level)));
  Arc arc;
  arc.face = (upright ? 2U : 0U) + (along < 0 ? 1U : 0U);
  if (along != 0)
    arc.at = static_cast<std::uint32_t>(
        std::clamp(std::floor((across / std::fabs(along) + 1) / 2 * n), 0.0, n - 1));
  return arc;
}

std::array<double, 2> TorusFamily::middle(std::uint32_t wedge_level, const Arc& arc) const {
  const double n = std::ldexp(1.0, static_cast<int>(arc_level(wedge_level))),
               across = 2 * static_cast<double>(arc.at) + 1 - n;
  const double along = arc.face % 2 == 0 ? n : -n, length = std::sqrt(n * n + across * across);
  return arc.face < 2 ? std::array{along / length, across / length}
                      : std::array{across / length, along / length};
}

std::uint32_t TorusFamily::outer(const Wedge& wedge, const Arc& arc) const {
  const std::uint32_t place = (wedge.face << wedge.level) + wedge.at[0],
                      arc_place = (arc.face << arc_level(wedge.level)) + arc.at;
  return first_of_level_[wedge.level] + 2 * ((place << (arc_level(wedge.level) + 2)) + arc_place);
}

std::array<std::int64_t, 4> TorusFamily::plane(std::uint32_t number) const {
  Wedge wedge;
  while (number >= first_of_level_[wedge.level + 1]) ++wedge.level;
  const std::uint32_t bits = arc_level(wedge.level), rest = number - first_of_level_[wedge.level];
  const bool is_inner = rest % 2 != 0;
  const std::uint32_t arc_place = rest / 2 & ((4U << bits) - 1), place = rest / 2 >> (bits + 2);
  wedge.face = place >> wedge.level;
  wedge.at[0] = place & ((1U << wedge.level) - 1);
  const Arc arc{arc_place >> bits, arc_place & ((1U << bits) - 1)};
  const auto d = direction(wedge);
  const auto [least, most] = span(wedge);
  const auto e = middle(wedge.level, arc);
  // The outer plane must not cut off what is in the torus, the inner one leaves on its negative side what is
  // before the chord.
  const double factor = e[0] * ((e[0] >= 0) != is_inner ? least : most);
  double offset = e[0] + minor_ + margin;
  if (is_inner) {
    const double n = std::ldexp(1.0, static_cast<int>(bits)),
                 across = 2 * static_cast<double>(arc.at) + 1 - n;
    double least_cosine = 1;
    for (const double v : {across - 1, across + 1})
      least_cosine = std::min(least_cosine,
                              (n * n + across * v) / std::sqrt((n * n + v * v) * (n * n + across * across)));
    offset = e[0] + minor_ * least_cosine - margin;
  }
  return {std::llround(factor * d[0] * unit), std::llround(factor * d[1] * unit), std::llround(e[1] * unit),
          -std::llround(offset * unit)};
}

std::array<LocalInteger, 4> TorusFamily::exact(std::uint32_t number) const {
  std::array<LocalInteger, 4> covector;
  const auto coefficients = plane(number);
  for (std::size_t i = 0; i < 4; ++i) covector[i] = coefficients[i];
  return covector;
}

std::array<long double, 4> TorusFamily::rounded(std::uint32_t number) const {
  std::array<long double, 4> covector{};
  const auto coefficients = plane(number);
  for (std::size_t i = 0; i < 4; ++i) covector[i] = static_cast<long double>(coefficients[i]);
  return covector;
}

}  // namespace bsp2::geometry
