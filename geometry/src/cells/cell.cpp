#include "bsp2/geometry/cells/cell.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <set>

#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "support/vector_lanes.hpp"

namespace bsp2::geometry {

template <int D>
Cell<D> Cell<D>::copy() const {
  Cell result;
  result.block_ = Block(block_.size());
  std::memcpy(result.block_.template at<std::byte>(0), block_.template at<std::byte>(0), block_.size());
  result.vertex_count_ = vertex_count_;
  result.levels_ = levels_;
  return result;
}

namespace {

/// A vertex's error stands behind its coordinates: four numbers at a time.
BSP2_VECTOR_CLONES void find_range(std::span<const Vertex<3>> vertices, VertexRange<3>& range) {
  static_assert(offsetof(Vertex<3>, error) == 3 * sizeof(double));
  Lanes low = Lanes{} + std::numeric_limits<double>::infinity(), high = -low, sum{}, at;
  for (const Vertex<3>& vertex : vertices) {
    std::memcpy(&at, &vertex, sizeof at);
    low = at < low ? at : low;
    high = at > high ? at : high;
    sum += at;
  }
  range = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}, {sum[0], sum[1], sum[2]}, high[3]};
}

}  // namespace

template <int D>
VertexRange<D> vertex_range(const Cell<D>& cell) {
  VertexRange<D> range;
  if constexpr (D == 3) {
    find_range(cell.vertices(), range);
  } else {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    range.lower.fill(infinity);
    range.upper.fill(-infinity);
    range.sum.fill(0);
    range.error = 0;
    for (const Vertex<D>& vertex : cell.vertices()) {
      range.error = std::max(range.error, vertex.error);
      for (int i = 0; i < D; ++i) {
        range.lower[i] = std::min(range.lower[i], vertex.x[i]);
        range.upper[i] = std::max(range.upper[i], vertex.x[i]);
        range.sum[i] += vertex.x[i];
      }
    }
  }
  return range;
}

namespace {

template <int D>
void collect_vertices(const Cell<D>& cell, int k, std::size_t face, std::set<std::uint16_t>& vertices) {
  if (k == 0) {
    vertices.insert(static_cast<std::uint16_t>(face));
    return;
  }
  for (const std::uint16_t sub : cell.subfaces(k, face)) collect_vertices(cell, k - 1, sub, vertices);
}

}  // namespace

template <int D>
std::vector<std::uint16_t> facet_vertices(const Cell<D>& cell, std::size_t facet) {
  std::set<std::uint16_t> vertices;
  collect_vertices(cell, D - 1, facet, vertices);
  return {vertices.begin(), vertices.end()};
}

namespace {

/// The k-faces of a box are the strings over {low, high, free} with k times free.
template <int D>
class BoxBuilder {
 public:
  explicit BoxBuilder(const HyperplaneTable<D>& table) : table_(table) {}

  Cell<D> build() {
    std::array<std::vector<std::array<int, D>>, D> faces;
    int total = 1;
    for (int axis = 0; axis < D; ++axis) total *= 3;
    for (int code = 0; code < total; ++code) {
      std::array<int, D> sides{};
      int free = 0, rest = code;
      for (int& side : sides) {
        side = rest % 3;
        rest /= 3;
        free += side == 2;
      }
      if (free < D) faces[free].push_back(sides);
    }
    CellScratch<D> scratch;
    std::uint64_t exact = 0;
    for (const auto& sides : faces[0]) {
      std::array<HyperplaneId, D> ids;
      for (int axis = 0; axis < D; ++axis) ids[axis] = hyperplane(axis, sides[axis]).id();
      scratch.add_vertex(make_vertex<D>(table_, ids, exact));
    }
    for (int k = 1; k < D; ++k)
      for (const auto& sides : faces[k]) {
        std::vector<std::uint32_t> codes;
        for (int axis = 0; axis < D; ++axis)
          if (sides[axis] != 2)
            codes.push_back(k == D - 1 ? hyperplane(axis, sides[axis]).code
                                       : hyperplane(axis, sides[axis]).id());
        scratch.add_face(k, codes.data());
        for (std::size_t sub = 0; sub < faces[k - 1].size(); ++sub)
          if (covers(sides, faces[k - 1][sub])) scratch.add_subface(k, static_cast<std::uint16_t>(sub));
        scratch.close_face(k);
      }
    return scratch.pack();
  }

 private:
  const HyperplaneTable<D>& table_;

  OrientedHyperplane hyperplane(int axis, int side) const {  // inside negative
    return oriented(table_.axis_hyperplane(axis, side == 0 ? table_.root_lower() : table_.root_upper()),
                    side == 0);
  }
  static bool covers(const std::array<int, D>& face, const std::array<int, D>& sub) {
    for (int axis = 0; axis < D; ++axis)
      if (face[axis] != 2 && face[axis] != sub[axis]) return false;
    return true;
  }
};

}  // namespace

template <int D>
Cell<D> root_cell(const HyperplaneTable<D>& table) {
  return BoxBuilder<D>(table).build();
}

#define BSP2_INSTANTIATE(D)                                                           \
  template class Cell<D>;                                                             \
  template VertexRange<D> vertex_range<D>(const Cell<D>&);                            \
  template std::vector<std::uint16_t> facet_vertices<D>(const Cell<D>&, std::size_t); \
  template Cell<D> root_cell<D>(const HyperplaneTable<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
