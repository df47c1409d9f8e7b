#include "bsp2/dataflow/shapes/round.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"

namespace bsp2::dataflow {

using geometry::Label;
using geometry::OrientedHyperplane;

void check_hyperplanes(std::uint64_t needed, std::uint32_t limit) {
  if (needed > limit)
    throw Error("too many round solids: the hyperplanes do not suffice for all of them; leave out --curved");
}

template <int D>
RoundFrame<D> Round<D>::frame(const model::Round& round) {
  const int axes = D - static_cast<int>(round.lengths.size());
  if (axes < 2) throw std::logic_error("a round solid has two round axes or more");
  RoundFrame<D> frame{{}, Box<D>::empty(), axes, {}};
  frame.factors.fill(std::max(round.bottom, round.top));
  std::copy(round.lengths.begin(), round.lengths.end(), frame.factors.begin() + axes);
  const std::vector<geometry::Covector<D>> box = geometry::unit_box<D>().covectors;
  frame.half_spaces.assign(box.begin() + 2 * axes, box.end());
  return frame;
}

template <int D>
Round<D> Round<D>::place(const model::Round& round, geometry::HyperplaneTable<D>& table, std::uint32_t map,
                         std::uint32_t limit) {
  const double widest = std::max(round.bottom, round.top);
  const auto on_grid = [](double x) {
    return std::ldexp(static_cast<double>(std::llround(std::ldexp(x, 53))), -53);
  };
  const Family family(D - static_cast<int>(round.lengths.size()), on_grid(round.bottom / widest),
                      on_grid(round.top / widest), limit);
  return {family, add_family(table, map, family, limit), table.map(map).inverse(table.radius())};
}

template <int D>
std::vector<OrientedHyperplane> Round<D>::axis_tangents() const {
  std::vector<OrientedHyperplane> tangents;
  for (std::uint32_t face = 0; face < outer_count() && family.bottom() == family.top(); ++face)
    tangents.push_back(outer(face));
  return tangents;
}

template <int D>
typename Round<D>::Wedge Round<D>::first_wedge(const std::array<double, D>& y) const {
  int axis = 0;
  for (int i = 1; i < family.axes(); ++i)
    if (std::fabs(y[i]) > std::fabs(y[axis])) axis = i;
  Wedge wedge;
  wedge.face = static_cast<std::uint32_t>(2 * axis + (y[axis] < 0 ? 1 : 0));
  return wedge;
}

template <int D>
double Round<D>::radius_at(const std::array<double, D>& y) const {
  return family.bottom() == family.top()
             ? 1
             : family.bottom() + (family.top() - family.bottom()) * y[family.axes()];
}

/// The solid is convex: a cell whose vertices are inside is inside. So is what is beyond a tangent outside.
template <int D>
Label Round<D>::ask_vertices(const Wedge* wedge, const geometry::Cell<D>& cell,
                             const std::array<double, D>& centre) const {
  if (!std::isfinite(to_frame.error)) return Label::fuzzy;
  const int axes = family.axes();
  double error = 0;
  for (const auto& vertex : cell.vertices()) error = std::max(error, vertex.error);
  // Of each coordinate in the frame; then of the distance to the axis minus the radius, which is at most 1
  // there.
  error = error * to_frame.scale + to_frame.error;
  const double slack = error * (D + 1) * 1.01;
  // A direction out of the solid, towards the cell.
  std::array<double, D> towards = wedge != nullptr ? family.direction(*wedge) : to_frame.image(centre);
  std::fill(towards.begin() + axes, towards.end(), 0.0);
  double length = 0;
  for (const double x : towards) length += x * x;
  length = std::sqrt(length);
  bool inside = true, outside = length > 0;
  for (const auto& vertex : cell.vertices()) {
    const std::array<double, D> y = to_frame.image(vertex.x);
    const double radius = radius_at(y);
    double square = 0, along = 0;
    for (int i = 0; i < axes; ++i) {
      square += y[i] * y[i];
      along += y[i] * towards[i];
    }
    // The sums are off by a few roundings of what they hold.
    const double distance = std::sqrt(square),
                 rounding = 0x1p-48 * (1 + distance + std::fabs(y[std::min(axes, D - 1)]));
    inside = inside && distance + slack + rounding <= radius;
    outside = outside && along / length > radius + slack + rounding;
    if (!inside && !outside) return Label::fuzzy;
  }
  return inside ? Label::in : Label::out;
}

#define BSP2_INSTANTIATE(D) template struct Round<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
