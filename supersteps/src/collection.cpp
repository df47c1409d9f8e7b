#include <algorithm>

#include "stages.hpp"

namespace bsp2::supersteps {

void Collection::consume(const std::shared_ptr<const dataflow::Refinement>& refinement) { refinements_.push_back(refinement); }

SolidMesh Collection::take(int dimension) {
  std::sort(refinements_.begin(), refinements_.end(), [](const auto& a, const auto& b) {
    return a->worker != b->worker ? a->worker < b->worker : a->first < b->first;
  });
  SolidMesh mesh;
  mesh.dimension = dimension;
  for (const auto& refinement : refinements_) mesh.batches.emplace_back(refinement, &refinement->cells);
  refinements_.clear();
  return mesh;
}

}  // namespace bsp2::supersteps
