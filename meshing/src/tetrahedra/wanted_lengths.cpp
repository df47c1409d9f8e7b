#include "tetrahedra/wanted_lengths.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::meshing {
namespace {

using geometry::Interruption;

constexpr double of_features = 3;  // as long may edges be at short edges of the solid
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

double WantedLengths::between(std::uint32_t p, std::uint32_t q) const {
  const auto at = [&](std::uint32_t point) { return point < wanted_.size() ? wanted_[point] : infinity; };
  return std::min(at(p), at(q));
}

void WantedLengths::add_between(std::uint32_t u, std::uint32_t v, std::uint32_t middle) {
  if (middle >= wanted_.size()) wanted_.resize(middle + 1, infinity);
  wanted_[middle] = (wanted_[u] + wanted_[v]) / 2;
}

std::map<std::int32_t, double> WantedLengths::tetrahedra_by_part() const {
  constexpr double volume_of_regular = 0.118;  // by the cube of its edges
  std::map<std::int32_t, double> counts;
  for (std::uint32_t t = 0; t < editor_.size(); ++t) {
    if (editor_.at(t).is_gone()) continue;
    const double size = size_in(editor_.at(t).part);
    counts[editor_.at(t).part] += editor_.volume(t) / (volume_of_regular * size * size * size);
  }
  return counts;
}

double WantedLengths::size_in(std::int32_t part) const {
  const auto number = static_cast<std::size_t>(part);
  const bool is_own = part >= 0 && number < options_.size_of_part.size() && options_.size_of_part[number] > 0;
  return is_own ? options_.size_of_part[number] : options_.size;
}

double WantedLengths::size_at(std::uint32_t p) const {
  double size = infinity;
  for (const std::uint32_t t : editor_.star(p)) size = std::min(size, size_in(editor_.at(t).part));
  return options_.field.is_empty() ? size : std::min(size, options_.field.at(editor_.point(p)));
}

bool WantedLengths::is_at_several_parts(std::uint32_t p) const {
  const auto star = editor_.star(p);
  return std::ranges::any_of(
      star, [&](std::uint32_t t) { return editor_.at(t).part != editor_.at(star.front()).part; });
}

void WantedLengths::find(bool with_features, bool from_seams) {
  wanted_.assign(editor_.point_count(), infinity);
  std::vector<std::pair<double, std::uint32_t>> known;
  for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
    if (editor_.star(p).empty()) continue;
    Interruption::check();
    if (from_seams && !is_at_several_parts(p)) continue;
    const double size = size_at(p);
    wanted_[p] = size;
    if (with_features && editor_.kind(p) == Editor::corner)
      for (const std::uint32_t q : editor_.neighbours(p))
        if (editor_.kind(q) == Editor::corner)
          wanted_[p] = std::min(wanted_[p], std::max(size / 16, of_features * editor_.length(p, q)));
    known.emplace_back(wanted_[p], p);
  }
  for (const Piece::Shared& shared : shared_) {
    wanted_[shared.point] = std::min(wanted_[shared.point], shared.wanted);
    known.emplace_back(wanted_[shared.point], shared.point);
  }
  grow(std::move(known));
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
    editor_.find_neighbours(p, around);
    for (const std::uint32_t q : around) {
      const double through = length + options_.growth * editor_.length(p, q);
      if (through >= wanted_[q]) continue;
      wanted_[q] = through;
      open.emplace(through, q);
    }
  }
}

}  // namespace bsp2::meshing
