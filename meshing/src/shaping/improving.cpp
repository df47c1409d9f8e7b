#include "shaping/improving.hpp"

#include <algorithm>
#include <tuple>

#include "bsp2/geometry/support/interruption.hpp"
#include "shaping/sizing.hpp"

namespace bsp2::meshing {

using geometry::Interruption;

std::uint64_t Improver::improve(double below, bool with_new_points) {
  std::vector<std::tuple<std::uint32_t, std::uint32_t, double>> worst;
  for (std::uint32_t t = 0; t < editor_.size(); ++t)
    if (const double shape = editor_.at(t).shape; !editor_.at(t).is_gone() && shape < below)
      worst.emplace_back(rank_of(std::max(shape, 0.0)), t, shape);
  std::sort(worst.begin(), worst.end());
  std::uint64_t count = 0;
  for (const auto& [rank, t, shape] : worst) {
    Interruption::check();
    if (editor_.at(t).is_gone() || editor_.at(t).shape != shape || is_settled(t, with_new_points)) continue;
    if (improve_one(t, with_new_points))
      ++count;
    else
      tried_[t] = {editor_.clock(), with_new_points};
  }
  return count;
}

/// Whether it was tried in vain, and nothing around it has changed since.
bool Improver::is_settled(std::uint32_t t, bool with_new_points) {
  if (tried_.size() < editor_.size()) tried_.resize(editor_.size());
  const auto& [clock, with] = tried_[t];
  const auto& points = editor_.at(t).point;
  return with >= with_new_points && std::all_of(points.begin(), points.end(), [&, when = clock](auto p) {
           return editor_.changed_at(p) < when;
         });
}

bool Improver::improve_one(std::uint32_t t, bool with_new_points) {
  const auto edges = editor_.at(t).edges();
  for (const auto& [u, v] : edges)
    if (editor_.remove_edge(u, v)) return true;
  for (int face = 0; face < 4; ++face)
    if (editor_.flip_face(t, face)) return true;
  const auto points = editor_.at(t).point;
  for (const std::uint32_t p : points)
    if (editor_.smooth(p)) return true;
  // A collapse counts if all that comes of it is better than this one.
  const double better = editor_.at(t).shape * 1.01 + 1e-9;
  for (const auto& [u, v] : edges)
    for (const auto& [from, to] : {std::pair(u, v), std::pair(v, u)})
      if (collapse_to_better(from, to, better)) return true;
  if (editor_.divide_face(t, better)) return true;
  if (!with_new_points) return false;
  // Of the surface only what is long, so that its edges do not become ever shorter.
  for (const auto& [u, v] : edges)
    if ((editor_.length(u, v) > wanted_.between(u, v) || !editor_.is_on_surface(u, v)) &&
        editor_.split_better(u, v))
      return true;
  return insert_near(t);
}

/// Puts a point in the middle of a tetrahedron, or of it and one beside it.
bool Improver::insert_near(std::uint32_t t) {
  const double better = std::max(0.0, editor_.at(t).shape) * 1.1;
  const Point middle = editor_.middle(t);
  std::vector<Point> places{middle};
  for (int face = 0; face < 4; ++face)
    if (const std::uint32_t other = editor_.beyond(t, face); other != Editor::none) {
      Point x = editor_.middle(other);
      for (std::size_t k = 0; k < 3; ++k) x[k] = (x[k] + middle[k]) / 2;
      places.push_back(x);
    }
  return std::any_of(places.begin(), places.end(), [&](const Point& x) {
    if (!editor_.insert(t, x, better)) return false;
    editor_.smooth(static_cast<std::uint32_t>(editor_.point_count() - 1));
    return true;
  });
}

bool Improver::collapse_to_better(std::uint32_t u, std::uint32_t v, double better) {
  return editor_.kind(u) > Editor::corner &&
         editor_.collapse(u, v, {.shape = better, .length = 2 * wanted_.between(u, v)});
}

void Improver::settle_all_but(const std::vector<bool>& points) {
  tried_.assign(editor_.size(), {});
  for (std::uint32_t t = 0; t < editor_.size(); ++t)
    if (std::ranges::none_of(editor_.at(t).point, [&](std::uint32_t p) { return points[p]; }))
      tried_[t] = {editor_.clock(), true};
}

}  // namespace bsp2::meshing
