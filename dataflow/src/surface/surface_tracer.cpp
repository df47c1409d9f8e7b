#include "surface/surface_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

#include "process/combiner.hpp"
#include "process/transformer.hpp"
#include "producers/mesh_producer.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::PolygonCorner;
using Table = geometry::HyperplaneTable<3>;

namespace {

/// Boxes with so many facets of several operands are not cut.
constexpr double few_facets = 120;
/// Nor those with so many where meshes meet.
constexpr double few_of_meshes = 40;
/// An operand on both sides of a cut counts on each by this share of its facets.
constexpr double share_of_both = 0.7;
/// The work on the facets of a box grows like their square. A cut that leaves more than this share of it is
/// in vain; one that makes more of it than there was counts twice. Many in a row are not made: where operands
/// have a corner, an edge or a facet in common, they will not come apart.
constexpr double in_vain = 0.9, harmful = 1.3;
constexpr unsigned most_in_vain = 4;
/// More facets in one box are not held against each other, nor those of many operands, which part them into
/// ever more pieces: cells are found sooner.
constexpr std::size_t most_in_a_box = 3000, most_with_operands = 200'000;
/// Nor do two operands end apart that end within this share of the box: their bounds are rounded.
constexpr double least_gap = 0x1p-12;

/// Programs up to this length are closed up where an operand has gone: of many, one in the other, that would
/// take quadratic time.
constexpr std::size_t longest_move = 4096;

/// The label of a leaf whose producer has this one.
Label label_of_leaf(const Word* leaf, Label label) {
  return (leaf[0] & Program::negated) != 0 ? Complement::map(label) : label;
}

}  // namespace

SurfaceTracer::SurfaceTracer(const Network<3>& network, const OperandFacets& facets,
                             const std::atomic<bool>& stop)
    : network_(network),
      source_(facets),
      stop_(stop),
      kernel_(network.table),
      clipper_(network.table, kernel_),
      skin_(network.table) {}

// --- boxes ---

SurfaceBox SurfaceTracer::whole() {
  SurfaceBox all;
  all.low = source_.space().low;
  all.high = source_.space().high;
  const auto& program = network_.program;
  all.program.assign(program);
  for (std::size_t at = 0; at < program.size();) {
    const bool is_leaf = (program[at] & Program::kind_mask) == Program::kind_leaf;
    if (is_leaf) {
      const Word producer = program[at + 2];
      for (std::uint32_t facet = source_.first(producer); facet < source_.first(producer + 1); ++facet)
        if (source_.is_in_space(facet)) all.facets.push(facet);
      all.operands.push({producer, static_cast<std::uint32_t>(all.facets.size())});
    }
    at += is_leaf ? program[at + 1] : Program::header;
  }
  labels_.clear();
  for (std::size_t i = 0; i < all.operands.size(); ++i)
    labels_.push_back(all.facets_of(i).empty()
                          ? label_at_centre(all.operands[i].producer, {all.low, all.high})
                          : Label::fuzzy);
  SurfaceBox box;
  box.low = all.low;
  box.high = all.high;
  if (all.program.empty()) return box;
  const Word* at = all.program.data();
  std::size_t leaf = 0;
  if (simplify(all, at, leaf, box) != Label::fuzzy) box.program.clear();
  return box;
}

void SurfaceTracer::find_extents(const SurfaceBox& box) {
  extents_.clear();
  for (std::size_t i = 0; i < box.operands.size(); ++i) {
    Extent extent;
    extent.low.fill(std::numeric_limits<double>::infinity());
    extent.high.fill(-std::numeric_limits<double>::infinity());
    const auto facets = box.facets_of(i);
    extent.weight = static_cast<double>(facets.size());
    for (const std::uint32_t facet : facets)
      for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        extent.low[k] = std::min(extent.low[k], source_.low(facet, axis));
        extent.high[k] = std::max(extent.high[k], source_.high(facet, axis));
      }
    extents_.push_back(extent);
  }
}

/// Where to cut across an axis so that the larger half gets least; between the ends of operands.
std::optional<SurfaceTracer::Place> SurfaceTracer::place_between(const SurfaceBox& box, int axis,
                                                                 double total) {
  const auto k = static_cast<std::size_t>(axis);
  const double low = network_.table.axis_value(axis, box.low[k]),
               high = network_.table.axis_value(axis, box.high[k]);
  ends_.clear();
  for (const Extent& extent : extents_) {
    ends_.push_back({std::max(low, extent.low[k]), extent.weight, false});
    ends_.push_back({std::min(high, extent.high[k]), extent.weight, true});
  }
  std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) { return a.at < b.at; });
  std::optional<Place> best;
  double begun = 0, ended = 0;  // operands below the place in part, or as a whole
  for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
    (ends_[i].upper ? ended : begun) += ends_[i].weight;
    if (!(ends_[i + 1].at - ends_[i].at > least_gap * (high - low))) continue;
    const double both = begun - ended, below = ended + share_of_both * both,
                 above = total - begun + share_of_both * both;
    const double cost = std::max(below, above) + 0.25 * std::min(below, above);
    if (!best || cost < best->cost) best = {cost, (ends_[i].at + ends_[i + 1].at) / 2};
  }
  return best;
}

/// A cut across an axis at about this place that no operand ends in.
std::optional<SurfaceTracer::Cut> SurfaceTracer::free_cut(const SurfaceBox& box, int axis, double at) const {
  const auto k = static_cast<std::size_t>(axis);
  const auto position = free_position(network_, axis, box.low[k], box.high[k], at);
  return position ? std::optional(Cut{axis, *position}) : std::nullopt;
}

std::optional<SurfaceTracer::Cut> SurfaceTracer::choose_cut(const SurfaceBox& box) {
  const auto total = static_cast<double>(box.facets.size());
  if (total <= few_of_meshes || box.in_vain >= most_in_vain) return std::nullopt;
  if (box.operands.size() == 1 && !has_doubtful(box)) return std::nullopt;
  if (total <= few_facets && !has_mesh(box)) return std::nullopt;
  find_extents(box);
  std::optional<Cut> best;
  double least = 0.9 * (1.25 * share_of_both) * total;  // little less than a cut through all of them costs
  for (int axis = 0; axis < 3; ++axis) {
    const auto place = place_between(box, axis, total);
    if (!place || !(place->cost < least)) continue;
    const auto cut = free_cut(box, axis, place->at);
    if (!cut) continue;
    least = place->cost;
    best = cut;
  }
  return best ? best : cut_in_the_middle(box);
}

/// Across the longest side of what of the operands is in the box.
std::optional<SurfaceTracer::Cut> SurfaceTracer::cut_in_the_middle(const SurfaceBox& box) const {
  Box<3> all = Box<3>::empty();
  for (const Extent& extent : extents_)
    for (std::size_t k = 0; k < 3; ++k) {
      all.lower[k] = std::min(all.lower[k], extent.low[k]);
      all.upper[k] = std::max(all.upper[k], extent.high[k]);
    }
  int longest = 0;
  std::array<double, 3> lengths;
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    all.lower[k] = std::max(all.lower[k], network_.table.axis_value(axis, box.low[k]));
    all.upper[k] = std::min(all.upper[k], network_.table.axis_value(axis, box.high[k]));
    lengths[k] = all.upper[k] - all.lower[k];
    if (lengths[k] > lengths[static_cast<std::size_t>(longest)]) longest = axis;
  }
  const auto k = static_cast<std::size_t>(longest);
  return free_cut(box, longest, (all.lower[k] + all.upper[k]) / 2);
}

std::array<SurfaceBox, 2> SurfaceTracer::halve(const SurfaceBox& box, const Cut& cut) {
  std::array<SurfaceBox, 2> halves{half(box, cut, false), half(box, cut, true)};
  const auto work_on = [](const SurfaceBox& some) {
    return some.operands.size() < 2 ? 0.0 : std::pow(static_cast<double>(some.facets.size()), 2);
  };
  const double left = (work_on(halves[0]) + work_on(halves[1])) / work_on(box);
  const unsigned steps = left > harmful ? 2 : left > in_vain ? 1 : 0;
  for (SurfaceBox& some : halves)
    some.in_vain = steps == 0 ? 0 : static_cast<std::uint8_t>(box.in_vain + steps);
  return halves;
}

SurfaceBox SurfaceTracer::half(const SurfaceBox& box, const Cut& cut, bool upper) {
  SurfaceBox some;  // all operands that have facets in the half
  some.low = box.low;
  some.high = box.high;
  (upper ? some.low : some.high)[static_cast<std::size_t>(cut.axis)] = cut.position;
  const double value = network_.table.axis_value(cut.axis, cut.position);
  labels_.clear();
  some.facets.reserve(box.facets.size());
  for (std::size_t i = 0; i < box.operands.size(); ++i) {
    const std::size_t before = some.facets.size();
    for (const std::uint32_t facet : box.facets_of(i))
      if (upper ? source_.high(facet, cut.axis) >= value : source_.low(facet, cut.axis) <= value)
        some.facets.push(facet);
    some.operands.push({box.operands[i].producer, static_cast<std::uint32_t>(some.facets.size())});
    labels_.push_back(some.facets.size() > before
                          ? Label::fuzzy
                          : label_at_centre(box.operands[i].producer, {some.low, some.high}));
  }
  SurfaceBox result;
  result.low = some.low;
  result.high = some.high;
  const Word* at = box.program.data();
  std::size_t leaf = 0;
  if (simplify(some, at, leaf, result) != Label::fuzzy) {
    result.program.clear();
    result.operands.clear();
    result.facets.clear();
  }
  // What is left out ends here, undecided as it was.
  for (std::size_t i = 0, kept = 0; i < some.operands.size(); ++i) {
    const bool is_kept = kept < result.operands.size() && labels_[i] == Label::in;
    if (is_kept)
      ++kept;
    else
      touch(some.facets_of(i));
  }
  return result;
}

/// Appends what is left of a program where some of its operands are decided, as labels_ say; those that are
/// left get the label IN.
Label SurfaceTracer::simplify(const SurfaceBox& box, const Word*& at, std::size_t& leaf, SurfaceBox& to) {
  const Word kind = at[0] & Program::kind_mask;
  const Word* const begin = at;
  const Word* const end = at + at[1];
  if (kind == Program::kind_leaf) {
    at = end;
    const std::size_t number = leaf++;
    if (labels_[number] != Label::fuzzy)
      return label_of_leaf(begin, std::exchange(labels_[number], Label::fuzzy));
    labels_[number] = Label::in;
    to.program.push(begin[0] & ~Program::whole, Program::header, begin[2]);
    to.facets.append(box.facets_of(number));
    to.operands.push({begin[2], static_cast<std::uint32_t>(to.facets.size())});
    return Label::fuzzy;
  }
  const std::size_t first_word = to.program.size(), first_operand = to.operands.size(),
                    first_facet = to.facets.size(), first_leaf = leaf;
  to.program.push(kind, 0, 0);
  Combiner combiner(kind, begin[2]);
  at += Program::header;
  while (at != end) {
    const Label label = simplify(box, at, leaf, to);
    if (label == Label::fuzzy || !combiner.fold({label})) continue;
    for (std::size_t i = first_leaf; i < leaf; ++i) labels_[i] = Label::fuzzy;
    while (at != end) {  // the others are left out
      const bool is_leaf = (at[0] & Program::kind_mask) == Program::kind_leaf;
      if (is_leaf) labels_[leaf++] = Label::fuzzy;
      at += is_leaf ? at[1] : Program::header;
    }
    to.program.resize(first_word);
    to.operands.resize(first_operand);
    to.facets.resize(first_facet);
    return label;
  }
  const std::size_t length = to.program.size() - first_word;
  if (length == Program::header) {
    to.program.resize(first_word);
    return combiner.answer().label;
  }
  to.program[first_word + 1] = static_cast<Word>(length);
  to.program[first_word + 2] = combiner.memory();
  if (combiner.is_transparent() && length <= longest_move &&
      to.program[first_word + Program::header + 1] == length - Program::header) {
    std::copy(to.program.begin() + first_word + Program::header, to.program.end(),
              to.program.begin() + first_word);
    to.program.resize(to.program.size() - Program::header);
  }
  return Label::fuzzy;
}

/// Whether a box in which a producer has no facet is inside of it.
Label SurfaceTracer::label_at_centre(std::uint32_t producer, const Sides& box) {
  const auto& table = network_.table;
  const Box<3>& bounds = source_.bounds(producer);
  std::array<double, 3> centre;
  for (std::size_t k = 0; k < 3; ++k) {
    const int axis = static_cast<int>(k);
    centre[k] = (table.axis_value(axis, box.low[k]) + table.axis_value(axis, box.high[k])) / 2;
    if (centre[k] < bounds.lower[k] || centre[k] > bounds.upper[k]) return Label::out;
  }
  if (network_.producers[producer].kind == ProducerKind::mesh) {
    const auto winding = winding_in(producer, box);
    if (!winding) has_given_up_ = true;
    return winding && winding->number != 0 ? Label::in : Label::out;
  }
  for (const OrientedHyperplane plane : network_.planes_of(network_.producers[producer])) {
    const auto h = table.rounded(plane.id());
    const double value = plane.flipped() ? -h.at(centre) : h.at(centre);
    if (value > h.error) return Label::out;
    if (value < -h.error) continue;
    const int side = table.side(centre, plane.id());
    if ((plane.flipped() ? -side : side) > 0) return Label::out;
  }
  return Label::in;
}

/// How often a mesh winds around the centre of a box, or another point there where rounding leaves that open.
std::optional<SurfaceTracer::Winding> SurfaceTracer::winding_in(std::uint32_t producer,
                                                                const Sides& box) const {
  const MeshProducer mesh(network_, network_.producers[producer]);
  std::minstd_rand random(4711);  // the same points in every run
  double share = 0.5;
  for (int attempt = 0; attempt < 16; ++attempt) {
    std::array<double, 3> at;
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      const double low = network_.table.axis_value(axis, box.low[k]),
                   high = network_.table.axis_value(axis, box.high[k]);
      if (attempt > 0) share = 0.25 + static_cast<double>(random() % 512) / 1024;
      at[k] = low + (high - low) * share;
    }
    if (const auto winding = mesh.winding_around(at)) return Winding{at, *winding};
  }
  return std::nullopt;
}

/// What of a facet is in a box. @return whether there is any.
bool SurfaceTracer::clip(std::uint32_t facet, const Sides& box, Polygon& polygon) {
  source_.polygon(facet, polygon);
  const HyperplaneId plane = source_.outward(facet).id();
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    for (const bool upper : {false, true}) {
      const std::uint32_t position = upper ? box.high[k] : box.low[k];
      const double value = network_.table.axis_value(axis, position);
      if (upper ? source_.high(facet, axis) < value : source_.low(facet, axis) > value) continue;
      const HyperplaneId side = Table::axis_hyperplane(axis, position);
      const unsigned sides = kernel_.sides({polygon.data(), polygon.size()}, side);
      const unsigned inner = upper ? 1 : 2;
      if ((sides & inner) == 0) return false;
      if (sides != 3) continue;
      scratch_.clear();
      kernel_.split({polygon.data(), polygon.size()}, plane, side, upper ? &scratch_ : nullptr,
                    upper ? nullptr : &scratch_);
      polygon.swap(scratch_);
    }
  }
  return true;
}

// --- regions ---

void SurfaceTracer::trace(SurfaceBox region, geometry::Skin& skin) {
  begin(region);
  std::vector<SurfaceBox> open;
  open.push_back(std::move(region));
  while (!open.empty() && !stop_ && !has_given_up_) {
    const SurfaceBox box = std::move(open.back());
    open.pop_back();
    if (box.program.empty()) continue;
    ++boxes_;
    if (const auto cut = choose_cut(box))
      for (SurfaceBox& half : halve(box, *cut)) open.push_back(std::move(half));
    else
      find_pieces(box);
  }
  end(skin);
}

void SurfaceTracer::begin(const SurfaceBox& region) {
  region_ = {region.low, region.high};
  if (touched_.empty()) touched_.assign(source_.size(), 0);
}

void SurfaceTracer::touch(std::span<const std::uint32_t> facets) {
  if (touched_.empty()) {  // no region is at hand
    across_.touched.insert(across_.touched.end(), facets.begin(), facets.end());
    return;
  }
  for (const std::uint32_t facet : facets) {
    if (touched_[facet] == 0) touched_list_.push_back(facet);
    touched_[facet] = 1;
  }
}

/// Facets that meet no other operand in the region are added as a whole, the others box by box.
void SurfaceTracer::end(geometry::Skin& skin) {
  constexpr std::uint8_t added = 2;
  const Sides space{source_.space().low, source_.space().high};
  Polygon polygon;
  for (const Untouched& piece : untouched_) {
    std::uint8_t& state = touched_[piece.facet];
    if (state == added) continue;
    const WholeFacet whole{piece.facet, piece.reversed};
    if (state != 0) {
      add_piece(whole, boxes_of_untouched_[piece.box], polygon);
      continue;
    }
    state = added;
    touched_list_.push_back(piece.facet);
    if (!source_.is_of_mesh(piece.facet) || !is_within(piece.facet, space))
      add_piece(whole, region_, polygon);
    else if (is_within(piece.facet, region_))
      across_.whole.push_back(whole);
    else
      across_.parts.push_back({whole, region_});
  }
  for (const std::uint32_t facet : touched_list_) {
    if (touched_[facet] != added && source_.is_of_mesh(facet) && !is_within(facet, region_))
      across_.touched.push_back(facet);
    touched_[facet] = 0;
  }
  touched_list_.clear();
  untouched_.clear();
  boxes_of_untouched_.clear();
  skin_.finish(skin);
}

bool SurfaceTracer::is_within(std::uint32_t facet, const Sides& box) const {
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (source_.low(facet, axis) <= network_.table.axis_value(axis, box.low[k]) ||
        source_.high(facet, axis) >= network_.table.axis_value(axis, box.high[k]))
      return false;
  }
  return true;
}

void SurfaceTracer::add_piece(const WholeFacet& whole, const Sides& box, Polygon& polygon) {
  if (!clip(whole.facet, box, polygon)) return;
  const OrientedHyperplane outward = source_.outward(whole.facet);
  skin_.add(whole.reversed ? outward.opposite() : outward, 0, {polygon.data(), polygon.size()}, outward);
}

void SurfaceTracer::add_parts(std::span<const FacetsAcrossRegions::Part> parts, geometry::Skin& skin) {
  Polygon polygon;
  for (const auto& part : parts) add_piece(part.facet, part.region, polygon);
  skin_.finish(skin);
}

// --- pieces ---

bool SurfaceTracer::has_mesh(const SurfaceBox& box) const {
  return std::any_of(box.operands.begin(), box.operands.end(), [&](const SurfaceBox::Operand& operand) {
    return network_.producers[operand.producer].kind == ProducerKind::mesh;
  });
}

/// Whether facets there may not bound their mesh.
bool SurfaceTracer::has_doubtful(const SurfaceBox& box) const {
  return source_.has_doubtful() &&
         std::any_of(box.facets.begin(), box.facets.end(),
                     [&](std::uint32_t facet) { return source_.is_doubtful(facet); });
}

void SurfaceTracer::leave_to_cells(const SurfaceBox& box) {
  touch({box.facets.data(), box.facets.size()});
  HotBox& hot = hot_.emplace_back();
  hot.low = box.low;
  hot.high = box.high;
  const Word* at = box.program.data();
  std::size_t leaf = 0;
  write_whole(box, at, leaf, hot.program);
}

/// The program with the states of its leaves: of a mesh the facets that are in the box.
void SurfaceTracer::write_whole(const SurfaceBox& box, const Word*& at, std::size_t& leaf,
                                std::vector<Word>& to) const {
  const Word* const begin = at;
  const Word* const end = at + at[1];
  const std::size_t first = to.size();
  to.insert(to.end(), begin, begin + Program::header);
  at += Program::header;
  if ((begin[0] & Program::kind_mask) == Program::kind_leaf) {
    const std::uint32_t producer = begin[2];
    if (network_.producers[producer].kind == ProducerKind::mesh) {
      std::vector<Word> facets;
      for (const std::uint32_t facet : box.facets_of(leaf)) facets.push_back(source_.number_in_mesh(facet));
      MeshProducer::write_state(facets, to);
    } else {
      to[first] |= Program::whole;
    }
    ++leaf;
  } else {
    while (at != end) write_whole(box, at, leaf, to);
  }
  at = end;
  to[first + 1] = static_cast<Word>(to.size() - first);
}

void SurfaceTracer::find_pieces(const SurfaceBox& box) {
  if (has_doubtful(box)) return leave_to_cells(box);
  expression_.load({box.program.data(), box.program.size()});
  if (box.operands.size() == 1) {
    expression_.set(0, Label::in, Label::out);
    const bool reversed = expression_.label(SidedExpression::below) == Label::out;
    boxes_of_untouched_.push_back({box.low, box.high});
    const auto number = static_cast<std::uint32_t>(boxes_of_untouched_.size() - 1);
    for (const std::uint32_t facet : box.facets_of(0)) untouched_.push_back({facet, number, reversed});
    return;
  }
  const bool are_many =
      box.facets.size() > most_in_a_box || box.facets.size() * box.operands.size() > most_with_operands;
  if (are_many) {
    if (has_mesh(box)) return leave_to_cells(box);
    has_given_up_ = true;
    return;
  }
  load(box);
  const std::size_t before = skin_.size();
  is_untold_ = false;
  for (std::uint32_t i = 0; i < operands_.size() && !stop_ && !is_untold_; ++i)
    if (operands_[i].label == Label::fuzzy) find_pieces_of(i);
  if (!is_untold_) return touch({box.facets.data(), box.facets.size()});
  skin_.shrink(before);
  leave_to_cells(box);
}

/// Of a box: its operands, with what of their facets is there.
void SurfaceTracer::load(const SurfaceBox& box) {
  box_ = {box.low, box.high};
  operands_.clear();
  facets_.clear();
  corners_.clear();
  Polygon polygon;
  for (std::size_t i = 0; i < box.operands.size(); ++i) {
    const auto first = static_cast<std::uint32_t>(facets_.size());
    for (const std::uint32_t facet : box.facets_of(i)) {
      if (!clip(facet, box_, polygon)) continue;
      const auto begin = static_cast<std::uint32_t>(corners_.size());
      corners_.append({polygon.data(), polygon.size()});
      facets_.push_back({source_.outward(facet), facet, begin, static_cast<std::uint32_t>(corners_.size()),
                         bounds_of_polygon({polygon.data(), polygon.size()})});
    }
    const auto end = static_cast<std::uint32_t>(facets_.size());
    const std::uint32_t producer = box.operands[i].producer;
    const Label label = end > first ? Label::fuzzy : label_at_centre(producer, box_);
    const bool is_mesh = network_.producers[producer].kind == ProducerKind::mesh;
    operands_.push_back({label, is_mesh, producer, first, end});
    expression_.set(i, label, label);
  }
  find_shared_planes();
}

/// Those that several operands have facets in.
void SurfaceTracer::find_shared_planes() {
  std::vector<std::pair<HyperplaneId, std::uint32_t>>& planes = planes_;
  planes.clear();
  for (std::uint32_t number = 0; number < operands_.size(); ++number)
    for (std::uint32_t i = operands_[number].begin; i < operands_[number].end; ++i)
      planes.emplace_back(facets_[i].outward.id(), number);
  std::sort(planes.begin(), planes.end());
  shared_planes_.clear();
  for (std::size_t i = 1; i < planes.size(); ++i)
    if (planes[i].first == planes[i - 1].first && planes[i].second != planes[i - 1].second)
      shared_planes_.push_back(planes[i].first);
}

void SurfaceTracer::find_pieces_of(std::uint32_t own) {
  Polygon polygon;
  for (std::uint32_t i = operands_[own].begin; i < operands_[own].end && !stop_ && !is_untold_; ++i) {
    const FacetInBox& facet = facets_[i];
    polygon.assign({corners_.data() + facet.begin, facet.end - facet.begin});
    order_operands(own, facet.outward, facet.bounds);
    hold_against(polygon, own, facet.outward, 0);
  }
}

/// Those that a facet may meet: first those that have a facet in the same hyperplane, and whose piece it is.
void SurfaceTracer::order_operands(std::uint32_t own, OrientedHyperplane outward, const Box<3>& bounds) {
  order_.clear();
  for (std::uint32_t other = 0; other < operands_.size(); ++other) {
    const Operand& operand = operands_[other];
    if (other == own || operand.label != Label::fuzzy) continue;
    if (bounds.misses(source_.bounds(operand.producer))) {
      expression_.set(other, Label::out, Label::out);
      continue;
    }
    expression_.set(other, Label::fuzzy, Label::fuzzy);
    order_.push_back(other);
  }
  expression_.set(own, Label::in, Label::out);
  std::stable_partition(order_.begin(), order_.end(), [&](std::uint32_t other) {
    return other < own && has_facet_in(operands_[other], outward.id());
  });
}

/// @param id of another operand's facet.
bool SurfaceTracer::has_facet_in(const Operand& operand, HyperplaneId id) const {
  return std::binary_search(shared_planes_.begin(), shared_planes_.end(), id) &&
         std::any_of(facets_.begin() + operand.begin, facets_.begin() + operand.end,
                     [&](const FacetInBox& facet) { return facet.outward.id() == id; });
}

/// The facet that a convex operand has in a hyperplane.
std::optional<OrientedHyperplane> SurfaceTracer::facet_in(const Operand& operand, HyperplaneId id) const {
  if (operand.is_mesh) return std::nullopt;
  for (std::uint32_t i = operand.begin; i < operand.end; ++i)
    if (facets_[i].outward.id() == id) return facets_[i].outward;
  return std::nullopt;
}

/// Parts a piece into what of it is inside of an operand, or on its facet in the piece's hyperplane, and what
/// is not. @param beyond gets the latter, in convex pieces; nothing if the operand has nothing of the piece.
/// @return whether it has any; then the piece is only that.
bool SurfaceTracer::cut_along(const Operand& operand, HyperplaneId own, Polygon& piece,
                              std::vector<Part>& beyond) {
  beyond.clear();
  const auto sides_of = [&](OrientedHyperplane plane, const Polygon& polygon) {  // 1: inside, 2: outside
    const unsigned sides = kernel_.sides({polygon.data(), polygon.size()}, plane.id());
    return plane.flipped() ? sides >> 1 | (sides & 1) << 1 : sides;
  };
  // Most are outside of one hyperplane as a whole.
  crossing_.clear();
  for (std::uint32_t i = operand.begin; i < operand.end; ++i) {
    const OrientedHyperplane plane = facets_[i].outward;
    if (plane.id() == own) continue;
    const unsigned sides = sides_of(plane, piece);
    if ((sides & 1) == 0) return false;
    if (sides == 3) crossing_.push(plane.code);
  }
  Polygon rest;
  for (const std::uint32_t code : crossing_) {
    const OrientedHyperplane plane{code};
    const Polygon& polygon = beyond.empty() ? piece : rest;
    const unsigned sides = sides_of(plane, polygon);
    if ((sides & 1) == 0) {  // nothing is inside: so the piece stays one
      beyond.clear();
      return false;
    }
    if (sides != 3) continue;
    Polygon inside, outside;
    kernel_.split({polygon.data(), polygon.size()}, own, plane.id(), plane.flipped() ? &outside : &inside,
                  plane.flipped() ? &inside : &outside);
    beyond.push_back({std::move(outside), Label::out});
    rest = std::move(inside);
  }
  if (!beyond.empty()) piece = std::move(rest);
  return true;
}

/// Parts a piece into one that is inside of an operand or outside as a whole, or on its facet in the piece's
/// hyperplane, and others that are inside or outside. @return where the one is; where an operand has a facet
/// in the hyperplane, IN is on that.
Label SurfaceTracer::part(Operand& operand, HyperplaneId own, Polygon& piece, std::vector<Part>& others) {
  if (!operand.is_mesh) return cut_along(operand, own, piece, others) ? Label::in : Label::out;
  const std::span facets(facets_.data() + operand.begin, operand.end - operand.begin);
  std::optional<Label> label;
  if (clipper_.part(facets, corners_, own, {piece.data(), piece.size()}, others)) {
    if (others.empty()) {
      label = label_around(operand, piece);
    } else {
      piece = std::move(others.back().polygon);
      label = others.back().label;
      others.pop_back();
    }
  }
  if (!label) is_untold_ = true;
  return label.value_or(Label::out);
}

/// Where a piece is that no facet of a mesh crosses: by the way to a point in its middle from one that is
/// known. Nothing where rounding leaves it open.
std::optional<Label> SurfaceTracer::label_around(Operand& operand, const Polygon& piece) const {
  if (!operand.known) operand.known = winding_in(operand.producer, box_);
  if (!operand.known) return std::nullopt;
  const MeshProducer mesh(network_, network_.producers[operand.producer]);
  std::minstd_rand random(2203);
  for (int attempt = 0; attempt < 4; ++attempt) {
    std::array<double, 3> middle{};
    double sum = 0, error = 0;
    for (const PolygonCorner& corner : piece) {
      const double weight = attempt == 0 ? 1 : 1 + static_cast<double>(random() % 16);
      for (std::size_t k = 0; k < 3; ++k) middle[k] += weight * corner.point.x[k];
      sum += weight;
      error = std::max(error, corner.point.error);
    }
    for (double& x : middle) x /= sum;
    std::optional<std::int32_t> winding = operand.known->number;
    for (std::uint32_t i = operand.begin; i < operand.end && winding; ++i) {
      const std::uint32_t number = source_.number_in_mesh(facets_[i].facet);
      const auto change = mesh.change_across(number, operand.known->point, middle, error);
      winding = change ? std::optional(*winding + *change) : std::nullopt;
    }
    if (winding) return *winding != 0 ? Label::in : Label::out;
  }
  return std::nullopt;
}

/// Finds out where the operands from the `next` one on are on both sides of a piece, and parts it where that
/// changes.
void SurfaceTracer::hold_against(Polygon& polygon, std::uint32_t own, OrientedHyperplane outward,
                                 std::size_t next) {
  std::vector<Part> others;
  for (; next < order_.size() && !is_untold_; ++next) {
    const std::uint32_t number = order_[next];
    Operand& operand = operands_[number];
    const auto same = facet_in(operand, outward.id());
    // A piece that an earlier operand has, too, is that one's, whatever else is known. Where that is a mesh
    // it stays untold.
    const bool is_earlier = number < own && has_facet_in(operand, outward.id());
    if (!is_earlier && is_settled(polygon, outward)) return;
    if (!is_earlier && !expression_.matters(number)) continue;
    const Label label = part(operand, outward.id(), polygon, others);
    for (Part& other : others) {
      expression_.set(number, other.label, other.label);
      hold_against(other.polygon, own, outward, next + 1);
      for (std::size_t later = next; later < order_.size(); ++later)
        expression_.set(order_[later], Label::fuzzy, Label::fuzzy);
    }
    if (label == Label::out || !same)
      expression_.set(number, label, label);
    else if (is_earlier)
      return;
    else if (*same == outward)
      expression_.set(number, Label::in, Label::out);
    else
      expression_.set(number, Label::out, Label::in);
  }
  if (!is_untold_ && !is_settled(polygon, outward))
    throw std::logic_error("a piece of the surface is undecided");
}

/// Whether enough is known of a piece; then it has been added to the skin, if it is of it.
bool SurfaceTracer::is_settled(const Polygon& polygon, OrientedHyperplane outward) {
  const Label below = expression_.label(SidedExpression::below),
              above = expression_.label(SidedExpression::above);
  if (below == Label::fuzzy || above == Label::fuzzy) return false;
  if (below != above)
    skin_.add(below == Label::in ? outward : outward.opposite(), 0, {polygon.data(), polygon.size()},
              outward);
  return true;
}

}  // namespace bsp2::dataflow
