#pragma once

#include <array>
#include <cstdint>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::geometry {

/// Cuts one cell by many hyperplanes, one after the other, and keeps what lies behind all of them.
///
/// Its cells are those of `Splitter::split`, face by face in the same order; but what stays is changed in
/// place, so a cut costs what it changes and one look at each vertex and edge. Thread rule: that of the
/// splitter, whose predicate it uses and whose counts it continues.
template <int D>
class Clipper {
 public:
  explicit Clipper(Splitter<D>& splitter) : splitter_(&splitter) {}
  void load(const Cell<D>& cell) { cell_ = cell.copy(); }
  /// Keeps what is on the negative side of the plane if the plane crosses the cell, else the cell stays as it
  /// is.
  /// @param rest if not null and the plane crosses: the other half. @return where the cell lay.
  Position cut(OrientedHyperplane plane, Cell<D>* rest);
  /// The mean of the vertices.
  [[nodiscard]] std::array<double, D> centre() const;
  [[nodiscard]] Cell<D> cell() const { return cell_.copy(); }

 private:
  Splitter<D>* splitter_;
  Cell<D> cell_;
};

/// In three dimensions every edge lies in exactly two facets: so what a cut changes is found from the edges
/// alone.
template <>
class Clipper<3> {
 public:
  explicit Clipper(Splitter<3>& splitter) : splitter_(&splitter) {}
  void load(const Cell<3>& cell);
  Position cut(OrientedHyperplane plane, Cell<3>* rest);
  [[nodiscard]] std::array<double, 3> centre() const;
  [[nodiscard]] Cell<3> cell();

 private:
  using Index = std::uint16_t;
  struct Edge {
    std::array<Index, 2> ends, facets;
    EdgeHyperplanes<3> hyperplanes;
  };
  struct Facet {
    std::uint32_t code;
    std::uint32_t begin, count;  // of its edges, in `lists_`
    bool alive;
  };
  static constexpr std::uint8_t has_negative = 1, has_positive = 2, crosses = 3;

  Splitter<3>* splitter_;
  // What was cut away leaves holes until `close_up`. New faces come last, as in `Splitter::split`.
  Buffer<Vertex<3>> vertices_;
  std::array<Buffer<double>, 3> x_;                 // the vertices' coordinates by axis
  Buffer<std::uint8_t> vertex_lives_, edge_lives_;  // 0, or all bits
  Buffer<Edge> edges_;
  Buffer<Facet> facets_;
  Buffer<Index> lists_, lists_copy_;
  static constexpr std::size_t none = 0xffff;
  std::size_t living_vertices_ = 0, witness_ = none;  // of the living, where the dead are
  double error_ = 0;                                  // the largest of the vertices'
  // Of the cut at hand.
  Buffer<double> values_;
  Buffer<std::uint8_t> vertex_mask_, edge_mask_;
  Buffer<std::uint8_t> facet_mask_;             // 0 where nothing goes
  bool is_touched_ = false;                     // some vertex lies on the plane
  Buffer<Index> going_vertices_, going_edges_;  // with vertices on the side that goes, in part or as a whole
  Buffer<Index> cut_vertex_;                    // of each crossing edge
  Buffer<EdgeHyperplanes<3>> crossing_;         // edges
  Buffer<Index> crossing_facets_;
  Buffer<Index> common_edge_;                 // of each crossing facet
  Buffer<std::array<Index, 2>> common_ends_;  // likewise: where the new edge ends
  Buffer<std::uint8_t> ends_found_;           // likewise: how many of these
  Buffer<Index> common_list_;                 // edges of the common facet
  Buffer<Index> renumbered_, packed_;         // of vertices or edges

  std::uint8_t find_sides(HyperplaneId id);
  void add_vertex(const Vertex<3>& vertex);
  void enter_vertex(const Vertex<3>& vertex);
  void mark(std::uint8_t going);
  void mark_vertices_and_edges(std::uint8_t going);
  void mark_touched_facets(std::uint8_t going);
  void cut_edges(HyperplaneId id);
  void find_common_ends();
  [[nodiscard]] std::array<Index, 2> touched_ends(const Facet& facet) const;
  void find_common_edges(HyperplaneId id);
  void find_common_facet(std::uint8_t going);
  Cell<3> pack_going(std::uint8_t going, std::uint32_t common_code);
  void drop_going(std::uint8_t going, std::uint32_t common_code);
  void shorten(Facet& facet, std::uint8_t going, Index new_edge);
  void bury_edges(std::uint8_t side);
  void bury_vertices();
  void close_up();
};

}  // namespace bsp2::geometry
