#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// Positions of 16 bits a coordinate in a box: the lattice of a power of two that the box just fits into. So
/// where boxes of about one size meet, their points are the same.
class Lattice {
 public:
  static constexpr unsigned bits = 16;
  using Place = std::array<std::uint16_t, 3>;
  /// @param least step.
  Lattice(const std::array<double, 3>& lower, const std::array<double, 3>& upper, double least = 0);
  [[nodiscard]] const std::array<double, 3>& origin() const { return origin_; }
  [[nodiscard]] double step() const { return step_; }  ///< of all axes; model units
  /// The nearest place to a point of the box: at most half a step away along each axis.
  [[nodiscard]] Place place(const std::array<double, 3>& point) const;

 private:
  std::array<double, 3> origin_;
  double step_;
};

/// Triangles on a lattice, as the page draws them. They have owners (cells, faces) that follow each other.
struct PackedTriangles {
  /// One a vertex: those of different parts or tints are different vertices.
  std::vector<std::uint16_t> positions, parts, tints;
  std::vector<std::uint32_t> triangles;  ///< 3 a triangle
  std::vector<std::uint32_t> of_owner;   ///< triangles of each owner; those without any are there with 0
};

/// A triangle on its way.
struct LooseTriangle {
  std::array<std::array<double, 3>, 3> corners;
  std::uint32_t owner = 0;  ///< ascending
  std::uint16_t part = 0, tint = 0;
};

/// Packs triangles. Where they are more than `most`, points that are near each other become one, until what
/// is left of the triangles is at most that or 8 steps along each axis are all that is left: what is too
/// small goes, no holes come. @param owners how many there are. @return with the bits that were left of each
/// coordinate.
std::pair<PackedTriangles, unsigned> packed(std::span<const LooseTriangle> triangles, std::uint32_t owners,
                                            const Lattice& lattice, std::size_t most);

/// How many distinct parts and tints a page knows.
inline constexpr std::uint16_t no_number = 0xffff;

/// What all messages about cells need of a run.
struct Looks {
  std::vector<std::int32_t> rank_of_region;
  std::vector<std::uint16_t> tint_of_primitive;  ///< index of a palette; empty: no colours
  supersteps::Bounds bounds;                     ///< of the model: what is FUZZY is not shown beyond them
};

/// Cells of a step that goes on: they have come since the picture of their region, and are shown with it
/// until the next.
struct Fresh {
  std::uint64_t number = 0;  ///< each message has its own
  unsigned step = 0;
};

/// The cells of one region, as a message: IN cells but for facets that two of them share, and FUZZY ones.
/// @param batches of that region alone, but for fresh ones; dimension 2 or 3. @param most triangles.
/// @return its bytes; a message without triangles where there are none.
std::string region_message(
    std::uint64_t run, std::uint32_t region,
    const std::vector<std::shared_ptr<const geometry::CellBatch>>& batches,  // as in a mesh
    const Looks& looks, std::size_t most, const std::optional<Fresh>& fresh = std::nullopt);

/// The faces of a surface in pieces of some thousand triangles, each of one part and of faces near each
/// other, with the edges that a person takes for edges: those where faces meet at more than
/// `feature_degrees`.
///
/// An interface of two parts is there for each of them, so that each part is closed by itself. What pieces
/// share has one place in all of them, so no gaps come: it is on the coarsest of their lattices.
inline constexpr double feature_degrees = 30;
/// @param most triangles of all pieces together: where there are more, points near each other become one.
std::vector<std::string> surface_messages(std::uint64_t run, const geometry::Brep& brep, std::size_t most);

}  // namespace bsp2::api
