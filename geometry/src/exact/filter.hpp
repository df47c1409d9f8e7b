#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "bsp2/geometry/exact/hyperplane.hpp"
#include "support/vector_lanes.hpp"

/// The filter of the predicate in three dimensions: rounded hyperplanes held against many points, or many of
/// them against one cell's. Compiled for several processors, each with its widest instructions, and the only
/// code with contracted additions: the bounds of errors cover any rounding, so no answer that is certain
/// depends on it.
namespace bsp2::geometry::filter {

/// Points by coordinates. There is room to read up to the next multiple of 4, where one of them stands again.
struct Points {
  const double *x, *y, *z;
  std::size_t count;
};

struct Range {
  double least, largest;
};

/// The hyperplane's value at each point, and once more at those that fill up the last four. @return their
/// range.
Range evaluate(const Points& points, const Hyperplane<3>& h, double* values);

/// For each value 1 if it is below -bound, 2 if it is above bound, else 0. @pre there is room for as many
/// values and marks as the next multiple of 8; marks beyond `count` mean nothing.
void mark(const double* values, std::size_t count, double bound, std::uint8_t* marks);

/// The range of the hyperplane's values at the points; only a part of it if that is beyond `bound` on both
/// sides already.
/// @param looked_at is increased by the number of points that were looked at.
Range find_range(const Points& points, const Hyperplane<3>& h, double bound, std::uint64_t& looked_at);

/// Where points are: 0 if that is in doubt. As wide as a number, so that a vector of them needs no packing.
enum Sides : std::uint64_t { doubtful = 0, all_negative = 1, all_positive = 2, both = 3 };

/// On which sides of each hyperplane the points certainly are. There must be room for the next multiple of
/// `wide`.
/// @param hyperplanes those of the table, by id. @param error of each point. @return the number of values
/// looked at.
std::size_t find_sides(const Points& points, double error, const Hyperplane<3>* hyperplanes,
                       std::span<const OrientedHyperplane> planes, Sides* sides);

}  // namespace bsp2::geometry::filter
