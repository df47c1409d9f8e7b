#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/support/buffer.hpp"
#include "bsp2/geometry/surface/contact.hpp"

namespace bsp2::geometry {

/// A corner of a convex polygon on a hyperplane.
struct PolygonCorner {
  Vertex<3> point;
  HyperplaneId across;  ///< carries the edge from here to the next corner
};

/// Cuts convex polygons, exactly. Thread rule: one thread at a time.
class PolygonSplitter {
 public:
  explicit PolygonSplitter(const HyperplaneTable<3>& table);
  ~PolygonSplitter();
  PolygonSplitter(const PolygonSplitter&) = delete;
  PolygonSplitter& operator=(const PolygonSplitter&) = delete;

  /// On which sides of the hyperplane the polygon has corners: 1 negative, 2 positive, 3 both, 0 neither.
  unsigned sides(std::span<const PolygonCorner> polygon, HyperplaneId id);
  /// The two parts of a polygon that has corners on both sides.
  /// @param plane in which the polygon lies. @param negative, positive what is on each side is appended; a
  /// null one is left out.
  void split(std::span<const PolygonCorner> polygon, HyperplaneId plane, HyperplaneId id,
             Buffer<PolygonCorner>* negative, Buffer<PolygonCorner>* positive);
  /// How a polygon lies to a hyperplane: it has corners on both sides; an edge of it lies there, or all of
  /// it; or a corner at most.
  enum class Meeting : std::uint8_t { crossing, along, apart };
  /// @param plane in which the polygon lies. @param ends of the segment in which it crosses the hyperplane:
  /// get their points.
  Meeting meet(std::span<const PolygonCorner> polygon, HyperplaneId plane, HyperplaneId id,
               std::array<PolygonCorner, 2>& ends);
  /// 1 where three points of the hyperplane turn counter-clockwise, seen from its positive side; else -1, and
  /// 0 on a line.
  int turn(OrientedHyperplane seen_from, const Vertex<3>& a, const Vertex<3>& b, const Vertex<3>& c);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// The facets of a convex cell as polygons. Thread rule: one thread at a time.
class CellPolygons {
 public:
  /// @param cell not empty.
  void load(PolygonSplitter& kernel, const Cell<3>& cell);
  [[nodiscard]] std::size_t size() const { return ends_.size(); }
  /// The hyperplane of a facet, the cell on its negative side.
  [[nodiscard]] OrientedHyperplane outward(std::size_t facet) const { return outward_[facet]; }
  struct Corner {
    std::uint32_t vertex;  ///< of the cell
    HyperplaneId across;   ///< see PolygonCorner
  };
  /// Counter-clockwise, seen from outside of the cell.
  [[nodiscard]] std::span<const Corner> polygon(std::size_t facet) const {
    const std::uint32_t begin = facet == 0 ? 0 : ends_[facet - 1];
    return {corners_.data() + begin, ends_[facet] - begin};
  }

 private:
  std::vector<OrientedHyperplane> outward_;
  std::vector<std::uint32_t> ends_;
  Buffer<Corner> corners_;
  std::vector<std::array<std::uint16_t, 2>> facets_of_edge_;
  std::vector<std::array<std::uint16_t, 2>> edges_at_;  // of each vertex, in the facet at hand
  std::vector<std::uint16_t> loop_;  // of the facet at hand: vertex, edge, vertex, edge ...

  void find_facets_of_edges(const Cell<3>& cell);
  void find_loop(const Cell<3>& cell, std::size_t facet);
};

/// Puts a skin together of convex polygons that lie on it, in any order, edge to edge or not. Thread rule:
/// one thread at a time.
class SkinBuilder {
 public:
  explicit SkinBuilder(const HyperplaneTable<3>& table) : table_(table) {}
  /// @param outward the solid is on the negative side. @param owner of the solid there: see Skin::Face.
  /// @param polygon on it, counter-clockwise seen from the side `seen_from` (flipped: the negative side).
  void add(OrientedHyperplane outward, std::int32_t owner, std::span<const PolygonCorner> polygon,
           OrientedHyperplane seen_from);
  [[nodiscard]] std::size_t size() const { return pieces_.size(); }
  /// Takes back all pieces but the first ones.
  void shrink(std::size_t pieces) {
    corners_.resize(pieces == 0 ? 0 : pieces_[pieces - 1].end);
    pieces_.resize(pieces);
  }
  /// Appends what has been added, plane by plane, and is empty again.
  void finish(Skin& skin);

 private:
  struct Piece {
    OrientedHyperplane outward;
    std::int32_t owner;
    std::uint32_t begin, end;
    bool forward;
  };
  const HyperplaneTable<3>& table_;
  std::vector<Piece> pieces_;
  Buffer<PolygonCorner> corners_;
};

}  // namespace bsp2::geometry
