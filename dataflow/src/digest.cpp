#include <xxhash.h>

#include <cstdio>

#include "bsp2/dataflow/evaluate.hpp"

namespace bsp2::dataflow {

void Digest::add(const geometry::CellBatch& batch, std::size_t cell) {
  const auto points = batch.cell_points(cell);
  const std::uint32_t first_facet = batch.facet_offset[cell], last_facet = batch.facet_offset[cell + 1];
  const std::uint32_t first_vertex = batch.facet_vertex_offset[first_facet], last_vertex = batch.facet_vertex_offset[last_facet];
  std::uint64_t corners = 0;  // of each facet
  for (std::uint32_t facet = first_facet; facet < last_facet; ++facet)
    corners = corners * 0x9e3779b97f4a7c15u + batch.facet_vertex_offset[facet + 1] - batch.facet_vertex_offset[facet];
  const std::array<std::uint64_t, 6> head{
      points.size() | std::uint64_t{last_facet - first_facet} << 32,
      static_cast<std::uint64_t>(batch.label[cell]) | std::uint64_t{batch.level[cell]} << 8,
      static_cast<std::uint32_t>(batch.part[cell]),
      XXH3_64bits(points.data(), points.size_bytes()),
      XXH3_64bits(batch.facet_vertices.data() + first_vertex, (last_vertex - first_vertex) * sizeof(std::uint16_t)),
      corners};
  const XXH128_hash_t hash = XXH3_128bits(head.data(), sizeof head);
  Digest one;
  one.words = {hash.low64, hash.high64};
  *this += one;
}

Digest& Digest::operator+=(const Digest& other) {
  words[0] += other.words[0];
  words[1] += other.words[1] + (words[0] < other.words[0] ? 1 : 0);
  return *this;
}

std::string Digest::hex() const {
  std::array<char, 33> text{};
  std::snprintf(text.data(), text.size(), "%016llx%016llx", static_cast<unsigned long long>(words[1]), static_cast<unsigned long long>(words[0]));
  return text.data();
}

}  // namespace bsp2::dataflow
