#include "loop/querying.hpp"

#include <algorithm>
#include <array>

#include "bsp2/geometry/cells/point_query.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::supersteps {

template <int D>
std::vector<Answer> querying(const geometry::HyperplaneTable<D>& table, const RunResult& result,
                             std::span<const double> points, unsigned threads) {
  std::vector<geometry::Label> labels;
  std::vector<std::int32_t> primitives, parts;
  for (const auto& batch : result.mesh.batches) {
    labels.insert(labels.end(), batch->label.begin(), batch->label.end());
    primitives.insert(primitives.end(), batch->primitive.begin(), batch->primitive.end());
    parts.insert(parts.end(), batch->part.begin(), batch->part.end());
  }
  const geometry::PointQuery<D> query(table, result.tree, std::move(labels));
  std::vector<Answer> answers(points.size() / D);
  constexpr std::size_t grain = 64;
  geometry::for_each_range(answers.size(), grain, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      std::array<double, D> point;
      std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(i * D), D, point.begin());
      const auto found = query.ask(point);
      Answer& answer = answers[i] = {.label = found.label,
                                     .distance = found.distance,
                                     .nearest = {found.nearest.begin(), found.nearest.end()}};
      if (found.leaf == 0) continue;
      answer.primitive = primitives[static_cast<std::size_t>(found.leaf) - 1];
      answer.part = parts[static_cast<std::size_t>(found.leaf) - 1];
    }
  });
  return answers;
}

#define BSP2_STAGE(D)                                                                             \
  template std::vector<Answer> querying<D>(const geometry::HyperplaneTable<D>&, const RunResult&, \
                                           std::span<const double>, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
