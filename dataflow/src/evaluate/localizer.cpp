#include "bsp2/dataflow/evaluate/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"
#include "process/combiner.hpp"
#include "process/transformer.hpp"
#include "producers/convex_producer.hpp"
#include "producers/lathe_producer.hpp"
#include "producers/mesh_producer.hpp"
#include "producers/preimage_producer.hpp"
#include "producers/round_producer.hpp"
#include "producers/spline_producer.hpp"
#include "producers/torus_producer.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::HyperplaneId;
using geometry::Label;
using geometry::Position;

namespace {

/// Where more than so many operands are left, space is cut between them rather than along one of them, if
/// that takes so many undecided half-spaces and facets away from the larger half, as many for each operand.
/// Measured: it parts what would be one cell.
constexpr std::size_t few_operands = 4;
constexpr double least_relief = 80;
/// A curved solid counts as at least so many half-spaces: it is cut again and again.
constexpr std::uint32_t least_of_curved = 16;
/// Programs longer than this are first localized without looking at vertices: a cut between operands may come
/// before that.
constexpr std::size_t long_program = 256;
/// Programs up to this length are closed up where an operand has gone.
constexpr std::size_t longest_move = 4096;

/// The answer of a leaf whose producer says this about the cell.
Answer answer_of(const Word* leaf, Label label) {
  const bool has_owner = label == Label::in && (leaf[0] & Program::mute) == 0;
  const Answer answer{label, has_owner ? static_cast<std::int32_t>(leaf[2]) : no_owner};
  return (leaf[0] & Program::negated) != 0 ? Complement::map(answer) : answer;
}

/// The producers of leaves ascend.
const Word* first_leaf(const Word* program) {
  while ((program[0] & Program::kind_mask) != Program::kind_leaf) program += Program::header;
  return program;
}

Answer known_answer(const Word* leaf) { return {Label::in, static_cast<std::int32_t>(leaf[2])}; }

/// Whether a program has so many leaves that space might be cut between its operands.
bool has_many_leaves(std::span<const Word> program) {
  std::size_t leaves = 0;
  for (std::size_t at = 0; at < program.size() && leaves <= few_operands;) {
    const bool leaf = (program[at] & Program::kind_mask) == Program::kind_leaf;
    leaves += leaf ? 1 : 0;
    at += leaf ? program[at + 1] : Program::header;
  }
  return leaves > few_operands;
}

}  // namespace

// --- firing ---

template <int D>
Answer Localizer<D>::fire(std::span<const Word> program, const Cell<D>& cell, Words& out, Cut& cut) {
  view_.look_at(cell);
  const bool box_test_only = program.size() > long_program && has_many_leaves(program);
  Answer answer = localize(program, out, box_test_only);
  if (answer.label == Label::in && was_box_test_only_ && (network_->has_colours || network_->is_divided()))
    answer = localize(program, out, false);  // an earlier operand may have all of the cell
  if (answer.label != Label::fuzzy) return answer;
  bool thin = is_thin() && !reaches_beyond_surfaces(out);
  const bool between_first = box_test_only && !thin;
  if (between_first && choose_between_operands(out, cut)) {
    cut.box_test_only = was_box_test_only_;
    return answer;
  }
  const bool again = was_box_test_only_;
  if (again) {
    std::swap(out, second_pass_);
    answer = localize(second_pass_, out, false);
    if (answer.label != Label::fuzzy) return answer;
    thin = is_thin() && !reaches_beyond_surfaces(out);
  }
  const bool is_last = active_.size() == 1;
  if (thin) leave_round_operands(out);  // what is left to choose from; the expression still has them
  cut.none = active_.empty();
  if (cut.none || ((again || !between_first) && choose_between_operands(out, cut))) return answer;
  choose_operand(out, cut);
  if (is_last && !stays_undecided_) offer_clipping(out, cut);
  return answer;
}

template <int D>
void Localizer<D>::set_view(std::span<const double> eye, double angle) {
  if (eye.size() != D) throw std::logic_error("an eye needs as many coordinates as the model has dimensions");
  std::copy_n(eye.begin(), D, eye_.begin());
  angle_ = angle;
}

/// What counts as thin in the cell at hand: the tolerance, or what is seen so small from the nearest point of
/// the cell's box.
template <int D>
double Localizer<D>::thin() const {
  if constexpr (D == 3)
    if (tolerance_shares_ != nullptr) return tolerance_ * tolerance_shares_->at(view_.extent().centre);
  if (!(angle_ > 0)) return tolerance_;
  double square = 0;
  for (int axis = 0; axis < D; ++axis) {
    const double away =
        std::max({view_.extent().lower[axis] - eye_[axis], eye_[axis] - view_.extent().upper[axis], 0.0});
    square += away * away;
  }
  return std::max(tolerance_, angle_ * std::sqrt(square));
}

/// Whether the cell is thinner than that, measured across its facets.
template <int D>
bool Localizer<D>::is_thin() const {
  if (!network_->is_round()) return false;
  const double thin = this->thin();
  if (!(thin > 0)) return false;
  for (int axis = 0; axis < D; ++axis)
    if (view_.extent().length(axis) < thin) return true;
  return view_.thickness() < thin;
}

/// Whether a thin cell is so long that all surfaces of round solids may be far from some of it. It is cut
/// then as any other: so it comes to the same cells as with a finer tolerance.
template <int D>
bool Localizer<D>::reaches_beyond_surfaces(std::span<const Word> program) {
  constexpr double long_cell = 4;  // times as long as what is thin
  const double thin = this->thin();
  if (view_.extent().length(view_.extent().axes_by_length()[0]) <= long_cell * thin) return false;
  bool is_any_round = false;
  for (const ActiveLeaf& active : active_) {
    const Word* const leaf = program.data() + active.at;
    const Producer<D>& producer = network_->producers[leaf[2]];
    if (!dataflow::is_curved(producer.kind)) continue;
    is_any_round = true;
    if (producer.kind != ProducerKind::round ||
        !with_round(producer, [&](const auto& process) { return process.is_coarse(leaf, view_, thin); }))
      return false;
  }
  return is_any_round;
}

/// Leaves to choose from only what ends by itself, and splines that end within the cell.
template <int D>
void Localizer<D>::leave_round_operands(std::span<const Word> program) {
  const auto* const end = std::remove_if(active_.begin(), active_.end(), [&](const ActiveLeaf& active) {
    const Word* const leaf = program.data() + active.at;
    const Producer<D>& producer = network_->producers[leaf[2]];
    if (producer.kind == ProducerKind::spline)
      return !SplineProducer<D>(*network_, producer).end(leaf, view_);
    if (producer.kind == ProducerKind::round)
      return with_round(producer, [&](const auto& process) { return !process.has_planes(leaf); });
    return dataflow::is_curved(producer.kind);
  });
  active_.resize(static_cast<std::size_t>(end - active_.begin()));
}

template <int D>
Answer Localizer<D>::decide(std::span<const Word> program, const Cell<D>& cell, Words& out) {
  view_.look_at(cell);
  return localize(program, out, false);
}

template <int D>
std::int32_t Localizer<D>::owner_of(const Cell<D>& cell, Words& out) {
  if (operand_groups_.empty()) group_operands();
  if (operand_groups_.empty()) return decide(network_->program, cell, out).owner;
  view_.look_at(cell);
  view_.test_boxes_only(false);
  // The answer of an operand if it is IN; else only that it is not.
  const auto ask = [&](const auto& self, const Word*& at) -> Answer {
    const Word kind = at[0] & Program::kind_mask;
    if (kind == Program::kind_leaf || kind == Program::kind_differ) {
      out.clear();
      active_.clear();
      return visit(at, out);
    }
    const Word* const end = at + at[1];
    Combiner combiner(kind, at[2]);
    at += Program::header;
    while (at != end) {
      const Answer operand = self(self, at);
      const bool ends = kind == Program::kind_unite ? operand.label == Label::in : operand.label != Label::in;
      if (ends) {
        at = end;
        return operand;
      }
      combiner.fold(operand);
    }
    return combiner.answer();
  };
  for (const OperandGroup& group : operand_groups_) {
    if (view_.extent().misses(group)) continue;
    for (const Word* at = group.begin; at != group.end;)
      if (const Answer answer = ask(ask, at); answer.label == Label::in) return answer.owner;
  }
  return no_owner;
}

/// None if the network is no union, or has parts: then what comes first does not answer for the rest.
template <int D>
void Localizer<D>::group_operands() {
  const auto& program = network_->program;
  if (program.empty() || (program[0] & Program::kind_mask) != Program::kind_unite || network_->is_divided())
    return;
  constexpr std::size_t together = 8;
  const Word* const end = program.data() + program.size();
  std::size_t count = 0;
  for (const Word* at = program.data() + Program::header; at != end; ++count) {
    if (count % together == 0) operand_groups_.push_back({Box<D>::empty(), at, at});
    operand_groups_.back().unite(box_of(at));
    operand_groups_.back().end = at;
  }
}

/// A box that has all of a sub-program's solid.
template <int D>
Box<D> Localizer<D>::box_of(const Word*& at) const {
  const Word* const begin = at;
  const Word* const end = at + at[1];
  const Word kind = begin[0] & Program::kind_mask;
  if (kind == Program::kind_leaf) {
    at = end;
    return (begin[0] & Program::negated) != 0 ? Box<D>::everything()
                                              : static_cast<const Box<D>&>(network_->producers[begin[2]]);
  }
  Box<D> box = kind == Program::kind_intersect ? Box<D>::everything() : Box<D>::empty();
  at += Program::header;
  while (at != end) {
    const Box<D> operand = box_of(at);
    if (kind == Program::kind_intersect)
      box.intersect(operand);
    else
      box.unite(operand);
  }
  return box;
}

template <int D>
Answer Localizer<D>::localize(std::span<const Word> program, Words& out, bool box_test_only) {
  out.clear();
  active_.clear();
  stays_undecided_ = was_box_test_only_ = false;
  view_.test_boxes_only(box_test_only);
  if (program.empty()) return {Label::out};
  const Word* at = program.data();
  return visit(at, out);
}

template <int D>
Answer Localizer<D>::visit(const Word*& at, Words& out) {
  return (at[0] & Program::kind_mask) == Program::kind_leaf ? visit_leaf(at, out) : visit_combiner(at, out);
}

template <int D>
Answer Localizer<D>::visit_combiner(const Word*& at, Words& out) {
  const Word kind = at[0] & Program::kind_mask;
  const Word* const end = at + at[1];
  const std::size_t begin = out.size(), first_active = active_.size();
  Combiner combiner(kind, at[2]);
  out.push(kind, 0, 0);
  at += Program::header;
  bool covers = kind == Program::kind_intersect;
  while (at != end) {
    const Answer operand = visit(at, out);
    if (operand.label == Label::fuzzy) {
      covers = kind == Program::kind_intersect ? covers && covers_ : kind == Program::kind_unite && covers_;
      if (!covers || kind == Program::kind_intersect) continue;
      at = end;  // no point is left to what comes after it
      break;
    }
    if (!combiner.fold(operand)) continue;
    at = end;
    covers = kind == Program::kind_unite && network_->is_divided() &&
             keep_earlier(begin, first_active, operand, out);
    if (covers) break;
    out.resize(begin);
    active_.resize(first_active);
    covers_ = false;
    return operand;
  }
  covers_ = covers;
  const std::size_t length = out.size() - begin;
  const bool is_settled = covers && kind == Program::kind_intersect &&
                          is_owned(out.begin() + begin + Program::header, out.end(), combiner.memory());
  if (is_settled) active_.resize(first_active);
  if (length == Program::header || is_settled) {  // no operand is left
    out.resize(begin);
    return combiner.answer();
  }
  out[begin + 1] = static_cast<Word>(length);
  out[begin + 2] = combiner.memory();
  // A single operand needs no combiner. Long ones stay: closing up many of them, one in the other, would take
  // quadratic time.
  if (combiner.is_transparent() && length <= longest_move &&
      out[begin + Program::header + 1] == length - Program::header) {
    std::copy(out.begin() + begin + Program::header, out.end(), out.begin() + begin);
    out.resize(out.size() - Program::header);
    for (std::size_t i = first_active; i < active_.size(); ++i) active_[i].at -= Program::header;
  }
  return {Label::fuzzy};
}

template <int D>
Answer Localizer<D>::visit_leaf(const Word*& at, Words& out) {
  const Word* const leaf = at;
  at += leaf[1];
  covers_ = false;
  if ((leaf[0] & Program::known) != 0) return known_answer(leaf);
  const Producer<D>& producer = network_->producers[leaf[2]];
  Label label = Label::out;
  if (!view_.extent().misses(producer)) {
    const std::size_t begin = out.size();
    label = with_producer(leaf, [&](const auto& process) {
      const Label answer = process.ask(leaf, view_, out);
      if (answer == Label::fuzzy) {
        out[begin + 1] = static_cast<Word>(out.size() - begin);
        active_.push({static_cast<std::uint32_t>(begin),
                      static_cast<std::uint32_t>(process.undecided(out.data() + begin))});
      }
      return answer;
    });
    if (label == Label::fuzzy) {
      was_box_test_only_ |= view_.box_test_only() && listed_planes(leaf).empty();
      return {Label::fuzzy};
    }
    if (label == Label::in && producer.undecided) {  // no cut will tell more
      out.resize(begin);
      out.push(leaf[0] & ~Program::whole, Program::header, leaf[2]);
      stays_undecided_ = true;
      return {Label::fuzzy};
    }
    out.resize(begin);
  }
  return answer_of(leaf, label);
}

// --- what cells belong to where the model has several parts ---

/// A union is IN by its newest operand, but earlier ones are undecided: what is in them is theirs. Leaves out
/// those that change nothing.
/// @return whether any is left; then the program ends in the answer.
template <int D>
bool Localizer<D>::keep_earlier(std::size_t begin, std::size_t first_active, const Answer& last, Words& out) {
  std::vector<std::size_t> operands;
  for (std::size_t at = begin + Program::header; at < out.size(); at += out[at + 1]) operands.push_back(at);
  while (!operands.empty() && belongs_to(out.begin() + operands.back(), last)) {
    out.resize(operands.back());
    operands.pop_back();
  }
  while (active_.size() > first_active && active_[active_.size() - 1].at >= out.size())
    active_.resize(active_.size() - 1);
  if (operands.empty()) return false;
  out.push(Program::kind_leaf | Program::known, Program::header, static_cast<Word>(last.owner));
  return true;
}

/// Whether all that is in an operand belongs to what the cell belongs to without it.
template <int D>
bool Localizer<D>::belongs_to(const Word* operand, const Answer& last) const {
  const Owners owners = owners_of(operand);
  if (last.owner == no_owner) return !owners.any;
  return !owners.nobody && !owners.several && (!owners.any || owners.part == network_->part_of(last.owner));
}

template <int D>
void Localizer<D>::Owners::add(std::int32_t other) {
  several = several || (any && part != other);
  any = true;
  part = other;
}

template <int D>
void Localizer<D>::Owners::add(const Owners& others) {
  if (others.any) add(others.part);
  several = several || others.several;
  nobody = nobody || others.nobody;
}

/// What points of an undecided program may belong to, if they are in it; rather too much.
template <int D>
typename Localizer<D>::Owners Localizer<D>::owners_of(const Word*& at) const {
  const Word* const begin = at;
  const Word* const end = at + at[1];
  const Word kind = begin[0] & Program::kind_mask;
  Owners owners;
  if (kind == Program::kind_leaf) {
    at = end;
    const Answer answer = (begin[0] & Program::known) != 0
                              ? known_answer(begin)
                              : answer_of(begin, (begin[0] & Program::negated) != 0 ? Label::out : Label::in);
    if (answer.owner == no_owner)
      owners.nobody = true;
    else
      owners.add(network_->part_of(answer.owner));
    return owners;
  }
  at += Program::header;
  if (kind == Program::kind_intersect) {
    owners = owners_in_intersection(at, end, begin[2]);
  } else {
    const Word memory = kind == Program::kind_differ
                            ? begin[2]
                            : 0;  // of the operands that were folded: the lowest owner + 1, and the parity
    if (memory >> 1 != 0)
      owners.add(network_->part_of(static_cast<std::int32_t>(memory >> 1) - 1));
    else if (memory != 0)
      owners.nobody = true;
    while (at != end) owners.add(owners_of(at));
  }
  at = end;
  return owners;
}

/// Whether it is known whose an intersection is, of which no more than that is undecided: none of its
/// operands comes before the one that is remembered.
template <int D>
bool Localizer<D>::is_owned(const Word* at, const Word* end, Word memory) {
  if (memory == 0) return false;
  for (; at != end; at += at[1])
    if (first_leaf(at)[2] < memory) return false;
  return true;
}

/// Those of the operands up to the first one that leaves nothing to nobody. @param memory of the operands
/// that were folded: the lowest owner + 1.
template <int D>
typename Localizer<D>::Owners Localizer<D>::owners_in_intersection(const Word* at, const Word* end,
                                                                   Word memory) const {
  Owners owners;
  while (at != end) {
    if (memory != 0 && first_leaf(at)[2] >= memory) break;  // it comes after the one that is remembered
    const Owners operand = owners_of(at);
    owners.add({operand.part, operand.any, operand.several, false});
    if (!operand.nobody) return owners;
  }
  if (memory != 0)
    owners.add(network_->part_of(static_cast<std::int32_t>(memory) - 1));
  else
    owners.nobody = true;
  return owners;
}

template <int D>
Answer Localizer<D>::known(std::span<const Word> program) {
  if (program.empty()) return {Label::fuzzy};
  const Word* at = program.data();
  return known(at);
}

template <int D>
Answer Localizer<D>::known(const Word*& at) {
  const Word* const begin = at;
  const Word* const end = at + at[1];
  const Word kind = begin[0] & Program::kind_mask;
  if (kind == Program::kind_leaf) {
    at = end;
    return (begin[0] & Program::known) != 0 ? known_answer(begin) : Answer{Label::fuzzy};
  }
  Combiner combiner(kind, begin[2]);
  bool undecided = false;
  at += Program::header;
  while (at != end) {
    const Answer operand = known(at);
    if (operand.label == Label::fuzzy) {
      undecided = true;
    } else if (combiner.fold(operand)) {
      at = end;
      return operand;
    }
  }
  return undecided ? Answer{Label::fuzzy} : combiner.answer();
}

template <int D>
bool Localizer<D>::is_left(const Producer<D>& producer, const Cell<D>& cell) {
  if (producer.guard < 0) return true;
  view_.look_at(cell);
  view_.test_boxes_only(false);
  active_.clear();
  Words unused;
  for (std::int32_t i = producer.guard; i >= 0; i = network_->guards[static_cast<std::size_t>(i)].around) {
    const Word* const begin = network_->program.data() + network_->guards[static_cast<std::size_t>(i)].begin;
    const Word* const end = begin + begin[1];
    bool odd = false;
    for (const Word* at = begin + Program::header; at != end;) {
      const auto first = static_cast<std::size_t>(at - network_->program.data());
      if (producer.leaf >= first && producer.leaf < first + at[1]) {  // the operand itself
        at += at[1];
        continue;
      }
      unused.clear();
      active_.clear();
      const Label label = visit(at, unused).label;
      if (label == Label::fuzzy) return false;
      if (label == Label::out && (begin[0] & Program::kind_mask) == Program::kind_intersect) return false;
      odd ^= label == Label::in;
    }
    if (odd && (begin[0] & Program::kind_mask) == Program::kind_differ) return false;
  }
  return true;
}

/// Hands the process of a round solid to `use`.
template <int D>
template <typename Use>
auto Localizer<D>::with_round(const Producer<D>& producer, const Use& use) const {
  return std::visit(
      [&]<typename Solid>(const Solid& solid) {
        return use(typename Solid::Process(*network_, producer, solid));
      },
      network_->rounds[producer.index]);
}

/// Hands the process behind a leaf to `use`.
template <int D>
template <typename Use>
auto Localizer<D>::with_producer(const Word* leaf, const Use& use) const {
  const Producer<D>& producer = network_->producers[leaf[2]];
  if constexpr (D == 3) {
    if (producer.kind == ProducerKind::lathe) return use(LatheProducer(*network_, producer));
    if (producer.kind == ProducerKind::mesh) return use(MeshProducer(*network_, producer));
  }
  switch (producer.kind) {
    case ProducerKind::convex:
    case ProducerKind::lathe:
    case ProducerKind::mesh:
      break;
    case ProducerKind::round:
      return with_round(producer, use);
    case ProducerKind::spline:
      return use(SplineProducer<D>(*network_, producer));
    case ProducerKind::preimage:
      return use(PreimageProducer<D>(*network_, producer));
  }
  return use(ConvexProducer<D>(*network_, producer));
}

template <int D>
bool Localizer<D>::is_convex(const Producer<D>& producer) const {
  if (producer.kind == ProducerKind::round)
    return std::visit([](const auto& solid) { return solid.is_convex; }, network_->rounds[producer.index]);
  return producer.kind == ProducerKind::convex || producer.kind == ProducerKind::lathe;
}

template <int D>
bool Localizer<D>::contains(const Producer<D>& producer, const Cell<D>& cell) {
  if (producer.is_empty() || producer.undecided) return false;
  if (!is_convex(producer)) return false;
  view_.look_at(cell);
  view_.test_boxes_only(false);
  if (producer.kind != ProducerKind::convex) {
    const Word whole[] = {Program::kind_leaf | Program::whole, Program::header,
                          static_cast<Word>(&producer - network_->producers.data())};
    Words unused;
    return with_producer(whole, [&](const auto& process) { return process.ask(whole, view_, unused); }) ==
           Label::in;
  }
  const auto planes = network_->planes_of(producer);
  return std::all_of(planes.begin(), planes.end(),
                     [&](auto plane) { return view_.position(plane) == Position::negative; });
}

template <int D>
bool Localizer<D>::is_curved(const Word* leaf) const {
  return dataflow::is_curved(network_->producers[leaf[2]].kind);
}

template <int D>
double Localizer<D>::work_left(std::span<const Word> program) const {
  std::size_t all = 0;
  for (const ActiveLeaf& leaf : active_)
    all += is_curved(program.data() + leaf.at) ? std::max(least_of_curved, leaf.undecided) : leaf.undecided;
  return static_cast<double>(all);
}

template <int D>
std::vector<typename Localizer<D>::UndecidedOperand> Localizer<D>::undecided_operands(
    std::span<const Word> program) const {
  std::vector<UndecidedOperand> operands;
  for (const ActiveLeaf& leaf : active_) operands.push_back({program[leaf.at + 2], leaf.undecided});
  return operands;
}

// --- choosing a hyperplane ---

/// How the operands may be parted across an axis.
template <int D>
SplitPosition Localizer<D>::part_operands(std::span<const Word> program, int axis) {
  const CellExtent<D>& extent = view_.extent();
  stretches_.clear();
  for (const ActiveLeaf& leaf : active_) {
    const Producer<D>& producer = network_->producers[program[leaf.at + 2]];
    stretches_.push_back({std::max(producer.lower[axis], extent.lower[axis]),
                          std::min(producer.upper[axis], extent.upper[axis])});
  }
  return best_split_position(stretches_);
}

/// The longest axis, but for one across which operands come apart better.
template <int D>
std::pair<int, SplitPosition> Localizer<D>::axis_between_operands(std::span<const Word> program) {
  constexpr double clearly = 0.95, least_possible = 0.5;  // every operand reaches below the place or above it
  const std::array<int, D> axes = view_.extent().axes_by_length();
  std::pair<int, SplitPosition> best{axes[0], part_operands(program, axes[0])};
  for (std::size_t i = 1; i < axes.size() && least_possible < clearly * best.second.share; ++i) {
    const SplitPosition other = part_operands(program, axes[i]);
    if (other.share < clearly * best.second.share) best = {axes[i], other};
  }
  return best;
}

/// Cuts between operands where that is worth while, at the end of one of them. Where an operand ends in one
/// of its own facets that facet's hyperplane is taken, and no stray cut appears.
template <int D>
bool Localizer<D>::choose_between_operands(std::span<const Word> program, Cut& cut) {
  constexpr double least_share = 0.5;  // of the larger half
  if (active_.size() <= few_operands) return false;
  const double work = work_left(program);
  if ((1 - least_share) * work <= least_relief) return false;
  const auto [axis, parting] = axis_between_operands(program);
  if ((1 - parting.share) * work <= least_relief) return false;
  candidates_.clear();
  add_ends(program, axis, parting.place);
  return take_nearest_candidate(cut);
}

/// Where operands end across an axis within the cell, by their distance from a place.
template <int D>
void Localizer<D>::add_ends(std::span<const Word> program, int axis, double place) {
  const CellExtent<D>& extent = view_.extent();
  const double margin = extent.length(axis) * 1e-3;
  const double low = extent.lower[axis] + margin, high = extent.upper[axis] - margin;
  for (const ActiveLeaf& leaf : active_) {
    const Word number = program[leaf.at + 2];
    const Producer<D>& producer = network_->producers[number];
    for (const int side : {0, 1}) {
      const double bound = side == 0 ? producer.lower[axis] : producer.upper[axis];
      if (low <= bound && bound <= high)
        candidates_.push_back({std::fabs(bound - place), number, static_cast<std::uint8_t>(axis),
                               static_cast<std::uint8_t>(side)});
    }
  }
}

/// The operand's own facet if it ends in one there, else a cut across the axis.
template <int D>
HyperplaneId Localizer<D>::hyperplane_at(const Candidate& end) const {
  const Producer<D>& producer = network_->producers[end.producer];
  if (const std::uint32_t own = producer.bounding_plane[end.axis][end.side]; own != 0) return (own - 1) >> 1;
  const auto& table = view_.table();
  const double bound = end.side == 0 ? producer.lower[end.axis] : producer.upper[end.axis];
  return network_->axial_planes.cut(table, end.axis, table.axis_position(end.axis, bound) + end.side);
}

/// The nearest one that crosses the cell, which is almost always the first: the others are not even looked up
/// before that one fails. Of equally near ones that with the lowest number. (Without those that are far, Pisa
/// has 0.7 % more cells.)
template <int D>
bool Localizer<D>::take_nearest_candidate(Cut& cut) {
  if (candidates_.empty()) return false;
  const double nearest = std::ranges::min_element(candidates_, {}, &Candidate::distance)->distance;
  HyperplaneId first = std::numeric_limits<HyperplaneId>::max();
  for (const Candidate& end : candidates_)
    if (end.distance == nearest) first = std::min(first, hyperplane_at(end));
  const auto take = [&](HyperplaneId id) {
    if (!view_.crosses(id)) return false;
    cut = {id};
    return true;
  };
  if (take(first)) return true;
  std::vector<std::pair<double, HyperplaneId>> all;
  for (const Candidate& end : candidates_) all.emplace_back(end.distance, hyperplane_at(end));
  std::sort(all.begin(), all.end());
  return std::any_of(all.begin(), all.end(), [&](const auto& candidate) { return take(candidate.second); });
}

/// The undecided half-spaces of an operand that is a list of them; none of any other.
template <int D>
std::span<const geometry::OrientedHyperplane> Localizer<D>::listed_planes(const Word* leaf) const {
  const Producer<D>& producer = network_->producers[leaf[2]];
  if (producer.undecided || producer.kind == ProducerKind::mesh || dataflow::is_curved(producer.kind) ||
      (leaf[0] & (Program::whole | Program::ranged)) != 0)
    return {};
  return ConvexProducer<D>(*network_, producer).undecided_planes(leaf);
}

/// The half-space of an operand in which most others end, too (or one that has it twice): a cut there tells
/// about all of them.
template <int D>
std::optional<geometry::OrientedHyperplane> Localizer<D>::shared_plane(std::span<const Word> program,
                                                                       const Word* leaf) {
  shared_.clear();
  for (const auto plane : listed_planes(leaf))
    if (network_->is_shared(plane.id())) shared_.push_back(plane);
  if (shared_.empty()) return std::nullopt;
  count_shared(program);
  std::optional<geometry::OrientedHyperplane> chosen;
  std::pair<std::uint32_t, double> most;  // operands, and how far the centre is outside
  for (const auto plane : shared_) {
    const std::uint32_t operands = operands_at_[place_of_[plane.id()]];
    if (operands == 1 || (chosen && operands < most.first)) continue;  // 1: the operand itself
    const double value = view_.table().rounded(plane.id()).at(view_.extent().centre);
    const std::pair key(operands, plane.flipped() ? -value : value);
    if (chosen && !(key > most)) continue;
    most = key;
    chosen = plane;
  }
  for (const auto plane : shared_) place_of_[plane.id()] = 0;
  return chosen;
}

/// How many undecided operands end in each of the half-spaces `shared_`, by places from 1 on. What is not one
/// of them counts at 0.
template <int D>
void Localizer<D>::count_shared(std::span<const Word> program) {
  place_of_.resize(network_->shared.size());
  operands_at_.assign(shared_.size() + 1, 0);
  for (std::size_t i = 0; i < shared_.size(); ++i)
    place_of_[shared_[i].id()] = static_cast<std::uint16_t>(i + 1);
  for (const ActiveLeaf& other : active_)
    for (const auto plane : listed_planes(program.data() + other.at)) ++operands_at_[place_of_[plane.id()]];
}

/// Cuts along the operand with the fewest undecided half-spaces or facets: where another operand ends, too,
/// else as its producer advises.
template <int D>
void Localizer<D>::choose_operand(std::span<const Word> program, Cut& cut) {
  const ActiveLeaf& fewest =
      *std::ranges::min_element(active_, {}, &ActiveLeaf::undecided);  // the first of those
  const Word* const best = program.data() + fewest.at;
  const std::size_t least = fewest.undecided;
  std::optional<geometry::OrientedHyperplane> shared;
  if (active_.size() > 1 && least <= ConvexProducer<D>::many_planes) shared = shared_plane(program, best);
  const Advice advice =
      shared ? Advice{*shared, true, least == 1}
             : with_producer(best, [&](const auto& process) { return process.advise(best, view_); });
  const auto is_out_if = [&](Label label) {
    const Word* at = program.data();
    return label_if(at, best, label) == Label::out;
  };
  const bool beyond_is_out = advice.beyond_is_out && is_out_if(Label::out);
  const bool behind_is_out =
      advice.behind_is_in && !network_->producers[best[2]].undecided && is_out_if(Label::in);
  cut.none = advice.none;
  cut.hyperplane = advice.plane.id();
  cut.positive_is_out = advice.plane.flipped() ? behind_is_out : beyond_is_out;
  cut.negative_is_out = advice.plane.flipped() ? beyond_is_out : behind_is_out;
}

/// Where one operand is left, and a list of half-spaces says where it is: nothing needs to be asked again
/// until it is decided.
template <int D>
void Localizer<D>::offer_clipping(std::span<const Word> program, Cut& cut) const {
  const Word* const leaf = program.data() + active_[0].at;
  const auto planes = listed_planes(leaf);
  if (planes.size() < 2 || planes.size() > ConvexProducer<D>::many_planes) return;
  const Word* at = program.data();
  cut.beyond = answer_if(at, answer_of(leaf, Label::out));
  at = program.data();
  cut.behind = answer_if(at, answer_of(leaf, Label::in));
  const bool are_alike = cut.beyond.label == cut.behind.label &&
                         network_->part_of(cut.beyond.owner) == network_->part_of(cut.behind.owner);
  if (!are_alike) cut.last_planes = planes;  // else what is cut is given back, which only splits see to
}

/// The program's answer if its only leaf had this one.
template <int D>
Answer Localizer<D>::answer_if(const Word*& at, const Answer& leaf) const {
  const Word kind = at[0] & Program::kind_mask;
  const Word* const end = at + at[1];
  if (kind == Program::kind_leaf) {
    const bool is_known = (at[0] & Program::known) != 0;
    const Word* const begin = at;
    at = end;
    return is_known ? known_answer(begin) : leaf;
  }
  Combiner combiner(kind, at[2]);
  at += Program::header;
  while (at != end) {
    const Answer operand = answer_if(at, leaf);
    if (combiner.fold(operand)) {
      at = end;
      return operand;
    }
  }
  return combiner.answer();
}

/// The program's label if its leaf `leaf` (complemented or not) had the label `assumed` and nothing else were
/// known.
template <int D>
Label Localizer<D>::label_if(const Word*& at, const Word* leaf, Label assumed) const {
  const Word kind = at[0] & Program::kind_mask;
  const Word* const begin = at;
  const Word* const end = at + at[1];
  if (kind == Program::kind_leaf) {
    at = end;
    if ((begin[0] & Program::known) != 0) return Label::in;
    if (begin != leaf) return Label::fuzzy;
    return (begin[0] & Program::negated) != 0 ? Complement::map(assumed) : assumed;
  }
  if (leaf < begin || leaf >= end) {  // elsewhere
    at = end;
    return Label::fuzzy;
  }
  const Label deciding = Combiner::deciding(kind);
  Label result = kind == Program::kind_differ ? Label::fuzzy : Complement::map(deciding);
  at += Program::header;
  while (at != end) {
    const Label label = label_if(at, leaf, assumed);
    if (kind == Program::kind_differ) continue;  // one operand alone decides nothing unless it is the last
    if (label == deciding) {
      at = end;
      return deciding;
    }
    if (label == Label::fuzzy) result = Label::fuzzy;
  }
  return result;
}

#define BSP2_INSTANTIATE(D) template class Localizer<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
