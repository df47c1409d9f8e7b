#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::meshing {

/// Points by the three planes that name them.
class PointRegister {
 public:
  explicit PointRegister(geometry::ExactPoints& exact) : exact_(exact) {}
  /// The point in which three planes meet; made where it is new. @param ids ascending.
  /// @param planes that are known to meet there, ascending; these three among them.
  std::uint32_t find(const std::array<geometry::HyperplaneId, 3>& ids,
                     std::span<const geometry::HyperplaneId> planes);
  /// The point that has this name, or `none`. Any number of threads may ask.
  [[nodiscard]] std::uint32_t known(const std::array<geometry::HyperplaneId, 3>& ids) const {
    return known_.empty() ? none : known_[place_of(ids)].point;
  }
  /// Room for so many names, so that it need not grow.
  void reserve(std::size_t names);
  static constexpr std::uint32_t none = ~0U;
  /// Takes in other points, which may be among these. @return the number of the first one.
  std::uint32_t append(const geometry::PointSet& points);
  /// Makes points that are equal one. They stay in the order in which they were made: what is used together
  /// is together in memory. @return the new number of each old one.
  std::vector<std::uint32_t> unify();
  /// A place for each point in an order that, of any two, depends on these alone (unify_in_order).
  [[nodiscard]] std::uint32_t rank(std::uint32_t point) const { return rank_[point]; }
  [[nodiscard]] const geometry::PointSet& points() const { return points_; }

 private:
  /// A place of an open table, which is free where there is no point.
  struct Entry {
    std::array<geometry::HyperplaneId, 3> ids{};
    std::uint32_t point = none;
  };
  geometry::ExactPoints& exact_;
  geometry::PointSet points_;
  std::vector<std::uint32_t> rank_;
  std::vector<std::pair<std::uint32_t, geometry::HyperplaneId>> more_;  // that points are known to be on
  std::vector<Entry> known_;  // as many as a power of two, half of them free at least
  std::size_t count_ = 0;

  [[nodiscard]] std::size_t place_of(const std::array<geometry::HyperplaneId, 3>& ids) const;
  void grow(std::size_t places);
  void take_in_more();
};

}  // namespace bsp2::meshing
