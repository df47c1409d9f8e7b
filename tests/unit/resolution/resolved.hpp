#pragma once

// Solids with their boundary and contacts, for the tests of resolution.

#include <memory>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

using Batches = std::vector<std::shared_ptr<const geometry::CellBatch>>;

/// All skin of a mesh, before it is triangulated.
inline geometry::Skin skin_of(const Network<3>& network, const Batches& batches,
                              std::vector<geometry::Contact>* contacts, bool with_interfaces = false) {
  const geometry::FacetIndex index(network.table, batches);
  geometry::FacetMatcher matcher(network.table, with_interfaces);
  geometry::FacetSet facets;
  geometry::Skin skin;
  for (std::size_t i = 0; i < index.size(); ++i) {
    facets.clear(index.hyperplane(i));
    index.append(i, facets);
    matcher.match(facets, contacts, &skin);
  }
  return skin;
}

struct Resolved {
  Network<3> network;
  Batches batches;
  std::vector<geometry::Contact> contacts;
  geometry::TriangleSurface surface;
  double volume = 0;  ///< of the IN cells
};

/// @param depth of the regions that are evaluated one by one.
inline Resolved resolved(const model::Expression& e, const EvaluateOptions& options, unsigned depth = 0,
                         double coincidence = 1e-9) {
  Resolved result{compile<3>(e, {.coincidence = coincidence}), {}, {}, {}, 0};
  const auto evaluated = evaluate_all(result.network, depth, options);
  for (const auto& refinement : evaluated.refinements)
    result.batches.emplace_back(refinement, &refinement->cells);
  result.volume = evaluated.evaluation.totals.in.value().volume();
  result.surface =
      triangulate(result.network.table, skin_of(result.network, result.batches, &result.contacts));
  return result;
}

}  // namespace bsp2::dataflow
