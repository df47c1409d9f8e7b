#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "render/camera.hpp"

namespace bsp2::supersteps {

/// How the picture's space is divided, by region: how far each is moved, and its root in the result's tree.
struct RegionsInSpace {
  std::span<const Vector> shifts;
  std::span<const std::int32_t> roots;
  bool are_apart = false;  ///< they have been moved, each by itself
};

/// What is where the eye is, in the regions that this rank draws: the label of a cell, OUT where none is;
/// nothing in the others' regions.
std::optional<geometry::Label> label_here(const RunResult& result, const RegionsInSpace& regions,
                                          const Vector& eye, int rank);

/// The boundary of the IN cells as it is seen from within: of each IN cell the pieces of its facets behind
/// which there is no IN cell, if they turn their backs to the eye. D = 3.
///
/// A facet goes down the BSP tree on its far side, and is cut where the tree parts it. Painted with their
/// cells, from the farthest to the nearest, the pieces hide each other as they should: what is seen first is
/// where the solid ends first. All is rounded: it is a picture.
class InnerSides {
 public:
  using Piece =
      std::vector<Vector>;  ///< around it, counter-clockwise seen from outside; in model space, not moved

  /// Pieces that lie on cuts between regions ask who has the other side. Collective.
  InnerSides(Ranks& ranks, const RunResult& result, const RegionsInSpace& regions, const Camera& camera);
  /// Those of a cell, counted through the batches.
  [[nodiscard]] std::span<const Piece> of(std::size_t cell) const;

 private:
  std::unordered_map<std::size_t, std::vector<Piece>> pieces_;
};

}  // namespace bsp2::supersteps
