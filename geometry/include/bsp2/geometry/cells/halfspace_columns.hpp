#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::geometry {

/// Rounded half-spaces by coefficient, to ask many of them about one point.
template <int D>
class HalfspaceColumns {
 public:
  void assign(const HyperplaneTable<D>& table, std::span<const OrientedHyperplane> halfspaces);
  /// How many are left.
  [[nodiscard]] std::size_t size() const { return left_; }
  /// The index of the one that the point is furthest outside of, the first of equals; the same on every
  /// processor. @pre size() > 0.
  [[nodiscard]] std::size_t furthest(const std::array<double, D>& point) const;
  /// It is not asked any more.
  void remove(std::size_t index);

 private:
  std::array<Buffer<double>, D> normal_;
  Buffer<double> offset_;  // minus infinity: removed
  std::size_t left_ = 0;
};

}  // namespace bsp2::geometry
