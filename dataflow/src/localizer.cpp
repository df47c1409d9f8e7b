#include "bsp2/dataflow/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh_localizer.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

namespace {

/// Above so many undecided operands, space is cut between them rather than along one of them.
constexpr std::size_t many_operands = 12;
/// An operand with more undecided half-spaces is halved first.
constexpr std::size_t many_planes = 160;
/// Programs longer than this are first localized without looking at vertices.
constexpr std::size_t long_program = 256;

}  // namespace

template <int D>
CellExtent<D>::CellExtent(const Cell<D>& cell) {
  lower.fill(std::numeric_limits<double>::infinity());
  upper.fill(-std::numeric_limits<double>::infinity());
  centre.fill(0);
  double error = 0;
  const auto vertices = cell.vertices();
  for (const auto& vertex : vertices) {
    error = std::max(error, vertex.error);
    for (int i = 0; i < D; ++i) {
      lower[i] = std::min(lower[i], vertex.x[i]);
      upper[i] = std::max(upper[i], vertex.x[i]);
      centre[i] += vertex.x[i];
    }
  }
  for (int i = 0; i < D; ++i) {
    centre[i] /= static_cast<double>(vertices.size());
    lower[i] -= error;
    upper[i] += error;
    middle[i] = (lower[i] + upper[i]) / 2;
    half[i] = (upper[i] - lower[i]) / 2 * (1 + 0x1p-40);
  }
  double square = 0;
  for (const auto& vertex : vertices) {
    double sum = 0;
    for (int i = 0; i < D; ++i) sum += (vertex.x[i] - centre[i]) * (vertex.x[i] - centre[i]);
    square = std::max(square, sum);
  }
  radius = std::sqrt(square) * (1 + 0x1p-40) + error;
}

template <int D>
bool CellExtent<D>::misses(const std::array<double, D>& low, const std::array<double, D>& high) const {
  for (int i = 0; i < D; ++i)
    if (upper[i] < low[i] || lower[i] > high[i]) return true;
  return false;
}

template <int D>
bool CellExtent<D>::contains(const std::array<double, D>& low, const std::array<double, D>& high) const {
  for (int i = 0; i < D; ++i)
    if (lower[i] > low[i] || upper[i] < high[i]) return false;
  return true;
}

template <int D>
Position CellExtent<D>::position(const geometry::Hyperplane<D>& h) const {
  const double value = h.at(middle);
  double reach = h.error;
  for (int i = 0; i < D; ++i) reach += std::fabs(h.normal[i]) * half[i];
  reach *= 1 + 0x1p-40;
  return value > reach ? Position::positive : value < -reach ? Position::negative : Position::crossing;
}

// --- folding ---------------------------------------------------------------------------------------------------------

template <int D>
Answer Localizer<D>::fire(std::span<const Word> program, const Cell<D>& cell, std::vector<Word>& out, Cut& cut) {
  const CellExtent<D> extent(cell);
  cell_ = &cell;
  extent_ = &extent;
  columns_.load(cell);
  const bool quick = program.size() > long_program;
  Answer answer = localize(program, out, quick);
  if (answer.label != Label::fuzzy) return answer;
  if (active_.size() > many_operands && choose_median(out, cut)) return answer;
  if (quick) {
    std::swap(out, second_pass_);
    answer = localize(second_pass_, out, false);
    if (answer.label != Label::fuzzy) return answer;
    if (active_.size() > many_operands && choose_median(out, cut)) return answer;
  }
  choose_facet(out, cut);
  return answer;
}

template <int D>
Answer Localizer<D>::localize(std::span<const Word> program, std::vector<Word>& out, bool quick) {
  out.clear();
  active_.clear();
  quick_ = quick;
  if (program.empty()) return {Label::out};
  const Word* at = program.data();
  return visit(at, out);
}

template <int D>
Answer Localizer<D>::visit(const Word*& at, std::vector<Word>& out) {
  return (at[0] & Net::kind_mask) == Net::kind_leaf ? visit_leaf(at, out) : visit_combiner(at, out);
}

/// The combiners: an operand that answered is folded away. IN ends a union, OUT ends an intersection.
template <int D>
Answer Localizer<D>::visit_combiner(const Word*& at, std::vector<Word>& out) {
  const Word kind = at[0] & Net::kind_mask;
  const Word* const end = at + at[1];
  const std::size_t begin = out.size(), first_active = active_.size();
  out.insert(out.end(), {kind, 0, at[2]});
  at += Net::header;
  while (at != end) {
    const Answer operand = visit(at, out);
    if (operand.label == Label::fuzzy) continue;
    const bool in = operand.label == Label::in;
    if ((kind == Net::kind_unite && in) || (kind == Net::kind_intersect && !in)) {
      at = end;
      out.resize(begin);
      active_.resize(first_active);
      return operand;
    }
    if (!in || kind == Net::kind_unite) continue;
    const auto part = static_cast<Word>(operand.part + 1);  // 0: none
    Word& folded = out[begin + 2];
    if (kind == Net::kind_intersect) {
      if (part != 0 && (folded == 0 || part < folded)) folded = part;
    } else {
      Word lowest = folded >> 1;
      if (part != 0 && (lowest == 0 || part < lowest)) lowest = part;
      folded = lowest << 1 | ((folded & 1) ^ 1);
    }
  }
  return close(begin, first_active, out);
}

template <int D>
Answer Localizer<D>::close(std::size_t begin, std::size_t first_active, std::vector<Word>& out) {
  const std::size_t length = out.size() - begin;
  const Word kind = out[begin], folded = out[begin + 2];
  if (length == Net::header) {  // no operand is left
    out.resize(begin);
    if (kind == Net::kind_unite) return {Label::out};
    if (kind == Net::kind_intersect) return {Label::in, static_cast<std::int32_t>(folded) - 1};
    return (folded & 1) != 0 ? Answer{Label::in, static_cast<std::int32_t>(folded >> 1) - 1} : Answer{Label::out};
  }
  out[begin + 1] = static_cast<Word>(length);
  if (folded == 0 && out[begin + Net::header + 1] == length - Net::header) {  // a single operand needs no combiner
    out.erase(out.begin() + static_cast<std::ptrdiff_t>(begin), out.begin() + static_cast<std::ptrdiff_t>(begin + Net::header));
    for (std::size_t i = first_active; i < active_.size(); ++i) active_[i] -= Net::header;
  }
  return {Label::fuzzy};
}

template <int D>
Answer Localizer<D>::visit_leaf(const Word*& at, std::vector<Word>& out) {
  const Word* const leaf = at;
  at += leaf[1];
  const Producer<D>& producer = network_->producers[leaf[2]];
  const bool complemented = (leaf[0] & Net::negated) != 0;
  Label label = Label::out;
  if (!extent_->misses(producer.lower, producer.upper)) {
    const std::size_t begin = out.size();
    label = producer.mesh < 0 ? visit_convex(leaf, producer, out) : visit_mesh(leaf, producer, out);
    if (label == Label::fuzzy) {
      out[begin + 1] = static_cast<Word>(out.size() - begin);
      active_.push_back(static_cast<std::uint32_t>(begin));
      return {Label::fuzzy};
    }
    out.resize(begin);
  }
  if (!complemented) return {label, label == Label::in ? producer.part : geometry::no_part};
  return {label == Label::in ? Label::out : Label::in};
}

/// Producer of a convex polytope: OUT outside one half-space, IN inside all, else the half-spaces that cross the cell.
template <int D>
Label Localizer<D>::visit_convex(const Word* leaf, const Producer<D>& producer, std::vector<Word>& out) {
  const bool whole = (leaf[0] & Net::whole) != 0;
  if (quick_ && whole && extent_->contains(producer.lower, producer.upper)) {
    out.insert(out.end(), leaf, leaf + Net::header);
    return Label::fuzzy;
  }
  out.insert(out.end(), {leaf[0] & ~Net::whole, 0, leaf[2]});
  const std::size_t begin = out.size();
  const OrientedHyperplane* const own = network_->planes.data() + producer.first_plane;
  const std::size_t count = whole ? producer.plane_count : leaf[1] - Net::header;
  for (std::size_t i = 0; i < count; ++i) {
    const OrientedHyperplane plane = whole ? own[i] : OrientedHyperplane{leaf[Net::header + i]};
    const Position where = position(plane);
    if (where == Position::positive) return Label::out;
    if (where == Position::crossing) out.push_back(plane.code);
  }
  return out.size() == begin ? Label::in : Label::fuzzy;
}

template <int D>
Label Localizer<D>::visit_mesh(const Word* leaf, const Producer<D>& producer, std::vector<Word>& out) {
  if constexpr (D == 3)
    return MeshLocalizer{*network_, *splitter_, *cell_, *extent_, quick_}.visit(leaf, producer, out);
  else
    return Label::out;
}

/// Where the cell lies: from its box if that is enough, else from its vertices, exactly.
template <int D>
Position Localizer<D>::position(OrientedHyperplane plane) {
  const auto h = splitter_->table().rounded(plane.id());
  Position where = extent_->position(h);
  if (where == Position::crossing && !quick_) where = splitter_->position(*cell_, columns_, plane.id(), h);
  if (where == Position::crossing || !plane.flipped()) return where;
  return where == Position::negative ? Position::positive : Position::negative;
}

template <int D>
bool Localizer<D>::contains(const Producer<D>& producer, const Cell<D>& cell) {
  if (producer.mesh >= 0 || producer.lower[0] > producer.upper[0]) return false;
  const CellExtent<D> extent(cell);
  cell_ = &cell;
  extent_ = &extent;
  columns_.load(cell);
  quick_ = false;
  const auto planes = network_->planes_of(producer);
  return std::all_of(planes.begin(), planes.end(), [&](OrientedHyperplane plane) { return position(plane) == Position::negative; });
}

// --- choosing a hyperplane -------------------------------------------------------------------------------------------

/// Half-spaces or facets of a leaf that are still undecided.
template <int D>
std::size_t Localizer<D>::undecided(const Word* leaf) const {
  const Producer<D>& producer = network_->producers[leaf[2]];
  if (producer.mesh >= 0)
    return (leaf[0] & Net::whole) != 0 ? network_->meshes[producer.mesh].facets.size() : leaf[1] - MeshLocalizer::header;
  return (leaf[0] & Net::whole) != 0 ? producer.plane_count : leaf[1] - Net::header;
}

template <int D>
std::vector<typename Localizer<D>::UndecidedOperand> Localizer<D>::undecided_operands(std::span<const Word> program) const {
  std::vector<UndecidedOperand> operands;
  for (const std::uint32_t leaf : active_) operands.push_back({program[leaf + 2], undecided(program.data() + leaf)});
  return operands;
}

/// Sorts the candidates and takes the one nearest to the middle that crosses the cell.
template <int D>
bool Localizer<D>::take_middle_candidate(Cut& cut) {
  std::sort(candidates_.begin(), candidates_.end());
  const std::size_t middle = candidates_.size() / 2;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const std::size_t step = (i + 1) / 2;
    const std::size_t at = i % 2 == 0 ? middle + step : middle - step;
    if (at >= candidates_.size()) continue;
    const HyperplaneId id = candidates_[at].second;
    if (splitter_->position(*cell_, id, splitter_->table().rounded(id)) != Position::crossing) continue;
    cut = {id};
    return true;
  }
  return false;
}

/// Cuts between operands: at the median of their bounds along the longest axis of the cell that has one inside. Where an
/// operand ends in one of its own facets that facet's hyperplane is taken, and no stray cut appears.
template <int D>
bool Localizer<D>::choose_median(std::span<const Word> program, Cut& cut) {
  std::array<int, D> axes;
  for (int i = 0; i < D; ++i) axes[i] = i;
  const auto length = [&](int axis) { return extent_->upper[axis] - extent_->lower[axis]; };
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return length(a) > length(b); });
  const auto& table = splitter_->table();
  for (const int axis : axes) {
    candidates_.clear();
    const double margin = length(axis) * 1e-3;
    for (const std::uint32_t leaf : active_) {
      const Producer<D>& producer = network_->producers[program[leaf + 2]];
      for (const int side : {0, 1}) {
        const double bound = side == 0 ? producer.lower[axis] : producer.upper[axis];
        if (bound < extent_->lower[axis] + margin || bound > extent_->upper[axis] - margin) continue;
        const std::uint32_t own = producer.bounding_plane[axis][side];
        const HyperplaneId id = own != 0 ? (own - 1) >> 1 : table.axis_hyperplane(axis, table.axis_position(axis, bound) + static_cast<std::uint32_t>(side));
        candidates_.emplace_back(bound, id);
      }
    }
    if (!candidates_.empty() && take_middle_candidate(cut)) return true;
  }
  return false;
}

/// Splits along the operand with the fewest undecided half-spaces, by the one that leaves most of the cell outside.
template <int D>
void Localizer<D>::choose_facet(std::span<const Word> program, Cut& cut) {
  const Word* best = nullptr;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const std::uint32_t at : active_) {
    const Word* leaf = program.data() + at;
    const std::size_t count = undecided(leaf);
    if (count < fewest) {
      fewest = count;
      best = leaf;
    }
  }
  const Producer<D>& producer = network_->producers[best[2]];
  if (producer.mesh >= 0) {
    if (!choose_mesh_median(best, cut)) cut = {choose_mesh_plane(best)};
    return;
  }
  // The attempt costs more than a cut; where it fails, all planes may meet in an apex, and it is not repeated at once.
  if (fewest > many_planes && fewest % 32 == 0 && choose_half(best, cut)) return;
  OrientedHyperplane chosen;
  double furthest = -std::numeric_limits<double>::infinity();
  for (const OrientedHyperplane plane : undecided_planes(best)) {
    const auto h = splitter_->table().rounded(plane.id());
    const double value = plane.flipped() ? -h.at(extent_->centre) : h.at(extent_->centre);
    if (value > furthest) {
      furthest = value;
      chosen = plane;
    }
  }
  const Word* at = program.data();
  const bool outside_is_out = label_if(at, best, Label::out) == Label::out;
  at = program.data();
  const bool inside_is_out = fewest == 1 && label_if(at, best, Label::in) == Label::out;
  cut.hyperplane = chosen.id();
  cut.positive_is_out = chosen.flipped() ? inside_is_out : outside_is_out;
  cut.negative_is_out = chosen.flipped() ? outside_is_out : inside_is_out;
}

template <int D>
std::span<const OrientedHyperplane> Localizer<D>::undecided_planes(const Word* leaf) const {
  static_assert(sizeof(OrientedHyperplane) == sizeof(Word));
  if ((leaf[0] & Net::whole) != 0) return network_->planes_of(network_->producers[leaf[2]]);
  return {reinterpret_cast<const OrientedHyperplane*>(leaf + Net::header), leaf[1] - Net::header};
}

/// Halves the cell across an operand with very many half-spaces, if that parts them: cutting along one after the other
/// would take time quadratic in their number.
template <int D>
bool Localizer<D>::choose_half(const Word* leaf, Cut& cut) {
  const auto planes = undecided_planes(leaf);
  const auto& table = splitter_->table();
  std::size_t fewest = planes.size() * 17 / 20;  // more than that in one half is no progress
  bool found = false;
  for (int axis = 0; axis < D; ++axis) {
    const HyperplaneId id = table.axis_hyperplane(axis, table.axis_position(axis, extent_->centre[axis]));
    if (splitter_->classify(*cell_, id) != Position::crossing) continue;
    std::array<Cell<D>, 2> halves;
    splitter_->split(*cell_, id, &halves[0], &halves[1]);
    std::size_t most = 0;
    for (const Cell<D>& half : halves) {
      columns_.load(half);
      most = std::max<std::size_t>(most, static_cast<std::size_t>(std::count_if(planes.begin(), planes.end(), [&](OrientedHyperplane plane) {
        return splitter_->position(half, columns_, plane.id(), table.rounded(plane.id())) == Position::crossing;
      })));
      if (most >= fewest) break;
    }
    if (most >= fewest) continue;
    fewest = most;
    cut = {id};
    found = true;
  }
  columns_.load(*cell_);
  return found;
}

/// The program's label if its leaf `leaf` (not complemented) had the label `assumed` and nothing else were known.
template <int D>
Label Localizer<D>::label_if(const Word*& at, const Word* leaf, Label assumed) const {
  const auto inverse = [](Label label) { return label == Label::in ? Label::out : Label::in; };
  const Word kind = at[0] & Net::kind_mask;
  const Word* const begin = at;
  const Word* const end = at + at[1];
  if (kind == Net::kind_leaf) {
    at = end;
    if (begin != leaf) return Label::fuzzy;
    return (begin[0] & Net::negated) != 0 ? inverse(assumed) : assumed;
  }
  if (leaf < begin || leaf >= end) {  // elsewhere
    at = end;
    return Label::fuzzy;
  }
  const Label deciding = kind == Net::kind_unite ? Label::in : Label::out;
  Label result = kind == Net::kind_differ ? Label::fuzzy : inverse(deciding);
  at += Net::header;
  while (at != end) {
    const Label label = label_if(at, leaf, assumed);
    if (kind == Net::kind_differ) continue;  // one operand alone decides nothing unless it is the last
    if (label == deciding) {
      at = end;
      return deciding;
    }
    if (label == Label::fuzzy) result = Label::fuzzy;
  }
  return result;
}

template <int D>
bool Localizer<D>::choose_mesh_median(const Word* leaf, Cut& cut) {
  if constexpr (D == 3) {
    candidates_.clear();
    MeshLocalizer{*network_, *splitter_, *cell_, *extent_, false}.median_candidates(leaf, candidates_);
    return !candidates_.empty() && take_middle_candidate(cut);
  } else {
    static_cast<void>(leaf);
    static_cast<void>(cut);
    return false;
  }
}

template <int D>
HyperplaneId Localizer<D>::choose_mesh_plane(const Word* leaf) {
  if constexpr (D == 3) {
    return MeshLocalizer{*network_, *splitter_, *cell_, *extent_, false}.best_plane(leaf);
  } else {
    static_cast<void>(leaf);
    return 0;
  }
}

#define BSP2_INSTANTIATE(D)       \
  template struct CellExtent<D>; \
  template class Localizer<D>;
BSP2_INSTANTIATE(1)
BSP2_INSTANTIATE(2)
BSP2_INSTANTIATE(3)
BSP2_INSTANTIATE(4)
BSP2_INSTANTIATE(5)
BSP2_INSTANTIATE(6)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
