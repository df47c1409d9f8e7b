#pragma once

#include <optional>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of the points that an affine map takes into a curved solid of another space: a prism over it, or
/// a section of it.
///
/// A cell is asked about by the images of its vertices in the frame of the solid: its image is their convex
/// hull. IN and OUT are certain, by bounds of these points that allow for all rounding. State of a leaf: the
/// level of the wedge that the image is in, or for a spline the patches that may meet it. Source:
/// docs/curved.md, "Prisms and sections".
template <int D>
class PreimageProducer {
 public:
  PreimageProducer(const Network<D>& network, const Producer<D>& producer)
      : network_(network), preimage_(network.preimages[producer.index]) {}

  geometry::Label ask(const Word* leaf, CellView<D>& cell, Words& out) const;
  /// Grows with the level: what is refined already can wait for what is not.
  [[nodiscard]] std::size_t undecided(const Word* leaf) const;
  /// A hyperplane of the solid; else across the axis of the model along which the image is longest. No advice
  /// where the cell is too small for that.
  Advice advise(const Word* leaf, CellView<D>& cell) const;

 private:
  const Network<D>& network_;
  const Preimage<D>& preimage_;

  /// The vertices of a cell in the frame of the solid.
  struct Image {
    std::vector<preimage::Vector> points;
    preimage::Vector lower, upper, centre{};  ///< of the points; their mean
    double error = 0;                         ///< of a coordinate
    double reach = 1;                         ///< a bound of their size
  };
  [[nodiscard]] preimage::Vector in_frame(const std::array<double, D>& x, double error,
                                          double& image_error) const;
  [[nodiscard]] Image image_of(const CellView<D>& cell) const;
  template <int F>
  [[nodiscard]] std::vector<std::array<double, F>> points_of(const Image& image) const;

  geometry::Label label(const preimage::RoundSolid& solid, const Image& image, Word& level) const;
  geometry::Label label(const preimage::TorusSolid& solid, const Image& image, Word& level) const;
  template <int F>
  geometry::Label keep_patches(const PatchTree<F>& tree, const Word* leaf, const Image& image,
                               const CellView<D>& cell, Words& out) const;
  template <int F>
  [[nodiscard]] geometry::Label label_off_patches(const PatchTree<F>& tree, const CellView<D>& cell) const;

  [[nodiscard]] std::optional<Advice> advise_in(const preimage::RoundSolid& solid, const Word* leaf,
                                                const Image& image, CellView<D>& cell) const;
  [[nodiscard]] std::optional<Advice> advise_in(const preimage::TorusSolid& solid, const Word* leaf,
                                                const Image& image, CellView<D>& cell) const;
  template <int F>
  [[nodiscard]] std::optional<Advice> advise_in(const preimage::PatchSolid<F>& solid, const Word* leaf,
                                                const Image& image, CellView<D>& cell) const;
  [[nodiscard]] Advice halve(CellView<D>& cell) const;
};

}  // namespace bsp2::dataflow
