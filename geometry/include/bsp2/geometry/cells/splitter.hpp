#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/exact/fraction.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::geometry {

/// Where a cell lies with respect to a hyperplane.
enum class Position : std::uint8_t { negative, positive, crossing };

/// What the kernel has done, for reports.
struct KernelCounts {
  std::uint64_t splits = 0, predicates = 0, exact_predicates = 0, vertices = 0, exact_vertices = 0;
  KernelCounts& operator+=(const KernelCounts& other);
};

template <int D>
class Clipper;

/// A cell under construction, in buffers that are reused from one split to the next.
template <int D>
class CellScratch {
 public:
  void clear();
  std::uint16_t add_vertex(const Vertex<D>& vertex) {
    const std::uint16_t index = next_index(vertices_.size());
    vertices_.push(vertex);
    return index;
  }
  /// Opens a k-face on these hyperplanes; its subfaces follow. @return its index.
  std::uint16_t add_face(int k, const std::uint32_t* hyperplanes) {
    Level& level = levels_[k - 1];
    const std::uint16_t index = next_index(level.faces++);
    for (int i = 0; i < D - k; ++i) level.hyperplanes.push(hyperplanes[i]);
    return index;
  }
  void add_subface(int k, std::uint16_t subface) { levels_[k - 1].subfaces.push(subface); }
  void close_face(int k) {
    levels_[k - 1].ends.push(static_cast<std::uint32_t>(levels_[k - 1].subfaces.size()));
  }
  /// Puts the ends of the edge that was added last in ascending order.
  void order_last_edge() {
    auto& ends = levels_[0].subfaces;
    const std::size_t count = ends.size();
    if (ends[count - 2] > ends[count - 1]) std::swap(ends[count - 2], ends[count - 1]);
  }
  [[nodiscard]] Cell<D> pack() const;
  [[noreturn]] static void throw_too_many_faces();

 private:
  struct Level {
    std::size_t faces = 0;
    Buffer<std::uint32_t> hyperplanes, ends;
    Buffer<std::uint16_t> subfaces;
  };
  Buffer<Vertex<D>> vertices_;
  std::array<Level, (D > 1 ? D - 1 : 1)> levels_;

  static std::uint16_t next_index(std::size_t size) {
    if (size >= std::numeric_limits<std::uint16_t>::max()) throw_too_many_faces();
    return static_cast<std::uint16_t>(size);
  }
};

/// The coordinates of a cell's vertices by axis, so that one hyperplane is held against all of them at a
/// time. The last vertex is repeated to fill the last block.
template <int D>
struct VertexColumns {
  static constexpr std::size_t block = 4;
  std::size_t count = 0;   ///< of vertices
  std::size_t padded = 0;  ///< a multiple of the block
  std::array<Buffer<double>, D> x;
  double error = 0;  ///< the largest of the vertices' error bounds
  void load(const Cell<D>& cell);
};

/// The kernel's two operations on cells, with the buffers and counts of one thread.
///
/// `side` is the one predicate: a floating-point filter with a proven bound answers almost always, exact
/// integer arithmetic the rest. Everything else is combinatorics on its answers, so a split never yields an
/// invalid cell. Thread rule: one thread at a time; the table is shared and only read.
template <int D>
class Splitter {
 public:
  explicit Splitter(const HyperplaneTable<D>& table);

  /// -1, 0, +1: the side of the hyperplane on which the vertex is. Exact.
  int side(const Vertex<D>& vertex, HyperplaneId id, const Hyperplane<D>& rounded);

  /// Where the cell lies; remembers the vertices' sides for `split`. A cell with no vertex strictly on one
  /// side is on the other one.
  Position classify(const Cell<D>& cell, HyperplaneId id);

  /// Where the cell lies, stopping as soon as that is known; remembers nothing.
  Position position(const Cell<D>& cell, HyperplaneId id, const Hyperplane<D>& rounded);
  /// Where the cell lies, found faster by its columns.
  Position position(const Cell<D>& cell, const VertexColumns<D>& columns, HyperplaneId id,
                    const Hyperplane<D>& rounded);

  /// Which of these half-spaces, all of primitives, cross the cell: their codes are appended to `crossing`,
  /// in the same order.
  /// @return false as soon as one is met that the cell is outside of; then what was appended means nothing.
  bool find_crossing(const Cell<D>& cell, const VertexColumns<D>& columns,
                     std::span<const OrientedHyperplane> planes, Buffer<std::uint32_t>& crossing);

  /// Splits the cell that was classified last, and crosses the hyperplane, into its two halves and their
  /// common facet. A null pointer leaves that half unbuilt. Linear in the faces of the cell. Source: Bajaj
  /// and Pascucci 1996; the paper, figure 4.
  void split(const Cell<D>& cell, HyperplaneId id, Cell<D>* negative, Cell<D>* positive);

  [[nodiscard]] const HyperplaneTable<D>& table() const { return *table_; }
  [[nodiscard]] const KernelCounts& counts() const { return counts_; }

 private:
  friend class Clipper<D>;
  struct Half {
    CellScratch<D> scratch;
    std::array<Buffer<std::uint16_t>, D> index;  // of each k-face in this half, where it is there
    std::array<Buffer<std::uint16_t>, D>
        common;  // [k-1]: of the (k-1)-face in which a crossing k-face meets h
    bool wanted = false;
  };
  static constexpr std::uint8_t has_negative = 1, has_positive = 2, crosses = 3;

  const HyperplaneTable<D>* table_;
  long reach_bits_;  // coordinates in the model are below 2^reach_bits_ steps of the grid
  KernelCounts counts_;
  std::array<Buffer<std::uint8_t>, D> mask_;            // of each k-face: on which sides it has vertices
  Buffer<EdgeHyperplanes<D>> crossing_;                 // edges
  Buffer<Vertex<D>> cuts_;                              // of each of them
  Buffer<std::uint16_t> cut_number_;                    // of each crossing edge
  std::array<Half, 2> halves_;                          // D != 3
  Buffer<std::array<std::uint32_t, 2>> common_edges_;   // D = 3: their ends
  Buffer<std::uint32_t> common_outline_;                // D = 3: edges
  std::array<Buffer<std::uint16_t>, 3> number_, kept_;  // D = 3: of the faces of a half

  template <typename Covector>
  struct CachedCovector {
    HyperplaneId id = ~HyperplaneId{0};
    Covector covector;
  };
  /// Hyperplanes that are not there: a table has no such id.
  static constexpr std::array<HyperplaneId, D> no_ids() {
    std::array<HyperplaneId, D> ids{};
    ids.fill(~HyperplaneId{0});
    return ids;
  }
  template <typename Covector>
  struct CachedPoint {
    std::array<HyperplaneId, D> ids = no_ids();
    Covector point;  // homogeneous, the weight last
  };
  using FractionCovector = std::array<Fraction, D + 1>;
  std::vector<CachedCovector<ExactCovector<D>>>
      exact_cache_;  // of the hyperplanes that exact predicates asked for last
  std::vector<CachedCovector<FractionCovector>> fraction_cache_;
  std::vector<CachedPoint<ExactCovector<D>>>
      point_cache_;  // what one hyperplane leaves open at a vertex, its neighbours often do, too
  std::vector<CachedPoint<FractionCovector>> fraction_point_cache_;
  struct CachedPencil {
    std::array<HyperplaneId, D> ids = no_ids();
  };
  std::vector<CachedPencil> pencil_cache_;  // hyperplanes that meet in more than a point

  /// What was asked: the vertex's hyperplanes, or their covectors, in ascending order, then the one that it
  /// is held against.
  struct CachedSide {
    std::array<std::uint32_t, D + 1> key{};  // no vertex lies on one hyperplane alone
    std::int8_t side = 0;
  };
  std::vector<CachedSide> side_cache_;   // cells that share a vertex ask the same again
  std::vector<CachedSide> frame_cache_;  // within a frame, by covectors: what one primitive asked, the next
                                         // of its shape asks again

  struct QuickSide {
    std::uint8_t mask;
    int is_doubtful;
  };
  static QuickSide quick_side(const Vertex<D>& vertex, HyperplaneId id, const Hyperplane<D>& rounded);
  // in exact_side.cpp
  int exact_side(const Vertex<D>& vertex, HyperplaneId id);
  int compute_exact_side(const std::array<HyperplaneId, D>& vertex, HyperplaneId id);
  std::optional<int> side_in_frame(const std::array<HyperplaneId, D>& vertex, HyperplaneId id);
  [[nodiscard]] int compute_side_in_frame(const std::array<std::uint32_t, D + 1>& covectors) const;
  [[nodiscard]] std::optional<int> side_in_fractions(const std::array<HyperplaneId, D>& vertex,
                                                     HyperplaneId id);
  bool is_known_pencil(const std::array<HyperplaneId, D>& ids);
  bool is_pencil(const std::array<HyperplaneId, D>& ids);
  const FractionCovector& in_fractions(HyperplaneId id);
  const FractionCovector& point_in_fractions(const std::array<HyperplaneId, D>& ids);
  const ExactCovector<D>& exact(HyperplaneId id);
  const ExactCovector<D>& exact_point(const std::array<HyperplaneId, D>& ids);
  // the general split
  void split_vertices(const Cell<D>& cell);
  void cut_edges(const Cell<D>& cell, HyperplaneId id);
  void split_edges(const Cell<D>& cell, HyperplaneId id);
  void split_faces(const Cell<D>& cell, int k, HyperplaneId id);
  void split_body(const Cell<D>& cell, HyperplaneId id);
  void copy_face(const Cell<D>& cell, int k, std::size_t face, Half& half);
  template <typename Facets>
  std::uint16_t add_common(const Cell<D>& cell, int k, const Facets& subfaces,
                           const std::uint32_t* hyperplanes, Half& half);
  // D = 3, in space_split.cpp
  void find_common_edges(const Cell<D>& cell);
  void find_touched_edges(const Cell<D>& cell);
  [[nodiscard]] std::array<std::uint32_t, 2> find_common_edge(const Cell<D>& cell,
                                                              std::span<const std::uint16_t> outline) const;
  std::size_t number_kept(int k, std::size_t count, std::uint8_t other);
  Cell<D> half_of(const Cell<D>& cell, HyperplaneId id, std::uint8_t side);
};

template <>
void Splitter<3>::split(const Cell<3>& cell, HyperplaneId id, Cell<3>* negative, Cell<3>* positive);

}  // namespace bsp2::geometry
