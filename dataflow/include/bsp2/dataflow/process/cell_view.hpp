#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/cells/triangle_columns.hpp"

namespace bsp2::dataflow {

/// A box around a cell, slightly enlarged: quick, conservative tests before the exact ones.
template <int D>
struct CellExtent : Box<D> {
  std::array<double, D> middle, half;  ///< the box's centre and half its size
  std::array<double, D> centre;        ///< mean of the vertices, inside the cell
  CellExtent() = default;
  explicit CellExtent(const geometry::Cell<D>& cell);
  /// Of a ball around the centre that contains the cell, slightly enlarged.
  [[nodiscard]] double radius(const geometry::Cell<D>& cell) const;
  [[nodiscard]] double length(int axis) const { return this->upper[axis] - this->lower[axis]; }
  /// The axes, the longest extent first.
  [[nodiscard]] std::array<int, D> axes_by_length() const;
  /// Where the cell lies, `crossing` also where the box alone cannot tell.
  [[nodiscard]] geometry::Position position(const geometry::Hyperplane<D>& h) const {
    const double value = h.at(middle);
    double reach = h.error;
    for (int i = 0; i < D; ++i) reach += std::fabs(h.normal[i]) * half[i];
    reach *= 1 + 0x1p-40;
    return value > reach    ? geometry::Position::positive
           : value < -reach ? geometry::Position::negative
                            : geometry::Position::crossing;
  }
};

/// The cell that the producers are asked about, with what makes asking cheap: its box, its vertices by
/// column.
///
/// Thread rule: one thread at a time. The cell must outlive the questions about it.
template <int D>
class CellView {
 public:
  explicit CellView(geometry::Splitter<D>& splitter) : splitter_(&splitter) {}
  void look_at(const geometry::Cell<D>& cell) {
    cell_ = &cell;
    extent_ = CellExtent<D>(cell);
    columns_.load(cell);
  }
  /// Quick questions keep as undecided what only a look at all vertices could decide.
  void test_boxes_only(bool box_test_only) { box_test_only_ = box_test_only; }

  [[nodiscard]] bool box_test_only() const { return box_test_only_; }
  [[nodiscard]] const geometry::Cell<D>& cell() const { return *cell_; }
  [[nodiscard]] const CellExtent<D>& extent() const { return extent_; }
  [[nodiscard]] geometry::Splitter<D>& splitter() { return *splitter_; }
  [[nodiscard]] const geometry::HyperplaneTable<D>& table() const { return splitter_->table(); }

  /// Room for the facets of a mesh, for one question.
  [[nodiscard]] geometry::TriangleColumns& triangles() { return triangles_; }

  /// Where the cell lies: from its box if that is enough, else (unless boxes alone are tested) from its
  /// vertices, exactly.
  geometry::Position position(geometry::OrientedHyperplane plane) {
    using geometry::Position;
    const auto h = table().rounded(plane.id());
    Position where = extent_.position(h);
    if (where == Position::crossing && !box_test_only_)
      where = splitter_->position(*cell_, columns_, plane.id(), h);
    if (where == Position::crossing || !plane.flipped()) return where;
    return where == Position::negative ? Position::positive : Position::negative;
  }
  /// Splitter::find_crossing for this cell. Exact.
  bool find_crossing(std::span<const geometry::OrientedHyperplane> planes,
                     geometry::Buffer<std::uint32_t>& crossing) {
    return splitter_->find_crossing(*cell_, columns_, planes, crossing);
  }
  /// The least extent of the cell across one of its facets, not less than its width by any rounding. D = 1:
  /// its length.
  [[nodiscard]] double thickness() const;
  /// Whether the hyperplane crosses the cell. Exact.
  bool crosses(geometry::HyperplaneId id) {
    return splitter_->position(*cell_, columns_, id, table().rounded(id)) == geometry::Position::crossing;
  }

 private:
  geometry::Splitter<D>* splitter_;
  const geometry::Cell<D>* cell_ = nullptr;
  CellExtent<D> extent_;
  geometry::VertexColumns<D> columns_;
  geometry::TriangleColumns triangles_;
  bool box_test_only_ = false;
};

}  // namespace bsp2::dataflow
