// What a worker does with tokens: takes one, fires it, splits its cell. What becomes of the halves is in
// joins.cpp.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

#include "bsp2/geometry/support/dimensions.hpp"
#include "evaluate/evaluation_context.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::Label;

template <int D>
Worker<D>::Worker(EvaluationContext<D>& context, std::uint32_t index_)
    : totals(context.network.table.radius(), context.network.table.width()),
      index(index_),
      context_(context),
      splitter_(context.network.table),
      clipper_(splitter_),
      localizer_(context.network, splitter_),
      writer_(context.network.table) {
  totals.reset_bounds();
  localizer_.set_tolerance(context.options.tolerance.value_or(0));
  localizer_.set_tolerance_shares(context.options.tolerance_shares.get());
  if (context.options.angle) localizer_.set_view(context.options.eye, *context.options.angle);
}

template <int D>
void Worker<D>::run() {
  try {
    work();
    flush();
  } catch (...) {
    context_.fail();
  }
  totals.counts = splitter_.counts();
  if (context_.running.fetch_sub(1) == 1) context_.queue.nudge();
}

template <int D>
void Worker<D>::work() {
  unsigned idle = 0;
  while (context_.open_regions.load(std::memory_order_acquire) != 0 &&
         !context_.abort.load(std::memory_order_relaxed)) {
    Token<D>* token = next();
    if (token == nullptr) {
      if (++idle < 64)
        std::this_thread::yield();
      else
        std::this_thread::sleep_for(std::chrono::microseconds(50));
      continue;
    }
    idle = 0;
    while (token != nullptr && !context_.abort.load(std::memory_order_relaxed)) token = process(token);
  }
}

template <int D>
void Worker<D>::add(Token<D>* token) {
  if (context_.options.order == Order::depth) return deque.push(token);
  const CellExtent<D> extent(token->cell);
  const double radius = extent.radius(token->cell);
  double key = radius;
  if (!context_.options.eye.empty()) {
    double square = 0;
    for (std::size_t i = 0; i < D; ++i)
      square += (extent.centre[i] - context_.options.eye[i]) * (extent.centre[i] - context_.options.eye[i]);
    key /= std::max(std::sqrt(square), radius);
  }
  const std::lock_guard lock(context_.heap_mutex);
  context_.heap.push_back({key, token});
  std::push_heap(context_.heap.begin(), context_.heap.end());
}

template <int D>
Token<D>* Worker<D>::next() {
  if (context_.options.order == Order::priority) {
    const std::lock_guard lock(context_.heap_mutex);
    if (context_.heap.empty()) return nullptr;
    std::pop_heap(context_.heap.begin(), context_.heap.end());
    Token<D>* token = context_.heap.back().token;
    context_.heap.pop_back();
    return token;
  }
  if (Token<D>* own = deque.pop()) return own;
  for (std::size_t i = 1; i < context_.workers.size(); ++i)
    if (Token<D>* stolen = context_.workers[(index + i) % context_.workers.size()]->deque.steal())
      return stolen;
  return nullptr;
}

/// Fires one token. @return a token to go on with, or null.
template <int D>
Token<D>* Worker<D>::process(Token<D>* token) {
  Outcome<D> outcome;
  outcome.level = token->level;
  const bool stop = context_.stop.load(std::memory_order_relaxed);
  if (token->restored != Token<D>::not_restored) {
    if (context_.options.suspend && (stop || has_ended(*token))) return suspend(token);
    if (context_.frontiers[token->region].node(token->restored).kind != Frontier::Kind::token)
      return unfold_by_the_clock(token);
    const auto program = context_.frontiers[token->region].program(token->restored);
    token->program.assign(program);
    token->restored = Token<D>::not_restored;
  }
  const bool deep = context_.options.level && token->level >= *context_.options.level;
  // What is not cut again is looked at closely, also in a picture, unless it may be taken up again later.
  const bool final = deep && !context_.options.suspend;
  bool left = stop && !final;
  if (!left) {
    typename Localizer<D>::Cut cut;
    Answer answer = localizer_.fire(token->program, token->cell, program_, cut);
    if (final && cut.box_test_only) answer = localizer_.decide(token->program, token->cell, program_);
    if (!context_.fired.load(std::memory_order_relaxed)) context_.fired = true;
    left = answer.label == Label::fuzzy;
    if (left && !deep && !cut.none) {
      token->program.swap(program_);
      return may_clip(*token, cut) ? clip(token, cut) : split(token, cut);
    }
    outcome.label = answer.label;
    outcome.owner = answer.owner;
    if (!stays(answer.label)) count_growth(-1);
  }
  if (left && context_.options.suspend) {
    token->ended = !stop;
    return suspend(token);
  }
  if (left) end_undecided(*token, outcome);
  outcome.cell = std::move(token->cell);
  if (left && outcome.label == Label::in)
    outcome.tree = emit_once(outcome, token->region);  // like a FUZZY cell, it is never given back
  return complete(token, std::move(outcome));
}

/// A cell that is not cut again is FUZZY, unless no more than what it belongs to is undecided about it.
template <int D>
void Worker<D>::end_undecided(const Token<D>& token, Outcome<D>& outcome) {
  Answer answer{Label::fuzzy};
  if (context_.network.is_divided()) answer = localizer_.decide(token.program, token.cell, program_);
  if (context_.network.is_divided() && answer.label == Label::fuzzy) answer = Localizer<D>::known(program_);
  outcome.label = answer.label;
  outcome.owner = answer.owner;
}

/// Whether nothing is left to be done with a token, or below a node of a frontier, that is suspended.
template <int D>
bool Worker<D>::has_ended(const Token<D>& token) const {
  return token.restored == Token<D>::not_restored
             ? token.ended
             : context_.frontiers[token.region].has_ended(token.restored);
}

/// Leaves a token, or what is below a node of a frontier, to another evaluation. @return null.
template <int D>
Token<D>* Worker<D>::suspend(Token<D>* token) {
  if (has_ended(*token)) count_decided(token->level);  // there is nothing to be done
  Outcome<D> outcome;
  outcome.level = token->level;
  outcome.kind = OutcomeKind::suspended_token;
  outcome.divided = token->restored != Token<D>::not_restored &&
                    context_.frontiers[token->region].has_emitted(token->restored);
  outcome.token = token;
  deliver(token->parent, token->side, token->region, std::move(outcome));
  return nullptr;
}

/// The end of a token. @return null.
template <int D>
Token<D>* Worker<D>::complete(Token<D>* token, Outcome<D>&& outcome) {
  count_decided(token->level);
  deliver(token->parent, token->side, token->region, std::move(outcome));
  tokens_.give(token);
  return nullptr;
}

/// A join in the place of a token.
template <int D>
Join<D>* Worker<D>::join_of(const Token<D>& token, geometry::HyperplaneId hyperplane) {
  if (token.level == std::numeric_limits<std::uint16_t>::max())
    throw std::length_error("the BSP tree is more than 65535 levels deep");
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
void Worker<D>::cut(const Cell<D>& cell, geometry::HyperplaneId hyperplane, std::array<bool, 2> built,
                    std::array<Cell<D>, 2>& halves) {
  if (splitter_.classify(cell, hyperplane) != geometry::Position::crossing)
    throw std::logic_error("a cut misses its cell");
  splitter_.split(cell, hyperplane, built[0] ? &halves[0] : nullptr, built[1] ? &halves[1] : nullptr);
}

/// A half that the cut tells to be OUT is so, and is not asked about again: in a narrower cell a round solid
/// has other tangents, and may not know any more what the one that it was cut along has told.
template <int D>
Token<D>* Worker<D>::split(Token<D>* token, const typename Localizer<D>::Cut& plane) {
  const std::array<bool, 2> is_out{plane.negative_is_out, plane.positive_is_out};
  const bool need_out = context_.options.keep_out;
  const std::array<bool, 2> built{need_out || !is_out[0], need_out || !is_out[1]};
  count_growth(built[0] + built[1] - 1);
  Join<D>* join = join_of(*token, plane.hyperplane);
  std::array<Cell<D>, 2> halves;
  cut(token->cell, plane.hyperplane, built, halves);
  join->cell = std::move(token->cell);
  const std::uint32_t region = token->region;
  const auto level = static_cast<std::uint16_t>(token->level + 1);

  if (!is_out[0] && !is_out[1]) {
    Token<D>* other = tokens_.take();
    other->program = token->program;
    other->cell = std::move(halves[1]);
    other->parent = join;
    other->region = region;
    other->level = level;
    other->side = 1;
    add(other);
  }
  const std::uint8_t mine = is_out[0] ? 1 : 0;
  const bool is_left = !is_out[mine];
  if (is_left) {
    token->cell = std::move(halves[mine]);
    token->parent = join;
    token->level = level;
    token->side = mine;
  } else {
    tokens_.give(token);
  }
  for (std::uint8_t side = 0; side < 2; ++side) {
    if (!is_out[side]) continue;
    Outcome<D> outside;
    outside.level = level;
    outside.cell = std::move(halves[side]);
    count_decided(level);
    deliver(join, side, region, std::move(outside));
  }
  if (!is_left || context_.options.order == Order::depth) return is_left ? token : nullptr;
  add(token);
  return nullptr;
}

/// Whether all cuts along the last operand may be made at once.
template <int D>
bool Worker<D>::may_clip(const Token<D>& token, const typename Localizer<D>::Cut& cut) const {
  const std::size_t deepest = token.level + cut.last_planes.size();
  return !cut.last_planes.empty() &&
         deepest <= context_.options.level.value_or(std::numeric_limits<std::uint16_t>::max());
}

/// Cuts along the last operand until all is decided. The cells are those that `split` would find one by one.
template <int D>
Token<D>* Worker<D>::clip(Token<D>* token, const typename Localizer<D>::Cut& cut) {
  clipper_.load(token->cell);
  Outcome<D> outcome;
  outcome.level = token->level;
  if (cut_along(cut.last_planes, stays(cut.beyond.label))) {
    outcome.kind = OutcomeKind::subtree;
    const std::size_t cells =
        (stays(cut.behind.label) ? 1 : 0) + (stays(cut.beyond.label) ? pieces_.size() : 0);
    count_growth(static_cast<std::int64_t>(cells) - 1);
    outcome.tree = emit_pieces(*token, cut);
    count_decided(token->level);
    deliver(token->parent, token->side, token->region, std::move(outcome));
    token->cell = {};
    tokens_.give(token);
    return nullptr;
  }
  if (!stays(cut.beyond.label)) count_growth(-1);
  outcome.label = cut.beyond.label;  // nothing is inside: no cut was needed
  outcome.owner = cut.beyond.owner;
  outcome.cell = std::move(token->cell);
  return complete(token, std::move(outcome));
}

/// Clips the cell by the half-spaces, the one first that leaves most of it outside. @return whether anything
/// is left.
template <int D>
bool Worker<D>::cut_along(std::span<const geometry::OrientedHyperplane> planes, bool keep_rest) {
  pieces_.clear();
  left_.assign(context_.network.table, planes);
  auto centre = clipper_.centre();
  while (left_.size() > 0) {
    const std::size_t chosen = left_.furthest(centre);
    left_.remove(chosen);
    Cell<D> rest;
    const auto where = clipper_.cut(planes[chosen], keep_rest ? &rest : nullptr);
    if (where == geometry::Position::positive) return false;
    if (where != geometry::Position::crossing) continue;
    pieces_.push_back({planes[chosen], std::move(rest)});
    if (left_.size() > 0) centre = clipper_.centre();
  }
  return true;
}

/// Emits what a chain of cuts made. @return the code of its subtree.
template <int D>
std::int64_t Worker<D>::emit_pieces(const Token<D>& token, const typename Localizer<D>::Cut& cut) {
  Outcome<D> outcome;
  outcome.label = cut.behind.label;
  outcome.owner = cut.behind.owner;
  outcome.level = static_cast<std::uint16_t>(token.level + pieces_.size());
  if (stays(outcome.label)) outcome.cell = clipper_.cell();
  std::int64_t tree = emit_once(outcome, token.region);
  outcome.kind = OutcomeKind::cell;
  outcome.label = cut.beyond.label;
  outcome.owner = cut.beyond.owner;
  for (std::size_t i = pieces_.size(); i-- > 0;) {
    outcome.level = static_cast<std::uint16_t>(token.level + i + 1);
    outcome.cell = std::move(pieces_[i].cell);
    const std::int64_t beyond = emit(outcome, token.region);
    if (!context_.options.record_tree) continue;
    const bool flipped = pieces_[i].plane.flipped();
    nodes.push_back({pieces_[i].plane.id(), {flipped ? beyond : tree, flipped ? tree : beyond}});
    tree = context_.codes.node(index, nodes.size() - 1);
  }
  return tree;
}

#define BSP2_INSTANTIATE(D)                                                                 \
  template Worker<D>::Worker(EvaluationContext<D>&, std::uint32_t);                         \
  template void Worker<D>::run();                                                           \
  template void Worker<D>::add(Token<D>*);                                                  \
  template Token<D>* Worker<D>::suspend(Token<D>*);                                         \
  template Token<D>* Worker<D>::complete(Token<D>*, Outcome<D>&&);                          \
  template Join<D>* Worker<D>::join_of(const Token<D>&, geometry::HyperplaneId);            \
  template void Worker<D>::cut(const Cell<D>&, geometry::HyperplaneId, std::array<bool, 2>, \
                               std::array<Cell<D>, 2>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
