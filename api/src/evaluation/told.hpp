#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "bsp2/evaluation.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2 {

/// Tells somebody, on the master, how far the work is, as long as this lives; who listened to supersteps
/// before still does.
class Told {
 public:
  Told(supersteps::Ranks& ranks, const std::function<void(const Progress&)>& tell)
      : ranks_(ranks), before_(ranks.on_superstep), tell_(ranks.is_master() ? tell : nullptr) {
    if (!tell_) return;
    ranks.on_superstep = [this](const std::string& name, unsigned step) {
      begin(name, phase_of(ranks_.phase()));
      if (before_) before_(name, step);
    };
  }
  ~Told() { ranks_.on_superstep = before_; }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;

  /// A superstep, or a file that is written.
  void begin(const std::string& what, Phase phase = Phase::completion) {
    if (!tell_) return;
    now_.superstep = what;
    now_.phase = phase;
    now_.done = 0;
    ++now_.begun;
    tell_(now_);
  }
  void show(double done, std::uint64_t cells) {
    if (!tell_) return;
    now_.done = done;
    if (cells > 0) now_.cells = cells;
    tell_(now_);
  }

 private:
  static Phase phase_of(supersteps::Phase phase) {
    switch (phase) {
      case supersteps::Phase::preparation:
        return Phase::preparation;
      case supersteps::Phase::computation:
        return Phase::computation;
      case supersteps::Phase::completion:
        return Phase::completion;
    }
    return Phase::completion;
  }

  supersteps::Ranks& ranks_;
  std::function<void(const std::string&, unsigned)> before_;
  std::function<void(const Progress&)> tell_;
  Progress now_;
};

}  // namespace bsp2
