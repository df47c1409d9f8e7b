#include <xxhash.h>

#include <cstdio>
#include <span>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/geometry/support/buffer.hpp"
#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Cell;

constexpr std::uint64_t multiplier = 0x9e3779b97f4a7c15u;

/// A number for a corner whose sum over corners stands for their set.
constexpr std::uint64_t mixed(std::uint64_t corner) {  // as splitmix64 does
  std::uint64_t x = (corner + 1) * multiplier;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

constexpr auto mixed_corners = [] {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t corner = 0; corner < table.size(); ++corner) table[corner] = mixed(corner);
  return table;
}();

std::uint64_t key_of(std::uint16_t corner) {
  return corner < mixed_corners.size() ? mixed_corners[corner] : mixed(corner);
}

/// Puts what a cell's hash is made of together, facet by facet.
class CellHash {
 public:
  void add_facet(std::uint64_t twice_the_corners) {
    facets_ = facets_ * multiplier + twice_the_corners;
    ++facet_count_;
  }
  [[nodiscard]] Digest digest(std::span<const double> points, geometry::Label label, std::int32_t primitive,
                              std::int32_t part, std::uint16_t level) const {
    const std::array<std::uint64_t, 4> head{points.size() | std::uint64_t{facet_count_} << 32,
                                            static_cast<std::uint64_t>(label) | std::uint64_t{level} << 8 |
                                                std::uint64_t{static_cast<std::uint32_t>(primitive)} << 32,
                                            XXH3_64bits(points.data(), points.size_bytes()),
                                            facets_ ^ mark_of(label, part)};
    const XXH128_hash_t hash = XXH3_128bits(head.data(), sizeof head);
    Digest one;
    one.words = {hash.low64, hash.high64};
    return one;
  }

 private:
  std::uint64_t facets_ = 0;
  std::uint32_t facet_count_ = 0;
  /// What is IN is in part 0 where nothing has a name: that adds nothing.
  static std::uint64_t mark_of(geometry::Label label, std::int32_t part) {
    return label != geometry::Label::in || part == 0 ? 0 : mixed(static_cast<std::uint32_t>(part));
  }
};

/// Around a facet in space, each corner ends two edges.
void add_facets(const Cell<3>& cell, CellHash& hash) {
  thread_local geometry::Buffer<std::uint64_t> of_edge;  // the sum of the keys of its ends
  const std::size_t edges = cell.face_count(1);
  const std::uint16_t* const ends = cell.subfaces(1, 0).data();  // two of each edge
  of_edge.resize(edges);
  for (std::size_t edge = 0; edge < edges; ++edge)
    of_edge[edge] = key_of(ends[2 * edge]) + key_of(ends[2 * edge + 1]);
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    std::uint64_t sum = 0;
    for (const std::uint16_t edge : cell.subfaces(2, facet)) sum += of_edge[edge];
    hash.add_facet(sum);
  }
}

template <int D>
void add_facets(const Cell<D>& cell, CellHash& hash) {
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    std::uint64_t sum = 0;
    for (const std::uint16_t corner : geometry::facet_vertices(cell, facet)) sum += 2 * key_of(corner);
    hash.add_facet(sum);
  }
}

}  // namespace

void Digest::add(const geometry::CellBatch& batch, std::size_t cell) {
  CellHash hash;
  for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
    std::uint64_t sum = 0;
    for (const std::uint16_t corner : batch.vertices_of_facet(facet)) sum += 2 * key_of(corner);
    hash.add_facet(sum);
  }
  *this += hash.digest(batch.cell_points(cell), batch.label[cell], batch.primitive[cell], batch.part[cell],
                       batch.level[cell]);
}

template <int D>
void Digest::add(const Cell<D>& cell, geometry::Label label, std::int32_t primitive, std::int32_t part,
                 std::uint16_t level) {
  CellHash hash;
  add_facets(cell, hash);
  thread_local std::vector<double> points;  // one after the other, as in a batch
  points.resize(cell.vertices().size() * D);
  double* next = points.data();
  for (const auto& vertex : cell.vertices())
    for (const double x : vertex.x) *next++ = x;
  *this += hash.digest(points, label, primitive, part, level);
}

Digest& Digest::operator+=(const Digest& other) {
  words[0] += other.words[0];
  words[1] += other.words[1] + (words[0] < other.words[0] ? 1 : 0);
  return *this;
}

std::string Digest::hex() const {
  std::array<char, 33> text{};
  std::snprintf(text.data(), text.size(), "%016llx%016llx", static_cast<unsigned long long>(words[1]),
                static_cast<unsigned long long>(words[0]));
  return text.data();
}

#define BSP2_INSTANTIATE(D)                                                                           \
  template void Digest::add<D>(const geometry::Cell<D>&, geometry::Label, std::int32_t, std::int32_t, \
                               std::uint16_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
