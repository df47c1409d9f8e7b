#pragma once

// Random points of cells.

#include <cmath>
#include <span>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

/// A random mix of `count` corners, of which `coordinate(k, i)` is the i-th coordinate of the k-th.
template <typename Coordinate>
Point random_mix(std::size_t count, std::size_t dimension, Random& random, Coordinate&& coordinate) {
  Point x(dimension, 0);
  Real sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Real weight = -std::log(uniform(random, 1e-9, 1));
    sum += weight;
    for (std::size_t i = 0; i < dimension; ++i) x[i] += weight * coordinate(k, i);
  }
  for (Real& c : x) c /= sum;
  return x;
}

template <int D>
Point point_in(const geometry::Cell<D>& cell, Random& random) {
  const auto vertices = cell.vertices();
  return random_mix(vertices.size(), D, random,
                    [&](std::size_t k, std::size_t i) { return vertices[k].x[i]; });
}

inline Point point_in(const geometry::CellBatch& batch, std::size_t cell, Random& random) {
  const auto corners = batch.cell_points(cell);
  const auto d = static_cast<std::size_t>(batch.dimension);
  return random_mix(corners.size() / d, d, random,
                    [&](std::size_t k, std::size_t i) { return corners[k * d + i]; });
}

}  // namespace bsp2::dataflow
