#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {

void broadcasting(Ranks& ranks, Source& source) {
  broadcast(ranks, source.text);
  broadcast(ranks, source.warnings);
}

}  // namespace bsp2::supersteps
