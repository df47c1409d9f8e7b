#include "sheets/hatching.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace bsp2::drawing {

std::vector<std::array<Point2, 2>> hatching(const std::vector<std::vector<Point2>>& loops,
                                            std::size_t number) {
  constexpr std::array distances{2.5, 3.5, 1.8};
  const double distance = distances[number / 2 % distances.size()];
  const double turn = number % 2 == 0 ? 1 : -1, half = std::numbers::sqrt2 / 2;
  // Lines of one distance from the origin; `along` them goes up.
  const Point2 along{half, turn * half}, across{-turn * half, half};
  const auto dot = [](const Point2& a, const Point2& b) { return a[0] * b[0] + a[1] * b[1]; };
  std::map<std::int64_t, std::vector<double>> crossings;
  for (const auto& loop : loops)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2 &p = loop[i], &q = loop[(i + 1) % loop.size()];
      const double at_p = dot(p, across) / distance, at_q = dot(q, across) / distance;
      // A corner on a line belongs to what is above it: so each line crosses an outline an even number of
      // times.
      const auto first = static_cast<std::int64_t>(std::ceil(std::min(at_p, at_q)));
      for (auto line = first; static_cast<double>(line) < std::max(at_p, at_q); ++line) {
        const double s = (static_cast<double>(line) - at_p) / (at_q - at_p);
        crossings[line].push_back(dot(p, along) + s * (dot(q, along) - dot(p, along)));
      }
    }
  std::vector<std::array<Point2, 2>> lines;
  for (auto& [line, places] : crossings) {
    std::sort(places.begin(), places.end());
    const double offset = static_cast<double>(line) * distance;
    const auto point = [&](double place) {
      return Point2{place * along[0] + offset * across[0], place * along[1] + offset * across[1]};
    };
    for (std::size_t i = 0; i + 1 < places.size(); i += 2)
      if (places[i] < places[i + 1]) lines.push_back({point(places[i]), point(places[i + 1])});
  }
  return lines;
}

}  // namespace bsp2::drawing
