#include "constructs/offset.hpp"

#include <algorithm>
#include <clipper.hpp>
#include <cmath>

namespace bsp2::dataflow {
namespace {

constexpr double mitre_limit = 1e6;  // no corner of a model is so sharp

ClipperLib::JoinType join_of(model::Offset::Join join) {
  switch (join) {
    case model::Offset::Join::round:
      return ClipperLib::jtRound;
    case model::Offset::Join::mitre:
      return ClipperLib::jtMiter;
    case model::Offset::Join::square:
      break;
  }
  return ClipperLib::jtSquare;
}

/// Takes out the corners that are in line with their neighbours but for the rounding to the unit: what an
/// edge leaves behind that is nearly in line with the next one, and paths that are no wider than that. Two
/// edges of one line are rounded at four ends, before they are moved and after, and so is where they meet.
void straighten(std::vector<std::array<double, 2>>& path, double unit) {
  constexpr double units = 256;
  const auto is_in_line = [&](const auto& p, const auto& q, const auto& r) {
    const double x = r[0] - p[0], y = r[1] - p[1];
    return std::fabs(x * (q[1] - p[1]) - y * (q[0] - p[0])) <= units * unit * std::hypot(x, y);
  };
  for (std::size_t i = 0, kept = 0; kept < path.size() && path.size() >= 3;) {
    const std::size_t n = path.size(), at = i % n;
    if (is_in_line(path[(at + n - 1) % n], path[at], path[(at + 1) % n])) {
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(at));
      i = at == 0 ? path.size() - 1 : at - 1;  // which has another neighbour now
      kept = 0;
    } else {
      ++i, ++kept;
    }
  }
}

std::size_t corners_of(const ClipperLib::Paths& paths) {
  std::size_t sum = 0;
  for (const auto& path : paths) sum += path.size();
  return sum;
}

ClipperLib::Paths moved_by(const ClipperLib::Paths& paths, double units) {
  ClipperLib::ClipperOffset clipper(mitre_limit);
  clipper.AddPaths(paths, ClipperLib::jtMiter, ClipperLib::etClosedPolygon);
  ClipperLib::Paths moved;
  clipper.Execute(moved, units);
  return moved;
}

/// Where what touches without overlapping is joined by rounding it has a neck of no width: what is so thin
/// goes. Nothing changes where there is none.
ClipperLib::Paths without_necks(ClipperLib::Paths paths) {
  constexpr double units = 32;
  ClipperLib::Paths opened = moved_by(moved_by(paths, -units), units);
  const bool is_same = opened.size() == paths.size() && corners_of(opened) == corners_of(paths);
  return is_same ? std::move(paths) : std::move(opened);
}

}  // namespace

Outline offset_outline(const model::Offset& offset, const Outline& outline) {
  if (offset.distance == 0 || outline.empty()) return outline;
  double reach = std::fabs(offset.distance);
  for (const auto& path : outline)
    for (const auto& p : path) reach = std::max({reach, std::fabs(p[0]), std::fabs(p[1])});
  const double unit = std::ldexp(1.0, std::ilogb(reach) - 45);

  const double sides = model::side_count(std::fabs(offset.distance), offset.resolution);
  const double deviation = std::fabs(offset.distance) * (1 - model::cosine(180 / sides));
  ClipperLib::ClipperOffset clipper(mitre_limit, deviation / unit);
  const auto join = join_of(offset.join);
  for (const auto& path : outline) {
    ClipperLib::Path scaled;
    for (const auto& p : path) scaled.emplace_back(std::llround(p[0] / unit), std::llround(p[1] / unit));
    clipper.AddPath(scaled, join, ClipperLib::etClosedPolygon);
  }
  ClipperLib::Paths moved;
  clipper.Execute(moved, offset.distance / unit);
  Outline result;
  for (const auto& path : without_necks(std::move(moved))) {
    std::vector<std::array<double, 2>> corners;
    for (const auto& p : path)
      corners.push_back({static_cast<double>(p.X) * unit, static_cast<double>(p.Y) * unit});
    straighten(corners, unit);
    if (corners.size() >= 3) result.push_back(std::move(corners));
  }
  return result;
}

}  // namespace bsp2::dataflow
