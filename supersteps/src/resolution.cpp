#include <utility>

#include "bsp2/geometry/contact.hpp"
#include "instantiate.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

template <int D>
Resolution resolution(const geometry::HyperplaneTable<D>& table, const SolidMesh& mesh, const RunOptions& options) {
  Resolution result;
  if constexpr (D == 3) {
    geometry::FacetIndex index(table, mesh.batches);
    geometry::FacetMatcher matcher(table);
    geometry::FacetSet facets;
    geometry::Skin skin;
    for (std::size_t i = 0; i < index.size(); ++i) {
      facets.clear(index.hyperplane(i));
      index.append(i, facets);
      matcher.match(facets, options.contacts ? &result.contacts : nullptr, options.boundary ? &skin : nullptr);
    }
    if (options.boundary) result.boundary = geometry::triangulate(table, std::move(skin));
  }
  return result;
}

#define BSP2_STAGE(D) template Resolution resolution<D>(const geometry::HyperplaneTable<D>&, const SolidMesh&, const RunOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
