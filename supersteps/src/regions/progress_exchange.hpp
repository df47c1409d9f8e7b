#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bsp2/dataflow/process/consumer.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "regions/cell_stream.hpp"

namespace bsp2::supersteps {

/// Keeps the ranks in touch while their workers compute: several times a second all tell how far they are. So
/// a failure of one rank is known to the others soon, the master shows the progress of all, and cells go to
/// where they are wanted.
///
/// A sync begins here and is completed some calls later; nobody waits for it before its own work is done.
class ProgressExchange : public dataflow::Consumer {
 public:
  using Report = std::function<void(double done, std::uint64_t cells)>;

  struct Limits {
    std::optional<double> move_after_seconds;  ///< then a rank without work may end the step; none: never
    std::optional<std::uint64_t> cells;        ///< by which those of all ranks together may grow
  };

  /// @param share of space that this rank computes, as `progress` counts it.
  /// @param recorded cells that this rank has from earlier steps.
  /// @param report told the progress of all ranks, on the master. @param stream whose cells travel along; may
  /// be null.
  ProgressExchange(Ranks& ranks, double share, std::uint64_t recorded, const Limits& limits, Report report,
                   CellStream* stream)
      : ranks_(ranks),
        share_(share),
        recorded_(recorded),
        limits_(limits),
        report_(std::move(report)),
        stream_(stream) {}

  void consume(const std::shared_ptr<const dataflow::Refinement>&) override {}
  [[nodiscard]] bool takes_cells() const override { return false; }
  void progress(double done, std::uint64_t cells, std::int64_t grown) override;
  /// The work of this rank is done; waits until that of all is. Collective.
  void finish();
  /// The others shall end their work, too. Heard by them soon.
  void end_all() { mine_.ends_all = true; }
  /// The ranks have agreed to end the step before its time: one has nothing left to do, there are cells
  /// enough, or one ends all.
  [[nodiscard]] bool is_over() const { return is_over_; }
  /// Because one has nothing left to do; the same on all ranks once they have finished.
  [[nodiscard]] bool shall_move() const { return shall_move_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Status {
    double seconds = 0;           ///< since the step began
    double gained = 0, left = 0;  ///< share of space that was decided since, and that is undecided
    double done = 0;              ///< likewise, in all
    std::uint64_t cells = 0;      ///< that are decided
    std::int64_t grown = 0;       ///< cells that are more than at the beginning, decided or not
    bool finished = false;
    bool ends_all = false;
    bool passed_on = false;  ///< cells come with this that have still some way to go
    bool full = false;       ///< the stream, on the master
  };

  Ranks& ranks_;
  double share_;
  std::uint64_t recorded_;
  Limits limits_;
  Report report_;
  CellStream* stream_;
  Clock::time_point start_ = Clock::now();
  std::optional<double> done_at_first_;
  Status mine_;
  bool all_done_ = false, is_over_ = false, shall_move_ = false;

  void tell();
  void listen();
  /// What the ranks say of themselves; the other messages are the stream's.
  [[nodiscard]] std::vector<Status> take_messages();
};

}  // namespace bsp2::supersteps
