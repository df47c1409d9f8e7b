#include "bsp2/geometry/dimensions.hpp"
#include "bsp2/geometry/error.hpp"
#include "bsp2/io/snapshot.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

Source compilation(const Ranks& ranks, const RunOptions& options) {
  Source source;
  if (!ranks.is_master()) return source;
  source.text = options.resume ? io::read_snapshot(*options.resume, io::SnapshotPart::head).head.source : model::read_text(options.model);
  source.model = model::parse_csg(source.text, options.model.string(), {.curved = options.curved});
  return source;
}

template <int D>
dataflow::Network<D> translation(const Source& source, const RunOptions& options) {
  try {
    return dataflow::compile<D>(source.model.expression, {.coincidence = options.coincidence});
  } catch (const Error& error) {
    throw Error(options.model.string() + ": " + error.what());
  }
}

#define BSP2_STAGE(D) template dataflow::Network<D> translation<D>(const Source&, const RunOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
