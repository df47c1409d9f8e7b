#pragma once

#include <clipper.hpp>
#include <cstddef>
#include <string>
#include <vector>

#include "drawing/svg_shapes.hpp"

namespace bsp2::model::svg {

/// A line with a width, on OpenSCAD's grid of 1e-4 units: its joins are mitres and its caps squares, if
/// nothing else is said. An element inherits nothing of this, as in OpenSCAD.
class Stroke {
 public:
  static constexpr double grid = 1e4, largest = 1e12;

  /// @param width in units of the drawing, at least 0.01.
  Stroke(double width, const std::string& cap, const std::string& join);

  /// @return false if it lies too far out.
  bool set_line(const std::vector<Point>& line);

  /// What its outline takes, from above, before it is made.
  struct Cost {
    double points = 0;     ///< of the outline, where it does not cross itself
    double looks = 0;      ///< an edge of it and a point of it at whose height it is
    double crossings = 0;  ///< edges of the line whose surroundings overlap
  };
  /// @param most_looks of which more are not counted; nor are crossings beyond most_crossings.
  [[nodiscard]] Cost cost(double most_looks, double most_crossings) const;

  std::vector<std::vector<Point>> outline();

 private:
  double radius_, tolerance_;
  bool is_round_, has_round_caps_;
  ClipperLib::ClipperOffset clipper_;
  ClipperLib::JoinType join_;
  ClipperLib::EndType cap_;
  ClipperLib::Path line_;

  /// As many as the outline has at a point of the line, on both sides of it.
  [[nodiscard]] double points_at(std::size_t i) const;
  [[nodiscard]] double crossings(double most) const;
};

}  // namespace bsp2::model::svg
