#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace bsp2::drawing {

using Point2 = std::array<double, 2>;
using Point3 = std::array<double, 3>;

enum class ViewKind : std::uint8_t { front, back, left, right, top, bottom, iso };
inline constexpr std::array all_views{ViewKind::front, ViewKind::back,   ViewKind::left, ViewKind::right,
                                      ViewKind::top,   ViewKind::bottom, ViewKind::iso};
std::string_view name_of(ViewKind view);
std::optional<ViewKind> view_named(std::string_view name);

/// Three directions at right angles: to the right, up, and towards who looks. Integers, of any length.
using ViewAxes = std::array<std::array<std::int64_t, 3>, 3>;
const ViewAxes& axes_of(ViewKind view);

/// Where a point of the model is seen, in the model's units.
Point2 seen(const ViewAxes& axes, const Point3& point);

/// Points on a grid of 2^-36 of the size of what they are of, so that every view has exact coordinates, and
/// all questions about them are answered in integers.
struct GridPoints {
  Point3 origin{};
  double unit = 1;
  std::vector<std::array<std::int64_t, 3>> points;  ///< each at most 2^36 away from the origin

  explicit GridPoints(std::span<const Point3> rounded);
};

}  // namespace bsp2::drawing
