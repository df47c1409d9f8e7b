#pragma once

#include <array>
#include <span>
#include <utility>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/dataflow/process/process.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"

namespace bsp2::dataflow {

/// An affine map of space: a process with one input stream, the hyperplanes and cells of a producer in its
/// own frame, and one output stream, their images.
///
/// Covectors are multiplied by the adjugate matrix, points by the matrix. Since a map refines nothing by
/// itself, the network applies it once, at compilation, to all hyperplanes that the producer will ever emit
/// (geometry::HyperplaneTable::merge): what it costs a cell is nothing. Source: the paper, section 4.1,
/// "Transformers".
template <int D>
class Transformer {
 public:
  Transformer();  ///< the identity
  explicit Transformer(const geometry::Matrix<D>& matrix) : matrix_(matrix) {}
  /// @param matrix (D+1) x (D+1), row-major, its last row 0 ... 0 1.
  explicit Transformer(std::span<const double> matrix);
  /// x -> factors x + shift, axis by axis.
  static Transformer scaling(const std::array<double, D>& factors, const std::array<double, D>& shift = {});

  /// First `inner`, then this.
  [[nodiscard]] Transformer after(const Transformer& inner) const;
  [[nodiscard]] const geometry::Matrix<D>& matrix() const { return matrix_; }

  /// Contains the image of a box, rounded outward.
  [[nodiscard]] Box<D> image(const Box<D>& box) const;
  /// Contains the image of a stack of circles around the last axis: their radii and heights. D = 3.
  [[nodiscard]] Box<D> image(std::span<const std::pair<double, double>> rings) const;
  /// Contains the image of the unit ball of the first `axes` axes times [0, 1] along the others.
  [[nodiscard]] Box<D> image_of_round(int axes) const;

 private:
  geometry::Matrix<D> matrix_;
  [[nodiscard]] Box<D> around(const std::array<std::pair<long double, long double>, D>& reach) const;
};

/// The complement of a solid: a process with one input stream, the answers of a producer, and one output
/// stream. Its answer IN names no owner, since no primitive contains the cell. Source: the paper,
/// section 4.1, "Transformers".
struct Complement {
  static constexpr geometry::Label map(geometry::Label label) {
    using geometry::Label;
    return label == Label::fuzzy ? label : label == Label::in ? Label::out : Label::in;
  }
  static constexpr Answer map(const Answer& answer) { return {map(answer.label)}; }
};

}  // namespace bsp2::dataflow
