#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/drawing/lines/hidden_lines.hpp"
#include "bsp2/drawing/views/views.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/io/outputs/sheet.hpp"

namespace bsp2::drawing {

enum class Projection : std::uint8_t { first, third };

/// Where edges behind faces are drawn; in sections never.
enum class HiddenLines : std::uint8_t { nowhere, flat_views, everywhere };

/// Of ISO 216, lying.
struct SheetSize {
  std::string_view name;
  double width, height;  ///< millimetres
};
/// A4 to A0. @return nothing for other names.
std::optional<SheetSize> sheet_size(std::string_view name);

/// A plane at right angles to an axis; what is in front of it is taken away.
struct Section {
  std::string name;          ///< a letter or two
  std::size_t axis = 0;      ///< 0, 1, 2: x, y, z
  double place = 0;          ///< model units
  bool from_behind = false;  ///< looked at against the usual direction
};
/// The view of a section: x from the left, y from the front, z from the top; from behind the opposite.
ViewKind view_of(const Section& section);

/// The distance of two points of the model as a view shows it.
struct Dimension {
  ViewKind view = ViewKind::front;
  Point3 from{}, to{};
};

/// Of which the drawing is made, and what is written on it.
struct DrawingOptions {
  std::vector<ViewKind> views{ViewKind::front, ViewKind::top, ViewKind::left, ViewKind::iso};
  Projection projection = Projection::first;
  std::optional<double> scale;  ///< millimetres on paper for a unit; none: the largest usual one that fits
  SheetSize size{"A3", 420, 297};
  HiddenLines hidden = HiddenLines::flat_views;  ///< not in `iso`
  bool smooth_edges = false, centre_lines = true, overall = true;
  double smooth_angle = 30;  ///< degrees
  std::vector<Section> sections;
  std::vector<Dimension> dimensions;
  std::string title, author, number, material, date;
  unsigned threads = 1;
};

struct Drawing {
  io::Sheet sheet;
  double scale = 1;
  std::vector<std::string> notes;  ///< what is as it should be, but may surprise
};

/// The lines of one view, as they are on the sheet.
struct ViewLines {
  std::vector<Stroke> strokes;
  std::uint64_t short_lines = 0;  ///< that were left out
};

/// What somebody finds of the lines of all views, where `of` share them: one view after the other, and of
/// their edges as many each.
struct Share {
  std::size_t number = 0, of = 1;
};

/// The pieces of lines of each view, on the sheet: what takes most of the time of a drawing. Views that have
/// no part in the share stay empty. Of the complexes it needs `points`, `edges`, `faces`, `uses`,
/// `uses_of_edges`, `triangles` and `face_of_triangle`.
/// @param cuts as for `draw`.
/// @throws bsp2::Error if it does not fit on the sheet, and for an empty solid.
std::vector<std::vector<Piece>> pieces_of_views(const geometry::Brep& brep,
                                                std::span<const geometry::Brep> cuts,
                                                const DrawingOptions& options, Share share = {});

/// The lines of a view from all its pieces, whose order does not matter.
ViewLines lines_from(std::vector<Piece> pieces);

/// An engineering drawing: views with hidden lines, sections, centre lines, dimensions, a frame and a title
/// block.
///
/// Layers: VISIBLE, SMOOTH, HIDDEN, SECTION (hatching), CENTER, DIMENSION, FRAME. Views lie as the projection
/// wants them, and sections on the right of them. A unit of the model is a millimetre. The result does not
/// depend on the number of threads.
/// @param cuts the solid without what is in front of each section, in their order.
/// @param lines of all views. @throws bsp2::Error if it does not fit on the sheet, and for an empty solid.
Drawing draw(const geometry::Brep& brep, std::span<const geometry::Brep> cuts, const DrawingOptions& options,
             std::span<const ViewLines> lines);

}  // namespace bsp2::drawing
