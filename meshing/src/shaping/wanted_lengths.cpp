#include "shaping/wanted_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::meshing {
namespace {

using geometry::Interruption;

// As long may edges be where the solid is as thin as 1: along strips and short edges, and of walls.
constexpr double of_details = 4, of_walls = 6;
// And beside an edge of the solid by how thick it is there: where its angle is less than the one from which
// on that says more than the strip's width, and above the one below which no tetrahedron is good anyway.
constexpr double of_wedges = 8, blunt = 0.5236, sharp = 0.1745;
// Details of a length that is this share of the wanted one are refined for at first; then by step and step
// finer ones, but no finer than that: what is coarse is of good shape then, and what is fine goes over to it.
// Where that makes too many tetrahedra, steps are smaller.
constexpr double coarsest = 1.0 / 16, finest = 1.0 / 65536, largest_step = 1.0 / 8, last_step = 0.8;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// The mean of the inverse cubes of a number that goes linearly from corner to corner of a tetrahedron: the
/// divided difference of what has been integrated three times (Hermite and Genocchi).
double mean_of_inverse_cubes(std::array<double, 4> at_corners) {
  std::sort(at_corners.begin(), at_corners.end());
  constexpr long double apart = 1e-3L;  // so that none are equal
  std::array<long double, 4> x, f;
  for (std::size_t k = 0; k < 4; ++k) {
    x[k] = at_corners[k] * (1 + apart * static_cast<long double>(k));
    f[k] = std::log(x[k]) / 2;
  }
  for (std::size_t order = 1; order < 4; ++order)
    for (std::size_t k = 0; k + order < 4; ++k) f[k] = (f[k + 1] - f[k]) / (x[k + order] - x[k]);
  return static_cast<double>(6 * f[0]);
}

}  // namespace

double WantedLengths::between(std::uint32_t p, std::uint32_t q) const {
  const auto at = [&](std::uint32_t point) { return point < wanted_.size() ? wanted_[point] : infinity; };
  return std::min(at(p), at(q));
}

void WantedLengths::add_between(std::uint32_t u, std::uint32_t v, std::uint32_t middle) {
  if (middle >= wanted_.size()) wanted_.resize(middle + 1, infinity);
  wanted_[middle] = (wanted_[u] + wanted_[v]) / 2;
  if (is_urgent(u) && is_urgent(v)) hurry(middle);
}

std::map<std::int32_t, double> WantedLengths::tetrahedra_by_part() const {
  std::map<std::int32_t, double> counts;
  for (std::uint32_t t = 0; t < editor_->size(); ++t)
    if (const auto part = editor_->at(t).part; !editor_->at(t).is_gone())
      counts[part] += count_of_size(editor_->volume(t), options_->size_in(part));
  return counts;
}

double WantedLengths::size_at(std::uint32_t p) const {
  double size = infinity;
  for (const std::uint32_t t : editor_->star(p))
    size = std::min(size, options_->size_in(editor_->at(t).part));
  return options_->field.is_empty() ? size : std::min(size, options_->field.at(editor_->point(p)));
}

bool WantedLengths::is_at_several_parts(std::uint32_t p) const {
  const auto star = editor_->star(p);
  return std::ranges::any_of(
      star, [&](std::uint32_t t) { return editor_->at(t).part != editor_->at(star.front()).part; });
}

void WantedLengths::find(bool with_details, bool from_seams) {
  wanted_.assign(editor_->point_count(), infinity);
  for (std::uint32_t p = 0; p < editor_->point_count(); ++p) {
    if (editor_->star(p).empty() || (from_seams && !is_at_several_parts(p))) continue;
    Interruption::check();
    wanted_[p] = size_at(p);
  }
  if (with_details) {
    for (Details* details : {&along_, &short_}) {
      if (details->least == 0) details->begin();
      details->is_cut = false;
    }
    urgent_.is_cut = false;
    find_short_edges();
    find_strips_and_walls();
  }
  for (const Piece::Shared& shared : *shared_)
    wanted_[shared.point] = std::min(wanted_[shared.point], shared.wanted);
  std::vector<std::pair<double, std::uint32_t>> known;
  for (std::uint32_t p = 0; p < editor_->point_count(); ++p)
    if (wanted_[p] < infinity) known.emplace_back(wanted_[p], p);
  grow(std::move(known));
}

void WantedLengths::Details::begin() {
  least = coarsest;
  step = largest_step;
}

void WantedLengths::Details::take_smaller_steps() { step = std::sqrt(step); }

bool WantedLengths::Details::may_be_finer() const { return is_cut && step <= last_step && least > finest; }

bool WantedLengths::may_be_finer() const {
  return along_.may_be_finer() || short_.may_be_finer() || urgent_.may_be_finer() || may_grow_faster();
}

bool WantedLengths::may_grow_faster() const {
  const auto is_left = [](const Details& details) { return details.is_cut && details.least > finest; };
  return growth_ < options_->steepest_growth && !has_grown_faster_ && (is_left(along_) || is_left(short_));
}

void WantedLengths::find_finer() {
  if (without_details_ == 0) {
    along_.begin();
    short_.begin();
    find(true);
    without_details_ = expected();
    return;
  }
  find(true);  // the mesh has become finer since, and may show more
  if (find_finer_that_fit() || (urgent_.may_be_finer() && find_finer_urgent())) return;
  if (!along_.is_cut && !short_.is_cut && !urgent_.is_cut) too_many_ = 0;
  if (!may_grow_faster()) return;
  has_grown_faster_ = true;
  growth_ = options_->steepest_growth;
  along_.step = short_.step = std::sqrt(largest_step);
  if (find_finer_that_fit()) {
    too_many_ = 0;
  } else {
    growth_ = options_->growth;
    find(true);
  }
}

/// Of kinds of which some are finer. @return whether there are such lengths; if not, all is as it was.
bool WantedLengths::find_finer_that_fit() {
  const Details along = along_, shorts = short_;
  const auto finer = [](const Details& before, const Details& now) {
    return before.is_cut && before.least > finest && now.step <= last_step
               ? std::max(finest, now.step * before.least)
               : before.least;
  };
  for (;;) {
    const double finer_along = finer(along, along_), finer_short = finer(shorts, short_);
    const bool is_along = finer_along < along.least, is_short = finer_short < shorts.least;
    if (!is_along && !is_short) break;
    if (fits_with(finer_along, finer_short)) return true;
    if (is_along && is_short && fits_with(along.least, finer_short)) {
      along_.take_smaller_steps();
      return true;
    }
    if (is_along && is_short && fits_with(finer_along, shorts.least)) {
      short_.take_smaller_steps();
      return true;
    }
    if (is_along) along_.take_smaller_steps();
    if (is_short) short_.take_smaller_steps();
  }
  if (along_.step == along.step && short_.step == shorts.step) return false;
  along_.least = along.least;
  short_.least = shorts.least;
  find(true);
  return false;
}

bool WantedLengths::begin_again_with_cleaned() {
  constexpr double share = 0.1;  // of what may be added: without limit such strips would take all of it
  if (too_many_ > 0 || !along_.leaves_out_cleaned) return false;
  find(true);
  most_ = std::min(most_, expected() - without_details_ + share * options_->most);
  along_.leaves_out_cleaned = false;
  for (Details* details : {&along_, &short_, &urgent_}) details->begin();
  return true;
}

void WantedLengths::hurry(std::uint32_t p) {
  if (p >= is_urgent_.size()) is_urgent_.resize(editor_->point_count());
  is_urgent_[p] = true;
}

bool WantedLengths::find_urgent(std::span<const std::uint32_t> points) {
  along_.step = short_.step = 1;  // the others stay as they are
  find(true);
  most_ = std::max(most_, expected() - without_details_) + options_->most;
  for (const std::uint32_t p : points) hurry(p);
  urgent_.least = std::max(along_.least, short_.least);
  urgent_.step = largest_step;
  return find_finer_urgent();
}

/// @return whether that fits; if not, all is as it was.
bool WantedLengths::find_finer_urgent() {
  const double before = urgent_.least;
  for (; urgent_.step <= last_step && before > finest; urgent_.take_smaller_steps()) {
    urgent_.least = std::max(finest, urgent_.step * before);
    if (fits()) return true;
  }
  urgent_.least = before;
  find(true);
  return false;
}

void WantedLengths::renumber(const std::vector<std::uint32_t>& map) {
  std::vector<bool> before(editor_->point_count());
  before.swap(is_urgent_);
  for (std::uint32_t p = 0; p < std::min(before.size(), map.size()); ++p)
    if (before[p] && map[p] != Editor::none) is_urgent_[map[p]] = true;
}

bool WantedLengths::fits_with(double least_along, double least_short) {
  along_.least = least_along;
  short_.least = least_short;
  return fits();
}

/// Finds the lengths. @return whether that does not make too many tetrahedra.
bool WantedLengths::fits() {
  find(true);
  const double count = expected();
  if (count <= without_details_ + most_) return true;
  if (too_many_ == 0) too_many_ = count;
  return false;
}

void WantedLengths::find_finest() {
  const Details along = along_, shorts = short_;
  along_.least = short_.least = finest;
  find(true);
  along_ = along;
  short_ = shorts;
}

double WantedLengths::expected() const {
  constexpr double volume =
      0.05;  // of those that come of it, on the average, by the cube of the wanted length
  double count = 0;
  for (std::uint32_t t = 0; t < editor_->size(); ++t) {
    if (editor_->at(t).is_gone()) continue;
    const auto& p = editor_->at(t).point;
    count += editor_->volume(t) / volume *
             mean_of_inverse_cubes({wanted_[p[0]], wanted_[p[1]], wanted_[p[2]], wanted_[p[3]]});
  }
  return count;
}

/// A tetrahedron that stands with one face on a side and with its top on another.
void WantedLengths::find_wall(std::uint32_t t, std::size_t top) {
  const auto& p = editor_->at(t).point;
  const std::uint32_t m = p[top];
  if (editor_->kind(m) == Editor::inside) return;
  const std::array<std::uint32_t, 3> face{p[(top + 1) % 4], p[(top + 2) % 4], p[(top + 3) % 4]};
  const Point n = geometry::cross(geometry::minus(editor_->point(face[1]), editor_->point(face[0])),
                                  geometry::minus(editor_->point(face[2]), editor_->point(face[0])));
  const double thickness = 6 * editor_->volume(t) / std::sqrt(geometry::dot(n, n));
  if (!(of_walls * thickness < wanted_[m])) return;
  // Sides that meet are an edge of the solid, which has its angle.
  if (std::ranges::any_of(face, [&](std::uint32_t q) { return editor_->is_on_surface(m, q); })) return;
  for (const std::uint32_t q : p) want_detail(q, thickness, of_walls, along_);
}

/// So long shall edges be at a point for the sake of a detail. Strips as thin as what is cleaned are none:
/// where no moves are left for them, good ones would take too many tetrahedra.
void WantedLengths::want_detail(std::uint32_t p, double thickness, double times, Details& details) {
  const double length = times * thickness;
  if ((details.leaves_out_cleaned && thickness < options_->clean) ||
      !(wanted_[p] < infinity && length < wanted_[p]))
    return;
  Details& own = is_urgent(p) && urgent_.least < details.least ? urgent_ : details;
  const double least = own.least * size_at(p);
  own.is_cut = own.is_cut || length < least;
  wanted_[p] = std::min(wanted_[p], std::max(least, length));
}

void WantedLengths::find_short_edges() {
  for (std::uint32_t p = 0; p < editor_->point_count(); ++p) {
    if (editor_->kind(p) != Editor::corner || wanted_[p] == infinity) continue;
    Interruption::check();
    for (const std::uint32_t q : editor_->neighbours(p))
      if (editor_->kind(q) == Editor::corner) want_detail(p, editor_->length(p, q), of_details, short_);
  }
}

/// Where two edges of the solid run along each other on one side of it, or two sides.
void WantedLengths::find_strips_and_walls() {
  for (std::uint32_t t = 0; t < editor_->size(); ++t) {
    if (editor_->at(t).is_gone()) continue;
    Interruption::check();
    const auto& p = editor_->at(t).point;
    for (std::size_t k = 0; k < 4; ++k)
      if (editor_->at(t).side[k] != Editor::inner) {
        find_wall(t, k);
        for (std::size_t i = 1; i < 4; ++i)
          find_strip(p[(k + i) % 4], p[(k + i % 3 + 1) % 4], p[(k + (i + 1) % 3 + 1) % 4]);
      }
  }
}

void WantedLengths::find_strip(std::uint32_t m, std::uint32_t u, std::uint32_t v) {
  if (editor_->kind(m) > Editor::on_edge) return;
  const auto distance = editor_->distance_from_edge(m, u, v);
  if (!distance || of_wedges * std::sin(sharp) * *distance >= wanted_[m] || !editor_->is_sharp(u, v)) return;
  // Two edges that meet are a corner of the solid, which has its angle.
  if (editor_->is_sharp(m, u) || editor_->is_sharp(m, v)) return;
  const double wedge = editor_->smallest_wedge(u, v);
  const bool is_wedge = sharp < wedge && wedge < blunt;
  want_detail(m, *distance, is_wedge ? of_wedges * std::sin(wedge) : of_details, along_);
}

/// From what is known on, by which share of the distance edges may grow.
void WantedLengths::grow(std::vector<std::pair<double, std::uint32_t>> known) {
  using Item = std::pair<double, std::uint32_t>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> open(std::greater<>(), std::move(known));
  std::vector<std::uint32_t> around;
  while (!open.empty()) {
    Interruption::check();
    const auto [length, p] = open.top();
    open.pop();
    if (length > wanted_[p]) continue;
    editor_->find_neighbours(p, around);
    for (const std::uint32_t q : around) {
      const double through = length + growth_ * editor_->length(p, q);
      if (through >= wanted_[q]) continue;
      wanted_[q] = through;
      open.emplace(through, q);
    }
  }
}

}  // namespace bsp2::meshing
