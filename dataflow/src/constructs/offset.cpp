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
    default:
      return ClipperLib::jtSquare;
  }
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
  for (const auto& path : moved) {
    auto& corners = result.emplace_back();
    for (const auto& p : path)
      corners.push_back({static_cast<double>(p.X) * unit, static_cast<double>(p.Y) * unit});
  }
  return result;
}

}  // namespace bsp2::dataflow
