#include "bsp2/drawing/views/views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bsp2::drawing {
namespace {

struct NamedView {
  ViewKind kind;
  std::string_view name;
  ViewAxes axes;
};

/// x is to the right and z up for who stands in front.
constexpr std::array<NamedView, 7> views{{
    {ViewKind::front, "front", {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}}},
    {ViewKind::back, "back", {{{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}}}},
    {ViewKind::left, "left", {{{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}}}},
    {ViewKind::right, "right", {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}}},
    {ViewKind::top, "top", {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}},
    {ViewKind::bottom, "bottom", {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}},
    {ViewKind::iso, "iso", {{{1, 1, 0}, {-1, 1, 2}, {1, -1, 1}}}},
}};

}  // namespace

std::string_view name_of(ViewKind view) { return views[static_cast<std::size_t>(view)].name; }

std::optional<ViewKind> view_named(std::string_view name) {
  const auto* found =
      std::find_if(views.begin(), views.end(), [&](const NamedView& view) { return view.name == name; });
  return found == views.end() ? std::nullopt : std::optional(found->kind);
}

const ViewAxes& axes_of(ViewKind view) { return views[static_cast<std::size_t>(view)].axes; }

Point2 seen(const ViewAxes& axes, const Point3& point) {
  Point2 at{};
  for (std::size_t i = 0; i < 2; ++i) {
    double length = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      at[i] += static_cast<double>(axes[i][k]) * point[k];
      length += static_cast<double>(axes[i][k] * axes[i][k]);
    }
    if (length != 1) at[i] /= std::sqrt(length);
  }
  return at;
}

GridPoints::GridPoints(std::span<const Point3> rounded) {
  if (rounded.empty()) return;
  Point3 lower = rounded.front(), upper = rounded.front();
  for (const Point3& point : rounded)
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], point[k]);
      upper[k] = std::max(upper[k], point[k]);
    }
  double size = std::numeric_limits<double>::min();
  for (std::size_t k = 0; k < 3; ++k) size = std::max(size, upper[k] - lower[k]);
  origin = lower;
  unit = std::ldexp(1, std::ilogb(size) + 1 - 36);
  points.reserve(rounded.size());
  for (const Point3& point : rounded) {
    auto& on_grid = points.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) on_grid[k] = std::llround((point[k] - origin[k]) / unit);
  }
}

}  // namespace bsp2::drawing
