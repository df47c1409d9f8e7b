#include "constructs/outline_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace bsp2::dataflow {
namespace {

/// Far above the rounding of a corner, far below the tolerance of coincidence.
constexpr double resolution = 0x1p-35;

std::uint64_t key(std::int64_t i, std::int64_t j) {
  return static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15ull ^
         static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4Full;
}

}  // namespace

std::uint32_t CornerNumbers::number(const Point& point) {
  const auto column = static_cast<std::int64_t>(std::floor(point[0] / (4 * distance_)));
  const auto row = static_cast<std::int64_t>(std::floor(point[1] / (4 * distance_)));
  for (std::int64_t i = column - 1; i <= column + 1; ++i)
    for (std::int64_t j = row - 1; j <= row + 1; ++j) {
      const auto found = by_square_.find(key(i, j));
      if (found == by_square_.end()) continue;
      for (const std::uint32_t n : found->second)
        if (std::hypot(points[n][0] - point[0], points[n][1] - point[1]) <= distance_) return n;
    }
  points.push_back(point);
  by_square_[key(column, row)].push_back(static_cast<std::uint32_t>(points.size() - 1));
  return static_cast<std::uint32_t>(points.size() - 1);
}

OutlineTracer::OutlineTracer(const Network<2>& network, double reach)
    : network_(network), corners_(std::max(reach, 1e-290) * resolution) {}

std::vector<std::uint32_t> OutlineTracer::numbers_of(const geometry::CellBatch& batch, std::size_t cell) {
  const auto points = batch.cell_points(cell);
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i < points.size(); i += 2)
    numbers.push_back(corners_.number({points[i], points[i + 1]}));
  return numbers;
}

void OutlineTracer::add(const geometry::CellBatch& batch, std::size_t cell) {
  const auto number = numbers_of(batch, cell);
  for (const TracedEdge& edge : around(batch, cell))
    if (number[edge.from] != number[edge.to])
      edges_.push_back({number[edge.from], number[edge.to], edge.line});
}

void OutlineTracer::add_beyond(const geometry::CellBatch& batch, std::size_t cell, std::uint32_t beyond) {
  const auto number = numbers_of(batch, cell);
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const auto ends = batch.vertices_of_facet(f);
    const std::int32_t code = batch.facet_hyperplane[f];
    if (number[ends[0]] != number[ends[1]])
      edges_.push_back(
          {number[ends[0]], number[ends[1]], static_cast<std::uint32_t>(code < 0 ? ~code : code), beyond});
  }
}

std::vector<std::vector<TracedEdge>> OutlineTracer::paths() {
  split_at_t_vertices();
  cancel();
  return trace();
}

/// The edges of a cell one after the other, the cell on their left. They name the cell's own points.
std::vector<TracedEdge> OutlineTracer::around(const geometry::CellBatch& batch, std::size_t cell) const {
  const auto points = batch.cell_points(cell);
  std::vector<TracedEdge> edges;
  std::size_t longest = 0;
  double length = -1;
  bool is_reversed = false;
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    const auto ends = batch.vertices_of_facet(f);
    const std::int32_t code = batch.facet_hyperplane[f];
    const auto line = static_cast<std::uint32_t>(code < 0 ? ~code : code);
    const double dx = points[2 * ends[1]] - points[2 * ends[0]],
                 dy = points[2 * ends[1] + 1] - points[2 * ends[0] + 1];
    edges.push_back({ends[0], ends[1], line});
    if (std::hypot(dx, dy) <= length) continue;
    length = std::hypot(dx, dy);
    longest = edges.size() - 1;
    // The cell is where the hyperplane is negative. Points would not tell on which side a thin one is, nor
    // short edges where they lead.
    const auto normal = network_.table.rounded(line).normal;
    is_reversed = (normal[0] * dy - normal[1] * dx < 0) != (code < 0);
  }
  if (edges.empty()) return edges;
  std::swap(edges[0], edges[longest]);
  if (is_reversed) std::swap(edges[0].from, edges[0].to);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const std::uint32_t at = edges[i - 1].to;
    const auto next = std::find_if(edges.begin() + static_cast<std::ptrdiff_t>(i), edges.end(),
                                   [&](const TracedEdge& e) { return e.from == at || e.to == at; });
    if (next == edges.end()) throw std::logic_error("the edges of a cell of an outline make no cycle");
    if (next->to == at) std::swap(next->from, next->to);
    std::iter_swap(edges.begin() + static_cast<std::ptrdiff_t>(i), next);
  }
  return edges;
}

/// Cuts the edges of each line at all corners of edges on it.
void OutlineTracer::split_at_t_vertices() {
  std::stable_sort(edges_.begin(), edges_.end(),
                   [](const TracedEdge& a, const TracedEdge& b) { return a.line < b.line; });
  std::vector<TracedEdge> pieces;
  for (std::size_t begin = 0, end = 0; begin < edges_.size(); begin = end) {
    while (end < edges_.size() && edges_[end].line == edges_[begin].line) ++end;
    split_line({edges_.data() + begin, end - begin}, pieces);
  }
  edges_.swap(pieces);
}

void OutlineTracer::split_line(std::span<const TracedEdge> line, std::vector<TracedEdge>& pieces) const {
  Point direction{};
  double longest = 0;
  std::vector<std::uint32_t> on_line;
  for (const TracedEdge& edge : line) {
    const auto &p = corners_.points[edge.from], &q = corners_.points[edge.to];
    const double length = std::hypot(q[0] - p[0], q[1] - p[1]);
    if (length > longest) longest = length, direction = {q[0] - p[0], q[1] - p[1]};
    on_line.insert(on_line.end(), {edge.from, edge.to});
  }
  const auto along = [&](std::uint32_t n) {
    return corners_.points[n][0] * direction[0] + corners_.points[n][1] * direction[1];
  };
  std::sort(on_line.begin(), on_line.end(), [&](auto a, auto b) {
    return std::pair{along(a), a} < std::pair{along(b), b};
  });
  on_line.erase(std::unique(on_line.begin(), on_line.end()), on_line.end());
  std::unordered_map<std::uint32_t, std::size_t> place;
  for (std::size_t i = 0; i < on_line.size(); ++i) place[on_line[i]] = i;
  for (const TracedEdge& edge : line) {
    std::size_t at = place[edge.from];
    const std::size_t to = place[edge.to];
    while (at != to) {
      const std::size_t next = at < to ? at + 1 : at - 1;
      pieces.push_back({on_line[at], on_line[next], edge.line, edge.beyond});
      at = next;
    }
  }
}

/// Takes out pairs of opposite edges.
void OutlineTracer::cancel() {
  const auto key = [](const TracedEdge& e) {
    return std::array{std::min(e.from, e.to), std::max(e.from, e.to)};
  };
  std::stable_sort(edges_.begin(), edges_.end(),
                   [&](const TracedEdge& a, const TracedEdge& b) { return key(a) < key(b); });
  std::vector<TracedEdge> left;
  for (std::size_t begin = 0, end = 0; begin < edges_.size(); begin = end) {
    while (end < edges_.size() && key(edges_[end]) == key(edges_[begin])) ++end;
    keep_uncancelled({edges_.data() + begin, end - begin}, left);
  }
  edges_.swap(left);
}

/// @param alike all edges between two corners.
void OutlineTracer::keep_uncancelled(std::span<const TracedEdge> alike, std::vector<TracedEdge>& left) {
  std::vector<TracedEdge> up, down;
  std::uint32_t beyond = TracedEdge::nothing;
  for (const TracedEdge& edge : alike)
    if (edge.beyond != TracedEdge::nothing)
      beyond = std::min(beyond, edge.beyond);
    else
      (edge.from < edge.to ? up : down).push_back(edge);
  const std::size_t pairs = std::min(up.size(), down.size()), first = left.size();
  left.insert(left.end(), up.begin() + static_cast<std::ptrdiff_t>(pairs), up.end());
  left.insert(left.end(), down.begin() + static_cast<std::ptrdiff_t>(pairs), down.end());
  for (std::size_t i = first; i < left.size(); ++i) left[i].beyond = beyond;
}

std::vector<std::vector<TracedEdge>> OutlineTracer::trace() {
  std::stable_sort(edges_.begin(), edges_.end(),
                   [](const TracedEdge& a, const TracedEdge& b) { return a.from < b.from; });
  std::vector<bool> used(edges_.size());
  std::vector<std::vector<TracedEdge>> paths;
  for (std::size_t start = 0; start < edges_.size(); ++start) {
    if (used[start]) continue;
    std::vector<TracedEdge> path;
    for (std::size_t at = start; at != edges_.size(); at = next_of(edges_[at], used)) {
      used[at] = true;
      path.push_back(edges_[at]);
      if (edges_[at].to == edges_[start].from) break;
    }
    check_end(path);
    paths.push_back(std::move(path));
  }
  return paths;
}

/// At every corner as many edges end as begin, so a path ends where it began.
void OutlineTracer::check_end(const std::vector<TracedEdge>& path) const {
  if (path.back().to == path.front().from) return;
  const auto& end = corners_.points[path.back().to];
  throw std::logic_error("the outline of a plane solid does not close at (" + std::to_string(end[0]) + ", " +
                         std::to_string(end[1]) + ")");
}

/// The edge that bounds the same corner of the solid: of those that leave, the first one clockwise from the
/// way back.
std::size_t OutlineTracer::next_of(const TracedEdge& edge, const std::vector<bool>& used) const {
  const auto& p = corners_.points[edge.from];
  const auto& q = corners_.points[edge.to];
  const double back = std::atan2(p[1] - q[1], p[0] - q[0]);
  std::size_t best = edges_.size();
  double least = 10;
  auto at = std::lower_bound(edges_.begin(), edges_.end(), edge.to,
                             [](const TracedEdge& e, std::uint32_t corner) { return e.from < corner; });
  for (; at != edges_.end() && at->from == edge.to; ++at) {
    const auto i = static_cast<std::size_t>(at - edges_.begin());
    if (used[i]) continue;
    const auto& r = corners_.points[at->to];
    double turn = back - std::atan2(r[1] - q[1], r[0] - q[0]);
    if (turn <= 0) turn += 2 * std::numbers::pi;
    if (turn < least) least = turn, best = i;
  }
  return best;
}

std::vector<CornerNumbers::Point> OutlineTracer::corners_of(const std::vector<TracedEdge>& path) const {
  std::vector<Point> corners;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const TracedEdge& before = path[(i + path.size() - 1) % path.size()];
    if (before.line != path[i].line) corners.push_back(corners_.points[path[i].from]);
  }
  return corners;
}

double reach_of(const geometry::CellBatch& batch) {
  double reach = 0;
  for (const double x : batch.points) reach = std::max(reach, std::fabs(x));
  return reach;
}

}  // namespace bsp2::dataflow
