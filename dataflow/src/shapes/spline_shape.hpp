#pragma once

#include <memory>
#include <vector>

#include "bsp2/dataflow/shapes/patch_tree.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "process/transformer.hpp"

namespace bsp2::dataflow {

/// The patches of a spline or subdivision surface, placed in the model.
template <int D>
struct PlacedPatches {
  std::vector<Patch<D>> roots;  ///< in the frame of a PatchTree
  typename PatchTree<D>::Placement placement;
  double error = 0;         ///< of their coordinates
  double weight_ratio = 1;  ///< the largest weight by the smallest
  bool closed = false;      ///< they have no boundary, and bound a solid
};

/// Control points in the model, and the frame that holds them.
template <int D>
class PlacedPoints {
 public:
  /// @param coordinates `stride` >= D numbers for each point, of which the first D count.
  PlacedPoints(const std::vector<double>& coordinates, std::size_t stride, const Transformer<D>& placement);
  void unite(const PlacedPoints& other);
  void choose_frame();
  [[nodiscard]] const typename PatchTree<D>::Placement& frame() const { return frame_; }
  /// A bound of how far coordinates in the frame are off.
  [[nodiscard]] double error() const;
  [[nodiscard]] std::size_t size() const { return points_.size(); }
  /// In the frame.
  [[nodiscard]] std::array<long double, D> operator[](std::size_t index) const;

 private:
  std::vector<std::array<long double, D>> points_;
  std::array<long double, D> lower_, upper_;
  typename PatchTree<D>::Placement frame_;
};

/// Bezier patches of a spline: by its knots' spans. Of solids those of their boundary.
template <int D>
PlacedPatches<D> place(const model::Spline& spline, const Transformer<D>& placement);

/// Quadrangles or triangles of the subdivided mesh, each with one irregular corner at most. D >= 3.
template <int D>
PlacedPatches<D> place(const model::SubdivisionSurface& surface, const Transformer<D>& placement);

/// A box around the control points: a surface lies in their convex hull.
template <int D>
Box<D> bounds_of(const model::Spline& spline);
template <int D>
Box<D> bounds_of(const model::SubdivisionSurface& surface);

}  // namespace bsp2::dataflow
