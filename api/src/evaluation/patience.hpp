#pragma once

#include <optional>

#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2 {

/// How long ranks wait for each other, as long as this lives.
class Patience {
 public:
  Patience(supersteps::Ranks& ranks, const std::optional<double>& seconds)
      : ranks_(ranks), before_(ranks.timeout()) {
    if (seconds) ranks.set_timeout(*seconds);
  }
  ~Patience() { ranks_.set_timeout(before_); }
  Patience(const Patience&) = delete;
  Patience& operator=(const Patience&) = delete;

 private:
  supersteps::Ranks& ranks_;
  double before_;
};

}  // namespace bsp2
