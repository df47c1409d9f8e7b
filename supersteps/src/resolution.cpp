#include <algorithm>
#include <future>
#include <utility>

#include "bsp2/geometry/contact.hpp"
#include "bsp2/geometry/dimensions.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {
namespace {

/// What was found on some of the hyperplanes.
struct Share {
  std::vector<geometry::Contact> contacts;
  geometry::Skin skin;
};

/// Every `step`-th hyperplane from the `first` one.
Share match(const geometry::HyperplaneTable<3>& table, const geometry::FacetIndex& index, std::size_t first, std::size_t step, const RunOptions& options) {
  Share share;
  geometry::FacetMatcher matcher(table);
  geometry::FacetSet facets;
  for (std::size_t i = first; i < index.size(); i += step) {
    facets.clear(index.hyperplane(i));
    index.append(i, facets);
    matcher.match(facets, options.contacts ? &share.contacts : nullptr, options.boundary ? &share.skin : nullptr);
  }
  return share;
}

/// Hyperplanes know nothing of each other: they are dealt out to threads.
Share match_all(const geometry::HyperplaneTable<3>& table, const SolidMesh& mesh, const RunOptions& options, unsigned threads) {
  const geometry::FacetIndex index(table, mesh.batches);
  std::vector<std::future<Share>> others;
  for (unsigned i = 1; i < threads; ++i)
    others.push_back(std::async(std::launch::async, [&, i] { return match(table, index, i, threads, options); }));
  Share all = match(table, index, 0, threads, options);
  for (auto& other : others) {
    const Share share = other.get();
    all.contacts.insert(all.contacts.end(), share.contacts.begin(), share.contacts.end());
    all.skin.append(share.skin);
  }
  std::sort(all.contacts.begin(), all.contacts.end(), [](const auto& a, const auto& b) { return a.cell < b.cell; });
  return all;
}

}  // namespace

template <int D>
Resolution resolution(const geometry::HyperplaneTable<D>& table, const SolidMesh& mesh, const RunOptions& options, unsigned threads) {
  Resolution result;
  if constexpr (D == 3) {
    Share all = match_all(table, mesh, options, threads);
    result.contacts = std::move(all.contacts);
    if (options.boundary) result.boundary = geometry::triangulate(table, std::move(all.skin));
  }
  return result;
}

#define BSP2_STAGE(D) \
  template Resolution resolution<D>(const geometry::HyperplaneTable<D>&, const SolidMesh&, const RunOptions&, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
