#include "bsp2/api/evaluation/ranks.hpp"

#include <mutex>

#include "bsp2/supersteps/loop/run.hpp"
#include "evaluation/patience.hpp"

namespace bsp2 {

std::string version() { return BSP2_VERSION; }
std::string mpi_version() { return supersteps::Ranks::library(); }

Ranks::Implementation::Implementation(supersteps::Ranks made)
    : Implementation(std::move(made), [](const supersteps::RunOptions& options, supersteps::Ranks& all) {
        return supersteps::run(options, all);
      }) {}

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

void Ranks::together(const std::function<void()>& work, std::optional<double> timeout) const {
  guarded([&] {
    const Patience patience(implementation_->ranks, timeout);
    implementation_->ranks.together([&] {
      work();
      implementation_->ranks.sync();
    });
  });
}

}  // namespace bsp2
