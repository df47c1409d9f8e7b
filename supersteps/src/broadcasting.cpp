#include "exchange.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

void broadcasting(Ranks& ranks, Source& source, const RunOptions& options) {
  broadcast(ranks, source.text);
  broadcast(ranks, source.warnings);
  if (!ranks.is_master()) source.model = model::parse_csg(source.text, source_name(options), {.curved = options.curved});
}

}  // namespace bsp2::supersteps
