#include "shaping/sizing.hpp"

#include <algorithm>
#include <bit>
#include <queue>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::meshing {
namespace {

using geometry::Interruption;

// Against the wanted length; half of what is too long is not too short.
constexpr double too_long = 1.4, too_short = 0.69;
// Shapes (`shape_of`): what a split or collapse may leave, since that is made better afterwards; and below
// what it is at once.
constexpr double poor = 0.1, thin = 0.35;
constexpr std::uint32_t octave = 8;  // of ranks

}  // namespace

std::uint32_t rank_of(double x) { return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x) >> 49); }

std::vector<Sizing::Pair> Sizing::edges_where(const std::function<bool(double, double)>& is_wanted,
                                              std::uint64_t since) const {
  std::vector<std::pair<std::uint32_t, Pair>> found;
  std::vector<std::uint32_t> around;
  for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
    if (editor_.star(p).empty() || editor_.changed_at(p) < since) continue;
    Interruption::check();
    editor_.find_neighbours(p, around);
    for (const std::uint32_t q : around)
      if (p < q && editor_.changed_at(q) >= since)
        if (const double length = editor_.length(p, q); is_wanted(length, wanted_.between(p, q)))
          found.push_back({rank_of(length), {p, q}});
  }
  std::sort(found.begin(), found.end());
  std::vector<Pair> edges;
  for (const auto& [rank, edge] : found) edges.push_back(edge);
  return edges;
}

std::uint64_t Sizing::coarsen(std::uint64_t since) { return coarsen(too_short, poor, since); }

std::uint64_t Sizing::coarsen(double share, double least, std::uint64_t since) {
  std::uint64_t gone = 0;
  for (const auto& [u, v] :
       edges_where([share](double length, double wanted) { return length < share * wanted; }, since)) {
    if (editor_.star(u).empty() || editor_.star(v).empty()) continue;
    Interruption::check();
    if (editor_.collapse_either(u, v, {.shape = least, .length = too_long * wanted_.between(u, v)})) ++gone;
  }
  return gone;
}

std::uint64_t Sizing::refine(std::uint64_t since) {
  std::uint64_t all = 0;
  for (int pass = 0; pass < 8; ++pass) {
    const auto edges =
        edges_where([](double length, double wanted) { return length > too_long * wanted; }, since);
    since = editor_.clock();  // what was looked at, and around which nothing has changed, is as it was
    const std::uint64_t made = split_longest(edges);
    if (made == 0) break;
    all += made;
  }
  smooth_all();
  return all;
}

/// Those that are too long by most first, with what comes of them: as many as there are long ones beside a
/// short one would become thin otherwise. @return how many points it has made.
std::uint64_t Sizing::split_longest(const std::vector<Pair>& edges) {
  using Item = std::pair<std::uint32_t, Pair>;
  std::vector<Item> items;
  for (const Pair& edge : edges) items.emplace_back(rank_of(ratio(edge)), edge);
  std::priority_queue<Item> open({}, std::move(items));
  std::uint32_t rank_before = open.empty() ? 0 : open.top().first;
  std::uint64_t made = 0, since = editor_.clock();
  std::vector<std::uint32_t> around;
  while (!open.empty()) {
    Interruption::check();
    const auto [rank, edge] = open.top();
    open.pop();
    if (rank + octave <= rank_before) {
      smooth_changed(std::exchange(since, editor_.clock()));
      rank_before = rank;
    }
    if (editor_.star(edge[0]).empty() || editor_.star(edge[1]).empty() || !(ratio(edge) > too_long)) continue;
    const std::uint32_t m = split(edge);
    if (m == Editor::none) continue;
    ++made;
    editor_.find_neighbours(m, around);
    for (const std::uint32_t q : around)
      if (const Pair next{std::min(m, q), std::max(m, q)}; ratio(next) > too_long)
        open.emplace(rank_of(ratio(next)), next);
  }
  smooth_changed(since);
  return made;
}

/// Splits an edge, and makes better what is around. @return the new point; none if it was refused or did not
/// stay.
std::uint32_t Sizing::split(const Pair& edge) {
  const std::uint32_t m = editor_.split(edge[0], edge[1], poor);
  if (m == Editor::none) return m;
  wanted_.add_between(edge[0], edge[1], m);
  if (take_back(m)) return Editor::none;
  flip_around(m);
  return m;
}

/// A new point that is too near to another one becomes that: its edge leads through that then.
bool Sizing::take_back(std::uint32_t m) {
  std::vector<std::uint32_t> around = editor_.neighbours(m);
  const std::uint32_t q =
      *std::min_element(around.begin(), around.end(), [&](std::uint32_t a, std::uint32_t b) {
        return ratio({m, a}) < ratio({m, b});
      });
  if (!(ratio({m, q}) < too_short) ||
      !editor_.collapse(m, q, {.shape = poor, .length = too_long * wanted_.between(m, q)}))
    return false;
  flip_around(q);
  return true;
}

/// Flips faces over which a point sees others, and removes edges across from it, where what is at it is not
/// good.
void Sizing::flip_around(std::uint32_t p) {
  const std::vector<std::uint32_t> star(editor_.star(p).begin(), editor_.star(p).end());
  for (const std::uint32_t t : star) {
    if (editor_.at(t).is_gone()) continue;
    const int place = editor_.at(t).place_of(p);
    if (place < 0 || editor_.at(t).shape >= thin) continue;
    if (editor_.flip_face(t, place)) continue;
    const auto points = editor_.at(t).point;
    const std::uint32_t a = points[(place + 1) % 4], b = points[(place + 2) % 4], c = points[(place + 3) % 4];
    if (!editor_.remove_edge(a, b) && !editor_.remove_edge(b, c)) editor_.remove_edge(a, c);
  }
}

/// Where something has changed since then, but not where only these steps change it.
void Sizing::smooth_changed(std::uint64_t since) {
  std::vector<std::uint32_t> changed;
  for (std::uint32_t p = 0; p < editor_.point_count(); ++p)
    if (editor_.changed_at(p) >= since) changed.push_back(p);
  for (const std::uint32_t p : changed) {
    Interruption::check();
    editor_.smooth(p);
  }
}

void Sizing::smooth_all() {
  for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
    Interruption::check();
    editor_.smooth(p);
  }
}

}  // namespace bsp2::meshing
