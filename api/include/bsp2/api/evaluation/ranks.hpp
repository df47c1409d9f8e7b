#pragma once

#include <functional>
#include <memory>
#include <new>
#include <utility>

#include "bsp2/bsp2.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2 {

class Ranks::Implementation {
 public:
  using Engine = std::function<supersteps::RunResult(const supersteps::RunOptions&, supersteps::Ranks&)>;

  explicit Implementation(supersteps::Ranks made);
  /// @param evaluates instead of the loop of supersteps: tests can do without one.
  Implementation(supersteps::Ranks made, Engine evaluates)
      : ranks(std::move(made)), engine(std::move(evaluates)) {}
  supersteps::Ranks ranks;
  Engine engine;
};

/// Does something of the rooms: whatever is thrown leaves as bsp2::Error, or std::bad_alloc.
template <typename Work>
auto guarded(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) {
    const supersteps::Cause cause = supersteps::cause_of_exception();
    throw Error(cause.text, cause.is_users);
  }
}

}  // namespace bsp2
