#include "bsp2/geometry/splitter.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/dimensions.hpp"
#include "filter_lanes.hpp"

namespace bsp2::geometry {

KernelCounts& KernelCounts::operator+=(const KernelCounts& other) {
  splits += other.splits;
  predicates += other.predicates;
  exact_predicates += other.exact_predicates;
  vertices += other.vertices;
  exact_vertices += other.exact_vertices;
  return *this;
}

// --- CellScratch ------------------------------------------------------------------------------------------------

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
  throw std::length_error("a cell has more than 65534 faces of one dimension");
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

// --- the predicate -----------------------------------------------------------------------------------------------

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
Splitter<D>::Splitter(const HyperplaneTable<D>& table) : table_(&table) {}

namespace {

/// The place of a key in a cache with one entry a place. A cache has no memory before it is needed: many splitters never ask exactly.
template <typename Entry, std::size_t N>
Entry& place_of(std::vector<Entry>& cache, std::size_t size, const std::array<std::uint32_t, N>& key) {
  if (cache.empty()) cache.resize(size);
  std::uint64_t hash = 0;
  for (const std::uint32_t word : key) hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
  return cache[(hash >> 32) % size];
}

constexpr int large_entries_above = 3;  // dimensions
template <int D>
constexpr std::size_t cached_covectors = D <= large_entries_above ? 256 : 16;
constexpr std::size_t cached_sides = 16384;

}  // namespace

/// Valid until the next call.
template <int D>
const ExactCovector<D>& Splitter<D>::exact(HyperplaneId id) {
  CachedCovector& entry = place_of(exact_cache_, cached_covectors<D>, std::array{id});
  if (entry.id != id) {
    entry.covector = table_->exact(id);
    divide_by_common_power_of_two(entry.covector);
    entry.id = id;
  }
  return entry.covector;
}

template <int D>
int Splitter<D>::exact_side(const Vertex<D>& vertex, HyperplaneId id) {
  std::array<HyperplaneId, D> ids = vertex.hyperplanes;  // cells name one vertex in several orders
  std::sort(ids.begin(), ids.end());
  std::array<HyperplaneId, D + 1> key;
  std::copy(ids.begin(), ids.end(), key.begin());
  key[D] = id;
  CachedSide& known = place_of(side_cache_, cached_sides, key);
  if (known.key != key) known = {key, static_cast<std::int8_t>(compute_exact_side(ids, id))};
  return known.side;
}

/// The sign of a hyperplane at a point in homogeneous coordinates.
template <int D, typename Integer>
int side_of_point(const std::array<Integer, D + 1>& point, const std::array<Integer, D + 1>& hyperplane) {
  Integer value = hyperplane[D] * point[D];
  for (int i = 0; i < D; ++i)
    if (!hyperplane[i].is_zero() && !point[i].is_zero()) value += hyperplane[i] * point[i];
  return value.sign() * point[D].sign();
}

/// The point in which hyperplanes meet, valid until the next call.
template <int D>
const ExactCovector<D>& Splitter<D>::exact_point(const std::array<HyperplaneId, D>& ids) {
  CachedPoint& known = place_of(point_cache_, cached_covectors<D>, ids);
  if (known.ids != ids) {
    std::array<ExactCovector<D>, D> rows;
    for (int i = 0; i < D; ++i) rows[i] = exact(ids[i]);
    known.point = meeting_point<D>(rows);
    divide_by_common_power_of_two(known.point);
    known.ids = ids;
  }
  return known.point;
}

/// Where all hyperplanes are of one primitive, as around the corners of a sphere: the same in its own frame, where the
/// coefficients are a third as long, and the answer is that of all primitives of its shape.
template <int D>
std::optional<int> Splitter<D>::side_in_frame(const std::array<HyperplaneId, D>& vertex, HyperplaneId id) {
  const auto* asked = table_->source(id);
  if (asked == nullptr) return std::nullopt;
  std::array<std::uint32_t, D + 1> covectors;
  covectors[D] = asked->covector;
  for (int i = 0; i < D; ++i) {
    const auto* own = table_->source(vertex[i]);
    if (own == nullptr || own->map != asked->map) return std::nullopt;
    covectors[i] = own->covector;
  }
  std::sort(covectors.begin(), covectors.begin() + D);
  CachedSide& known = place_of(frame_cache_, cached_sides, covectors);
  if (known.key != covectors) known = {covectors, static_cast<std::int8_t>(compute_side_in_frame(covectors))};
  return known.side;
}

/// Columns may be divided by a power of two: that only scales the frame's axes.
template <int D>
int Splitter<D>::compute_side_in_frame(const std::array<std::uint32_t, D + 1>& covectors) const {
  using Integer = FixedInteger<D <= 3 ? 896 : 512>;  // D + 1 coefficients of 216 bits; above D = 3, of 64
  std::array<std::array<Integer, D + 1>, D> rows;
  std::array<Integer, D + 1> last;
  for (int column = 0; column <= D; ++column) {
    unsigned shift = std::numeric_limits<unsigned>::max();
    for (const std::uint32_t covector : covectors) {
      const LocalInteger& entry = table_->covector(covector).exact[column];
      if (!entry.is_zero()) shift = std::min(shift, static_cast<unsigned>(mp::lsb(LocalInteger(mp::abs(entry)))));
    }
    if (shift == std::numeric_limits<unsigned>::max()) shift = 0;
    for (int row = 0; row <= D; ++row) {
      const LocalInteger& entry = table_->covector(covectors[row]).exact[column];
      const LocalInteger size = LocalInteger(mp::abs(entry)) >> shift;
      (row < D ? rows[row][column] : last[column]) = Integer(entry.sign() < 0 ? LocalInteger(-size) : size);
    }
  }
  return side_of_point<D>(meeting_point<D>(rows), last);
}

template <int D>
int Splitter<D>::compute_exact_side(const std::array<HyperplaneId, D>& vertex, HyperplaneId id) {
  ++counts_.exact_predicates;
  if (const auto side = side_in_frame(vertex, id)) return *side;
  const ExactCovector<D>& point = exact_point(vertex);  // before the covector: it asks for others
  return side_of_point<D>(point, exact(id));
}

template <int D>
Position Splitter<D>::classify(const Cell<D>& cell, HyperplaneId id) {
  const Hyperplane<D> rounded = table_->rounded(id);
  const auto vertices = cell.vertices();
  mask_[0].resize(vertices.size());
  std::uint8_t all = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const int s = side(vertices[i], id, rounded);
    const std::uint8_t mask = s < 0 ? has_negative : s > 0 ? has_positive : 0;
    mask_[0][i] = mask;
    all |= mask;
  }
  return all == crosses ? Position::crossing : all == has_positive ? Position::positive : Position::negative;
}

template <int D>
Position Splitter<D>::position(const Cell<D>& cell, HyperplaneId id, const Hyperplane<D>& rounded) {
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

BSP2_VECTOR_CLONES std::size_t find_range(const VertexColumns<3>& columns, const Hyperplane<3>& h, double bound, double& least, double& largest) {
  return find_range(columns.x[0].data(), columns.x[1].data(), columns.x[2].data(), columns.padded, h, bound, least, largest);
}

/// Where values between `least` and `largest` lie: 1 all certainly negative, 2 all positive, 3 there are some of both, 0 in doubt.
[[gnu::always_inline]] inline std::uint8_t sides_of_range(double least, double largest, double bound) {
  return least < -bound && largest > bound ? 3 : largest < -bound ? 1 : least > bound ? 2 : 0;
}

/// On which sides of each hyperplane the points are, with certainty: 1 negative, 2 positive, 3 there are some on both, 0 in doubt.
/// Long lists are looked at eight hyperplanes at a time, and `sides` has room for a multiple of eight. @return the number of values looked at.
BSP2_VECTOR_CLONES std::size_t find_sides(const VertexColumns<3>& columns, const Hyperplane<3>* hyperplanes, std::span<const OrientedHyperplane> planes,
                                          std::uint8_t* sides) {
  const double *x = columns.x[0].data(), *y = columns.x[1].data(), *z = columns.x[2].data();
  const double error = columns.error * (1 + 0x1p-40);
  constexpr std::size_t width = 8, least_worth = 5;
  constexpr std::uint64_t all_cross = 0x0303030303030303;
  std::size_t i = 0, looked_at = 0;
  for (; i + least_worth <= planes.size(); i += width) {
    WideLanes nx, ny, nz, offset, bound;
    for (std::size_t lane = 0; lane < width; ++lane) {
      if (i + width + lane < planes.size()) __builtin_prefetch(hyperplanes + planes[i + width + lane].id());
      const Hyperplane<3>& h = hyperplanes[planes[std::min(i + lane, planes.size() - 1)].id()];
      nx[lane] = h.normal[0];
      ny[lane] = h.normal[1];
      nz[lane] = h.normal[2];
      offset[lane] = h.offset;
      bound[lane] = h.error;
    }
    bound += error;
    WideLanes low = offset + nx * x[0] + ny * y[0] + nz * z[0], high = low;
    std::uint64_t found = 0;
    for (std::size_t v = 1; v < columns.count && found != all_cross;) {
      const std::size_t some = std::min<std::size_t>(columns.count, v + 256);
      for (; v < some; ++v) {
        const WideLanes value = offset + nx * x[v] + ny * y[v] + nz * z[v];
        low = value < low ? value : low;
        high = value > high ? value : high;
      }
      const auto each = ((low < -bound) & (high > bound) & 3) | ((high < -bound) & 1) | ((low > bound) & 2);
      const auto bytes = __builtin_convertvector(each, WideBytes);
      std::memcpy(&found, &bytes, width);
    }
    std::memcpy(sides + i, &found, width);
    looked_at += std::min(width, planes.size() - i) * columns.count;
  }
  for (; i < planes.size(); ++i) {
    const Hyperplane<3>& h = hyperplanes[planes[i].id()];
    double least, largest;
    looked_at += std::min(find_range(x, y, z, columns.padded, h, h.error + error, least, largest), columns.count);
    sides[i] = sides_of_range(least, largest, h.error + error);
  }
  return looked_at;
}

template <int D>
std::size_t find_range_of(const VertexColumns<D>& columns, const Hyperplane<D>& h, double bound, double& least, double& largest) {
  if constexpr (D == 3) {
    return find_range(columns, h, bound, least, largest);
  } else {
    static_cast<void>(bound);
    for (std::size_t i = 0; i < columns.count; ++i) {
      double value = h.offset;
      for (int k = 0; k < D; ++k) value += h.normal[k] * columns.x[k][i];
      least = value < least ? value : least;
      largest = value > largest ? value : largest;
    }
    return columns.count;
  }
}

}  // namespace

template <int D>
Position Splitter<D>::position(const Cell<D>& cell, const VertexColumns<D>& columns, HyperplaneId id, const Hyperplane<D>& rounded) {
  const double bound = rounded.error + columns.error * (1 + 0x1p-40);
  double least = std::numeric_limits<double>::infinity(), largest = -least;
  counts_.predicates += std::min(find_range_of<D>(columns, rounded, bound, least, largest), columns.count);
  if (least < -bound && largest > bound) return Position::crossing;
  if (largest < -bound) return Position::negative;
  if (least > bound) return Position::positive;
  return position(cell, id, rounded);
}

template <int D>
bool Splitter<D>::find_crossing(const Cell<D>& cell, const VertexColumns<D>& columns, std::span<const OrientedHyperplane> planes,
                                std::vector<std::uint32_t>& crossing) {
  const auto keep = [&](OrientedHyperplane plane, Position where) {
    if (where == Position::crossing) crossing.push_back(plane.code);
    return where == Position::crossing || (where == Position::negative) != plane.flipped();
  };
  if constexpr (D == 3) {
    constexpr std::size_t block = 64;
    const auto stored = table_->rounded();
    sides_.resize(block);
    for (std::size_t first = 0; first < planes.size(); first += block) {
      const auto some = planes.subspan(first, std::min(block, planes.size() - first));
      counts_.predicates += find_sides(columns, stored.data(), some, &sides_[0]);
      for (std::size_t i = 0; i < some.size(); ++i) {
        const HyperplaneId id = some[i].id();
        const Position where = sides_[i] == crosses        ? Position::crossing
                               : sides_[i] == has_negative ? Position::negative
                               : sides_[i] == has_positive ? Position::positive
                                                           : position(cell, id, stored[id]);
        if (!keep(some[i], where)) return false;
      }
    }
    return true;
  } else {
    return std::all_of(planes.begin(), planes.end(), [&](OrientedHyperplane plane) {
      return keep(plane, position(cell, columns, plane.id(), table_->rounded(plane.id())));
    });
  }
}

// --- split: signs of the vertices, then each k-face from its (k-1)-faces --------------------------------------------

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
      if (halves_[h].wanted && mask_[0][i] != other_side) halves_[h].index[0][i] = halves_[h].scratch.add_vertex(vertices[i]);
    }
}

template <int D>
void Splitter<D>::copy_face(const Cell<D>& cell, int k, std::size_t face, Half& half) {
  half.index[k][face] = half.scratch.add_face(k, cell.hyperplanes(k, face).data());
  for (const std::uint16_t sub : cell.subfaces(k, face)) half.scratch.add_subface(k, half.index[k - 1][sub]);
  half.scratch.close_face(k);
}

template <int D>
void Splitter<D>::split_edges(const Cell<D>& cell, HyperplaneId id) {
  if constexpr (D > 1) {
    const std::size_t count = cell.face_count(1);
    mask_[1].resize(count);
    for (std::size_t edge = 0; edge < count; ++edge) {
      const auto ends = cell.subfaces(1, edge);
      const std::uint8_t mask = mask_[0][ends[0]] | mask_[0][ends[1]];
      mask_[1][edge] = mask;
      if (mask != crosses) {
        for (unsigned h = 0; h < 2; ++h)
          if (halves_[h].wanted && mask != (h == 0 ? has_positive : has_negative)) copy_face(cell, 1, edge, halves_[h]);
        continue;
      }
      std::array<HyperplaneId, D> ids;
      const auto own = cell.hyperplanes(1, edge);
      for (int i = 0; i + 1 < D; ++i) ids[i] = D == 2 ? own[i] >> 1 : own[i];  // in the plane, edges are facets
      ids[D - 1] = id;
      ++counts_.vertices;
      const Vertex<D> vertex = make_vertex<D>(*table_, ids, counts_.exact_vertices);
      for (unsigned h = 0; h < 2; ++h) {
        Half& half = halves_[h];
        if (!half.wanted) continue;
        const std::uint16_t cut = half.common[0][edge] = half.scratch.add_vertex(vertex);
        const bool first_stays = mask_[0][ends[0]] == (h == 0 ? has_negative : has_positive);
        half.index[1][edge] = half.scratch.add_face(1, own.data());
        half.scratch.add_subface(1, first_stays ? half.index[0][ends[0]] : cut);
        half.scratch.add_subface(1, first_stays ? cut : half.index[0][ends[1]]);
        half.scratch.close_face(1);
      }
    }
  }
}

/// The (k-1)-face in which a crossing k-face with these (k-1)-faces meets the hyperplane. Its own (k-2)-faces are the
/// common ones of the crossing (k-1)-faces, and those that lie on the hyperplane already: each of these belongs to two
/// (k-1)-faces, one a side, and is taken from the negative one.
template <int D>
template <typename Subfaces>
std::uint16_t Splitter<D>::add_common(const Cell<D>& cell, int k, const Subfaces& subfaces, const std::uint32_t* hyperplanes, Half& half) {
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
        if (halves_[h].wanted && mask != (h == 0 ? has_positive : has_negative)) copy_face(cell, k, face, halves_[h]);
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
        if (mask_[k - 1][sub] != (h == 0 ? has_positive : has_negative)) half.scratch.add_subface(k, half.index[k - 1][sub]);
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

#define BSP2_INSTANTIATE(D)          \
  template struct VertexColumns<D>; \
  template class CellScratch<D>;    \
  template class Splitter<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
