// What a worker does with outcomes: the halves of a split come together in its join, whole cells are given
// back, decided ones are counted and go to the consumers, and frontiers become joins and tokens again.
#include <algorithm>
#include <chrono>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"
#include "evaluate/common_owner.hpp"
#include "evaluate/evaluation_context.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::CellBatch;
using geometry::Label;

namespace {

constexpr std::size_t cells_per_batch = 512;

/// At most the integrals over the cell of min(x_i x_j, 0), from its box.
template <int D>
geometry::Moments<D> below_zero(const Cell<D>& cell, const geometry::Moments<D>& moments) {
  const CellExtent<D> extent(cell);
  const auto bounds = [&](int i) {
    return i == 0 ? std::array{1.0, 1.0} : std::array{extent.lower[i - 1], extent.upper[i - 1]};
  };
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

}  // namespace

template <int D>
bool Worker<D>::needs_cell(const Token<D>& restored) const {
  const UnfoldedFrontier& frontier = context_.frontiers[restored.region];
  if (context_.options.suspend && frontier.has_ended(restored.restored)) return false;
  const Frontier::Node& node = frontier.node(restored.restored);
  if (node.kind == Frontier::Kind::emitted || node.kind == Frontier::Kind::elsewhere) return false;
  return node.kind != Frontier::Kind::held || stays(node.label);
}

/// Takes one node of a frontier up again: a split becomes a join and its halves, what is decided goes where
/// it would have gone. @return a token to go on with, or null.
template <int D>
Token<D>* Worker<D>::unfold(Token<D>* token) {
  const UnfoldedFrontier& frontier = context_.frontiers[token->region];
  const Frontier::Node& node = frontier.node(token->restored);
  if (node.kind != Frontier::Kind::split) {
    Outcome<D> outcome;
    outcome.level = token->level;
    if (node.kind == Frontier::Kind::elsewhere && context_.options.suspend) return suspend(token);
    if (node.kind == Frontier::Kind::held) {
      outcome.label = node.label;
      outcome.owner = node.value;
      outcome.cell = std::move(token->cell);
    } else {
      outcome.kind = OutcomeKind::subtree;
      if (node.kind == Frontier::Kind::emitted && node.value != geometry::BspTree::empty_leaf)
        outcome.tree =
            node.value < 0
                ? context_.codes.cell(context_.codes.earlier(), static_cast<std::uint32_t>(~node.value) - 1)
                : context_.codes.node(context_.codes.earlier(), static_cast<std::uint32_t>(node.value));
    }
    token->restored = Token<D>::not_restored;
    return complete(token, std::move(outcome));
  }
  const auto hyperplane = static_cast<geometry::HyperplaneId>(node.value);
  const std::array<std::uint32_t, 2> children{frontier.negative(token->restored),
                                              frontier.positive(token->restored)};
  Join<D>* join = join_of(*token, hyperplane);
  Token<D>* other = tokens_.take();
  other->parent = token->parent = join;
  other->region = token->region;
  other->restored = children[1];
  token->restored = children[0];
  other->level = token->level = static_cast<std::uint16_t>(token->level + 1);
  other->side = 1;
  token->side = 0;
  const std::array<bool, 2> needed{needs_cell(*token), needs_cell(*other)};
  std::array<Cell<D>, 2> halves;
  cut(token->cell, hyperplane, needed, halves);
  join->cell = std::move(token->cell);
  token->cell = std::move(halves[0]);
  other->cell = std::move(halves[1]);
  // What needs no cell is done at once: no order can be told of it.
  if (!needed[1])
    process(other);
  else
    add(other);
  if (!needed[0]) return process(token);
  if (context_.options.order == Order::depth) return token;
  add(token);
  return nullptr;
}

/// Unfolds a token; what making the cells again takes is no part of a budget.
template <int D>
Token<D>* Worker<D>::unfold_by_the_clock(Token<D>* token) {
  if (!context_.options.budget_seconds) return unfold(token);
  const std::int64_t before = unfolding.load(std::memory_order_relaxed);  // of this worker alone
  const auto start = std::chrono::steady_clock::now();
  Token<D>* next = unfold(token);
  const auto taken =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start).count();
  unfolding.store(before + taken,
                  std::memory_order_relaxed);  // with that of the halves that were unfolded within
  return next;
}

/// Hands an outcome to the split it came from; whoever brings the second half goes on with the whole.
template <int D>
void Worker<D>::deliver(Join<D>* parent, std::uint8_t side, std::uint32_t region, Outcome<D>&& outcome) {
  while (parent != nullptr) {
    parent->outcomes[side] = std::move(outcome);
    if (parent->pending.fetch_sub(1, std::memory_order_acq_rel) == 2) return;
    Join<D>* const join = parent;
    outcome = combine(*join);
    side = join->side;
    parent = join->parent;
    if (outcome.kind == OutcomeKind::suspended_join) continue;
    for (Outcome<D>& done : join->outcomes) done = {};
    join->cell = {};
    joins_.give(join);
  }
  context_.is_left[region] = outcome.is_suspended() || is_held(outcome);
  if (context_.is_left[region])
    context_.suspended[region] = std::move(outcome);
  else
    context_.region_codes[region] = emit_once(outcome, region);
  context_.open_regions.fetch_sub(1, std::memory_order_acq_rel);
}

/// Two halves of one label are given back as one cell; others are emitted and become a node of the BSP tree.
template <int D>
Outcome<D> Worker<D>::combine(Join<D>& join) {
  auto& [a, b] = join.outcomes;
  if (a.is_suspended() || b.is_suspended()) return suspend(join);
  Outcome<D> whole;
  whole.level = join.level;
  if (a.kind == OutcomeKind::cell && b.kind == OutcomeKind::cell && a.label == b.label &&
      a.label != Label::fuzzy) {
    if (const auto owner = owner_of_both<D>(context_.network, localizer_, a.owner, b.owner,
                                            [&]() -> const Cell<D>& { return join.cell; })) {
      whole.label = a.label;
      whole.owner = *owner;
      whole.cell = std::move(join.cell);
      if (stays(whole.label)) count_growth(-1);
      return whole;
    }
  }
  const std::int64_t negative = emit_once(a, join.region), positive = emit_once(b, join.region);
  whole.kind = OutcomeKind::subtree;
  if (context_.options.record_tree) {
    whole.tree = context_.codes.node(index, nodes.size());
    nodes.push_back({join.hyperplane, {negative, positive}});
  }
  return whole;
}

/// A split of which a half is suspended waits with it. The other half is held, unless it is certain already
/// that the cell will not be given back whole.
template <int D>
Outcome<D> Worker<D>::suspend(Join<D>& join) {
  Outcome<D> whole;
  whole.kind = OutcomeKind::suspended_join;
  whole.level = join.level;
  whole.join = &join;
  for (const Outcome<D>& half : join.outcomes)
    whole.divided = whole.divided || half.divided || half.kind == OutcomeKind::subtree;
  if (whole.divided)
    for (Outcome<D>& half : join.outcomes)
      if (half.kind == OutcomeKind::cell) half.tree = emit_once(half, join.region);
  if (join.parent != nullptr) join.cell = {};  // will be built again
  return whole;
}

/// Emits what is still a cell. @return the code of the cell or the subtree.
template <int D>
std::int64_t Worker<D>::emit_once(Outcome<D>& outcome, std::uint32_t region) {
  if (outcome.kind == OutcomeKind::subtree) return outcome.tree;
  const std::int64_t code = emit(outcome, region);
  outcome.kind = OutcomeKind::subtree;
  outcome.cell = {};
  return code;
}

/// Counts a decided cell and, if it is kept, sends it to the consumers. @return its code in the tree.
template <int D>
std::int64_t Worker<D>::emit(Outcome<D>& outcome, std::uint32_t region) {
  const EvaluateOptions& options = context_.options;
  const bool kept = outcome.label == Label::in      ? options.keep_in
                    : outcome.label == Label::fuzzy ? options.keep_fuzzy
                                                    : options.keep_out;
  if (outcome.label == Label::out && !kept) return 0;
  if (Container::is_one(outcome.owner)) outcome.owner = localizer_.owner_of(outcome.cell, found_);
  if (kept && context_.writes_cells) {
    write(outcome, region);
  } else {
    count(outcome, writer_.measure(outcome.cell));
    if (kept)
      totals.digest.add(outcome.cell, outcome.label, context_.network.primitive_of(outcome.owner),
                        part_of(outcome), outcome.level);
  }
  if (!kept) return 0;
  const std::uint64_t number = emitted++;
  decided_cells.store(emitted, std::memory_order_relaxed);
  return context_.codes.cell(index, number);
}

/// What is not IN is no part of the model.
template <int D>
std::int32_t Worker<D>::part_of(const Outcome<D>& outcome) const {
  return outcome.label == Label::in ? context_.network.part_of(outcome.owner) : geometry::no_part;
}

/// Counts a cell, and adds it to the batch at hand.
template <int D>
void Worker<D>::write(const Outcome<D>& outcome, std::uint32_t region) {
  if (batch_ == nullptr) {
    batch_ = std::make_shared<Refinement>();
    batch_->worker = index;
    batch_->first = emitted;
  }
  CellBatch& cells = batch_->cells;
  count(outcome, writer_.append(outcome.cell, cells));
  cells.label.push_back(outcome.label);
  cells.primitive.push_back(context_.network.primitive_of(outcome.owner));
  cells.part.push_back(part_of(outcome));
  cells.region.push_back(context_.region_numbers[region]);
  cells.level.push_back(outcome.level);
  totals.digest.add(cells, cells.size() - 1);
  if (cells.size() >= cells_per_batch) flush();
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
    if (const std::int32_t part = part_of(outcome); part >= 0 && context_.network.is_divided())
      totals.of_part(static_cast<std::size_t>(part)).add(moments);
    const auto range = geometry::vertex_range(outcome.cell);
    for (int i = 0; i < D; ++i) {
      totals.lower[i] = std::min(totals.lower[i], range.lower[i]);
      totals.upper[i] = std::max(totals.upper[i], range.upper[i]);
    }
  }
}

template <int D>
void Worker<D>::flush() {
  if (batch_ != nullptr && !batch_->cells.empty()) {
    batch_->cells.shrink_to_fit();
    context_.queue.push(std::move(batch_));
  }
  batch_ = nullptr;
}

template <int D>
void Worker<D>::count_decided(std::uint16_t level) {
  if (level < 60) decided.fetch_add((std::uint64_t{1} << 60) >> level, std::memory_order_relaxed);
}

/// There are so many cells more now, decided or not. Once there are enough, all stop.
template <int D>
void Worker<D>::count_growth(std::int64_t cells) {
  if (!context_.options.cells || cells == 0) return;
  const std::int64_t grown = context_.grown.fetch_add(cells, std::memory_order_relaxed) + cells;
  if (cells > 0 && grown >= 0 && static_cast<std::uint64_t>(grown) >= *context_.options.cells)
    context_.stop = true;
}

#define BSP2_INSTANTIATE(D)                                                              \
  template Token<D>* Worker<D>::unfold(Token<D>*);                                       \
  template Token<D>* Worker<D>::unfold_by_the_clock(Token<D>*);                          \
  template void Worker<D>::deliver(Join<D>*, std::uint8_t, std::uint32_t, Outcome<D>&&); \
  template std::int64_t Worker<D>::emit_once(Outcome<D>&, std::uint32_t);                \
  template std::int64_t Worker<D>::emit(Outcome<D>&, std::uint32_t);                     \
  template void Worker<D>::flush();                                                      \
  template void Worker<D>::count_decided(std::uint16_t);                                 \
  template void Worker<D>::count_growth(std::int64_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
