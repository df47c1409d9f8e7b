#pragma once

// The workers of one evaluation, and what they share. Private to evaluate.cpp, worker.cpp, joins.cpp and
// assembling.cpp.

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/cells/clipper.hpp"
#include "bsp2/geometry/cells/halfspace_columns.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "evaluate/bounded_queue.hpp"
#include "evaluate/tokens.hpp"
#include "evaluate/work_deque.hpp"

namespace bsp2::dataflow {

/// What the workers of one evaluation share.
template <int D>
class EvaluationContext;

/// What one thread of the evaluation does, with everything that is its own.
template <int D>
class Worker {
 public:
  Worker(EvaluationContext<D>& context, std::uint32_t index);
  /// On a thread of its own, with a large stack. Throws nothing: the evaluation knows of failures.
  void run();
  void add(Token<D>* token);

  WorkDeque<Token<D>> deque;
  Totals<D> totals;
  std::deque<RecordedNode> nodes;  // grows without copying
  std::uint64_t emitted = 0;
  std::atomic<std::uint64_t> decided{0};        // share of the space, in units of 2^-60
  std::atomic<std::uint64_t> decided_cells{0};  // for progress
  std::atomic<std::int64_t> unfolding{0};       // nanoseconds, where there is a budget
  std::uint32_t index;

 private:
  EvaluationContext<D>& context_;
  /// A cut of a chain: its hyperplane, and what is beyond it.
  struct Piece {
    geometry::OrientedHyperplane plane;
    geometry::Cell<D> cell;
  };

  geometry::Splitter<D> splitter_;
  geometry::Clipper<D> clipper_;
  Localizer<D> localizer_;
  geometry::CellWriter<D> writer_;
  Pool<Token<D>> tokens_;
  Pool<Join<D>> joins_;
  std::shared_ptr<Refinement> batch_;
  Words program_;
  Words found_;  // of a cell that is looked at once more
  std::vector<Piece> pieces_;
  geometry::HalfspaceColumns<D> left_;  // of a chain

  void work();
  Token<D>* next();
  Token<D>* process(Token<D>* token);
  Token<D>* split(Token<D>* token, const typename Localizer<D>::Cut& cut);
  [[nodiscard]] bool may_clip(const Token<D>& token, const typename Localizer<D>::Cut& cut) const;
  Token<D>* clip(Token<D>* token, const typename Localizer<D>::Cut& cut);
  bool cut_along(std::span<const geometry::OrientedHyperplane> planes, bool keep_rest);
  std::int64_t emit_pieces(const Token<D>& token, const typename Localizer<D>::Cut& cut);
  void end_undecided(const Token<D>& token, Outcome<D>& outcome);
  Token<D>* unfold(Token<D>* token);
  Token<D>* unfold_by_the_clock(Token<D>* token);
  Token<D>* suspend(Token<D>* token);
  [[nodiscard]] bool has_ended(const Token<D>& token) const;
  Token<D>* complete(Token<D>* token, Outcome<D>&& outcome);
  Join<D>* join_of(const Token<D>& token, geometry::HyperplaneId hyperplane);
  void cut(const geometry::Cell<D>& cell, geometry::HyperplaneId hyperplane, std::array<bool, 2> built,
           std::array<geometry::Cell<D>, 2>& halves);
  [[nodiscard]] bool needs_cell(const Token<D>& restored) const;
  void deliver(Join<D>* parent, std::uint8_t side, std::uint32_t region, Outcome<D>&& outcome);
  Outcome<D> combine(Join<D>& join);
  Outcome<D> suspend(Join<D>& join);
  std::int64_t emit_once(Outcome<D>& outcome, std::uint32_t region);
  std::int64_t emit(Outcome<D>& outcome, std::uint32_t region);
  void write(const Outcome<D>& outcome, std::uint32_t region);
  [[nodiscard]] std::int32_t part_of(const Outcome<D>& outcome) const;
  void count(const Outcome<D>& outcome, const geometry::Moments<D>& moments);
  void flush();
  void count_decided(std::uint16_t level);
  void count_growth(std::int64_t cells);
  /// Whether a region as a whole is one cell that may be given back with its sibling.
  [[nodiscard]] bool is_held(const Outcome<D>& region) const {
    return context_.options.hold_uniform_regions && region.level > 0 && region.kind == OutcomeKind::cell &&
           region.label != geometry::Label::fuzzy && stays(region.label);
  }
  /// Whether it is a cell of the mesh: what is OUT goes, unless somebody wants it.
  [[nodiscard]] bool stays(geometry::Label label) const {
    return label != geometry::Label::out || context_.options.keep_out;
  }
};

template <int D>
class EvaluationContext {
 public:
  EvaluationContext(const Network<D>& network_, const EvaluateOptions& options_, bool writes_cells_)
      : network(network_),
        options(options_),
        writes_cells(writes_cells_),
        codes(std::max(1u, options_.threads)) {
    for (std::uint32_t i = 0; i < std::max(1u, options.threads); ++i)
      workers.push_back(std::make_unique<Worker<D>>(*this, i));
  }

  const Network<D>& network;
  const EvaluateOptions& options;
  const bool writes_cells;  // to batches, for the consumers
  const TreeCodes codes;
  std::vector<std::unique_ptr<Worker<D>>> workers;
  BoundedQueue<std::shared_ptr<const Refinement>> queue{
      32};  // as many again may be on their way to the consumers
  Pool<Token<D>> first_tokens;
  std::atomic<std::size_t> open_regions{0};
  std::atomic<unsigned> running{0};
  std::atomic<std::int64_t> grown{
      0};  // by so many the cells, decided or not, have become more; counted where there is a limit
  std::atomic<bool> stop{false};  // leave the rest as it is
  std::atomic<bool> fired{
      false};  // something has been done: no step, however short, does nothing but unfold frontiers
  std::atomic<bool> abort{false};             // leave everything: an exception was thrown
  std::vector<std::int64_t> region_codes;     // by place among the regions at hand
  std::vector<std::uint32_t> region_numbers;  // likewise
  std::vector<Outcome<D>> suspended;          // likewise: what is suspended of it, or held
  std::vector<std::uint8_t> is_left;          // likewise: whether anything is
  std::vector<UnfoldedFrontier> frontiers;    // likewise: of a region that was begun before
  // Tokens in order of priority; unused when depth first.
  std::mutex heap_mutex;
  struct Priority {
    double key;
    Token<D>* token;
    bool operator<(const Priority& other) const { return key < other.key; }
  };
  std::vector<Priority> heap;

  void fail() {
    const std::lock_guard lock(failure_mutex_);
    if (!failure_) failure_ = std::current_exception();
    abort = true;
    queue.close();
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
};

}  // namespace bsp2::dataflow
