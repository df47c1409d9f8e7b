#include "evaluation/ranks.hpp"

#include <mutex>

namespace bsp2 {

std::string version() { return BSP2_VERSION; }

Ranks::Ranks() : Ranks(std::make_shared<Implementation>(supersteps::Ranks())) {}
Ranks::Ranks(std::shared_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Ranks Ranks::launched() {
  static std::mutex mutex;
  static std::weak_ptr<Implementation> known;  // MPI starts once
  const std::lock_guard lock(mutex);
  auto made = known.lock();
  if (!made)
    known = made = guarded([] { return std::make_shared<Implementation>(supersteps::Ranks::launched()); });
  return Ranks(std::move(made));
}

int Ranks::rank() const { return implementation_->ranks.rank(); }
int Ranks::count() const { return implementation_->ranks.count(); }

}  // namespace bsp2
