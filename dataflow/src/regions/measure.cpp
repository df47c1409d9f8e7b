#include "bsp2/dataflow/regions/measure.hpp"

#include "bsp2/dataflow/regions/partition.hpp"
#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

template <int D>
Totals<D> measure(const model::Expression& solid, const EvaluateOptions& how, const CompileOptions& options) {
  CompileOptions whole = options;
  whole.parts = Parts::none;
  const Network<D> network = compile<D>(solid, whole);
  return evaluate(network, partition(network, 0).regions, how, {}).totals;
}

#define BSP2_INSTANTIATE(D) \
  template Totals<D> measure<D>(const model::Expression&, const EvaluateOptions&, const CompileOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
