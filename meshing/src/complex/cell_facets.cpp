#include "complex/cell_facets.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::meshing {

using geometry::CellBatch;
using geometry::HyperplaneId;
using geometry::OrientedHyperplane;

FacetLoader::FacetLoader(geometry::ExactPoints& exact, PointRegister& points,
                         std::vector<HyperplaneId> families)
    : exact_(exact), points_(points), names_(exact.table(), std::move(families)) {
  result_.planes.resize(exact_.table().size());
  std::iota(result_.planes.begin(), result_.planes.end(), HyperplaneId{0});
}

FacetLoader::Name FacetLoader::name(std::int32_t code) {
  const bool is_flipped = code < 0;
  const auto id = static_cast<HyperplaneId>(is_flipped ? ~code : code);
  if (id < exact_.table().size()) return {geometry::oriented(id, is_flipped), id};
  const auto [entry, is_new] = known_.try_emplace(id);
  if (is_new) entry->second = find_name(id);
  Name name = entry->second;
  if (is_flipped) name.outward = name.outward.opposite();
  return name;
}

/// Of a plane that is no primitive's, or has another name.
FacetLoader::Name FacetLoader::find_name(HyperplaneId id) {
  const OrientedHyperplane name = names_.find(id);
  if (name.id() < exact_.table().size()) return {name, name.id()};
  const auto [entry, is_new] =
      number_.try_emplace(name.id(), static_cast<std::uint32_t>(result_.planes.size()));
  if (is_new) result_.planes.push_back(name.id());
  return {name, entry->second};
}

void FacetLoader::load(std::span<const std::shared_ptr<const CellBatch>> batches) {
  std::size_t cells = result_.part.size(), points = result_.cell_points.size(),
              facets = result_.facets.size(), corners = result_.corners.size();
  for (const auto& batch : batches) {
    cells += batch->size();
    points += batch->point_offset.back();
    facets += batch->facet_offset.back();
    corners += batch->facet_vertices.size();
  }
  result_.part.reserve(cells);
  result_.cell_offset.reserve(cells + 1);
  result_.cell_points.reserve(points);
  result_.facets.reserve(facets + 1);
  result_.corners.reserve(corners);
  points_.reserve(points / 4);  // a corner is one of several cells
  for (const auto& batch : batches)
    for (std::uint32_t cell = 0; cell < batch->size(); ++cell)
      if (batch->label[cell] == geometry::Label::in) {
        geometry::Interruption::check();
        load(*batch, cell);
      }
}

CellFacets FacetLoader::take() {
  result_.facets.push_back({0, -1, static_cast<std::uint32_t>(result_.corners.size()), false});
  return std::move(result_);
}

void FacetLoader::load(const CellBatch& batch, std::uint32_t cell) {
  edges_.find(batch, cell);
  outward_.clear();
  for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet)
    outward_.push_back(name(batch.facet_hyperplane[facet]));
  name_corners(batch, cell);
  // A cell that is as thin as its corners are rounded may have been written inside out, so the order is
  // asked for exactly; once for all facets, if each edge leads back and forth in its two.
  bool is_right = true;
  for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
    if (facet == batch.facet_offset[cell] || !edges_.is_consistent())
      is_right = turns_right(batch, cell, facet);
    add_facet(batch, cell, facet, is_right);
  }
  result_.part.push_back(batch.part[cell]);
  result_.cell_offset.push_back(static_cast<std::uint32_t>(result_.cell_points.size()));
}

/// A corner of a facet is where its plane meets those of the facets beyond its two edges. Of a corner of the
/// cell that has several such names the lowest one is taken.
void FacetLoader::name_corners(const CellBatch& batch, std::uint32_t cell) {
  const std::uint32_t first = batch.facet_offset[cell];
  const auto plane_of = [&](std::uint32_t facet) { return outward_[facet - first].outward.id(); };
  const std::size_t corners = batch.point_count(cell);
  constexpr HyperplaneId none = ~HyperplaneId{0};
  ids_.assign(corners, {none, none, none});
  count_.assign(corners, 0);
  for (std::uint32_t facet = first; facet < batch.facet_offset[cell + 1]; ++facet) {
    const auto loop = batch.vertices_of_facet(facet);
    const std::uint32_t begin = batch.facet_vertex_offset[facet];
    HyperplaneId before = plane_of(edges_.beyond(begin + static_cast<std::uint32_t>(loop.size()) - 1));
    for (std::uint32_t k = 0; k < loop.size(); ++k) {
      const HyperplaneId after = plane_of(edges_.beyond(begin + k));
      Ids ids{plane_of(facet), before, after};
      std::sort(ids.begin(), ids.end());
      Ids& lowest = ids_[loop[k]];
      lowest = std::min(lowest, ids);
      ++count_[loop[k]];
      before = after;
    }
  }
  for (std::size_t corner = 0; corner < corners; ++corner) {
    if (count_[corner] > 3) {
      collect_planes(batch, cell, static_cast<std::uint16_t>(corner));
      result_.cell_points.push_back(points_.find(ids_[corner], planes_));
    } else {
      result_.cell_points.push_back(points_.find(ids_[corner], ids_[corner]));
    }
  }
}

/// All that meet in a corner of the cell.
void FacetLoader::collect_planes(const CellBatch& batch, std::uint32_t cell, std::uint16_t corner) {
  const std::uint32_t first = batch.facet_offset[cell];
  planes_.clear();
  for (std::uint32_t facet = first; facet < batch.facet_offset[cell + 1]; ++facet) {
    const auto loop = batch.vertices_of_facet(facet);
    if (std::find(loop.begin(), loop.end(), corner) != loop.end())
      planes_.push_back(outward_[facet - first].outward.id());
  }
  std::sort(planes_.begin(), planes_.end());
}

/// Whether a facet's corners are counter-clockwise seen from outside of the cell.
bool FacetLoader::turns_right(const CellBatch& batch, std::uint32_t cell, std::uint32_t facet) {
  const auto loop = batch.vertices_of_facet(facet);
  const std::uint32_t* points = result_.cell_points.data() + result_.cell_offset.back();
  const auto& vertices = points_.points().vertices;
  const geometry::PlaneFrame frame(exact_, outward_[facet - batch.facet_offset[cell]].outward);
  return frame.orientation(vertices[points[loop[0]]], vertices[points[loop[1]]], vertices[points[loop[2]]]) >
         0;
}

void FacetLoader::add_facet(const CellBatch& batch, std::uint32_t cell, std::uint32_t facet, bool is_right) {
  const std::uint32_t first = batch.facet_offset[cell], begin = batch.facet_vertex_offset[facet];
  const auto [outward, number] = outward_[facet - first];
  result_.facets.push_back({number, static_cast<std::int32_t>(result_.part.size()),
                            static_cast<std::uint32_t>(result_.corners.size()), outward.flipped()});
  const auto loop = batch.vertices_of_facet(facet);
  const std::uint32_t* points = result_.cell_points.data() + result_.cell_offset.back();
  const auto across = [&](std::size_t k) {
    return outward_[edges_.beyond(begin + static_cast<std::uint32_t>(k)) - first].outward;
  };
  const std::size_t n = loop.size();
  if (is_right != outward.flipped())
    for (std::size_t k = 0; k < n; ++k) result_.corners.push_back({points[loop[k]], across(k)});
  else  // the edge that began at a corner now ends there
    for (std::size_t k = n; k-- > 0;)
      result_.corners.push_back({points[loop[k]], across(k > 0 ? k - 1 : n - 1)});
}

}  // namespace bsp2::meshing
