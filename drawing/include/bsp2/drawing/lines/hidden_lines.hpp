#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/drawing/views/views.hpp"
#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::drawing {

/// What a line of a view is, the stronger first: where two are in one place the stronger one is drawn.
enum class LineKind : std::uint8_t {
  visible,         ///< a sharp edge, or the contour of something round
  visible_smooth,  ///< an edge between facets of something round
  hidden,
};
inline constexpr std::size_t line_kinds = 3;

/// A straight piece of a line, as it is seen; in the model's units.
struct Piece {
  Point2 from{}, to{};
  LineKind kind = LineKind::visible;
};

/// What is drawn without lifting the pen. On the sheet, in millimetres.
struct Stroke {
  LineKind kind = LineKind::visible;
  bool is_closed = false;
  std::vector<Point2> points;
};

/// Some of the edges of a view, where several share them: of each `of` blocks those from `first` to before
/// `end`. What the parts find is, together, what the whole has.
struct EdgePart {
  std::size_t first = 0, end = 1, of = 1;
};

struct LineOptions {
  double smooth_angle = 30;  ///< degrees: facets that meet in less are of something round
  bool smooth_edges = false;
  bool hidden = true;
  double shortest = 0;  ///< gaps and pieces of an edge that are not longer are none; in the model's units
  EdgePart part;
  unsigned threads = 1;
};

/// The edges of a solid as they are seen from far away, each cut where it goes behind a face.
///
/// Drawn are sharp edges, those of more than two faces, and contours: edges between a face that is seen and
/// one that is not. Where faces cover both sides of an edge it is hidden; so a line that runs along the edge
/// of what is in front of it is not, which makes no difference, since it is in the same place. Faces that an
/// edge touches do not cover it. Points are those of the grid; all decisions about them are exact, and
/// touching means nearer than the grid's unit times four, since the grid moves each point by up to one half
/// in each direction. The result does not depend on the number of threads. Source of the idea: Appel, "The
/// notion of quantitative invisibility" (1967), here by the faces alone.
/// @param grid the points of the complex.
std::vector<Piece> lines_of(const geometry::Brep& brep, const GridPoints& grid, const ViewAxes& axes,
                            const LineOptions& options);

}  // namespace bsp2::drawing
