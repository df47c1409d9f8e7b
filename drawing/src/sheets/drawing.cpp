#include "bsp2/drawing/sheets/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "bsp2/drawing/lines/hidden_lines.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "lines/joining.hpp"
#include "lines/round_faces.hpp"
#include "sheets/annotations.hpp"
#include "sheets/hatching.hpp"
#include "sheets/layout.hpp"

namespace bsp2::drawing {
namespace {

using geometry::Brep;

/// A solid, or what a section leaves of it, as all views need it.
struct Seen {
  const Brep& brep;
  GridPoints grid;
  std::vector<RoundAxis> axes;
};

Seen prepared(const Brep& brep, const DrawingOptions& options) {
  return {brep, GridPoints(brep.points),
          options.centre_lines ? round_axes(brep, options.smooth_angle) : std::vector<RoundAxis>{}};
}

/// What was left out of all views.
struct LeftOut {
  std::uint64_t short_lines = 0, small_circles = 0;
  std::vector<std::string> marks;
};

Point2 corner(const Layout& layout, const PlacedView& view, const Point2& at) {
  return {view.origin[0] + (at[0] - view.lower[0]) * layout.scale,
          view.origin[1] + (at[1] - view.lower[1]) * layout.scale};
}

std::vector<Piece> pieces_of_view(const Brep& brep, const GridPoints& grid, const PlacedView& view,
                                  const Layout& layout, const DrawingOptions& options, const EdgePart& part) {
  LineOptions how;
  how.smooth_angle = options.smooth_angle;
  how.smooth_edges = options.smooth_edges;
  how.hidden =
      view.section == nullptr && (options.hidden == HiddenLines::everywhere ||
                                  (options.hidden == HiddenLines::flat_views && view.kind != ViewKind::iso));
  how.shortest = finest / layout.scale;
  how.part = part;
  how.threads = options.threads;
  std::vector<Piece> pieces = lines_of(brep, grid, axes_of(view.kind), how);
  for (Piece& piece : pieces) {
    piece.from = corner(layout, view, piece.from);
    piece.to = corner(layout, view, piece.to);
  }
  return pieces;
}

/// Of a share in a view: all views have as many units as there are shares, and each share as many as there
/// are views.
EdgePart part_of(const Share& share, std::size_t view, std::size_t views) {
  const std::size_t before = view * share.of;
  const auto unit = [&](std::size_t number) {
    return std::clamp(number * views, before, before + share.of) - before;
  };
  return {unit(share.number), unit(share.number + 1), share.of};
}

/// @throws bsp2::Error if the solid is empty, or does not fit.
Layout checked_layout(const Brep& brep, const DrawingOptions& options) {
  if (brep.points.empty()) throw Error("there is nothing to draw: the solid is empty");
  return layout_of(brep.points, options);
}

/// Draws views on a sheet.
class Draughtsman {
 public:
  Draughtsman(const DrawingOptions& options, const Layout& layout, io::Sheet& sheet)
      : options_(options), layout_(layout), sheet_(sheet), notes_(sheet) {}

  void draw(const PlacedView& view, const Seen& solid, const ViewLines& lines) {
    view_ = &view;
    axes_ = &axes_of(view.kind);
    draw_lines(lines);
    if (view.section != nullptr) hatch(solid);
    if (options_.centre_lines && view.kind != ViewKind::iso) draw_axes(solid);
    write_name();
  }

  /// Overall dimensions, each where a view shows it first.
  void measure_all(const Point3& lower, const Point3& upper) {
    std::array<bool, 3> is_told{};
    for (const PlacedView& view : layout_.views) {
      if (view.section != nullptr || view.kind == ViewKind::iso) continue;
      for (const std::size_t way : {0, 1}) {
        const auto& axis = axes_of(view.kind)[way];
        const std::size_t k = axis[0] != 0 ? 0 : axis[1] != 0 ? 1 : 2;
        if (std::exchange(is_told[k], true)) continue;
        measure_side(view, way, upper[k] - lower[k]);
      }
    }
  }

  void measure(const Dimension& asked) {
    constexpr double first_line = 8, next_line = 7;
    if (asked.view == ViewKind::iso)
      throw Error("--dimension: 'iso' shows no lengths as they are; name a view at right angles");
    for (const PlacedView& view : layout_.views) {
      if (view.kind != asked.view || view.section != nullptr) continue;
      view_ = &view;
      axes_ = &axes_of(view.kind);
      Point2 from = on_sheet(asked.from), to = on_sheet(asked.to);
      const double value = std::hypot(to[0] - from[0], to[1] - from[1]) / layout_.scale;
      if (!(value > 0))
        throw Error("--dimension: the two points are one in the view '" + std::string(name_of(view.kind)) +
                    "'");
      const auto is_on_paper = [&](const Point2& p) {
        return p[0] >= 0 && p[0] <= options_.size.width && p[1] >= 0 && p[1] <= options_.size.height;
      };
      if (!is_on_paper(from) || !is_on_paper(to))
        throw Error("--dimension: at a scale of " + scale_text(layout_.scale) +
                    " it leads off the sheet in the view '" + std::string(name_of(view.kind)) +
                    "'; name points nearer to the solid, or a smaller --scale");
      double& lines = dimension_lines_[&view];
      const bool is_upright = std::fabs(to[0] - from[0]) < 1e-6, is_flat = std::fabs(to[1] - from[1]) < 1e-6;
      const Point2 upper = corner(view, view.upper);
      double offset = first_line;
      if (is_flat) {  // above the view
        if (to[0] < from[0]) std::swap(from, to);
        offset = upper[1] - from[1] + first_line + next_line * lines++;
      } else if (is_upright) {  // on the right of it
        if (to[1] > from[1]) std::swap(from, to);
        offset = upper[0] - from[0] + first_line + next_line * lines++;
      }
      notes_.distance(from, to, offset, value);
      return;
    }
    throw Error("--dimension: there is no view '" + std::string(name_of(asked.view)) +
                "' on the sheet; add it to --views");
  }

  /// In the first view that sees the plane from its edge.
  void mark(const Section& section) {
    const PlacedView* const view = view_across(section);
    if (view == nullptr) {
      left_out_.marks.push_back(section.name);
      return;
    }
    constexpr double beyond = 3;
    const ViewAxes& axes = axes_of(view->kind);
    const std::size_t way = way_across(*view, section).value();
    Point3 on_plane{};
    on_plane[section.axis] = section.place;
    Point2 from = view->origin, to = corner(*view, view->upper), looking{0, 0};
    from[way] = to[way] = view->origin[way] + (seen(axes, on_plane)[way] - view->lower[way]) * layout_.scale;
    from[1 - way] -= beyond;
    to[1 - way] += beyond;
    // Who looks stands where the section's view is seen from.
    const auto towards = axes_of(view_of(section))[2][section.axis];
    looking[way] = static_cast<double>(-towards * axes[way][section.axis]);
    notes_.cutting_line(from, to, looking, section.name);
  }

  void finish() { notes_.frame_and_title(options_, layout_.scale); }
  [[nodiscard]] const LeftOut& left_out() const { return left_out_; }

 private:
  const DrawingOptions& options_;
  const Layout& layout_;
  io::Sheet& sheet_;
  Annotator notes_;
  LeftOut left_out_;
  const PlacedView* view_ = nullptr;
  const ViewAxes* axes_ = nullptr;
  std::map<const PlacedView*, double> dimension_lines_;

  [[nodiscard]] Point2 corner(const PlacedView& view, const Point2& at) const {
    return drawing::corner(layout_, view, at);
  }
  [[nodiscard]] Point2 on_sheet(const Point3& point) const { return corner(*view_, seen(*axes_, point)); }

  void draw_lines(const ViewLines& lines) {
    constexpr std::array<LayerNumber, line_kinds> layers{visible_layer, smooth_layer, hidden_layer};
    left_out_.short_lines += lines.short_lines;
    for (const Stroke& stroke : lines.strokes)
      sheet_.paths.push_back(
          {layers[static_cast<std::size_t>(stroke.kind)], stroke.is_closed, stroke.points});
  }

  /// The faces that lie in the plane of the section.
  void hatch(const Seen& solid) {
    const Brep& brep = solid.brep;
    const std::size_t k = view_->section->axis;
    std::int64_t plane = std::numeric_limits<std::int64_t>::min();
    const std::int64_t towards = (*axes_)[2][k];
    for (const auto& point : solid.grid.points) plane = std::max(plane, towards * point[k]);
    // A section between two parts cuts nothing: what is left ends elsewhere, but for planes that were merged.
    constexpr double merged = 1e-6;
    const double at = solid.grid.origin[k] + static_cast<double>(towards * plane) * solid.grid.unit;
    const double largest = solid.grid.unit * static_cast<double>(std::int64_t{1} << 36);
    if (std::fabs(at - view_->section->place) > merged * largest) return;
    std::map<std::int32_t, std::vector<std::vector<Point2>>> loops_of_part;
    for (const Brep::Face& face : brep.faces) {
      if (face.other != Brep::outside) continue;
      std::vector<std::vector<Point2>> loops;
      bool is_cut = true;
      for (const Brep::Loop& loop : brep.loops_of(face)) {
        auto& points = loops.emplace_back();
        for (const Brep::Use& use : brep.uses_of(loop)) {
          is_cut = is_cut && towards * solid.grid.points[brep.from(use)][k] == plane;
          points.push_back(on_sheet(brep.points[brep.from(use)]));
        }
      }
      auto& all = loops_of_part[face.part];
      if (is_cut) std::move(loops.begin(), loops.end(), std::back_inserter(all));
    }
    for (const auto& [part, loops] : loops_of_part)
      for (const auto& [from, to] : hatching(loops, part < 0 ? 0 : static_cast<std::size_t>(part)))
        notes_.line(section_layer, from, to);
  }

  void draw_axes(const Seen& solid) {
    constexpr double beyond = 3, smallest = 1.5;  // millimetres
    std::vector<Piece> pieces;
    for (const RoundAxis& axis : solid.axes) {
      if (view_->section != nullptr && !is_cut(axis)) continue;
      const double radius = axis.radius * layout_.scale;
      const Point2 from = on_sheet(axis.from), to = on_sheet(axis.to);
      const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
      if (2 * radius < smallest) {
        ++left_out_.small_circles;
        continue;
      }
      const double depth =
          std::sqrt(std::max(0.0, squared_length(axis) - std::pow(length / layout_.scale, 2)));
      if (length <= 1e-6 * depth * layout_.scale) {
        for (const Point2& way : {Point2{1, 0}, Point2{0, 1}}) {
          const double reach = radius + beyond;
          pieces.push_back({{from[0] - reach * way[0], from[1] - reach * way[1]},
                            {from[0] + reach * way[0], from[1] + reach * way[1]}});
        }
      } else if (depth <= 1e-6 * length / layout_.scale) {
        const Point2 along{(to[0] - from[0]) / length, (to[1] - from[1]) / length};
        pieces.push_back({{from[0] - beyond * along[0], from[1] - beyond * along[1]},
                          {to[0] + beyond * along[0], to[1] + beyond * along[1]}});
      }
    }
    std::uint64_t none = 0;
    for (Stroke& stroke : joined(std::move(pieces), none))
      sheet_.paths.push_back({center_layer, stroke.is_closed, std::move(stroke.points)});
  }

  /// Whether the plane of the section goes through what is round, or across it.
  [[nodiscard]] bool is_cut(const RoundAxis& axis) const {
    const std::size_t k = view_->section->axis;
    const double length = std::sqrt(squared_length(axis)), reach = axis.radius * (1 + 1e-6);
    const auto [low, high] = std::minmax(axis.from[k], axis.to[k]);
    return length > 0 && low - reach < view_->section->place && high + reach > view_->section->place;
  }

  static double squared_length(const RoundAxis& axis) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += (axis.to[k] - axis.from[k]) * (axis.to[k] - axis.from[k]);
    return sum;
  }

  void write_name() {
    constexpr double letters = 3.5, above = 6;
    if (view_->section == nullptr) return;
    const Point2 upper = corner(*view_, view_->upper);
    notes_.text(dimension_layer, {(view_->origin[0] + upper[0]) / 2, upper[1] + above}, letters,
                view_->section->name + "–" + view_->section->name, io::Sheet::Anchor::middle);
  }

  /// The direction in which a view shows the plane of a section, if it sees it from its edge.
  static std::optional<std::size_t> way_across(const PlacedView& view, const Section& section) {
    if (view.section != nullptr || view.kind == ViewKind::iso) return std::nullopt;
    for (const std::size_t way : {0, 1})
      if (axes_of(view.kind)[way][section.axis] != 0) return way;
    return std::nullopt;
  }

  /// The first view that sees the plane of a section from its edge.
  [[nodiscard]] const PlacedView* view_across(const Section& section) const {
    const auto found = std::find_if(layout_.views.begin(), layout_.views.end(), [&](const PlacedView& view) {
      return way_across(view, section).has_value();
    });
    return found == layout_.views.end() ? nullptr : &*found;
  }

  /// Whether the mark of a section is where a dimension would be.
  [[nodiscard]] bool is_marked(const PlacedView& view, std::size_t way) const {
    return std::any_of(options_.sections.begin(), options_.sections.end(), [&](const Section& section) {
      return view_across(section) == &view && way_across(view, section) == way;
    });
  }

  /// Below a view, or on its left.
  void measure_side(const PlacedView& view, std::size_t way, double value) {
    const double aside = is_marked(view, way) ? 18 : 10;
    const Point2 lower = view.origin, upper = corner(view, view.upper);
    if (way == 0)
      notes_.distance(lower, {upper[0], lower[1]}, -aside, value);
    else
      notes_.distance(lower, {lower[0], upper[1]}, aside, value);
  }
};

}  // namespace

std::optional<SheetSize> sheet_size(std::string_view name) {
  constexpr std::array sizes{SheetSize{"A0", 1189, 841}, SheetSize{"A1", 841, 594}, SheetSize{"A2", 594, 420},
                             SheetSize{"A3", 420, 297}, SheetSize{"A4", 297, 210}};
  const auto* found =
      std::find_if(sizes.begin(), sizes.end(), [&](const SheetSize& size) { return size.name == name; });
  return found == sizes.end() ? std::nullopt : std::optional(*found);
}

ViewKind view_of(const Section& section) {
  constexpr std::array usual{ViewKind::left, ViewKind::front, ViewKind::top},
      behind{ViewKind::right, ViewKind::back, ViewKind::bottom};
  return (section.from_behind ? behind : usual).at(section.axis);
}

std::vector<std::vector<Piece>> pieces_of_views(const Brep& brep, std::span<const Brep> cuts,
                                                const DrawingOptions& options, Share share) {
  const Layout layout = checked_layout(brep, options);
  std::vector<std::vector<Piece>> pieces(layout.views.size());
  std::optional<GridPoints> grid;  // of what was seen last
  const Brep* seen_last = nullptr;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const PlacedView& view = layout.views[i];
    const EdgePart part = part_of(share, i, pieces.size());
    if (part.first == part.end) continue;
    const Brep& seen = view.section == nullptr ? brep : cuts[view.cut];
    if (seen_last != &seen) grid.emplace(seen.points);
    seen_last = &seen;
    pieces[i] = pieces_of_view(seen, *grid, view, layout, options, part);
  }
  return pieces;
}

ViewLines lines_from(std::vector<Piece> pieces) {
  ViewLines lines;
  lines.strokes = joined(std::move(pieces), lines.short_lines);
  return lines;
}

Drawing draw(const Brep& brep, std::span<const Brep> cuts, const DrawingOptions& options,
             std::span<const ViewLines> lines) {
  const Layout layout = checked_layout(brep, options);
  Drawing drawing;
  drawing.scale = layout.scale;
  io::Sheet& sheet = drawing.sheet;
  sheet.title = options.title;
  sheet.upper = {options.size.width, options.size.height};
  sheet.decimals = 3;
  sheet.layers = drawing_layers();
  Draughtsman draughtsman(options, layout, sheet);
  const Seen whole = prepared(brep, options);
  for (std::size_t i = 0; i < layout.views.size(); ++i) {
    const PlacedView& view = layout.views[i];
    draughtsman.draw(view, view.section == nullptr ? whole : prepared(cuts[view.cut], options), lines[i]);
  }
  Point3 lower = brep.points.front(), upper = lower;
  for (const Point3& point : brep.points)
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], point[k]);
      upper[k] = std::max(upper[k], point[k]);
    }
  if (options.overall) draughtsman.measure_all(lower, upper);
  for (const Dimension& each : options.dimensions) draughtsman.measure(each);
  for (const Section& each : options.sections) draughtsman.mark(each);
  draughtsman.finish();
  const LeftOut& left_out = draughtsman.left_out();
  if (left_out.short_lines > 0)
    drawing.notes.push_back(counted(left_out.short_lines,
                                    "# line[s] [is|are] shorter than 0.01 mm on the sheet, and left out; a "
                                    "larger --scale shows [it|them]"));
  if (left_out.small_circles > 0)
    drawing.notes.push_back(counted(left_out.small_circles,
                                    "centre lines are left out # time[s] where something round is smaller "
                                    "than 1.5 mm on the sheet; a larger --scale has "
                                    "them"));
  for (const std::string& name : left_out.marks)
    drawing.notes.push_back("where section " + name +
                            " cuts is marked in no view: none of --views sees its plane from its edge");
  return drawing;
}

}  // namespace bsp2::drawing
