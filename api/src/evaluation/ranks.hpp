#pragma once

#include <functional>
#include <memory>
#include <new>
#include <utility>

#include "bsp2/bsp2.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2 {

class Ranks::Implementation {
 public:
  explicit Implementation(supersteps::Ranks made) : ranks(std::move(made)) {}
  supersteps::Ranks ranks;
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
