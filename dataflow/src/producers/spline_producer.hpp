#pragma once

#include <optional>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a spline or subdivision surface: refined without end, by the hyperplanes that its patches lie
/// between.
///
/// A cell that certainly meets no patch is OUT of an open surface; of a closed one it is IN where the surface
/// winds around it. State of a leaf: the numbers of the patches that may meet the cell; they are about as
/// large as the cell or smaller. Source: the paper, section 4.1 and figure 6; docs/curved.md.
template <int D>
class SplineProducer {
 public:
  SplineProducer(const Network<D>& network, const Producer<D>& producer)
      : producer_(producer), spline_(network.splines[producer.index]), tree_(*spline_.tree) {}

  geometry::Label ask(const Word* leaf, CellView<D>& cell, Words& out) const;
  /// Grows with the level: what is refined already can wait for what is not.
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  /// An axis-parallel hyperplane that cuts off an end of the cell with no patch in it, if there is one that
  /// is worth it. Without that the cells at the edges of a surface end thin, but reach far beyond them.
  [[nodiscard]] std::optional<geometry::HyperplaneId> end(const Word* leaf, CellView<D>& cell) const;
  /// Such an end; else the hyperplane of a patch that cuts off most of the cell, if that is much; else across
  /// the longest axis of the cell, at the roundest place near its middle. No advice where the cell is too
  /// small for that.
  Advice advise(const Word* leaf, CellView<D>& cell) const;

 private:
  using Number = typename PatchTree<D>::Number;
  const Producer<D>& producer_;
  const Spline<D>& spline_;
  const PatchTree<D>& tree_;

  using Node = typename PatchTree<D>::Node;
  using Point = typename PatchTree<D>::Point;
  /// A cell in the frame of the patches.
  struct Image {
    Box<D> box;                 ///< holds the cell
    double size = 0;            ///< the longest side of the box
    std::vector<Point> points;  ///< the vertices; unless boxes alone are tested
    double error = 0;           ///< of their coordinates
  };
  [[nodiscard]] Box<D> bounds(const Word* leaf, const CellView<D>& cell) const;
  [[nodiscard]] Box<D> in_frame(const Box<D>& box) const;
  [[nodiscard]] Image image_of(const CellView<D>& cell) const;
  [[nodiscard]] bool may_meet(Number patch, const Node& node, const Image& image, CellView<D>& cell) const;
  void keep(Number patch, const Node& node, std::uint32_t level, const Image& image, CellView<D>& cell,
            Words& out) const;
  [[nodiscard]] geometry::Label label_off_patches(const CellView<D>& cell) const;
};

}  // namespace bsp2::dataflow
