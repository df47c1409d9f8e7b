#include "drawing/svg_stroke.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace bsp2::model::svg {

Stroke::Stroke(double width, const std::string& cap, const std::string& join)
    : radius_(width * grid / 2),
      tolerance_(std::max(0.25, radius_ * 1e-9)),  // arcs of any width have a bounded number of chords
      is_round_(join == "round"),
      has_round_caps_(cap == "round"),
      clipper_(2.0, tolerance_),
      join_(is_round_         ? ClipperLib::jtRound
            : join == "bevel" ? ClipperLib::jtSquare
                              : ClipperLib::jtMiter),
      cap_(has_round_caps_ ? ClipperLib::etOpenRound
           : cap == "butt" ? ClipperLib::etOpenButt
                           : ClipperLib::etOpenSquare) {}

bool Stroke::set_line(const std::vector<Point>& line) {
  line_.clear();
  for (const Point& p : line) {
    if (!(std::fabs(p[0]) < largest && std::fabs(p[1]) < largest)) return false;
    line_.emplace_back(static_cast<ClipperLib::cInt>(p[0] * grid),
                       static_cast<ClipperLib::cInt>(p[1] * grid));
  }
  return true;
}

Stroke::Cost Stroke::cost(double most_looks, double most_crossings) const {
  const std::size_t n = line_.size();
  std::vector<std::pair<double, double>> heights;  // of each point, and how many the outline has there
  for (std::size_t i = 0; i < n; ++i) heights.emplace_back(static_cast<double>(line_[i].Y), points_at(i));
  std::sort(heights.begin(), heights.end());
  std::vector<double> before{0};
  for (const auto& [height, points] : heights) before.push_back(before.back() + points);
  const auto between = [&](double low, double high) {
    const auto from = std::lower_bound(heights.begin(), heights.end(), std::pair{low, 0.0});
    const auto to =
        std::upper_bound(from, heights.end(), std::pair{high, std::numeric_limits<double>::infinity()});
    return before[static_cast<std::size_t>(to - heights.begin())] -
           before[static_cast<std::size_t>(from - heights.begin())];
  };
  Cost cost{.points = before.back()};
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = static_cast<double>(line_[i].Y),
               next = static_cast<double>(line_[std::min(i + 1, n - 1)].Y);
    cost.looks += 2 * (between(std::min(at, next) - radius_, std::max(at, next) + radius_) +
                       between(at - radius_, at + radius_));
  }
  if (cost.looks <= most_looks) cost.crossings = crossings(most_crossings);
  return cost;
}

std::vector<std::vector<Point>> Stroke::outline() {
  clipper_.AddPath(line_, join_, cap_);
  ClipperLib::Paths area;
  clipper_.Execute(area, radius_);
  std::vector<std::vector<Point>> paths;
  for (const auto& path : area) {
    auto& points = paths.emplace_back();
    for (const auto& p : path)
      points.push_back({static_cast<double>(p.X) / grid, static_cast<double>(p.Y) / grid});
  }
  return paths;
}

double Stroke::points_at(std::size_t i) const {
  constexpr double of_corner = 5;
  const double chord_angle = 2 * std::acos(1 - std::min(tolerance_ / radius_, 0.25));
  if (i == 0 || i + 1 == line_.size())
    return of_corner + (has_round_caps_ ? std::numbers::pi / chord_angle : 0);
  if (!is_round_) return of_corner;
  const auto direction = [&](std::size_t k) {
    return Point{static_cast<double>(line_[k + 1].X - line_[k].X),
                 static_cast<double>(line_[k + 1].Y - line_[k].Y)};
  };
  const Point a = direction(i - 1), b = direction(i);
  return of_corner +
         std::fabs(std::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])) / chord_angle;
}

double Stroke::crossings(double most) const {
  struct Surroundings {
    double low, high, left, right;
  };
  std::vector<Surroundings> all;
  for (std::size_t i = 0; i + 1 < line_.size(); ++i) {
    const auto [left, right] = std::minmax(
        {static_cast<double>(line_[i].X), static_cast<double>(line_[i + 1].X)});  // values, no references
    const auto [low, high] =
        std::minmax({static_cast<double>(line_[i].Y), static_cast<double>(line_[i + 1].Y)});
    all.push_back({low - radius_, high + radius_, left - radius_, right + radius_});
  }
  std::sort(all.begin(), all.end(),
            [](const Surroundings& a, const Surroundings& b) { return a.low < b.low; });
  double count = 0;
  for (std::size_t i = 0; i < all.size() && count <= most; ++i)
    for (std::size_t k = i + 1; k < all.size() && all[k].low <= all[i].high; ++k)
      if (all[k].left <= all[i].right && all[i].left <= all[k].right) ++count;
  return count;
}

}  // namespace bsp2::model::svg
