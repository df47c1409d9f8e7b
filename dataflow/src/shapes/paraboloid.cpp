#include "bsp2/dataflow/shapes/paraboloid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Label;
using geometry::OrientedHyperplane;

// --- the hyperplanes ---

template <int D>
ParaboloidFamily<D>::ParaboloidFamily(std::uint64_t limit) {
  const auto size_with = [](std::uint32_t levels) {
    std::uint64_t size = bounds_with(levels);
    for (std::uint32_t level = 0; level <= levels; ++level) size += 2 * wedges_at(level);
    return size;
  };
  while (levels_ < most_levels && (levels_ + 1) * static_cast<std::uint32_t>(axes) < 32 &&
         size_with(levels_ + 1) <= limit)
    ++levels_;
  first_of_level_[0] = static_cast<std::uint32_t>(bounds_with(levels_));
  for (std::uint32_t level = 0; level <= levels_; ++level)
    first_of_level_[level + 1] = first_of_level_[level] + static_cast<std::uint32_t>(2 * wedges_at(level));
}

template <int D>
std::uint32_t ParaboloidFamily<D>::tangent(const Wedge& wedge) const {
  std::uint32_t place = 0;
  for (int j = axes - 1; j >= 0; --j) place = (place << wedge.level) + wedge.at[static_cast<std::size_t>(j)];
  return first_of_level_[wedge.level] + 2 * place;
}

template <int D>
std::uint32_t ParaboloidFamily<D>::across(const Wedge& wedge, int axis, int side) const {
  const auto place = static_cast<std::int64_t>(wedge.at[static_cast<std::size_t>(axis)]);
  const std::int64_t n = std::int64_t{1} << levels_,
                     t = (2 * place + 1 + side) * (std::int64_t{1} << (levels_ - wedge.level));  // from -1 on
  return static_cast<std::uint32_t>(axis * (2 * n + 1) + t);
}

/// Times 4^level: of the wedge, the middle is d / 2^level.
template <int D>
std::array<std::int64_t, D + 1> ParaboloidFamily<D>::covector(std::uint32_t number) const {
  std::array<std::int64_t, D + 1> covector{};
  if (number < first_of_level_[0]) {
    const std::int64_t n = std::int64_t{1} << levels_;
    const auto stride = static_cast<std::uint32_t>(2 * n + 1);
    covector[number / stride] = n;
    covector[D] = n - static_cast<std::int64_t>(number % stride);
    return covector;
  }
  std::uint32_t level = 0;
  while (number >= first_of_level_[level + 1]) ++level;
  const std::uint32_t rest = number - first_of_level_[level];
  const std::int64_t n = std::int64_t{1} << level;
  std::uint32_t place = rest / 2;
  covector[D] = rest % 2 != 0 ? std::int64_t{axes} : 0;
  for (int j = 0; j < axes; ++j, place >>= level) {
    const std::int64_t d = 2 * static_cast<std::int64_t>(place & (n - 1)) + 1 - n;
    covector[static_cast<std::size_t>(j)] = 2 * n * d;
    covector[D] -= d * d;
  }
  covector[D - 1] = -n * n;
  return covector;
}

// --- the placed solid ---

template <int D>
RoundFrame<D> Paraboloid<D>::frame(const model::Paraboloid& paraboloid) {
  RoundFrame<D> frame;
  frame.factors.fill(paraboloid.radius);
  frame.factors[D - 1] = paraboloid.height;
  frame.bounds.lower.fill(-1);
  frame.bounds.lower[D - 1] = 0;
  frame.bounds.upper.fill(1);
  std::array<geometry::LocalInteger, D + 1> top{};
  top[D - 1] = 1;
  top[D] = -1;
  frame.half_spaces = {geometry::make_covector<D>(top)};
  return frame;
}

template <int D>
Paraboloid<D> Paraboloid<D>::place(const model::Paraboloid&, geometry::HyperplaneTable<D>& table,
                                   std::uint32_t map, std::uint32_t limit) {
  const auto family = std::make_shared<const Family>(limit);
  return {family, add_family(table, map, geometry::SharedFamily<D>(family), limit),
          table.map(map).inverse(table.radius())};
}

/// Heights grow with the square of the radius.
template <int D>
std::vector<std::pair<double, double>> Paraboloid<D>::profile(const model::Paraboloid& paraboloid,
                                                              std::uint32_t corners) {
  std::vector<std::pair<double, double>> circles;
  const std::uint32_t rings = std::max(2U, corners / 6);
  for (std::uint32_t i = 0; i <= rings; ++i) {
    const double share = static_cast<double>(i) / rings;
    circles.emplace_back(paraboloid.radius * share, paraboloid.height * share * share);
  }
  return circles;
}

template <int D>
OrientedHyperplane Paraboloid<D>::outer(std::uint32_t i) const {
  if (i == 0) return tangent({});
  const bool is_below = i % 2 != 0;
  const OrientedHyperplane side = bound({}, static_cast<int>((i - 1) / 2), is_below ? -1 : 1);
  return geometry::oriented(side.id(), is_below);
}

template <int D>
std::vector<OrientedHyperplane> Paraboloid<D>::axis_tangents() const {
  std::vector<OrientedHyperplane> tangents;
  for (std::uint32_t i = 0; i < outer_count(); ++i) tangents.push_back(outer(i));
  return tangents;
}

/// The solid is convex: a cell whose vertices are inside is inside. So is what is below a tangent outside;
/// that over the middle of the cell is asked.
template <int D>
Label Paraboloid<D>::ask_vertices(const Wedge*, const geometry::Cell<D>& cell,
                                  const std::array<double, D>& centre) const {
  if (!std::isfinite(to_frame.error)) return Label::fuzzy;
  double error = 0;
  for (const auto& vertex : cell.vertices()) error = std::max(error, vertex.error);
  error = error * to_frame.scale + to_frame.error;  // of each coordinate in the frame
  const std::array<double, D> c = to_frame.image(centre);
  double offset = 0, slope = 0;
  for (int i = 0; i + 1 < D; ++i) {
    offset += c[i] * c[i];
    slope += 2 * std::fabs(c[i]);
  }
  bool inside = true, outside = true;
  for (const auto& vertex : cell.vertices()) {
    const std::array<double, D> y = to_frame.image(vertex.x);
    const double z = y[D - 1];
    double square = 0, along = 0, size = 0;
    for (int i = 0; i + 1 < D; ++i) {
      square += y[i] * y[i];
      along += 2 * c[i] * y[i];
      size += std::fabs(y[i]);
    }
    // What the coordinates are off by, and a few roundings of what the sums hold.
    const double in_square = error * (2 * size + 1 + D * error) * 1.01 + 0x1p-48 * (square + std::fabs(z)),
                 in_tangent = error * (slope + 1) * 1.01 + 0x1p-48 * (slope * size + offset + std::fabs(z));
    inside = inside && square + in_square <= z;
    outside = outside && along - offset > z + in_tangent;
    if (!inside && !outside) return Label::fuzzy;
  }
  return inside ? Label::in : Label::out;
}

#define BSP2_INSTANTIATE(D)           \
  template class ParaboloidFamily<D>; \
  template struct Paraboloid<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
