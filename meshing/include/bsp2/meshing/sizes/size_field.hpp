#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// Wanted lengths of edges by place: at each place that of the nearest of the points for which one is given.
///
/// Shape: a tree of boxes in an array; each half is divided at its middle along the next axis. Finding one of
/// n takes about log n steps. Thread rule: may be asked by many threads.
class SizeField {
 public:
  struct Entry {
    Point at;
    double size;
  };
  SizeField() = default;
  /// @param entries sizes above 0.
  explicit SizeField(std::vector<Entry> entries);

  [[nodiscard]] bool is_empty() const { return entries_.empty(); }
  [[nodiscard]] double largest() const { return largest_; }
  /// Of several points as near, the smallest size. Infinite if there are none.
  [[nodiscard]] double at(const Point& place) const;

 private:
  struct Nearest;
  std::vector<Entry> entries_;
  double largest_ = 0;

  static void order(std::span<Entry> entries, std::size_t axis);
  static void search(std::span<const Entry> entries, std::size_t axis, Nearest& nearest);
};

}  // namespace bsp2::meshing
