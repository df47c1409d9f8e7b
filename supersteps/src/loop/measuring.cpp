#include "loop/measuring.hpp"

#include <string>
#include <unordered_set>

#include "bsp2/dataflow/regions/measure.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "state/evaluate_options.hpp"

namespace bsp2::supersteps {

template <int D>
Measures measures_of(const dataflow::Totals<D>& totals) {
  using Moments = geometry::Moments<D>;
  const Moments in = totals.in.value(), fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
  Measures measures;
  measures.in_volume = in.volume();
  measures.fuzzy_volume = fuzzy.volume();
  for (int i = 1; i <= D && in.volume() > 0; ++i)
    measures.centroid.push_back(in.integral[Moments::index(0, i)] / in.volume());
  for (int i = 0; i <= D; ++i) {
    std::vector<double> row, least, most;
    for (int j = 0; j <= D; ++j) {
      const int at = Moments::index(i, j);
      row.push_back(in.integral[at]);
      least.push_back(in.integral[at] + below.integral[at]);
      most.push_back(in.integral[at] + fuzzy.integral[at] - below.integral[at]);
    }
    measures.inertia.push_back(std::move(row));
    if (totals.fuzzy_cells == 0) continue;
    measures.inertia_least.push_back(std::move(least));
    measures.inertia_most.push_back(std::move(most));
  }
  return measures;
}

namespace {

/// The measured sub-expressions, each once, in the order of the source.
std::vector<const model::Named*> measured_in(const model::Expression& model) {
  std::vector<const model::Named*> found;
  std::unordered_set<const model::Node*> seen;
  std::vector<const model::Node*> stack{&model.node()};
  while (!stack.empty()) {
    const model::Node* node = stack.back();
    stack.pop_back();
    if (!seen.insert(node).second) continue;
    if (const auto* named = std::get_if<model::Named>(&node->value);
        named != nullptr && named->role == model::Named::Role::measure)
      found.push_back(named);
    const auto children = node->children();
    for (std::size_t i = children.size(); i-- > 0;) stack.push_back(&children[i].node());
  }
  return found;
}

}  // namespace

std::vector<NamedMeasures> measuring(const model::Expression& model, const RunOptions& options,
                                     const RunReport& report) {
  dataflow::EvaluateOptions how = limits_of(options, report.threads);
  how.tolerance = report.tolerance;  // the one that was chosen where none was given
  std::vector<NamedMeasures> all;
  for (const model::Named* named : measured_in(model)) {
    NamedMeasures measures;
    measures.name = named->name;
    measures.dimension = named->child.dimension();
    geometry::in_dimension(measures.dimension, [&](auto dimension) {
      static_cast<Measures&>(measures) = measures_of(
          dataflow::measure<dimension()>(named->child, how, {.coincidence = options.coincidence}));
    });
    all.push_back(std::move(measures));
  }
  return all;
}

#define BSP2_INSTANTIATE(D) template Measures measures_of<D>(const dataflow::Totals<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::supersteps
