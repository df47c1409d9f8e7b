#include "constructs/circle_skins.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "process/combiner.hpp"
#include "process/transformer.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Cell;
using geometry::Label;
using Point = std::array<double, 2>;

constexpr double turn = 2 * std::numbers::pi;
/// Radians that two angles of one place differ by at most.
constexpr double same_angle = 1e-8;

double length(const Point& a) { return std::hypot(a[0], a[1]); }

/// Whether circles are circles in the model: the rows of the map into the frame are across each other and of
/// one length.
bool keeps_circles(const geometry::AffineMap<2>::Inverse& frame) {
  constexpr double rounding = 1e-12;
  const auto& [x, y] = frame.matrix;
  const double a = length(x), b = length(y);
  return std::fabs(x[0] * y[0] + x[1] * y[1]) <= rounding * a * b && std::fabs(a - b) <= rounding * a;
}

/// The points of the common chord: `along` from the centre in a direction, and as far beside it as the radius
/// leaves.
std::vector<Point> ends_of_chord(const Circle& circle, const Point& direction, double along,
                                 double rounding) {
  if (std::fabs(along) > circle.radius + rounding) return {};
  const Point foot{circle.centre[0] + along * direction[0], circle.centre[1] + along * direction[1]};
  if (std::fabs(std::fabs(along) - circle.radius) <= rounding) return {foot};
  const double half = std::sqrt((circle.radius - along) * (circle.radius + along));
  return {{foot[0] - half * direction[1], foot[1] + half * direction[0]},
          {foot[0] + half * direction[1], foot[1] - half * direction[0]}};
}

/// The angle from `from` on to the left, below a whole turn.
double angle_after(double from, double angle) {
  const double after = std::fmod(angle - from, turn);
  return after < 0 ? after + turn : after;
}

/// The program's answer if all its leaves were of one circle, and the cell inside of it or outside.
Answer answer_if(const Word*& at, bool is_inside) {
  const Word kind = at[0] & Program::kind_mask;
  const Word* const begin = at;
  const Word* const end = at + at[1];
  if (kind == Program::kind_leaf) {
    at = end;
    const bool is_known = (begin[0] & Program::known) != 0, is_mute = (begin[0] & Program::mute) != 0;
    Answer answer{Label::out};
    if (is_known || is_inside) answer = {Label::in, is_mute ? no_owner : static_cast<std::int32_t>(begin[2])};
    return (begin[0] & Program::negated) != 0 ? Complement::map(answer) : answer;
  }
  Combiner combiner(kind, at[2]);
  at += Program::header;
  while (at != end) {
    const Answer operand = answer_if(at, is_inside);
    if (!combiner.fold(operand)) continue;
    at = end;
    return operand;
  }
  return combiner.answer();
}

}  // namespace

double Circle::angle_of(const Point& point) const {
  return std::atan2(point[1] - centre[1], point[0] - centre[0]);
}

Point Circle::at(double angle) const {
  return {centre[0] + radius * std::cos(angle), centre[1] + radius * std::sin(angle)};
}

std::vector<Point> meetings(const Circle& circle, const Point& normal, double offset, double rounding) {
  const double along = -(offset + normal[0] * circle.centre[0] + normal[1] * circle.centre[1]);
  return ends_of_chord(circle, normal, along, rounding);
}

std::vector<Point> meetings(const Circle& a, const Circle& b, double rounding) {
  const Point way{b.centre[0] - a.centre[0], b.centre[1] - a.centre[1]};
  const double apart = length(way);
  if (!(apart > rounding)) return {};
  const Point direction{way[0] / apart, way[1] / apart};
  if (std::fabs(apart - a.radius - b.radius) <= rounding)
    return ends_of_chord(a, direction, a.radius, rounding);
  if (std::fabs(apart - std::fabs(a.radius - b.radius)) <= rounding)
    return ends_of_chord(a, direction, a.radius > b.radius ? a.radius : -a.radius, rounding);
  if (apart > a.radius + b.radius || apart < std::fabs(a.radius - b.radius)) return {};
  const double along = (apart + (a.radius - b.radius) * (a.radius + b.radius) / apart) / 2;
  return ends_of_chord(a, direction, along, rounding);
}

/// Cuts cells out of the space of a network.
class CellCutter {
 public:
  explicit CellCutter(const Network<2>& network)
      : network_(network), splitter_(network.table), localizer_(network, splitter_) {}

  /// The half of a cell before a hyperplane.
  void cut(Cell<2>& cell, geometry::HyperplaneId id, bool is_positive) {
    if (splitter_.classify(cell, id) != geometry::Position::crossing) return;
    Cell<2> half;
    splitter_.split(cell, id, is_positive ? nullptr : &half, is_positive ? &half : nullptr);
    cell = std::move(half);
  }
  /// What of a cell is in a box, or little more.
  Cell<2> in_box(const Cell<2>& cell, const Box<2>& box) {
    const auto& table = network_.table;
    Cell<2> rest = cell.copy();
    for (const int axis : {0, 1}) {
      const std::uint32_t low = table.axis_position(axis, box.lower[axis]),
                          high = table.axis_position(axis, box.upper[axis]) + 1;
      if (low > 0) cut(rest, table.axis_hyperplane(axis, low - 1), true);
      if (high < table.axis_steps) cut(rest, table.axis_hyperplane(axis, high + 1), false);
    }
    return rest;
  }
  /// What of it is in a cell of a batch.
  Cell<2> in_cell(const Cell<2>& cell, const geometry::CellBatch& batch, std::size_t number) {
    Cell<2> rest = cell.copy();
    for (std::size_t f = batch.facet_offset[number]; f < batch.facet_offset[number + 1]; ++f) {
      const std::int32_t code = batch.facet_hyperplane[f];
      cut(rest, static_cast<std::uint32_t>(code < 0 ? ~code : code), code < 0);
    }
    return rest;
  }
  bool is_fuzzy(std::span<const Word> program, const Cell<2>& cell, Words& left) {
    left.clear();
    return localizer_.decide(program, cell, left).label == Label::fuzzy;
  }

 private:
  const Network<2>& network_;
  geometry::Splitter<2> splitter_;
  Localizer<2> localizer_;
};

CircleSkins::CircleSkins(const Network<2>& network, double reach)
    : network_(network),
      rounding_(std::max(reach, 1e-290) * 0x1p-36),
      circle_of_round_(network.rounds.size(), -1) {
  for (std::size_t i = 0; i < network.rounds.size(); ++i)
    if (const auto* round = std::get_if<Round<2>>(&network.rounds[i])) add_circle(*round, i);
  std::sort(families_.begin(), families_.end());
  spans_.resize(circles_.size());
}

/// One that is there already, but for rounding, is the same.
void CircleSkins::add_circle(const Round<2>& round, std::size_t index) {
  families_.emplace_back(round.first, round.first + round.family.count());
  if (!keeps_circles(round.to_frame)) return;
  const Circle circle{round.to_frame.origin, 1 / length(round.to_frame.matrix[0])};
  const auto is_same = [&](const Circle& other) {
    return std::fabs(other.radius - circle.radius) <= rounding_ &&
           std::hypot(other.centre[0] - circle.centre[0], other.centre[1] - circle.centre[1]) <= rounding_;
  };
  const auto known = std::find_if(circles_.begin(), circles_.end(), is_same);
  circle_of_round_[index] = static_cast<std::int32_t>(known - circles_.begin());
  if (known == circles_.end()) circles_.push_back(circle);
}

bool CircleSkins::is_of_curve(geometry::HyperplaneId line) const {
  const auto after = std::upper_bound(families_.begin(), families_.end(), line,
                                      [](auto id, const auto& family) { return id < family.first; });
  return after != families_.begin() && line < std::prev(after)->second;
}

double CircleSkins::area() const {
  double sum = 0;
  for (const FuzzyCell& cell : cells_) sum += cell.batch->volume[cell.cell];
  return sum;
}

// --- finding ---

void CircleSkins::find() {
  std::vector<std::uint32_t> all(cells_.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  CellCutter cutter(network_);
  if (!all.empty()) find(geometry::root_cell<2>(network_.table), network_.program, all, cutter);
  for (std::uint32_t i = 0; i < cells_.size(); ++i) add_spans(i);
  for (auto& spans : spans_)
    std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) {
      return std::tie(a.from, a.to, a.cell) < std::tie(b.from, b.to, b.cell);
    });
}

/// Localizes the program within a box around some cells, and then within the boxes around either half of
/// them: so what is far from a cell is not asked about it.
void CircleSkins::find(const Cell<2>& around, std::span<const Word> program, std::span<std::uint32_t> cells,
                       CellCutter& cutter) {
  constexpr std::size_t few = 4;
  Words left;
  if (cells.size() <= few) {
    for (const std::uint32_t i : cells) {
      const Cell<2> cell = cutter.in_cell(around, *cells_[i].batch, cells_[i].cell);
      cells_[i].is_unknown = cell.empty() || !cutter.is_fuzzy(program, cell, left);
      if (!cells_[i].is_unknown) take(cells_[i], {left.data(), left.size()});
    }
    return;
  }
  const auto corner = [&](std::uint32_t i) { return cells_[i].batch->cell_points(cells_[i].cell); };
  Box<2> box = Box<2>::empty();
  for (const std::uint32_t i : cells)
    for (std::size_t k = 0; k < corner(i).size(); ++k) {
      box.lower[k % 2] = std::min(box.lower[k % 2], corner(i)[k]);
      box.upper[k % 2] = std::max(box.upper[k % 2], corner(i)[k]);
    }
  const Cell<2> inner = cutter.in_box(around, box);
  if (!cutter.is_fuzzy(program, inner, left)) left = Words(program);
  const std::size_t axis = box.upper[0] - box.lower[0] >= box.upper[1] - box.lower[1] ? 0 : 1;
  const auto middle = cells.begin() + static_cast<std::ptrdiff_t>(cells.size() / 2);
  std::nth_element(cells.begin(), middle, cells.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(corner(a)[axis], a) < std::pair(corner(b)[axis], b);
  });
  find(inner, {left.data(), left.size()}, {cells.begin(), middle}, cutter);
  find(inner, {left.data(), left.size()}, {middle, cells.end()}, cutter);
}

/// @param left the program within the cell.
void CircleSkins::take(FuzzyCell& cell, std::span<const Word> left) const {
  for (std::size_t at = 0; at < left.size();) {
    const bool is_leaf = (left[at] & Program::kind_mask) == Program::kind_leaf;
    if (is_leaf && (left[at] & Program::known) == 0) {
      const Producer<2>& producer = network_.producers[left[at + 2]];
      const bool is_round = producer.kind == ProducerKind::round;
      const std::int32_t circle = is_round ? circle_of_round_[producer.index] : -1;
      cell.is_unknown = cell.is_unknown || circle < 0;
      if (circle >= 0) cell.circles.push_back(static_cast<std::uint32_t>(circle));
    }
    at += is_leaf ? left[at + 1] : Program::header;
  }
  std::sort(cell.circles.begin(), cell.circles.end());
  cell.circles.erase(std::unique(cell.circles.begin(), cell.circles.end()), cell.circles.end());
  if (cell.circles.size() != 1) return;
  const auto part_if = [&](bool is_inside) {
    const Word* at = left.data();
    const Answer answer = answer_if(at, is_inside);
    return answer.label == Label::in ? network_.part_of(answer.owner) : nobody;
  };
  cell.inside = part_if(true);
  cell.outside = part_if(false);
}

namespace {

struct HalfPlane {
  Point outward;
  double offset;
  [[nodiscard]] double at(const Point& p) const { return outward[0] * p[0] + outward[1] * p[1] + offset; }
};

/// Those before the edges of a cell that are longer than `least`, by its points.
std::vector<HalfPlane> half_planes_of(const geometry::CellBatch& batch, std::size_t cell, double least) {
  const auto points = batch.cell_points(cell);
  Point centre{};
  for (std::size_t i = 0; i < points.size(); ++i)
    centre[i % 2] += 2 * points[i] / static_cast<double>(points.size());
  std::vector<HalfPlane> sides;
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const auto ends = batch.vertices_of_facet(f);
    const double *a = &points[2 * ends[0]], *b = &points[2 * ends[1]],
                 apart = std::hypot(b[0] - a[0], b[1] - a[1]);
    if (!(apart > least)) continue;
    HalfPlane side{{(b[1] - a[1]) / apart, (a[0] - b[0]) / apart}, 0};
    side.offset = -side.at({a[0], a[1]});
    if (side.at(centre) > 0) side = {{-side.outward[0], -side.outward[1]}, -side.offset};
    sides.push_back(side);
  }
  return sides;
}

}  // namespace

/// Which parts of its circles are in a cell: between the places where its edges cut them.
void CircleSkins::add_spans(std::uint32_t number) {
  const auto circles = circles_of(number);
  if (circles.empty()) return;
  const auto sides = half_planes_of(*cells_[number].batch, cells_[number].cell, rounding_);
  for (const std::uint32_t i : circles) {
    const Circle& circle = circles_[i];
    std::vector<double> places;
    for (const HalfPlane& side : sides)
      for (const Point& p : meetings(circle, side.outward, side.offset - rounding_, 0))
        places.push_back(circle.angle_of(p));
    if (places.empty()) places.push_back(0);
    std::sort(places.begin(), places.end());
    const auto is_within = [&](const Point& p) {
      return std::all_of(sides.begin(), sides.end(),
                         [&](const HalfPlane& side) { return side.at(p) <= rounding_; });
    };
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double from = places[k], to = k + 1 < places.size() ? places[k + 1] : places[0] + turn;
      if (to > from && is_within(circle.at((from + to) / 2))) spans_[i].push_back({from, to, number});
    }
  }
}

// --- asking ---

bool CircleSkins::has_side(const Span& span, std::int32_t part, bool is_inside) const {
  const FuzzyCell& cell = cells_[span.cell];
  return (cell.inside == part) == is_inside && (cell.outside == part) != is_inside;
}

/// The parts of a circle's spans in a piece of it, by where they begin.
std::vector<CircleSkins::Span> CircleSkins::within(const Arc& arc) const {
  std::vector<Span> found;
  for (const Span& span : spans_[arc.circle]) {
    if (is_alone(span) && !has_side(span, arc.part, arc.is_inside)) continue;
    const double begin = arc.from + angle_after(arc.from, span.from), sweep = span.to - span.from;
    for (const double start : {begin - turn, begin}) {
      const double low = std::max(start, arc.from), high = std::min(start + sweep, arc.from + arc.sweep);
      if (low < high) found.push_back({low, high, span.cell});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Span& a, const Span& b) { return std::tie(a.from, a.to) < std::tie(b.from, b.to); });
  return found;
}

/// How many points there are in a piece between two angles, but for its ends, in which other circles cross it
/// that are left there, too.
/// @param spans of the piece.
std::size_t CircleSkins::crossings(const Arc& arc, const std::vector<Span>& spans, double from,
                                   double to) const {
  std::vector<std::uint32_t> others;
  for (const Span& span : spans)
    if (span.from <= to + same_angle && span.to >= from - same_angle)
      for (const std::uint32_t other : cells_[span.cell].circles)
        if (other != arc.circle) others.push_back(other);
  std::sort(others.begin(), others.end());
  others.erase(std::unique(others.begin(), others.end()), others.end());
  std::size_t count = 0;
  const Circle& circle = circles_[arc.circle];
  for (const std::uint32_t other : others) {
    const auto points = meetings(circle, circles_[other], rounding_);
    if (points.size() != 2) continue;  // they may touch: none passes from one side of the other to the other
    count += static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const Point& p) {
      const double at = arc.from + angle_after(arc.from - same_angle, circle.angle_of(p)) - same_angle;
      const bool is_at_end = at <= arc.from + same_angle || at >= arc.from + arc.sweep - same_angle;
      return !is_at_end && at >= from - same_angle && at <= to + same_angle;
    }));
  }
  return count;
}

bool CircleSkins::bounds(const Arc& arc, Beside beside, bool alone) const {
  const double to = arc.from + arc.sweep;
  const std::vector<Span> spans = within(arc);
  double reached = arc.from, alone_to = arc.from;
  bool is_ever_alone = false;
  // Between the spans where nothing else is left, others must not cross it.
  const auto is_crossed_before = [&](double end) {
    if (!(end > alone_to + same_angle)) return false;
    const bool is_between = beside == Beside::boundary || (alone_to > arc.from && end < to);
    return crossings(arc, spans, alone_to, end) > (is_between ? 1U : 0U);
  };
  for (const Span& span : spans) {
    if (span.from > reached + same_angle) return false;
    reached = std::max(reached, span.to);
    if (!is_alone(span)) continue;
    if (is_crossed_before(span.from)) return false;
    is_ever_alone = is_ever_alone || span.to - span.from > same_angle;
    alone_to = std::max(alone_to, span.to);
  }
  return reached >= to - same_angle && !is_crossed_before(to) && (is_ever_alone || !alone);
}

/// Begins where nothing else is left, so that no end of it lies where others cross.
bool CircleSkins::bounds_all_around(std::uint32_t circle, std::int32_t part, bool is_inside) const {
  const auto& spans = spans_[circle];
  const auto first = std::find_if(spans.begin(), spans.end(), [&](const Span& span) {
    return is_alone(span) && has_side(span, part, is_inside);
  });
  return first != spans.end() &&
         bounds({circle, part, is_inside, (first->from + first->to) / 2, turn}, Beside::boundary, true);
}

}  // namespace bsp2::dataflow
