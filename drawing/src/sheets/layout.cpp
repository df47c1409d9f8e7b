#include "sheets/layout.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::drawing {
namespace {

/// Column and row of a view, the front being at 0, 0.
std::array<int, 2> place_of(ViewKind view, Projection projection) {
  const int side = projection == Projection::third ? 1 : -1;
  switch (view) {
    case ViewKind::front:
      break;
    case ViewKind::back:
      return {2, 0};
    case ViewKind::left:
      return {-side, 0};
    case ViewKind::right:
      return {side, 0};
    case ViewKind::top:
      return {0, side};
    case ViewKind::bottom:
      return {0, -side};
    case ViewKind::iso:
      return {1, side};
  }
  return {0, 0};
}

/// Columns or rows: how much each needs, and where it begins.
class Lanes {
 public:
  void need(int lane, double length) { lengths_[lane] = std::max(lengths_[lane], length); }
  [[nodiscard]] double total() const {
    double sum = 0;
    for (const auto& [lane, length] : lengths_) sum += length;
    return sum;
  }
  [[nodiscard]] double count() const { return static_cast<double>(lengths_.size()); }
  [[nodiscard]] double length(int lane) const { return lengths_.at(lane); }
  /// On the sheet.
  [[nodiscard]] double begin(int wanted, double scale) const {
    double at = 0;
    for (const auto& [lane, length] : lengths_) {
      if (lane == wanted) break;
      at += length * scale + gap;
    }
    return at;
  }

 private:
  std::map<int, double> lengths_;
};

/// The largest of 1, 2, 5, 10, ... or one over one of these that is not above a limit.
double usual_scale(double limit) {
  const double decade = std::pow(10, std::floor(std::log10(limit)));
  for (const double step : {5.0, 2.0, 1.0})
    if (step * decade <= limit * (1 + 1e-9)) return step * decade;
  return decade;
}

std::string number(double x) {
  std::ostringstream text;
  text.precision(6);
  text << x;
  return text.str();
}

void place_bounds(PlacedView& view, const std::vector<Point3>& points) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  view.lower = {infinity, infinity};
  view.upper = {-infinity, -infinity};
  for (const Point3& point : points) {
    const Point2 at = seen(axes_of(view.kind), point);
    for (const std::size_t k : {0, 1}) {
      view.lower[k] = std::min(view.lower[k], at[k]);
      view.upper[k] = std::max(view.upper[k], at[k]);
    }
  }
}

}  // namespace

std::string scale_text(double scale) { return scale >= 1 ? number(scale) + ":1" : "1:" + number(1 / scale); }

Layout layout_of(const std::vector<Point3>& points, const DrawingOptions& options) {
  Layout layout;
  Lanes columns, rows;
  std::vector<std::array<int, 2>> places;
  const auto add = [&](PlacedView view, const std::array<int, 2>& place) {
    place_bounds(view, points);
    columns.need(place[0], view.upper[0] - view.lower[0]);
    rows.need(place[1], view.upper[1] - view.lower[1]);
    places.push_back(place);
    layout.views.push_back(view);
  };
  int last_column = 0;
  for (const ViewKind kind : options.views) {
    add({.kind = kind}, place_of(kind, options.projection));
    if (places.back()[1] == 0) last_column = std::max(last_column, places.back()[0]);
  }
  for (std::size_t i = 0; i < options.sections.size(); ++i)
    add({.kind = view_of(options.sections[i]), .section = &options.sections[i], .cut = i},
        {++last_column, 0});

  const double width = options.size.width - binding_margin - margin - (columns.count() + 1) * gap;
  const double height = options.size.height - 2 * margin - block_height - (rows.count() + 1) * gap;
  const double most = std::min(columns.total() > 0 ? width / columns.total() : 1e300,
                               rows.total() > 0 ? height / rows.total() : 1e300);
  if (!(width > 0 && height > 0) || !(most > 0 && most < 1e300))
    throw Error("there is no room for so many views on " + std::string(options.size.name) +
                ": choose a larger sheet or fewer views");
  layout.scale = options.scale.value_or(usual_scale(most));
  if (layout.scale > most * (1 + 1e-9))
    throw Error("at a scale of " + scale_text(layout.scale) + " the views do not fit on " +
                std::string(options.size.name) + ": " + scale_text(usual_scale(most)) +
                " is the largest usual scale that does; choose it, or a larger sheet");
  const double free_width = width - columns.total() * layout.scale,
               free_height = height - rows.total() * layout.scale;
  for (std::size_t i = 0; i < layout.views.size(); ++i) {
    PlacedView& view = layout.views[i];
    const std::array<const Lanes*, 2> lanes{&columns, &rows};
    const Point2 corner{binding_margin + gap + free_width / 2, margin + block_height + gap + free_height / 2};
    for (const std::size_t k : {0, 1}) {
      const double rest = lanes[k]->length(places[i][k]) - (view.upper[k] - view.lower[k]);
      view.origin[k] = corner[k] + lanes[k]->begin(places[i][k], layout.scale) + rest * layout.scale / 2;
    }
  }
  return layout;
}

}  // namespace bsp2::drawing
