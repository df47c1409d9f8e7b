#include <algorithm>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/edge_facets.hpp"

namespace bsp2::geometry {
namespace {

OrientedHyperplane outward(std::int32_t code) {
  return oriented(static_cast<HyperplaneId>(code < 0 ? ~code : code), code < 0);
}

}  // namespace

void FacetSet::clear(HyperplaneId id) {
  hyperplane = id;
  facets.clear();
  corners.clear();
}

void FacetSet::append(const FacetSet& other) {
  const auto base = static_cast<std::uint32_t>(corners.size());
  corners.insert(corners.end(), other.corners.begin(), other.corners.end());
  for (Facet facet : other.facets) {
    facet.end += base;
    facets.push_back(facet);
  }
}

FacetIndex::FacetIndex(const HyperplaneTable<3>& table,
                       std::span<const std::shared_ptr<const CellBatch>> batches, FacetGrouping grouping)
    : batches_(batches),
      names_(std::move(grouping.names)),
      first_unnamed_(static_cast<HyperplaneId>(table.size())),
      first_cell_(std::move(grouping.first_cell)) {
  if (!names_) names_ = std::make_shared<PlaneNames>(table, family_planes(table, batches));
  const bool is_numbered = !first_cell_.empty();
  std::uint64_t cells = 0;
  EdgeFacets edges;
  for (std::uint32_t b = 0; b < batches.size(); ++b) {
    const CellBatch& batch = *batches[b];
    if (batch.dimension != 3) throw std::logic_error("facets of cells of dimension 3 are expected");
    if (!is_numbered) first_cell_.push_back(cells);
    cells += batch.size();
    for (std::uint32_t cell = 0; cell < batch.size(); ++cell) {
      if (batch.label[cell] != Label::in) continue;
      bool has_edges = false;
      for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
        const HyperplaneId id = outward(batch.facet_hyperplane[facet]).id();
        const std::uint32_t group = grouping.group ? grouping.group(batch.region[cell], id) : 0;
        const HyperplaneId name = add(id);  // also of those left out: others have edges on them
        if (group == FacetGrouping::left_out) continue;
        if (!std::exchange(has_edges, true)) edges.find(batch, cell);
        entries_.push_back({group, name, b, cell, facet, across_.size()});
        for (std::uint32_t corner = batch.facet_vertex_offset[facet];
             corner < batch.facet_vertex_offset[facet + 1]; ++corner)
          across_.push_back(batch.facet_hyperplane[edges.beyond(corner)]);
      }
    }
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.group, a.hyperplane, a.batch, a.facet) <
           std::tie(b.group, b.hyperplane, b.batch, b.facet);
  });
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (i == 0 || entries_[i].group != entries_[i - 1].group ||
        entries_[i].hyperplane != entries_[i - 1].hyperplane)
      begin_.push_back(i);
  begin_.push_back(entries_.size());
}

/// Finds the name of a plane. @return its id.
HyperplaneId FacetIndex::add(HyperplaneId id) {
  if (id < first_unnamed_) return id;
  const auto [entry, is_new] = known_.try_emplace(id);
  if (is_new) entry->second = names_->find(id);
  return entry->second.id();
}

/// @pre it has been added.
OrientedHyperplane FacetIndex::canonical(OrientedHyperplane hyperplane) const {
  if (hyperplane.id() < first_unnamed_) return hyperplane;
  const OrientedHyperplane name = known_.find(hyperplane.id())->second;
  return hyperplane.flipped() ? name.opposite() : name;
}

void FacetIndex::append(std::size_t index, FacetSet& set) const {
  for (std::size_t i = begin_[index]; i < begin_[index + 1]; ++i) {
    const Entry& entry = entries_[i];
    const CellBatch& batch = *batches_[entry.batch];
    const auto points = batch.cell_points(entry.cell);
    const auto loop = batch.vertices_of_facet(entry.facet);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const double* x = &points[3 * loop[k]];
      set.corners.push_back({{x[0], x[1], x[2]}, canonical(outward(across_[entry.first_across + k]))});
    }
    set.facets.push_back({first_cell_[entry.batch] + entry.cell, batch.part[entry.cell],
                          static_cast<std::uint16_t>(entry.facet - batch.facet_offset[entry.cell]),
                          canonical(outward(batch.facet_hyperplane[entry.facet])).flipped(),
                          static_cast<std::uint32_t>(set.corners.size())});
  }
}

}  // namespace bsp2::geometry
