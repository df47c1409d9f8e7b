#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include "bsp2/dataflow/consumer.hpp"
#include "bsp2/supersteps/ranks.hpp"

namespace bsp2::supersteps {

/// Keeps the ranks in touch while their workers compute: several times a second all tell how far they are. So a failure of
/// one rank is known to the others soon, and the master shows the progress of all.
///
/// A sync begins here and is completed some calls later; nobody waits for it before its own work is done.
class Contact : public dataflow::Consumer {
 public:
  using Report = std::function<void(double done, std::uint64_t cells)>;

  /// @param share of space that this rank computes, as `progress` counts it.
  /// @param report told the progress of all ranks, on the master.
  Contact(Ranks& ranks, double share, Report report) : ranks_(ranks), share_(share), report_(std::move(report)) {}

  void consume(const std::shared_ptr<const dataflow::Refinement>&) override {}
  void progress(double done, std::uint64_t cells) override;
  /// The work of this rank is done; waits until that of all is. Collective.
  void finish();

 private:
  struct Status {
    double done = 0;  ///< share of space
    std::uint64_t cells = 0;
    bool finished = false;
  };

  Ranks& ranks_;
  double share_;
  Report report_;
  Status mine_;
  bool all_finished_ = false;

  void tell();
  void listen();
};

}  // namespace bsp2::supersteps
