#include <utility>

#include "bsp2/bsp2.hpp"
#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2 {

class Stoppable::Implementation : public geometry::Interruption {
  using Interruption::Interruption;
};

Stoppable::Stoppable(std::function<bool()> stop)
    : implementation_(std::make_unique<Implementation>(std::move(stop))) {}
Stoppable::~Stoppable() = default;

}  // namespace bsp2
