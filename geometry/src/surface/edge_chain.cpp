#include "bsp2/geometry/surface/edge_chain.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::geometry {
namespace {

std::pair<std::uint32_t, std::uint32_t> ends(const Skin::Edge& edge) {
  return std::minmax(edge.from, edge.to);
}

constexpr std::size_t few = 8;  // below it all pairs are looked at

}  // namespace

std::vector<std::uint32_t> group_by_face(EdgeChain& edges) {
  std::vector<std::uint32_t> begin;  // of each face, then its end
  for (const Skin::Edge& edge : edges) {
    if (edge.face + std::size_t{2} > begin.size()) begin.resize(edge.face + std::size_t{2});
    ++begin[edge.face + std::size_t{1}];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  EdgeChain grouped(edges.size());
  for (const Skin::Edge& edge : edges) grouped[begin[edge.face]++] = edge;
  edges.swap(grouped);
  return begin;
}

void add_up(EdgeChain& edges) {
  sort_by_face(edges, [](const Skin::Edge& a, const Skin::Edge& b) {
    return std::tuple(ends(a), a.across, a.from) < std::tuple(ends(b), b.across, b.from);
  });
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    std::ptrdiff_t sum = 0;
    for (end = begin;
         end < edges.size() && edges[end].face == edges[begin].face && ends(edges[end]) == ends(edges[begin]);
         ++end)
      sum += edges[end].from < edges[end].to ? 1 : -1;
    Skin::Edge edge = edges[begin];
    if ((edge.from < edge.to) != (sum > 0)) std::swap(edge.from, edge.to);
    for (; sum != 0; sum += sum > 0 ? -1 : 1) edges[kept++] = edge;
  }
  edges.resize(kept);
}

HyperplaneId common_plane(const PointSet& points, std::uint32_t a, std::uint32_t b, HyperplaneId own) {
  const auto p = points.planes_of(a), q = points.planes_of(b);
  for (std::size_t i = 0, k = 0; i < p.size() && k < q.size();) {
    if (p[i] == q[k]) {
      if (p[i] != own) return p[i];
      ++i, ++k;
    } else {
      p[i] < q[k] ? ++i : ++k;
    }
  }
  throw std::logic_error("the ends of an edge share one plane only");
}

void LineAdder::add_up(const PointSet& points, HyperplaneId plane, EdgeChain& edges) {
  items_.clear();
  for (const Skin::Edge& edge : edges)
    items_.push_back({std::uint64_t{common_plane(points, edge.from, edge.to, plane)} << 32 | edge.face,
                      edge.from, edge.to});
  std::sort(items_.begin(), items_.end(),
            [](const Item& a, const Item& b) { return a.line_and_face < b.line_and_face; });
  edges.clear();
  for (std::size_t begin = 0, end = 0; begin < items_.size(); begin = end) {
    while (end < items_.size() && items_[end].line_and_face == items_[begin].line_and_face) ++end;
    add_line(points, std::span(items_).subspan(begin, end - begin), edges);
  }
}

void LineAdder::add_line(const PointSet& points, std::span<const Item> items, EdgeChain& sum) {
  const auto across = static_cast<HyperplaneId>(items[0].line_and_face >> 32);
  const auto face = static_cast<std::uint32_t>(items[0].line_and_face);
  if (items.size() == 1) {
    sum.push_back({items[0].from, items[0].to, face, across});
    return;
  }
  // What an edge adds to all that is beyond its end, it takes away beyond its beginning. By points, then
  // along the line.
  ends_.clear();
  for (const Item& item : items) {
    ends_.push_back({item.from, 1});
    ends_.push_back({item.to, -1});
  }
  std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) { return a.point < b.point; });
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < ends_.size(); begin = end) {
    End total{ends_[begin].point, 0};
    for (; end < ends_.size() && ends_[end].point == total.point; ++end) total.change += ends_[end].change;
    if (total.change != 0) ends_[kept++] = total;
  }
  ends_.resize(kept);
  if (ends_.empty()) return;
  const int axis = ExactPoints::axis_of_line(points, items[0].from, items[0].to);
  std::sort(ends_.begin(), ends_.end(), [&](const End& a, const End& b) {
    if (a.point == b.point) return false;
    if (axis >= 0) return exact_.compare(points, a.point, b.point, axis) < 0;
    for (int k = 0; k < 3; ++k)
      if (const int order = exact_.compare(points, a.point, b.point, k)) return order < 0;
    return false;
  });
  int count = 0;
  for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
    count += ends_[i].change;
    for (int k = 0; k < count; ++k) sum.push_back({ends_[i].point, ends_[i + 1].point, face, across});
    for (int k = 0; k > count; --k) sum.push_back({ends_[i + 1].point, ends_[i].point, face, across});
  }
}

void EdgeSplitter::collect_segments(std::span<const Skin::Face> faces, const EdgeChain& edges) {
  segments_.clear();
  for (const Skin::Edge& edge : edges) {
    const auto [low, high] = ends(edge);
    segments_.push_back({low, high, faces[edge.face].outward.id(), edge.across});
  }
  // By their lower ends, by counting; the few at each by the others.
  std::vector<std::uint32_t> begin;
  for (const Segment& segment : segments_) {
    if (segment.from + std::size_t{2} > begin.size()) begin.resize(segment.from + std::size_t{2});
    ++begin[segment.from + std::size_t{1}];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Segment> sorted(segments_.size());
  for (const Segment& segment : segments_) sorted[begin[segment.from]++] = segment;
  segments_.swap(sorted);
  for (std::size_t point = 0, first = 0; point + 1 < begin.size(); first = begin[point++])
    std::sort(segments_.begin() + static_cast<std::ptrdiff_t>(first),
              segments_.begin() + static_cast<std::ptrdiff_t>(begin[point]),
              [](const Segment& a, const Segment& b) {
                return std::tie(a.to, a.plane, a.across) < std::tie(b.to, b.plane, b.across);
              });
  segments_.erase(
      std::unique(segments_.begin(), segments_.end(),
                  [](const Segment& a, const Segment& b) { return a.from == b.from && a.to == b.to; }),
      segments_.end());
}

bool EdgeSplitter::is_inside(const Search& search, const Segment& segment, std::uint32_t point) {
  if (point == segment.from || point == segment.to) return false;
  const auto& [exact, points, inner] = search;
  const Vertex<3>&u = points.vertices[segment.from], &v = points.vertices[segment.to],
        &w = points.vertices[point];
  std::array<double, 3> along, to;
  double length = 0, projected = 0;
  for (int k = 0; k < 3; ++k) {
    along[k] = v.x[k] - u.x[k];
    to[k] = w.x[k] - u.x[k];
    length += along[k] * along[k];
    projected += along[k] * to[k];
  }
  const double share = length > 0 ? std::clamp(projected / length, 0.0, 1.0) : 0;
  const double reach = 2 * (u.error + v.error + w.error) + 0x1p-49 * std::sqrt(length);
  for (int k = 0; k < 3; ++k)
    if (std::fabs(to[k] - share * along[k]) > reach) return false;
  return exact.side(points, point, segment.plane) == 0 && exact.side(points, point, segment.across) == 0 &&
         exact.is_between(points, segment.from, point, segment.to);
}

/// Makes a k-d tree: the one in the middle parts those before it from those after it, along its axis.
void EdgeSplitter::build(std::span<Candidate> candidates) {
  if (candidates.size() <= few) return;
  std::array<double, 3> low = candidates[0].x, high = low;
  for (const Candidate& candidate : candidates)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], candidate.x[k]);
      high[k] = std::max(high[k], candidate.x[k]);
    }
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  const std::size_t half = candidates.size() / 2;
  std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(half),
                   candidates.end(),
                   [axis](const Candidate& a, const Candidate& b) { return a.x[axis] < b.x[axis]; });
  candidates[half].axis = axis;
  build(candidates.first(half));
  build(candidates.subspan(half + 1));
}

auto EdgeSplitter::way_of(const Search& search, std::uint32_t number) const -> Way {
  const Segment& segment = segments_[number];
  const auto &from = search.points.vertices[segment.from].x, &to = search.points.vertices[segment.to].x;
  Way way{number, from, {}, {}, {}};
  for (int k = 0; k < 3; ++k) {
    way.step[k] = to[k] - from[k];
    way.low[k] = std::min(from[k], to[k]) - margin_;
    way.high[k] = std::max(from[k], to[k]) + margin_;
  }
  return way;
}

/// Follows a piece of a segment down the tree. Shares of its length are rounded by 2^-51 of it at most, for
/// which the margin has room.
void EdgeSplitter::find(const Search& search, const Way& way, std::span<const Candidate> candidates,
                        double low, double high) const {
  const auto test = [&](const Candidate& candidate) {
    bool is_near = true;
    for (int k = 0; k < 3; ++k) is_near &= way.low[k] <= candidate.x[k] && candidate.x[k] <= way.high[k];
    if (is_near && is_inside(search, segments_[way.number], candidate.point))
      search.inner.emplace_back(way.number, candidate.point);
  };
  while (candidates.size() > few) {
    const std::size_t half = candidates.size() / 2;
    const Candidate& middle = candidates[half];
    test(middle);
    const double start = way.from[middle.axis], step = way.step[middle.axis];
    const double at_low = start + low * step, at_high = start + high * step;
    const auto share_at = [&](double position) { return std::clamp((position - start) / step, low, high); };
    const double bottom = middle.x[middle.axis] - margin_, top = middle.x[middle.axis] + margin_;
    const std::span<const Candidate> above = candidates.subspan(half + 1);
    if (std::min(at_low, at_high) > top) {
      candidates = above;
      continue;
    }
    if (std::max(at_low, at_high) >= bottom)
      find(search, way, above, at_low < bottom ? share_at(bottom) : low,
           at_high < bottom ? share_at(bottom) : high);
    candidates = candidates.first(half);
    const double low_below = at_low > top ? share_at(top) : low;
    high = at_high > top ? share_at(top) : high;
    low = low_below;
  }
  for (const Candidate& candidate : candidates) test(candidate);
}

/// The points of each segment in order from its lower end.
void EdgeSplitter::sort_inner(const PointSet& points) {
  std::sort(inner_.begin(), inner_.end());
  for (std::size_t begin = 0, end = 0; begin < inner_.size(); begin = end) {
    const std::uint32_t segment = inner_[begin].first;
    while (end < inner_.size() && inner_[end].first == segment) ++end;
    std::sort(inner_.begin() + static_cast<std::ptrdiff_t>(begin),
              inner_.begin() + static_cast<std::ptrdiff_t>(end), [&](const auto& a, const auto& b) {
                return a.second != b.second &&
                       exact_.is_before(points, a.second, b.second, segments_[segment].to);
              });
  }
}

std::vector<bool> EdgeSplitter::ends_of_segments(std::size_t points) const {
  std::vector<bool> is_end(points);
  for (const Segment& segment : segments_) is_end[segment.from] = is_end[segment.to] = true;
  return is_end;
}

/// In ascending order of points, as a tree.
auto EdgeSplitter::candidates(const PointSet& points, const std::vector<bool>& is_one)
    -> std::vector<Candidate> {
  double largest_error = 0;
  std::vector<Candidate> candidates;
  for (std::uint32_t point = 0; point < points.size(); ++point) {
    if (!is_one[point]) continue;
    candidates.push_back({points.vertices[point].x, point, 0});
    largest_error = std::max(largest_error, points.vertices[point].error);
  }
  margin_ = 8 * largest_error + 0x1p-48 * exact_.table().radius();
  build(candidates);
  return candidates;
}

/// Follows segments down the tree together, each as far as all of it is on one side of what parts the points.
void EdgeSplitter::descend(std::span<const Candidate> candidates, std::span<std::uint32_t> numbers,
                           const PointSet& points, std::size_t small, std::vector<Bundle>& bundles) const {
  if (numbers.empty()) return;
  if (numbers.size() <= small || candidates.size() <= few) {
    bundles.push_back({candidates, numbers});
    return;
  }
  const std::size_t half = candidates.size() / 2;
  const auto [below, across] = part(candidates[half], numbers, points);
  const std::span<std::uint32_t> crossing = numbers.subspan(below, across - below);
  for (std::size_t i = 0; i < crossing.size(); i += small)
    bundles.push_back({candidates, crossing.subspan(i, std::min(small, crossing.size() - i)), true});
  descend(candidates.first(half), numbers.first(below), points, small, bundles);
  descend(candidates.subspan(half + 1), numbers.subspan(across), points, small, bundles);
}

/// Those that are before the middle one, those that may meet it, and those after it. @return where they end.
std::pair<std::size_t, std::size_t> EdgeSplitter::part(const Candidate& middle,
                                                       std::span<std::uint32_t> numbers,
                                                       const PointSet& points) const {
  const auto axis = static_cast<std::size_t>(middle.axis);
  const double bottom = middle.x[axis] - margin_, top = middle.x[axis] + margin_;
  const auto from = [&](std::uint32_t i) { return points.vertices[segments_[i].from].x[axis]; };
  const auto to = [&](std::uint32_t i) { return points.vertices[segments_[i].to].x[axis]; };
  const auto below = std::partition(numbers.begin(), numbers.end(),
                                    [&](std::uint32_t i) { return std::max(from(i), to(i)) < bottom; });
  const auto across =
      std::partition(below, numbers.end(), [&](std::uint32_t i) { return std::min(from(i), to(i)) <= top; });
  return {static_cast<std::size_t>(below - numbers.begin()),
          static_cast<std::size_t>(across - numbers.begin())};
}

void EdgeSplitter::find_all(const Search& search, const Bundle& bundle) const {
  const auto [candidates, numbers, is_crossing] = bundle;
  Interruption::check();
  if (is_crossing || candidates.size() <= few || numbers.size() <= 2) {
    for (const std::uint32_t number : numbers) find(search, way_of(search, number), candidates, 0, 1);
    return;
  }
  const std::size_t half = candidates.size() / 2;
  const auto [below, across] = part(candidates[half], numbers, search.points);
  find_all(search, {candidates, numbers.subspan(below, across - below), true});
  find_all(search, {candidates.first(half), numbers.first(below)});
  find_all(search, {candidates.subspan(half + 1), numbers.subspan(across)});
}

void EdgeSplitter::find_inner(const PointSet& points, std::span<const Candidate> candidates) {
  std::vector<std::uint32_t> numbers(segments_.size());
  std::iota(numbers.begin(), numbers.end(), 0U);
  std::vector<Bundle> bundles;
  const std::size_t small = threads_ <= 1 ? numbers.size() : std::max<std::size_t>(2048, numbers.size() / 64);
  descend(candidates, numbers, points, small, bundles);
  std::vector<Inner> found(bundles.size());
  const auto work = [&](ExactPoints& exact, std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) find_all({exact, points, found[i]}, bundles[i]);
  };
  if (bundles.size() <= 1)
    work(exact_, 0, bundles.size());
  else
    for_each_range(bundles.size(), 1, threads_, [&](std::size_t first, std::size_t end) {
      ExactPoints own(exact_.table());
      work(own, first, end);
    });
  inner_.clear();
  for (const Inner& some : found) inner_.insert(inner_.end(), some.begin(), some.end());
}

auto EdgeSplitter::inner_ends(const PointSet& points, std::vector<Segment> segments) -> const Inner& {
  segments_ = std::move(segments);
  inner_.clear();
  if (segments_.empty()) return inner_;
  find_inner(points, candidates(points, ends_of_segments(points.size())));
  sort_inner(points);
  return inner_;
}

void EdgeSplitter::split(const PointSet& points, std::span<const Skin::Face> faces, EdgeChain& edges) {
  collect_segments(faces, edges);
  divide(points, ends_of_segments(points.size()), edges);
}

void EdgeSplitter::split_at(std::span<const std::uint32_t> some, const PointSet& points,
                            std::span<const Skin::Face> faces, EdgeChain& edges) {
  collect_segments(faces, edges);
  std::vector<bool> is_one(points.size());
  for (const std::uint32_t point : some) is_one[point] = true;
  divide(points, is_one, edges);
}

void EdgeSplitter::divide(const PointSet& points, const std::vector<bool>& at, EdgeChain& edges) {
  if (edges.empty()) return;
  find_inner(points, candidates(points, at));
  if (inner_.empty()) return;
  sort_inner(points);

  EdgeChain divided;
  divided.reserve(edges.size() + 2 * inner_.size());
  for (const Skin::Edge& edge : edges) {
    const auto [low, high] = ends(edge);
    const auto segment =
        std::lower_bound(segments_.begin(), segments_.end(), std::pair(low, high),
                         [](const Segment& s, const auto& key) { return std::pair(s.from, s.to) < key; });
    const auto number = static_cast<std::uint32_t>(segment - segments_.begin());
    std::uint32_t last = low;
    const bool forward = edge.from == low;
    const auto step = [&](std::uint32_t next) {
      divided.push_back({forward ? last : next, forward ? next : last, edge.face, edge.across});
      last = next;
    };
    for (auto inner = std::lower_bound(inner_.begin(), inner_.end(), std::pair(number, 0u));
         inner != inner_.end() && inner->first == number; ++inner)
      step(inner->second);
    step(high);
  }
  edges = std::move(divided);
}

}  // namespace bsp2::geometry
