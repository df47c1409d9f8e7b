#include "constructs/outline.hpp"

#include <algorithm>
#include <set>

#include "bsp2/dataflow/constructs/part_outlines.hpp"
#include "constructs/arcs.hpp"
#include "constructs/circle_skins.hpp"
#include "constructs/outline_tracer.hpp"
#include "operands/nested.hpp"

namespace bsp2::dataflow {
namespace {

using Batches = std::span<const std::shared_ptr<const geometry::CellBatch>>;
using geometry::Label;
using geometry::OutlinePath;

/// Of all batches, the cells that are wanted.
template <typename Wanted, typename Use>
void for_each_cell(Batches batches, const Wanted& wanted, const Use& use) {
  for (const auto& batch : batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      if (wanted(*batch, cell)) use(*batch, cell);
}

bool is_fuzzy(const geometry::CellBatch& batch, std::size_t cell) {
  return batch.label[cell] == Label::fuzzy;
}

/// Whatever cells they are of, in whatever order.
void sort_paths(std::vector<OutlinePath>& paths) {
  for (OutlinePath& path : paths) {
    const auto first = std::min_element(path.corners.begin(), path.corners.end()) - path.corners.begin();
    std::rotate(path.corners.begin(), path.corners.begin() + first, path.corners.end());
    if (!path.bulges.empty())
      std::rotate(path.bulges.begin(), path.bulges.begin() + first, path.bulges.end());
  }
  std::sort(paths.begin(), paths.end(), [](const OutlinePath& a, const OutlinePath& b) {
    return std::tie(a.corners, a.bulges) < std::tie(b.corners, b.bulges);
  });
}

/// @param skins of what is curved; null: nothing is.
geometry::PartOutline outline_of_part(const Network<2>& network, Batches batches, std::int32_t part,
                                      double reach, const CircleSkins* skins) {
  OutlineTracer tracer(network, reach);
  for_each_cell(
      batches,
      [&](const auto& batch, std::size_t cell) {
        return batch.label[cell] == Label::in && batch.part[cell] == part;
      },
      [&](const auto& batch, std::size_t cell) { tracer.add(batch, cell); });
  geometry::PartOutline outline{part, {}};
  if (skins == nullptr) {
    for (const auto& path : tracer.paths())
      if (auto corners = tracer.corners_of(path); corners.size() >= 3)
        outline.paths.push_back({std::move(corners), {}});
  } else {
    std::uint32_t number = 0;
    for_each_cell(batches, is_fuzzy,
                  [&](const auto& batch, std::size_t cell) { tracer.add_beyond(batch, cell, number++); });
    add_arcs(network, *skins, tracer, outline);
  }
  sort_paths(outline.paths);
  return outline;
}

}  // namespace

std::vector<geometry::PartOutline> part_outlines(const Network<2>& network, Batches batches) {
  std::set<std::int32_t> parts;
  double reach = 0;
  for (const auto& batch : batches) {
    reach = std::max(reach, reach_of(*batch));
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      if (batch->label[cell] == Label::in) parts.insert(batch->part[cell]);
  }
  std::optional<CircleSkins> skins;
  if (network.is_round() && !parts.empty()) {
    skins.emplace(network, reach);
    for_each_cell(batches, is_fuzzy, [&](const auto& batch, std::size_t cell) { skins->add(batch, cell); });
    skins->find();
  }
  std::vector<geometry::PartOutline> outlines;
  for (const std::int32_t part : parts)
    outlines.push_back(outline_of_part(network, batches, part, reach, skins ? &*skins : nullptr));
  return outlines;
}

Outline outline_of(const model::Expression& solid, const CompileOptions& options) {
  CompileOptions own = options;
  own.coincidence = outline_coincidence;
  Outline outline;
  evaluate_plane_cells(solid, own, [&](const Network<2>& network, const auto& batches) {
    double reach = 0;
    for (const auto& batch : batches) reach = std::max(reach, reach_of(batch));
    OutlineTracer tracer(network, reach);
    for (const auto& batch : batches)
      for (std::size_t cell = 0; cell < batch.size(); ++cell) tracer.add(batch, cell);
    for (const auto& path : tracer.paths())
      if (auto corners = tracer.corners_of(path); corners.size() >= 3) outline.push_back(std::move(corners));
  });
  return outline;
}

double signed_area(const std::vector<std::array<double, 2>>& path) {
  double twice = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto &p = path[i], &q = path[(i + 1) % path.size()], &o = path[0];
    twice += (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
  }
  return twice / 2;
}

}  // namespace bsp2::dataflow
