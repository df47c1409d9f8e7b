#include "evaluation/ranks.hpp"

#include <mutex>

namespace bsp2 {

std::string version() { return BSP2_VERSION; }

Ranks::Ranks() : Ranks(std::make_shared<Implementation>(supersteps::Ranks())) {}
Ranks::Ranks(std::shared_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Ranks Ranks::launched() {
  static std::mutex mutex;
  static std::shared_ptr<Implementation> known;  // MPI starts once, and once it has ended it stays so
  const std::lock_guard lock(mutex);
  if (!known) known = guarded([] { return std::make_shared<Implementation>(supersteps::Ranks::launched()); });
  return Ranks(known);
}

int Ranks::rank() const { return implementation_->ranks.rank(); }
int Ranks::count() const { return implementation_->ranks.count(); }

}  // namespace bsp2
