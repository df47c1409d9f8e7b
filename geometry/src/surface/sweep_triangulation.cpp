#include "surface/sweep_triangulation.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

[[noreturn]] void fail() { throw std::logic_error("the edges of a face of the boundary bound no region"); }

/// Whether three points of a plane share a second one, as far as is known: then they are on a line.
bool share_second_plane(const PointSet& points, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                        HyperplaneId own) {
  for (const HyperplaneId plane : points.planes_of(a))
    if (plane != own && points.is_known_on(b, plane) && points.is_known_on(c, plane)) return true;
  return false;
}

}  // namespace

int SweepTriangulator::orientation(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const std::uint32_t p = vertices_[a], q = vertices_[b], r = vertices_[c];
  if (share_second_plane(*points_, p, q, r, frame_->plane())) return 0;
  return frame_->orientation(points_->vertices[p], points_->vertices[q], points_->vertices[r]);
}

void SweepTriangulator::triangulate(ExactPoints& exact, const PointSet& points, OrientedHyperplane outward,
                                    std::span<const Skin::Edge> edges,
                                    std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const PlaneFrame frame(exact, outward);
  points_ = &points;
  frame_ = &frame;
  triangles_ = &triangles;
  if (is_triangle(edges)) return;
  load(edges);
  for (std::uint32_t v = 0; v < vertices_.size(); ++v) sweep_over(v);
  if (!crossed_.empty()) fail();
}

/// Most faces of meshes are one: it is the same as the sweep makes, which begins before the last vertex.
bool SweepTriangulator::is_triangle(std::span<const Skin::Edge> edges) {
  if (edges.size() != 3) return false;
  const bool is_second_next = edges[0].to == edges[1].from;
  const Skin::Edge &next = edges[is_second_next ? 1 : 2], &last = edges[is_second_next ? 2 : 1];
  if (edges[0].to != next.from || next.to != last.from || last.to != edges[0].from) return false;
  const auto vertex = [&](std::uint32_t point) -> const Vertex<3>& { return points_->vertices[point]; };
  std::array<std::uint32_t, 3> corners{edges[0].from, next.from, last.from};
  if (frame_->orientation(vertex(corners[0]), vertex(corners[1]), vertex(corners[2])) <= 0) return false;
  while (!frame_->is_left_of(vertex(corners[0]), vertex(corners[1])) ||
         !frame_->is_left_of(vertex(corners[2]), vertex(corners[1])))
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
  triangles_->push_back(corners);
  return true;
}

void SweepTriangulator::load(std::span<const Skin::Edge> edges) {
  vertices_.clear();
  for (const Skin::Edge& edge : edges) vertices_.push_back(edge.from);  // which leave where others end
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  by_point_ = vertices_;
  rank_.resize(vertices_.size());
  std::sort(vertices_.begin(), vertices_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return a != b && frame_->is_left_of(points_->vertices[a], points_->vertices[b]);
  });
  const auto index = [&](std::uint32_t point) {
    const auto at = std::lower_bound(by_point_.begin(), by_point_.end(), point);
    if (at == by_point_.end() || *at != point) fail();
    return at - by_point_.begin();
  };
  for (std::uint32_t v = 0; v < vertices_.size(); ++v) rank_[index(vertices_[v])] = v;

  edges_.clear();
  in_count_.assign(vertices_.size(), 0);
  first_out_.assign(vertices_.size() + 1, 0);
  for (const Skin::Edge& edge : edges) {
    const std::uint32_t from = rank_[index(edge.from)], to = rank_[index(edge.to)];
    edges_.push_back({std::min(from, to), std::max(from, to), from < to, none});
    ++in_count_[edges_.back().right];
    ++first_out_[edges_.back().left + 1];
  }
  for (std::size_t v = 0; v < vertices_.size(); ++v) first_out_[v + 1] += first_out_[v];
  std::sort(edges_.begin(), edges_.end(), [&](const Edge& a, const Edge& b) {
    if (a.left != b.left) return a.left < b.left;
    return a.right != b.right && orientation(a.left, a.right, b.right) > 0;
  });
  crossed_.clear();
  nodes_.clear();
  chains_.clear();
}

void SweepTriangulator::sweep_over(std::uint32_t v) {
  // The crossed edges [low, high) end here.
  const auto is_below = [&](std::uint32_t e) {
    return edges_[e].right != v && orientation(edges_[e].left, edges_[e].right, v) > 0;
  };
  const auto low = static_cast<std::size_t>(std::partition_point(crossed_.begin(), crossed_.end(), is_below) -
                                            crossed_.begin());
  std::size_t high = low;
  while (high < crossed_.size() && edges_[crossed_[high]].right == v) ++high;
  if (high - low != in_count_[v]) fail();
  const std::uint32_t below =
      low > 0 && edges_[crossed_[low - 1]].region_above ? edges_[crossed_[low - 1]].chain : none;
  std::uint32_t above = none;
  if (high > low) {
    if (below != none) append(chains_[below], v);
    for (std::size_t i = low; i + 1 < high; ++i)
      if (edges_[crossed_[i]].region_above) finish(chains_[edges_[crossed_[i]].chain], v);
    const Edge& top = edges_[crossed_[high - 1]];
    if (top.region_above) prepend(chains_[above = top.chain], v);
  } else if (below != none) {
    above = divide(below, v);
  }

  const std::uint32_t begin = first_out_[v], end = first_out_[v + 1];
  if (begin == end) {
    if ((below == none) != (above == none)) fail();
    if (below != none) join(below, above);
  }
  for (std::uint32_t e = begin; e < end; ++e) {
    // Regions and holes alternate, and the outermost ones go on as they were.
    const bool region_below = e == begin ? below != none : edges_[e - 1].region_above;
    if (edges_[e].region_above == region_below) fail();
    if (e + 1 == end && edges_[e].region_above != (above != none)) fail();
    if (edges_[e].region_above) edges_[e].chain = e + 1 == end ? above : new_chain(v);
  }
  const auto at = crossed_.begin() + static_cast<std::ptrdiff_t>(low);
  crossed_.erase(at, crossed_.begin() + static_cast<std::ptrdiff_t>(high));
  crossed_.insert(crossed_.begin() + static_cast<std::ptrdiff_t>(low), end - begin, 0);
  for (std::uint32_t e = begin; e < end; ++e) crossed_[low + e - begin] = e;
}

void SweepTriangulator::emit(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  triangles_->push_back({vertices_[a], vertices_[b], vertices_[c]});
}

std::uint32_t SweepTriangulator::new_node(std::uint32_t vertex) {
  nodes_.push_back({vertex, none, none});
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t SweepTriangulator::new_chain(std::uint32_t vertex) {
  const std::uint32_t node = new_node(vertex);
  chains_.push_back({node, node, node});
  return static_cast<std::uint32_t>(chains_.size() - 1);
}

/// Adds a vertex at the upper end, and the triangles that it makes with what it sees there.
void SweepTriangulator::append(Chain& chain, std::uint32_t vertex) {
  const std::uint32_t node = new_node(vertex);
  std::uint32_t b = chain.last;
  while (nodes_[b].previous != none &&
         orientation(nodes_[nodes_[b].previous].vertex, nodes_[b].vertex, vertex) < 0) {
    const std::uint32_t a = nodes_[b].previous;
    emit(nodes_[b].vertex, nodes_[a].vertex, vertex);
    b = a;
  }
  nodes_[b].next = node;
  nodes_[node].previous = b;
  chain.last = chain.newest = node;
}

/// Adds a vertex at the lower end of a chain, with the triangles that it closes.
void SweepTriangulator::prepend(Chain& chain, std::uint32_t vertex) {
  const std::uint32_t node = new_node(vertex);
  std::uint32_t a = chain.first;
  while (nodes_[a].next != none && orientation(nodes_[a].vertex, nodes_[nodes_[a].next].vertex, vertex) < 0) {
    const std::uint32_t b = nodes_[a].next;
    emit(nodes_[b].vertex, nodes_[a].vertex, vertex);
    a = b;
  }
  nodes_[a].previous = node;
  nodes_[node].next = a;
  chain.first = chain.newest = node;
}

/// A vertex within the region: it sees the chain's newest vertex. @return the chain above it.
std::uint32_t SweepTriangulator::divide(std::uint32_t chain, std::uint32_t vertex) {
  const std::uint32_t newest = chains_[chain].newest;
  const std::uint32_t copy = new_node(nodes_[newest].vertex);
  Chain upper{copy, chains_[chain].last == newest ? copy : chains_[chain].last, copy};
  nodes_[copy].next = nodes_[newest].next;
  if (nodes_[copy].next != none) nodes_[nodes_[copy].next].previous = copy;
  nodes_[newest].next = none;
  chains_[chain].last = newest;
  append(chains_[chain], vertex);
  prepend(upper, vertex);
  chains_.push_back(upper);
  return static_cast<std::uint32_t>(chains_.size() - 1);
}

/// Two regions become one at a vertex that ends the lower chain and begins the upper one.
void SweepTriangulator::join(std::uint32_t lower, std::uint32_t upper) {
  const std::uint32_t last = chains_[lower].last, second = nodes_[chains_[upper].first].next;
  nodes_[last].next = second;
  if (second != none) {
    nodes_[second].previous = last;
    chains_[lower].last = chains_[upper].last;
  }
  chains_[lower].newest = last;
}

/// Triangles from a vertex to the edges along a path.
void SweepTriangulator::emit_fan(std::uint32_t apex, std::span<const std::uint32_t> path) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) emit(apex, path[i], path[i + 1]);
}

/// Both edges around a region end in a vertex: it sees the whole chain. Where the chain begins or ends on a
/// line with it, the triangle beside that line takes the line's vertices in.
void SweepTriangulator::finish(const Chain& chain, std::uint32_t v) {
  chain_vertices_.clear();
  for (std::uint32_t node = chain.first; node != none; node = nodes_[node].next)
    chain_vertices_.push_back(nodes_[node].vertex);
  const auto& p = chain_vertices_;
  if (p.size() < 2) fail();
  std::size_t low = 0, high = p.size() - 1;  // p[0..low] and p[high..] are on lines with v
  while (low < high && orientation(p[low], p[low + 1], v) == 0) ++low;
  while (high > low && orientation(p[high - 1], p[high], v) == 0) --high;
  if (low == high) fail();
  std::vector<std::uint32_t>& path = path_;  // from p[low] to v
  path.assign(p.rend() - static_cast<std::ptrdiff_t>(low) - 1, p.rend());
  path.push_back(v);
  if (high - low > 1) {
    emit_fan(p[low + 1], path);
    for (std::size_t i = low + 1; i + 1 < high; ++i) emit(p[i + 1], p[i], v);
  } else {
    emit_fan(p[high], std::span(path).first(path.size() - 1));
  }
  const std::uint32_t apex = high - low > 1 ? p[high - 1] : p[0];
  path = {v};  // now from v to p[high]
  path.insert(path.end(), p.rbegin(), p.rbegin() + static_cast<std::ptrdiff_t>(p.size() - high));
  emit_fan(apex, path);
}

}  // namespace bsp2::geometry
