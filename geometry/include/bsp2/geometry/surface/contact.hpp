#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/surface/plane_names.hpp"

namespace bsp2::geometry {

/// Two cells that touch in more than a lower-dimensional face: an edge of the adjacency graph.
///
/// cell[0] is on the negative side of the hyperplane, cell[1] on the positive one. Two cells touch in one
/// contact at most, since they are convex and disjoint.
struct Contact {
  std::array<std::uint64_t, 2> cell;   ///< counted through the batches, or as the facets say
  std::array<std::uint16_t, 2> facet;  ///< of each cell, from 0
  HyperplaneId hyperplane;
  double area;  ///< (D-1)-dimensional content, in model units
};

/// The facets of some cells that lie on one hyperplane: what has to travel where a hyperplane parts two
/// ranks.
///
/// A facet is a convex polygon, counter-clockwise seen from outside its cell. Its corners are known exactly:
/// corner i is where the facet's hyperplane meets `across` of corner i - 1 and of corner i.
struct FacetSet {
  struct Facet {
    std::uint64_t cell;    ///< number of the cell in the mesh
    std::int32_t owner;    ///< the part of the cell
    std::uint16_t number;  ///< of the facet in its cell
    bool positive;         ///< the cell is on the positive side of the hyperplane
    std::uint32_t end;     ///< its corners end here; they begin where those of the facet before end
  };
  struct Corner {
    std::array<double, 3> x;    ///< rounded
    OrientedHyperplane across;  ///< carries the edge from this corner to the next one, and the cell's facet
                                ///< beyond it; the cell negative
  };
  HyperplaneId hyperplane = 0;
  std::vector<Facet> facets;
  std::vector<Corner> corners;
  void clear(HyperplaneId id);
  /// Takes in more facets on the same hyperplane.
  void append(const FacetSet& other);
  [[nodiscard]] std::span<const Corner> corners_of(std::size_t facet) const {
    const std::uint32_t begin = facet == 0 ? 0 : facets[facet - 1].end;
    return {corners.data() + begin, facets[facet].end - begin};
  }
};

/// How the facets of a mesh are told apart beyond their hyperplanes, and how its cells are numbered.
struct FacetGrouping {
  std::vector<std::uint64_t>
      first_cell;  ///< number of the first cell of each batch, in contacts; empty: they follow each other
  /// The group of a facet of a cell of a region, by its hyperplane as the cell has it, or `left_out`; none:
  /// all are one group.
  std::function<std::uint32_t(std::uint32_t region, HyperplaneId)> group;
  static constexpr std::uint32_t left_out = ~0U;
  /// Shared by all indices of a mesh; null: the names that the planes of these batches have alone.
  std::shared_ptr<const PlaneNames> names;
};

/// Finds the facets of the IN cells of a mesh by group and hyperplane. Holds 32 bytes a facet and 4 a corner;
/// the table and the batches must outlive it. Once made, any number of threads may read it. Of a plane's
/// names one is taken here, for all that follows (PlaneNames).
class FacetIndex {
 public:
  /// @param batches of dimension 3.
  FacetIndex(const HyperplaneTable<3>& table, std::span<const std::shared_ptr<const CellBatch>> batches,
             FacetGrouping grouping = {});

  /// Number of pairs of a group and a hyperplane that carry facets, in ascending order.
  [[nodiscard]] std::size_t size() const { return begin_.size() - 1; }
  [[nodiscard]] HyperplaneId hyperplane(std::size_t index) const {
    return entries_[begin_[index]].hyperplane;
  }
  [[nodiscard]] std::uint32_t group(std::size_t index) const { return entries_[begin_[index]].group; }
  /// How many facets the index-th pair has.
  [[nodiscard]] std::size_t count(std::size_t index) const { return begin_[index + 1] - begin_[index]; }
  /// Appends the facets of the index-th pair to a set of the same hyperplane.
  void append(std::size_t index, FacetSet& set) const;

 private:
  struct Entry {
    std::uint32_t group;
    HyperplaneId hyperplane;
    std::uint32_t batch, cell, facet;  // the facet counts through the batch
    std::size_t first_across;
  };
  std::span<const std::shared_ptr<const CellBatch>> batches_;
  std::shared_ptr<const PlaneNames> names_;
  HyperplaneId first_unnamed_;                                  // those below it, of primitives, are names
  std::unordered_map<HyperplaneId, OrientedHyperplane> known_;  // names of the others here
  std::vector<std::uint64_t> first_cell_;                       // of each batch
  std::vector<Entry> entries_;                                  // by group and hyperplane
  std::vector<std::int32_t> across_;  // for each corner of a facet, the cell's facet beyond the edge that
                                      // begins there, as the batch names it
  std::vector<std::size_t> begin_;

  HyperplaneId add(HyperplaneId id);
  [[nodiscard]] OrientedHyperplane canonical(OrientedHyperplane hyperplane) const;
};

/// The part of the boundary on some hyperplanes, before it is triangulated: directed edges with the solid's
/// skin on their left, seen from outside.
///
/// A face is all skin on one side of one hyperplane in cells of one owner, with the same on its other side.
/// Vertices are named by the
/// hyperplanes that are known to meet there, at least three of which are independent. Edges of one face that
/// run along each other in opposite directions have cancelled: coplanar fragments are merged.
struct Skin {
  static constexpr std::int32_t outside = -2;  ///< where the solid is not: no part, and not `no_part` either
  struct Face {
    OrientedHyperplane outward;    ///< the solid is on its negative side
    std::int32_t owner;            ///< the part there
    std::int32_t other = outside;  ///< the part on the other side
    friend bool operator==(const Face&, const Face&) = default;
  };
  struct Edge {
    std::uint32_t from, to, face;
    HyperplaneId across;  ///< the edge is on it and on the face's hyperplane
  };
  std::vector<std::array<HyperplaneId, 3>> vertices;  ///< ascending ids of three independent hyperplanes
  std::vector<std::uint32_t> incident_offset{
      0};                              ///< vertex i is known to lie on incident [offset[i], offset[i + 1])
  std::vector<HyperplaneId> incident;  ///< ascending for each vertex
  std::vector<Face> faces;
  std::vector<Edge> edges;
  /// Vertices, ascending, with all around them whole triangles that nothing else of the skin meets, each with
  /// three edges here; the vertices have the names that the surface gives them, and nobody else names them.
  std::vector<std::uint32_t> untouched;

  /// Takes in the skin on other hyperplanes.
  void append(const Skin& other);
  /// Makes one of vertices that have the same name: each hyperplane through a corner of the solid has named
  /// it for itself. Which ones are untouched is forgotten. @return the new number of each vertex.
  std::vector<std::uint32_t> weld();
};

/// Matches the facets on a hyperplane: where cells touch, and what of their facets is left for the boundary.
///
/// Exact: no tolerance, every decision is the kernel's predicate. Facets that are equal are recognized by
/// their corners; the others are clipped against each other. Thread rule: one thread at a time; the table is
/// shared and only read.
class FacetMatcher {
 public:
  /// @param with_interfaces where cells of different parts touch, the skin has faces, too: out of that which
  /// is on the negative side of the hyperplane.
  explicit FacetMatcher(const HyperplaneTable<3>& table, bool with_interfaces = false);
  ~FacetMatcher();
  FacetMatcher(const FacetMatcher&) = delete;
  FacetMatcher& operator=(const FacetMatcher&) = delete;

  /// @param facets all facets of the mesh on this hyperplane.
  /// @param contacts gets the contacts, if not null. @param skin gets the faces on this hyperplane, if not
  /// null.
  void match(const FacetSet& facets, std::vector<Contact>* contacts, Skin* skin);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bsp2::geometry
