#include "bsp2/dataflow/evaluate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <exception>
#include <limits>
#include <mutex>
#include <queue>
#include <stdexcept>
#include <thread>
#include <unordered_map>

#include "bounded_queue.hpp"
#include "bsp2/dataflow/localizer.hpp"
#include "bsp2/geometry/clipper.hpp"
#include "bsp2/geometry/dimensions.hpp"
#include "large_stack.hpp"
#include "tokens.hpp"
#include "work_deque.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::CellBatch;
using geometry::Label;
using Clock = std::chrono::steady_clock;

template <int D>
void Totals<D>::reset_bounds() {
  lower.fill(std::numeric_limits<double>::infinity());
  upper.fill(-std::numeric_limits<double>::infinity());
}

template <int D>
Totals<D>& Totals<D>::operator+=(const Totals& other) {
  in += other.in;
  fuzzy += other.fuzzy;
  fuzzy_below += other.fuzzy_below;
  in_cells += other.in_cells;
  fuzzy_cells += other.fuzzy_cells;
  out_cells += other.out_cells;
  for (int i = 0; i < D; ++i) {
    lower[i] = std::min(lower[i], other.lower[i]);
    upper[i] = std::max(upper[i], other.upper[i]);
  }
  level = std::max(level, other.level);
  digest += other.digest;
  counts += other.counts;
  return *this;
}

namespace {

constexpr std::size_t cells_per_batch = 512;

/// What the workers of one evaluation share.
template <int D>
class Crew;

/// One pthread of the crew with everything that is its own.
template <int D>
class Worker {
 public:
  Worker(Crew<D>& crew, std::uint32_t index);
  void start();
  void join();
  void run();
  void add(Token<D>* token);

  WorkDeque<Token<D>> deque;
  Totals<D> totals;
  std::deque<RecordedNode> nodes;  // grows without copying
  std::uint64_t emitted = 0;
  std::atomic<std::uint64_t> decided{0};        // share of the space, in units of 2^-60
  std::atomic<std::uint64_t> decided_cells{0};  // for progress
  std::uint32_t index;

 private:
  Crew<D>& crew_;
  /// A cut of a chain: its hyperplane, and what is beyond it.
  struct Piece {
    geometry::OrientedHyperplane plane;
    Cell<D> cell;
  };

  geometry::Splitter<D> splitter_;
  geometry::Clipper<D> clipper_;
  Localizer<D> localizer_;
  geometry::CellWriter<D> writer_;
  Pool<Token<D>> tokens_;
  Pool<Join<D>> joins_;
  std::shared_ptr<Refinement> batch_;
  std::vector<Word> program_;
  std::vector<Piece> pieces_;
  std::vector<geometry::Hyperplane<D>> rounded_;  // of the planes of a chain that are left
  std::vector<geometry::OrientedHyperplane> left_;
  pthread_t thread_{};

  void work();
  Token<D>* next();
  Token<D>* process(Token<D>* token);
  Token<D>* split(Token<D>* token, const typename Localizer<D>::Cut& cut);
  [[nodiscard]] bool may_clip(const Token<D>& token, const typename Localizer<D>::Cut& cut) const;
  Token<D>* clip(Token<D>* token, const typename Localizer<D>::Cut& cut);
  bool cut_along(std::span<const geometry::OrientedHyperplane> planes, bool keep_rest);
  std::int64_t settle_pieces(const Token<D>& token, const typename Localizer<D>::Cut& cut);
  Token<D>* unfold(Token<D>* token);
  Token<D>* give(Token<D>* token, Outcome<D> outcome);
  Join<D>* join_of(const Token<D>& token, geometry::HyperplaneId hyperplane);
  void cut(const Cell<D>& cell, geometry::HyperplaneId hyperplane, std::array<bool, 2> built, std::array<Cell<D>, 2>& halves);
  [[nodiscard]] bool needs_cell(const Frontier::Node& node) const;
  void finish(Join<D>* parent, std::uint8_t side, std::uint32_t region, Outcome<D> outcome);
  Outcome<D> combine(Join<D>& join);
  Outcome<D> suspend(Join<D>& join);
  std::int64_t settle(Outcome<D>& outcome, std::uint32_t region);
  std::int64_t emit(Outcome<D>& outcome, std::uint32_t region);
  void count(const Outcome<D>& outcome, const geometry::Moments<D>& moments);
  void flush();
  void count_decided(std::uint16_t level);
};

template <int D>
class Crew {
 public:
  Crew(const Network<D>& network_, const EvaluateOptions& options_)
      : network(network_), options(options_), codes(std::max(1u, options_.threads)) {
    for (std::uint32_t i = 0; i < std::max(1u, options.threads); ++i) workers.push_back(std::make_unique<Worker<D>>(*this, i));
  }

  const Network<D>& network;
  const EvaluateOptions& options;
  const TreeCodes codes;
  std::vector<std::unique_ptr<Worker<D>>> workers;
  BoundedQueue<std::shared_ptr<const Refinement>> queue{64};
  Pool<Token<D>> first_tokens;
  std::atomic<std::size_t> open_regions{0};
  std::atomic<unsigned> running{0};
  std::atomic<std::uint64_t> emitted{0};  // counted where there is a limit
  std::atomic<bool> stop{false};   // leave the rest as it is
  std::atomic<bool> fired{false};  // something has been done: no step, however short, does nothing but unfold frontiers
  std::atomic<bool> abort{false};  // leave everything: an exception was thrown
  std::vector<std::int64_t> region_codes;     // by place among the regions at hand
  std::vector<std::uint32_t> region_numbers;  // likewise
  std::vector<Outcome<D>> suspended;          // likewise: what is suspended of it
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

template <int D>
Worker<D>::Worker(Crew<D>& crew, std::uint32_t index_)
    : totals(crew.network.table.radius(), crew.network.table.width()), index(index_), crew_(crew), splitter_(crew.network.table), clipper_(splitter_),
      localizer_(crew.network, splitter_), writer_(crew.network.table) {
  totals.reset_bounds();
  localizer_.set_tolerance(crew.options.tolerance.value_or(0));
}

template <int D>
void Worker<D>::start() {
  const auto body = [](void* self) -> void* {
    static_cast<Worker*>(self)->run();
    return nullptr;
  };
  thread_ = start_on_large_stack(body, this);
}

template <int D>
void Worker<D>::join() {
  pthread_join(thread_, nullptr);
}

template <int D>
void Worker<D>::run() {
  try {
    work();
    flush();
  } catch (...) {
    crew_.fail();
  }
  totals.counts = splitter_.counts();
  if (crew_.running.fetch_sub(1) == 1) crew_.queue.nudge();
}

template <int D>
void Worker<D>::work() {
  unsigned idle = 0;
  while (crew_.open_regions.load(std::memory_order_acquire) != 0 && !crew_.abort.load(std::memory_order_relaxed)) {
    Token<D>* token = next();
    if (token == nullptr) {
      if (++idle < 64)
        std::this_thread::yield();
      else
        std::this_thread::sleep_for(std::chrono::microseconds(50));
      continue;
    }
    idle = 0;
    while (token != nullptr && !crew_.abort.load(std::memory_order_relaxed)) token = process(token);
  }
}

template <int D>
void Worker<D>::add(Token<D>* token) {
  if (crew_.options.order == Order::depth) return deque.push(token);
  const CellExtent<D> extent(token->cell);
  double key = extent.radius;
  if (!crew_.options.eye.empty()) {
    double square = 0;
    for (std::size_t i = 0; i < D; ++i) square += (extent.centre[i] - crew_.options.eye[i]) * (extent.centre[i] - crew_.options.eye[i]);
    key /= std::max(std::sqrt(square), extent.radius);
  }
  const std::lock_guard lock(crew_.heap_mutex);
  crew_.heap.push_back({key, token});
  std::push_heap(crew_.heap.begin(), crew_.heap.end());
}

template <int D>
Token<D>* Worker<D>::next() {
  if (crew_.options.order == Order::priority) {
    const std::lock_guard lock(crew_.heap_mutex);
    if (crew_.heap.empty()) return nullptr;
    std::pop_heap(crew_.heap.begin(), crew_.heap.end());
    Token<D>* token = crew_.heap.back().token;
    crew_.heap.pop_back();
    return token;
  }
  if (Token<D>* own = deque.pop()) return own;
  for (std::size_t i = 1; i < crew_.workers.size(); ++i)
    if (Token<D>* stolen = crew_.workers[(index + i) % crew_.workers.size()]->deque.steal()) return stolen;
  return nullptr;
}

/// Fires one token. @return a token to go on with, or null.
template <int D>
Token<D>* Worker<D>::process(Token<D>* token) {
  Outcome<D> outcome;
  outcome.level = token->level;
  const bool stop = crew_.stop.load(std::memory_order_relaxed);
  if (token->restored != Token<D>::not_restored && !(stop && crew_.options.suspend)) {
    if (crew_.frontiers[token->region].node(token->restored).kind != Frontier::Kind::token) return unfold(token);
    const auto program = crew_.frontiers[token->region].program(token->restored);
    token->program.assign(program.begin(), program.end());
    token->restored = Token<D>::not_restored;
  }
  bool left = stop;
  if (!left) {
    typename Localizer<D>::Cut cut;
    const bool deep = crew_.options.level && token->level >= *crew_.options.level;
    // What is not cut again is looked at closely, unless it may be taken up again later.
    const bool final = deep && !crew_.options.suspend;
    const Answer answer = final ? localizer_.decide(token->program, token->cell, program_) : localizer_.fire(token->program, token->cell, program_, cut);
    if (!crew_.fired.load(std::memory_order_relaxed)) crew_.fired = true;
    left = answer.label == Label::fuzzy;
    if (left && !deep && !cut.none) {
      std::swap(token->program, program_);
      return may_clip(*token, cut) ? clip(token, cut) : split(token, cut);
    }
    outcome.label = answer.label;
    outcome.part = answer.part;
  }
  if (left && crew_.options.suspend) {
    outcome.form = Form::suspended_token;
    outcome.token = token;
    finish(token->parent, token->side, token->region, std::move(outcome));
    return nullptr;
  }
  if (left) outcome.label = Label::fuzzy;
  outcome.cell = std::move(token->cell);
  return give(token, std::move(outcome));
}

/// The end of a token. @return null.
template <int D>
Token<D>* Worker<D>::give(Token<D>* token, Outcome<D> outcome) {
  count_decided(token->level);
  finish(token->parent, token->side, token->region, std::move(outcome));
  tokens_.give(token);
  return nullptr;
}

/// A join in the place of a token.
template <int D>
Join<D>* Worker<D>::join_of(const Token<D>& token, geometry::HyperplaneId hyperplane) {
  if (token.level == std::numeric_limits<std::uint16_t>::max()) throw std::length_error("the BSP tree is more than 65535 levels deep");
  Join<D>* join = joins_.take();
  join->parent = token.parent;
  join->region = token.region;
  join->level = token.level;
  join->side = token.side;
  join->hyperplane = hyperplane;
  join->pending.store(2, std::memory_order_relaxed);
  return join;
}

template <int D>
void Worker<D>::cut(const Cell<D>& cell, geometry::HyperplaneId hyperplane, std::array<bool, 2> built, std::array<Cell<D>, 2>& halves) {
  if (splitter_.classify(cell, hyperplane) != geometry::Position::crossing) throw std::logic_error("a cut misses its cell");
  splitter_.split(cell, hyperplane, built[0] ? &halves[0] : nullptr, built[1] ? &halves[1] : nullptr);
}

template <int D>
Token<D>* Worker<D>::split(Token<D>* token, const typename Localizer<D>::Cut& plane) {
  const bool need_out = crew_.options.keep_out;
  std::array<bool, 2> built{need_out || !plane.negative_is_out, need_out || !plane.positive_is_out};
  Join<D>* join = join_of(*token, plane.hyperplane);
  std::array<Cell<D>, 2> halves;
  cut(token->cell, plane.hyperplane, built, halves);
  join->cell = std::move(token->cell);
  const auto level = static_cast<std::uint16_t>(token->level + 1);

  if (built[0] && built[1]) {
    Token<D>* other = tokens_.take();
    other->program = token->program;
    other->cell = std::move(halves[1]);
    other->parent = join;
    other->region = token->region;
    other->level = level;
    other->side = 1;
    add(other);
  } else {
    Outcome<D> outside;
    outside.level = level;
    count_decided(level);
    const std::uint8_t side = built[0] ? 1 : 0;
    finish(join, side, token->region, std::move(outside));
    if (!built[0] && !built[1]) {  // both halves are OUT
      tokens_.give(token);
      Outcome<D> second;
      second.level = level;
      count_decided(level);
      finish(join, static_cast<std::uint8_t>(1 - side), join->region, std::move(second));
      return nullptr;
    }
  }
  const std::uint8_t mine = built[0] ? 0 : 1;
  token->cell = std::move(halves[mine]);
  token->parent = join;
  token->level = level;
  token->side = mine;
  if (crew_.options.order == Order::depth) return token;
  add(token);
  return nullptr;
}

/// Whether all cuts along the last operand may be made at once.
template <int D>
bool Worker<D>::may_clip(const Token<D>& token, const typename Localizer<D>::Cut& cut) const {
  const std::size_t deepest = token.level + cut.last_planes.size();
  return !cut.last_planes.empty() && deepest <= crew_.options.level.value_or(std::numeric_limits<std::uint16_t>::max());
}

/// Cuts along the last operand until all is decided. The cells are those that `split` would find one by one.
template <int D>
Token<D>* Worker<D>::clip(Token<D>* token, const typename Localizer<D>::Cut& cut) {
  const auto is_built = [&](const Answer& answer) { return answer.label != Label::out || crew_.options.keep_out; };
  clipper_.load(token->cell);
  Outcome<D> outcome;
  outcome.level = token->level;
  if (cut_along(cut.last_planes, is_built(cut.beyond))) {
    outcome.form = Form::subtree;
    outcome.tree = settle_pieces(*token, cut);
    count_decided(token->level);
    finish(token->parent, token->side, token->region, std::move(outcome));
    token->cell = {};
    tokens_.give(token);
    return nullptr;
  }
  outcome.label = cut.beyond.label;  // nothing is inside: no cut was needed
  outcome.part = cut.beyond.part;
  outcome.cell = std::move(token->cell);
  return give(token, std::move(outcome));
}

/// Clips the cell by the half-spaces, the one first that leaves most of it outside. @return whether anything is left.
template <int D>
bool Worker<D>::cut_along(std::span<const geometry::OrientedHyperplane> planes, bool keep_rest) {
  pieces_.clear();
  left_.assign(planes.begin(), planes.end());
  rounded_.clear();
  for (const auto plane : planes) {
    auto h = crew_.network.table.rounded(plane.id());
    if (plane.flipped()) {
      for (double& x : h.normal) x = -x;
      h.offset = -h.offset;
    }
    rounded_.push_back(h);
  }
  bool moved = true;
  std::array<double, D> centre{};
  while (!left_.empty()) {
    if (moved) centre = clipper_.centre();
    std::size_t chosen = 0;
    double furthest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < left_.size(); ++i) {
      const double value = rounded_[i].at(centre);
      if (value > furthest) {
        furthest = value;
        chosen = i;
      }
    }
    Cell<D> rest;
    const auto where = clipper_.cut(left_[chosen], keep_rest ? &rest : nullptr);
    if (where == geometry::Position::positive) return false;
    moved = where == geometry::Position::crossing;
    if (moved) pieces_.push_back({left_[chosen], std::move(rest)});
    left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(chosen));  // the order stays: the first of equals is chosen
    rounded_.erase(rounded_.begin() + static_cast<std::ptrdiff_t>(chosen));
  }
  return true;
}

/// Emits what a chain of cuts made. @return the code of its subtree.
template <int D>
std::int64_t Worker<D>::settle_pieces(const Token<D>& token, const typename Localizer<D>::Cut& cut) {
  Outcome<D> outcome;
  outcome.label = cut.behind.label;
  outcome.part = cut.behind.part;
  outcome.level = static_cast<std::uint16_t>(token.level + pieces_.size());
  if (outcome.label != Label::out || crew_.options.keep_out) outcome.cell = clipper_.cell();
  std::int64_t tree = settle(outcome, token.region);
  outcome.form = Form::cell;
  outcome.label = cut.beyond.label;
  outcome.part = cut.beyond.part;
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    outcome.level = static_cast<std::uint16_t>(token.level + i + 1);
    outcome.cell = std::move(pieces_[i].cell);
    const std::int64_t beyond = emit(outcome, token.region);
    if (!crew_.options.record_tree) continue;
    const bool flipped = pieces_[i].plane.flipped();
    nodes.push_back({pieces_[i].plane.id(), {flipped ? beyond : tree, flipped ? tree : beyond}});
    tree = crew_.codes.node(index, nodes.size() - 1);
  }
  return tree;
}

template <int D>
bool Worker<D>::needs_cell(const Frontier::Node& node) const {
  if (node.kind == Frontier::Kind::emitted || node.kind == Frontier::Kind::elsewhere) return false;
  return node.kind != Frontier::Kind::held || node.label != Label::out || crew_.options.keep_out;
}

/// Takes one node of a frontier up again: a split becomes a join and its halves, what is decided goes where it would have
/// gone. @return a token to go on with, or null.
template <int D>
Token<D>* Worker<D>::unfold(Token<D>* token) {
  const UnfoldedFrontier& frontier = crew_.frontiers[token->region];
  const Frontier::Node& node = frontier.node(token->restored);
  if (node.kind != Frontier::Kind::split) {
    Outcome<D> outcome;
    outcome.level = token->level;
    if (node.kind == Frontier::Kind::elsewhere && crew_.options.suspend) {
      outcome.form = Form::suspended_token;
      outcome.divided = node.value != 0;
      outcome.token = token;
      finish(token->parent, token->side, token->region, std::move(outcome));
      return nullptr;
    }
    if (node.kind == Frontier::Kind::held) {
      outcome.label = node.label;
      outcome.part = node.value;
      outcome.cell = std::move(token->cell);
    } else {
      outcome.form = Form::subtree;
      if (node.kind == Frontier::Kind::emitted && node.value != geometry::BspTree::empty_leaf)
        outcome.tree = node.value < 0 ? crew_.codes.cell(crew_.codes.earlier(), static_cast<std::uint32_t>(~node.value) - 1)
                                      : crew_.codes.node(crew_.codes.earlier(), static_cast<std::uint32_t>(node.value));
    }
    token->restored = Token<D>::not_restored;
    return give(token, std::move(outcome));
  }
  const auto hyperplane = static_cast<geometry::HyperplaneId>(node.value);
  const std::array<std::uint32_t, 2> children{frontier.negative(token->restored), frontier.positive(token->restored)};
  Join<D>* join = join_of(*token, hyperplane);
  std::array<Cell<D>, 2> halves;
  cut(token->cell, hyperplane, {needs_cell(frontier.node(children[0])), needs_cell(frontier.node(children[1]))}, halves);
  join->cell = std::move(token->cell);
  Token<D>* other = tokens_.take();
  other->cell = std::move(halves[1]);
  other->parent = join;
  other->region = token->region;
  other->restored = children[1];
  other->level = static_cast<std::uint16_t>(token->level + 1);
  other->side = 1;
  token->cell = std::move(halves[0]);
  token->parent = join;
  token->restored = children[0];
  token->level = other->level;
  token->side = 0;
  // What needs no cell is done at once: no order can be told of it.
  if (!needs_cell(frontier.node(children[1])))
    unfold(other);
  else
    add(other);
  if (!needs_cell(frontier.node(children[0]))) return unfold(token);
  if (crew_.options.order == Order::depth) return token;
  add(token);
  return nullptr;
}

/// Hands an outcome to the split it came from; whoever brings the second half goes on with the whole.
template <int D>
void Worker<D>::finish(Join<D>* parent, std::uint8_t side, std::uint32_t region, Outcome<D> outcome) {
  while (parent != nullptr) {
    parent->outcomes[side] = std::move(outcome);
    if (parent->pending.fetch_sub(1, std::memory_order_acq_rel) == 2) return;
    Join<D>* const join = parent;
    outcome = combine(*join);
    side = join->side;
    parent = join->parent;
    if (outcome.form == Form::suspended_join) continue;
    for (Outcome<D>& done : join->outcomes) done = {};
    join->cell = {};
    joins_.give(join);
  }
  if (outcome.is_suspended())
    crew_.suspended[region] = std::move(outcome);
  else
    crew_.region_codes[region] = settle(outcome, region);
  crew_.open_regions.fetch_sub(1, std::memory_order_acq_rel);
}

/// Two halves of one label are given back as one cell; others are emitted and become a node of the BSP tree.
template <int D>
Outcome<D> Worker<D>::combine(Join<D>& join) {
  auto& [a, b] = join.outcomes;
  if (a.is_suspended() || b.is_suspended()) return suspend(join);
  Outcome<D> whole;
  whole.level = join.level;
  if (a.form == Form::cell && b.form == Form::cell && a.label == b.label && a.label != Label::fuzzy) {
    bool same = a.part == b.part;
    whole.part = a.part;
    if (!same) {  // a primitive that contains one half may contain both
      for (const std::int32_t part : {std::min(a.part, b.part), std::max(a.part, b.part)})
        if (!same && part >= 0 && localizer_.contains(crew_.network.producers[part], join.cell)) {
          same = true;
          whole.part = part;
        }
    }
    if (same) {
      whole.label = a.label;
      whole.cell = std::move(join.cell);
      return whole;
    }
  }
  const std::int64_t negative = settle(a, join.region), positive = settle(b, join.region);
  whole.form = Form::subtree;
  if (crew_.options.record_tree) {
    whole.tree = crew_.codes.node(index, nodes.size());
    nodes.push_back({join.hyperplane, {negative, positive}});
  }
  return whole;
}

/// A split of which a half is suspended waits with it. The other half is held, unless it is certain already that the cell
/// will not be given back whole.
template <int D>
Outcome<D> Worker<D>::suspend(Join<D>& join) {
  Outcome<D> whole;
  whole.form = Form::suspended_join;
  whole.level = join.level;
  whole.join = &join;
  for (const Outcome<D>& half : join.outcomes) whole.divided = whole.divided || half.divided || half.form == Form::subtree;
  if (whole.divided)
    for (Outcome<D>& half : join.outcomes)
      if (half.form == Form::cell) half.tree = settle(half, join.region);
  if (join.parent != nullptr) join.cell = {};  // will be built again
  return whole;
}

/// Emits what is still a cell. @return the code of the cell or the subtree.
template <int D>
std::int64_t Worker<D>::settle(Outcome<D>& outcome, std::uint32_t region) {
  if (outcome.form == Form::subtree) return outcome.tree;
  const std::int64_t code = emit(outcome, region);
  outcome.form = Form::subtree;
  outcome.cell = {};
  return code;
}

/// Counts a decided cell and, if it is kept, sends it to the consumers. @return its code in the tree.
template <int D>
std::int64_t Worker<D>::emit(Outcome<D>& outcome, std::uint32_t region) {
  const EvaluateOptions& options = crew_.options;
  const bool kept = outcome.label == Label::in ? options.keep_in : outcome.label == Label::fuzzy ? options.keep_fuzzy : options.keep_out;
  if (outcome.label == Label::out && !kept) return 0;
  if (!kept) {
    count(outcome, writer_.measure(outcome.cell));
    return 0;
  }
  if (batch_ == nullptr) {
    batch_ = std::make_shared<Refinement>();
    batch_->worker = index;
    batch_->first = emitted;
  }
  CellBatch& cells = batch_->cells;
  count(outcome, writer_.append(outcome.cell, cells));
  cells.label.push_back(outcome.label);
  cells.part.push_back(outcome.part >= 0 ? crew_.network.producers[outcome.part].part : outcome.part);
  cells.region.push_back(crew_.region_numbers[region]);
  cells.level.push_back(outcome.level);
  totals.digest.add(cells, cells.size() - 1);
  const std::uint64_t number = emitted++;
  decided_cells.store(emitted, std::memory_order_relaxed);
  if (options.cells && crew_.emitted.fetch_add(1, std::memory_order_relaxed) + 1 >= *options.cells) crew_.stop = true;
  if (cells.size() >= cells_per_batch) flush();
  return crew_.codes.cell(index, number);
}

/// At most the integrals over the cell of min(x_i x_j, 0), from its box.
template <int D>
geometry::Moments<D> below_zero(const Cell<D>& cell, const geometry::Moments<D>& moments) {
  const CellExtent<D> extent(cell);
  const auto bounds = [&](int i) { return i == 0 ? std::array{1.0, 1.0} : std::array{extent.lower[i - 1], extent.upper[i - 1]}; };
  geometry::Moments<D> below;
  for (int i = 0; i <= D; ++i)
    for (int j = i + 1; j <= D; ++j) {  // squares are not below 0
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const double x : bounds(i))
        for (const double y : bounds(j)) {
          least = std::min(least, x * y);
          most = std::max(most, x * y);
        }
      const int at = geometry::Moments<D>::index(i, j);
      if (least < 0) below.integral[at] = most <= 0 ? moments.integral[at] : least * moments.volume();
    }
  return below;
}

template <int D>
void Worker<D>::count(const Outcome<D>& outcome, const geometry::Moments<D>& moments) {
  totals.level = std::max<unsigned>(totals.level, outcome.level);
  if (outcome.label == Label::fuzzy) {
    ++totals.fuzzy_cells;
    totals.fuzzy.add(moments);
    totals.fuzzy_below.add(below_zero(outcome.cell, moments));
  } else if (outcome.label == Label::out) {
    ++totals.out_cells;
  } else {
    ++totals.in_cells;
    totals.in.add(moments);
    for (const auto& vertex : outcome.cell.vertices())
      for (int i = 0; i < D; ++i) {
        totals.lower[i] = std::min(totals.lower[i], vertex.x[i]);
        totals.upper[i] = std::max(totals.upper[i], vertex.x[i]);
      }
  }
}

template <int D>
void Worker<D>::flush() {
  if (batch_ != nullptr && !batch_->cells.empty()) {
    batch_->cells.shrink_to_fit();
    crew_.queue.push(std::move(batch_));
  }
  batch_ = nullptr;
}

template <int D>
void Worker<D>::count_decided(std::uint16_t level) {
  if (level < 60) decided.fetch_add((std::uint64_t{1} << 60) >> level, std::memory_order_relaxed);
}

/// The thread that called `evaluate`: serves the consumers and watches the budget.
template <int D>
void serve(Crew<D>& crew, std::span<Consumer* const> consumers) {
  const auto start = Clock::now();
  auto last_progress = start;
  for (;;) {
    const bool all_done = crew.running.load() == 0;  // before the look into the queue: nothing comes after it
    auto item = crew.queue.pop(std::chrono::milliseconds(all_done ? 0 : 20));
    if (item)
      for (Consumer* consumer : consumers) consumer->consume(*item);
    else if (all_done)
      return;
    const auto now = Clock::now();
    std::uint64_t cells = 0;
    double decided = 0;
    for (const auto& worker : crew.workers) {
      cells += worker->decided_cells.load(std::memory_order_relaxed);
      decided += std::ldexp(static_cast<double>(worker->decided.load(std::memory_order_relaxed)), -60);
    }
    if (crew.options.budget_seconds && crew.fired && std::chrono::duration<double>(now - start).count() > *crew.options.budget_seconds) crew.stop = true;
    if (crew.options.interrupted && crew.options.interrupted()) crew.stop = true;
    if (now - last_progress > std::chrono::milliseconds(100)) {
      last_progress = now;
      for (Consumer* consumer : consumers) consumer->progress(std::min(1.0, decided), cells);
    }
  }
}

/// Codes of the workers' cells and nodes as children of one BSP tree.
template <int D>
class TreeNumbering {
 public:
  explicit TreeNumbering(const Crew<D>& crew) : codes_(crew.codes), first_node_{crew.options.recorded_nodes}, first_cell_{crew.options.recorded_cells} {
    for (const auto& worker : crew.workers) {
      first_node_.push_back(first_node_.back() + worker->nodes.size());
      first_cell_.push_back(first_cell_.back() + worker->emitted);
    }
    constexpr std::uint64_t limit = std::numeric_limits<std::int32_t>::max();
    if (crew.options.record_tree && (first_node_.back() > limit || first_cell_.back() >= limit))
      throw std::length_error("the BSP tree has more than 2^31 nodes or cells");
  }
  [[nodiscard]] std::int32_t child(std::int64_t code) const {
    if (code == 0) return geometry::BspTree::empty_leaf;
    const std::uint32_t worker = codes_.worker(code);
    const bool is_earlier = worker == codes_.earlier();
    if (code < 0) return static_cast<std::int32_t>((is_earlier ? 0 : first_node_[worker]) + codes_.index(code));
    return ~static_cast<std::int32_t>((is_earlier ? 0 : first_cell_[worker]) + codes_.index(code) + 1);
  }

 private:
  const TreeCodes& codes_;
  std::vector<std::uint64_t> first_node_, first_cell_;  // of each worker
};

/// The workers' nodes as one tree per region.
template <int D>
void assemble_tree(Crew<D>& crew, const TreeNumbering<D>& numbering, Evaluation<D>& result) {
  geometry::BspTree& tree = result.tree;
  tree.dimension = D;
  std::size_t count = 0;
  for (const auto& worker : crew.workers) {
    count += worker->nodes.size();
    result.cells_of_worker.push_back(worker->emitted);
  }
  std::unordered_map<geometry::HyperplaneId, std::uint32_t> used;
  tree.nodes.reserve(count);
  for (const auto& worker : crew.workers) {
    for (const auto& [id, children] : worker->nodes) {
      const auto [entry, is_new] = used.try_emplace(id, static_cast<std::uint32_t>(used.size()));
      if (is_new) {
        const auto h = crew.network.table.rounded(id);
        tree.ids.push_back(id);
        tree.hyperplanes.push_back(h.offset);
        tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
      }
      tree.nodes.push_back({entry->second, numbering.child(children[0]), numbering.child(children[1])});
    }
    worker->nodes = {};
  }
  for (const std::int64_t code : crew.region_codes) result.region_roots.push_back(numbering.child(code));
}

/// What is suspended under an outcome, in flat arrays.
template <int D>
Frontier frontier_of(const Crew<D>& crew, const TreeNumbering<D>& numbering, const Outcome<D>& root) {
  Frontier frontier;
  std::vector<const Outcome<D>*> left{&root};
  while (!left.empty()) {
    const Outcome<D>& outcome = *left.back();
    left.pop_back();
    switch (outcome.form) {
      case Form::cell: frontier.nodes.push_back({Frontier::Kind::held, outcome.label, 0, outcome.part}); break;
      case Form::subtree: frontier.nodes.push_back({Frontier::Kind::emitted, Label::out, 0, numbering.child(outcome.tree)}); break;
      case Form::suspended_token: {
        const Token<D>& token = *outcome.token;
        if (token.restored != Token<D>::not_restored) {
          crew.frontiers[token.region].copy(token.restored, frontier);
        } else {
          frontier.nodes.push_back({Frontier::Kind::token, Label::fuzzy, 0, static_cast<std::int32_t>(token.program.size())});
          frontier.programs.insert(frontier.programs.end(), token.program.begin(), token.program.end());
        }
        break;
      }
      case Form::suspended_join:
        frontier.nodes.push_back({Frontier::Kind::split, Label::fuzzy, 0, static_cast<std::int32_t>(outcome.join->hyperplane)});
        left.push_back(&outcome.join->outcomes[1]);
        left.push_back(&outcome.join->outcomes[0]);
    }
  }
  return frontier;
}

/// The regions in which something is left.
template <int D>
void collect_unfinished(Crew<D>& crew, const TreeNumbering<D>& numbering, Evaluation<D>& result) {
  for (std::size_t i = 0; i < crew.suspended.size(); ++i) {
    Outcome<D>& root = crew.suspended[i];
    if (!root.is_suspended()) continue;
    Region<D> region;
    region.number = crew.region_numbers[i];
    region.level = root.level;
    region.frontier = frontier_of(crew, numbering, root);
    region.cell = std::move(root.form == Form::suspended_token ? root.token->cell : root.join->cell);
    result.unfinished.push_back(std::move(region));
  }
}

/// The first tokens, one a region, dealt out to the workers.
template <int D>
void deal(Crew<D>& crew, std::vector<Region<D>> regions) {
  crew.region_codes.assign(regions.size(), 0);
  crew.suspended.resize(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    Region<D>& region = regions[i];
    Token<D>* token = crew.first_tokens.take();
    token->cell = std::move(region.cell);
    token->program = std::move(region.program);
    token->region = static_cast<std::uint32_t>(i);
    token->level = region.level;
    if (!region.frontier.empty()) token->restored = 0;
    crew.region_numbers.push_back(region.number);
    crew.frontiers.emplace_back(std::move(region.frontier));
    crew.workers[i % crew.workers.size()]->add(token);
  }
  crew.open_regions = regions.size();
}

template <int D>
Evaluation<D> run_crew(const Network<D>& network, std::vector<Region<D>> regions, const EvaluateOptions& options,
                       std::span<Consumer* const> consumers, bool refine) {
  Crew<D> crew(network, options);
  crew.stop = !refine;
  deal(crew, std::move(regions));
  crew.running = static_cast<unsigned>(crew.workers.size());
  std::size_t started = 0;
  try {
    for (; started < crew.workers.size(); ++started) crew.workers[started]->start();
    serve(crew, consumers);
  } catch (...) {
    crew.fail();
  }
  for (std::size_t i = 0; i < started; ++i) crew.workers[i]->join();
  crew.rethrow();

  Evaluation<D> result{Totals<D>(network.table.radius(), network.table.width()), {}, {}, {}, {}, crew.stop};
  result.totals.reset_bounds();
  for (const auto& worker : crew.workers) result.totals += worker->totals;
  const TreeNumbering<D> numbering(crew);
  assemble_tree(crew, numbering, result);
  collect_unfinished(crew, numbering, result);
  return result;
}

}  // namespace

template <int D>
Evaluation<D> evaluate(const Network<D>& network, std::vector<Region<D>> regions, const EvaluateOptions& options,
                       std::span<Consumer* const> consumers) {
  return run_crew(network, std::move(regions), options, consumers, true);
}

template <int D>
Evaluation<D> picture(const Network<D>& network, std::span<const Region<D>> regions, EvaluateOptions options,
                      std::span<Consumer* const> consumers) {
  std::vector<Region<D>> copies;
  for (const Region<D>& region : regions) copies.push_back({region.number, region.level, region.cell.copy(), region.program, region.frontier});
  options.suspend = false;
  return run_crew(network, std::move(copies), options, consumers, false);
}

#define BSP2_INSTANTIATE(D)                                                                                            \
  template struct Totals<D>;                                                                                           \
  template Evaluation<D> evaluate<D>(const Network<D>&, std::vector<Region<D>>, const EvaluateOptions&, std::span<Consumer* const>); \
  template Evaluation<D> picture<D>(const Network<D>&, std::span<const Region<D>>, EvaluateOptions, std::span<Consumer* const>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
