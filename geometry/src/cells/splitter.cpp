#include "bsp2/geometry/cells/splitter.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "exact/filter.hpp"

namespace bsp2::geometry {

KernelCounts& KernelCounts::operator+=(const KernelCounts& other) {
  splits += other.splits;
  predicates += other.predicates;
  exact_predicates += other.exact_predicates;
  vertices += other.vertices;
  exact_vertices += other.exact_vertices;
  return *this;
}

// --- CellScratch ---

namespace {

template <typename T>
std::size_t put(Block& block, std::size_t at, const Buffer<T>& values) {
  if (values.size() != 0) std::memcpy(block.at<std::byte>(at), values.data(), values.size() * sizeof(T));
  return at + (values.size() * sizeof(T) + 3) / 4 * 4;
}

}  // namespace

template <int D>
void CellScratch<D>::clear() {
  vertices_.clear();
  for (Level& level : levels_) {
    level.faces = 0;
    level.hyperplanes.clear();
    level.ends.clear();
    level.subfaces.clear();
  }
}

template <int D>
void CellScratch<D>::throw_too_many_faces() {
  throw std::length_error("a cell has more than 65535 faces of one dimension");
}

template <int D>
Cell<D> CellScratch<D>::pack() const {
  std::size_t bytes = vertices_.size() * sizeof(Vertex<D>);
  if constexpr (D > 1)
    for (const Level& level : levels_)
      bytes += (level.hyperplanes.size() + level.ends.size()) * 4 + (level.subfaces.size() * 2 + 3) / 4 * 4;
  Cell<D> cell;
  cell.block_ = Block(bytes);
  cell.vertex_count_ = static_cast<std::uint32_t>(vertices_.size());
  std::size_t at = put(cell.block_, 0, vertices_);
  if constexpr (D > 1)
    for (int k = 1; k < D; ++k) {
      const Level& level = levels_[k - 1];
      auto& packed = cell.levels_[k - 1];
      packed.faces = static_cast<std::uint32_t>(level.faces);
      packed.hyperplanes_at = static_cast<std::uint32_t>(at);
      at = put(cell.block_, at, level.hyperplanes);
      packed.ends_at = static_cast<std::uint32_t>(at);
      if (k > 1) at = put(cell.block_, at, level.ends);  // edges have two vertices each
      packed.subfaces_at = static_cast<std::uint32_t>(at);
      at = put(cell.block_, at, level.subfaces);
    }
  return cell;
}

template <int D>
void VertexColumns<D>::load(const Cell<D>& cell) {
  const auto vertices = cell.vertices();
  error = 0;
  count = vertices.size();
  padded = (count + block - 1) / block * block;
  for (auto& column : x) column.resize(padded);
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < D; ++k) x[k][i] = vertices[i].x[k];
    error = std::max(error, vertices[i].error);
  }
  for (std::size_t i = count; i < padded; ++i)
    for (auto& column : x) column[i] = column[count - 1];
}

// --- the predicate ---

template <int D>
int Splitter<D>::side(const Vertex<D>& vertex, HyperplaneId id, const Hyperplane<D>& rounded) {
  ++counts_.predicates;
  const double value = rounded.at(vertex.x);
  const double bound = rounded.error + vertex.error * (1 + 0x1p-40);
  if (value > bound) return 1;
  if (value < -bound) return -1;
  for (const HyperplaneId own : vertex.hyperplanes)
    if (own == id) return 0;
  return exact_side(vertex, id);
}

template <int D>
Splitter<D>::Splitter(const HyperplaneTable<D>& table)
    : table_(&table), reach_bits_(std::ilogb(table.radius()) + 1 - table.grid_exponent()) {}

/// What the filter, and the hyperplanes that a vertex is named by, tell of its side: without branches, as
/// there is no telling.
template <int D>
auto Splitter<D>::quick_side(const Vertex<D>& vertex, HyperplaneId id, const Hyperplane<D>& rounded)
    -> QuickSide {
  const double value = rounded.at(vertex.x);
  const double bound = rounded.error + vertex.error * (1 + 0x1p-40);
  const int mask = (value < -bound ? has_negative : 0) | (value > bound ? has_positive : 0);
  int is_own = 0;
  for (const HyperplaneId own : vertex.hyperplanes) is_own |= own == id ? 1 : 0;
  return {static_cast<std::uint8_t>(mask), (mask == 0 ? 1 : 0) & (is_own ^ 1)};
}

template <int D>
Position Splitter<D>::classify(const Cell<D>& cell, HyperplaneId id) {
  const Hyperplane<D> rounded = table_->rounded(id);
  const auto vertices = cell.vertices();
  mask_[0].resize(vertices.size());
  std::uint8_t all = 0;
  int doubtful = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto [mask, is_doubtful] = quick_side(vertices[i], id, rounded);
    mask_[0][i] = mask;
    all |= mask;
    doubtful |= is_doubtful;
  }
  counts_.predicates += vertices.size();
  for (std::size_t i = 0; doubtful != 0 && i < vertices.size(); ++i) {
    if (mask_[0][i] != 0) continue;
    --counts_.predicates;  // counted again there
    const int s = side(vertices[i], id, rounded);
    mask_[0][i] = s < 0 ? has_negative : s > 0 ? has_positive : 0;
    all |= mask_[0][i];
  }
  return all == crosses ? Position::crossing : all == has_positive ? Position::positive : Position::negative;
}

namespace {

/// Where a cell lies that has a facet on the hyperplane, as most have that touch it.
template <int D>
std::optional<Position> side_of_facet(const Cell<D>& cell, HyperplaneId id) {
  if constexpr (D > 1) {
    const std::uint32_t* const codes = cell.hyperplanes(D - 1, 0).data();
    for (std::size_t facet = 0; facet < cell.facet_count(); ++facet)
      if (const OrientedHyperplane plane{codes[facet]}; plane.id() == id)
        return plane.flipped() ? Position::positive : Position::negative;
  }
  return std::nullopt;
}

}  // namespace

template <int D>
Position Splitter<D>::position(const Cell<D>& cell, HyperplaneId id, const Hyperplane<D>& rounded) {
  if (const auto side = side_of_facet(cell, id)) return *side;
  int seen = 0;
  for (const Vertex<D>& vertex : cell.vertices()) {
    const int s = side(vertex, id, rounded);
    if (s * seen < 0) return Position::crossing;
    if (s != 0) seen = s;
  }
  return seen > 0 ? Position::positive : Position::negative;
}

namespace {

static_assert(VertexColumns<3>::block == 4);

filter::Sides sides_of(Position position) {
  return position == Position::crossing   ? filter::both
         : position == Position::negative ? filter::all_negative
                                          : filter::all_positive;
}

filter::Points points_of(const VertexColumns<3>& columns) {
  return {columns.x[0].data(), columns.x[1].data(), columns.x[2].data(), columns.count};
}

template <int D>
filter::Range find_range(const VertexColumns<D>& columns, const Hyperplane<D>& h, double bound,
                         std::uint64_t& looked_at) {
  if constexpr (D == 3) {
    return filter::find_range(points_of(columns), h, bound, looked_at);
  } else {
    static_cast<void>(bound);
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (std::size_t i = 0; i < columns.count; ++i) {
      double value = h.offset;
      for (int k = 0; k < D; ++k) value += h.normal[k] * columns.x[k][i];
      least = value < least ? value : least;
      largest = value > largest ? value : largest;
    }
    looked_at += columns.count;
    return {least, largest};
  }
}

}  // namespace

template <int D>
Position Splitter<D>::position(const Cell<D>& cell, const VertexColumns<D>& columns, HyperplaneId id,
                               const Hyperplane<D>& rounded) {
  const double bound = rounded.error + columns.error * (1 + 0x1p-40);
  const auto [least, largest] = find_range<D>(columns, rounded, bound, counts_.predicates);
  if (least < -bound && largest > bound) return Position::crossing;
  if (largest < -bound) return Position::negative;
  if (least > bound) return Position::positive;
  return position(cell, id, rounded);
}

template <int D>
bool Splitter<D>::find_crossing(const Cell<D>& cell, const VertexColumns<D>& columns,
                                std::span<const OrientedHyperplane> planes, Buffer<std::uint32_t>& crossing) {
  if constexpr (D == 3) {
    constexpr std::size_t block = 64;
    static_assert(block % wide == 0);
    const auto stored = table_->rounded();
    alignas(64) std::array<filter::Sides, block> sides;  // stored in pieces of that size
    for (std::size_t first = 0; first < planes.size(); first += block) {
      const auto some = planes.subspan(first, std::min(block, planes.size() - first));
      counts_.predicates += filter::find_sides(points_of(columns), columns.error * (1 + 0x1p-40),
                                               stored.data(), some, sides.data());
      const std::size_t before = crossing.size();
      crossing.resize(before + some.size());
      std::uint32_t* codes = crossing.data() + before;
      bool is_outside = false;
      for (std::size_t i = 0; i < some.size();
           ++i) {  // hardly any branches: there is no telling which ones cross
        const OrientedHyperplane plane = some[i];
        filter::Sides where = sides[i];
        if (where == filter::doubtful) [[unlikely]] {
          if (is_outside) return false;
          where = sides_of(position(cell, plane.id(), stored[plane.id()]));
        }
        *codes = plane.code;
        codes += where == filter::both ? 1 : 0;
        is_outside |= where == (plane.flipped() ? filter::all_negative : filter::all_positive);
      }
      if (is_outside) return false;
      crossing.resize(static_cast<std::size_t>(codes - crossing.data()));
    }
    return true;
  } else {
    return std::all_of(planes.begin(), planes.end(), [&](OrientedHyperplane plane) {
      const Position where = position(cell, columns, plane.id(), table_->rounded(plane.id()));
      if (where == Position::crossing) crossing.push(plane.code);
      return where == Position::crossing || (where == Position::negative) != plane.flipped();
    });
  }
}

// --- split: signs of the vertices, then each k-face from its (k-1)-faces ---

template <int D>
void Splitter<D>::split(const Cell<D>& cell, HyperplaneId id, Cell<D>* negative, Cell<D>* positive) {
  ++counts_.splits;
  halves_[0].wanted = negative != nullptr;
  halves_[1].wanted = positive != nullptr;
  for (Half& half : halves_) {
    half.scratch.clear();
    for (int k = 0; k < D; ++k) half.index[k].resize(cell.face_count(k));
    for (int k = 1; k < D; ++k) half.common[k - 1].resize(cell.face_count(k));
  }
  split_vertices(cell);
  if constexpr (D == 1) {
    std::array<HyperplaneId, 1> ids{id};
    const Vertex<D> vertex = make_vertex<D>(*table_, ids, counts_.exact_vertices);
    for (Half& half : halves_)
      if (half.wanted) half.scratch.add_vertex(vertex);
  } else {
    split_edges(cell, id);
    for (int k = 2; k < D; ++k) split_faces(cell, k, id);
    split_body(cell, id);
  }
  if (negative != nullptr) *negative = halves_[0].scratch.pack();
  if (positive != nullptr) *positive = halves_[1].scratch.pack();
}

template <int D>
void Splitter<D>::split_vertices(const Cell<D>& cell) {
  const auto vertices = cell.vertices();
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (unsigned h = 0; h < 2; ++h) {
      const std::uint8_t other_side = h == 0 ? has_positive : has_negative;
      if (halves_[h].wanted && mask_[0][i] != other_side)
        halves_[h].index[0][i] = halves_[h].scratch.add_vertex(vertices[i]);
    }
}

template <int D>
void Splitter<D>::copy_face(const Cell<D>& cell, int k, std::size_t face, Half& half) {
  half.index[k][face] = half.scratch.add_face(k, cell.hyperplanes(k, face).data());
  for (const std::uint16_t sub : cell.subfaces(k, face)) half.scratch.add_subface(k, half.index[k - 1][sub]);
  half.scratch.close_face(k);
}

/// On which sides edges are, and a new vertex for each crossing one, in their order.
template <int D>
void Splitter<D>::cut_edges(const Cell<D>& cell, HyperplaneId id) {
  const std::size_t count = cell.face_count(1);
  mask_[1].resize(count);
  cut_number_.resize(count);
  crossing_.resize(count);
  const std::uint16_t* const ends = cell.subfaces(1, 0).data();
  const std::uint32_t* const hyperplanes = cell.hyperplanes(1, 0).data();
  const std::uint8_t* const of_vertex = mask_[0].data();
  std::uint8_t* const of_edge = mask_[1].data();
  std::uint16_t* const number = cut_number_.data();
  EdgeHyperplanes<D>* const crossing = crossing_.data();
  std::size_t found = 0;
  for (std::size_t edge = 0; edge < count;
       ++edge) {  // without branches: there is no telling which ones cross
    const std::uint8_t mask = of_vertex[ends[2 * edge]] | of_vertex[ends[2 * edge + 1]];
    number[edge] = static_cast<std::uint16_t>(found);
    of_edge[edge] = mask;
    const std::uint32_t* const own = hyperplanes + (D - 1) * edge;
    for (int i = 0; i + 1 < D; ++i)
      crossing[found][i] = D == 2 ? own[i] >> 1 : own[i];  // in the plane, edges are facets
    found += mask == crosses ? 1 : 0;
  }
  crossing_.resize(found);
  cuts_.resize(crossing_.size());
  make_vertices<D>(*table_, crossing_, id, cuts_.data(), counts_.exact_vertices);
  counts_.vertices += cuts_.size();
}

template <int D>
void Splitter<D>::split_edges(const Cell<D>& cell, HyperplaneId id) {
  if constexpr (D > 1) {
    cut_edges(cell, id);
    const Vertex<D>* cut_vertex = cuts_.data();
    for (std::size_t edge = 0; edge < mask_[1].size(); ++edge) {
      const std::uint8_t mask = mask_[1][edge];
      if (mask != crosses) {
        for (unsigned h = 0; h < 2; ++h)
          if (halves_[h].wanted && mask != (h == 0 ? has_positive : has_negative))
            copy_face(cell, 1, edge, halves_[h]);
        continue;
      }
      const Vertex<D>& vertex = *cut_vertex++;
      const auto ends = cell.subfaces(1, edge);
      for (unsigned h = 0; h < 2; ++h) {
        Half& half = halves_[h];
        if (!half.wanted) continue;
        const std::uint16_t cut = half.common[0][edge] = half.scratch.add_vertex(vertex);
        const bool first_stays = mask_[0][ends[0]] == (h == 0 ? has_negative : has_positive);
        half.index[1][edge] = half.scratch.add_face(1, cell.hyperplanes(1, edge).data());
        half.scratch.add_subface(1, first_stays ? half.index[0][ends[0]] : cut);
        half.scratch.add_subface(1, first_stays ? cut : half.index[0][ends[1]]);
        half.scratch.close_face(1);
      }
    }
  }
}

/// The (k-1)-face in which a crossing k-face with these (k-1)-faces meets the hyperplane. Its own (k-2)-faces
/// are the common ones of the crossing (k-1)-faces, and those that lie on the hyperplane already: each of
/// these belongs to two (k-1)-faces, one a side, and is taken from the negative one. The ends of a new edge
/// are in ascending order.
template <int D>
template <typename Subfaces>
std::uint16_t Splitter<D>::add_common(const Cell<D>& cell, int k, const Subfaces& subfaces,
                                      const std::uint32_t* hyperplanes, Half& half) {
  const std::uint16_t index = half.scratch.add_face(k - 1, hyperplanes);
  for (const std::uint16_t sub : subfaces) {
    if (mask_[k - 1][sub] == crosses) {
      half.scratch.add_subface(k - 1, half.common[k - 2][sub]);
    } else if (mask_[k - 1][sub] == has_negative) {
      for (const std::uint16_t on : cell.subfaces(k - 1, sub))
        if (mask_[k - 2][on] == 0) half.scratch.add_subface(k - 1, half.index[k - 2][on]);
    }
  }
  half.scratch.close_face(k - 1);
  if (k == 2) half.scratch.order_last_edge();
  return index;
}

template <int D>
void Splitter<D>::split_faces(const Cell<D>& cell, int k, HyperplaneId id) {
  const std::size_t count = cell.face_count(k);
  mask_[k].resize(count);
  for (std::size_t face = 0; face < count; ++face) {
    const auto subfaces = cell.subfaces(k, face);
    std::uint8_t mask = 0;
    for (const std::uint16_t sub : subfaces) mask |= mask_[k - 1][sub];
    mask_[k][face] = mask;
    if (mask != crosses) {
      for (unsigned h = 0; h < 2; ++h)
        if (halves_[h].wanted && mask != (h == 0 ? has_positive : has_negative))
          copy_face(cell, k, face, halves_[h]);
      continue;
    }
    std::array<std::uint32_t, D> ids{};  // of the common face
    const auto own = cell.hyperplanes(k, face);
    for (int i = 0; i < D - k; ++i) ids[i] = k == D - 1 ? own[i] >> 1 : own[i];
    ids[D - k] = id;
    for (unsigned h = 0; h < 2; ++h) {
      Half& half = halves_[h];
      if (!half.wanted) continue;
      const std::uint16_t common = half.common[k - 1][face] = add_common(cell, k, subfaces, ids.data(), half);
      half.index[k][face] = half.scratch.add_face(k, own.data());
      for (const std::uint16_t sub : subfaces)
        if (mask_[k - 1][sub] != (h == 0 ? has_positive : has_negative))
          half.scratch.add_subface(k, half.index[k - 1][sub]);
      half.scratch.add_subface(k, common);
      half.scratch.close_face(k);
    }
  }
}

template <int D>
void Splitter<D>::split_body(const Cell<D>& cell, HyperplaneId id) {
  if constexpr (D > 1) {
    struct AllFacets {
      std::uint16_t count;
      struct Iterator {
        std::uint16_t at;
        std::uint16_t operator*() const { return at; }
        Iterator& operator++() {
          ++at;
          return *this;
        }
        bool operator!=(const Iterator& other) const { return at != other.at; }
      };
      [[nodiscard]] Iterator begin() const { return {0}; }
      [[nodiscard]] Iterator end() const { return {count}; }
    };
    const AllFacets facets{static_cast<std::uint16_t>(cell.facet_count())};
    for (unsigned h = 0; h < 2; ++h) {
      if (!halves_[h].wanted) continue;
      const std::uint32_t code = oriented(id, h == 1).code;  // the half is on its negative side
      add_common(cell, D, facets, &code, halves_[h]);
    }
  }
}

#define BSP2_INSTANTIATE(D)         \
  template struct VertexColumns<D>; \
  template class CellScratch<D>;    \
  template class Splitter<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
