#include "bsp2/geometry/error.hpp"
#include "instantiate.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

template <int D>
dataflow::Network<D> compilation(const model::Model& model, const RunOptions& options) {
  try {
    return dataflow::compile<D>(model.expression, {.coincidence = options.coincidence});
  } catch (const Error& error) {
    throw Error(options.model.string() + ": " + error.what());
  }
}

#define BSP2_STAGE(D) template dataflow::Network<D> compilation<D>(const model::Model&, const RunOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
