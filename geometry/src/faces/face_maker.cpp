#include "faces/face_maker.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

/// @see make_faces
class FaceMaker {
 public:
  FaceMaker(ExactPoints& exact, const TriangulatedSkin& skin, BrepPiece& piece)
      : exact_(exact), skin_(skin), piece_(piece), position_(skin.points.size(), none) {}

  std::vector<BoundOfFace> run() {
    const auto& edges = skin_.edges;
    const auto& face_of = skin_.face_of_triangle;
    for (std::size_t edge = 0, edge_end = 0, triangle = 0, end = 0; edge < edges.size();
         edge = edge_end, triangle = end) {
      while (edge_end < edges.size() && edges[edge_end].face == edges[edge].face) ++edge_end;
      while (end < face_of.size() && face_of[end] == edges[edge].face) ++end;
      add_faces({edges.data() + edge, edge_end - edge}, triangle, end);
    }
    return std::move(all_);
  }

 private:
  /// A side of a triangle, or an edge.
  struct Side {
    std::uint32_t low, high;
    bool forward, is_edge;
    std::uint32_t number;  // of the triangle, or of the edge
    std::uint32_t apex;
    friend bool operator<(const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.forward, a.is_edge, a.number) <
             std::tie(b.low, b.high, b.forward, b.is_edge, b.number);
    }
  };
  struct Bound {  // an edge of the plane at hand
    std::uint32_t component, from, to, apex;
    bool is_used;
  };

  ExactPoints& exact_;
  const TriangulatedSkin& skin_;
  BrepPiece& piece_;
  std::vector<BoundOfFace> all_;
  // Of the plane at hand.
  std::vector<Side> sides_;
  std::vector<Bound> bounds_;
  std::vector<std::uint32_t> position_;  // of a vertex on the way so far
  std::vector<std::uint32_t> path_;
  std::vector<std::vector<std::uint32_t>> cycles_;

  void add_faces(std::span<const Skin::Edge> edges, std::size_t first, std::size_t end) {
    DisjointSets classes(end - first);
    collect(edges, first, end);
    connect(edges, classes);
    std::stable_sort(bounds_.begin(), bounds_.end(), [](const Bound& a, const Bound& b) {
      return std::tie(a.component, a.from, a.to) < std::tie(b.component, b.from, b.to);
    });
    const std::uint32_t face = edges.front().face;
    std::vector<std::uint32_t> number(end - first, none);  // of the triangles that stand for components
    std::uint32_t faces = 0;
    for (std::size_t begin = 0, stop = 0; begin < bounds_.size(); begin = stop) {
      while (stop < bounds_.size() && bounds_[stop].component == bounds_[begin].component) ++stop;
      number[bounds_[begin].component] = faces++;
      add_face(face, {bounds_.data() + begin, stop - begin});
    }
    piece_.connected.push_back(faces);
    order_triangles(classes, number, first, faces);
  }

  /// Those of each connected face, in their order.
  void order_triangles(DisjointSets& classes, const std::vector<std::uint32_t>& number, std::size_t first,
                       std::uint32_t faces) {
    std::vector<std::uint32_t> face_of(number.size()), next(faces + std::size_t{1});
    for (std::uint32_t i = 0; i < face_of.size(); ++i) {
      face_of[i] = number[classes.find(i)];
      if (face_of[i] == none) throw std::logic_error("a face of the boundary has no edges");
      ++next[face_of[i] + std::size_t{1}];
    }
    for (std::uint32_t face = 0; face < faces; ++face) {
      piece_.faces[piece_.faces.size() - faces + face].triangles = next[face + std::size_t{1}];
      next[face + std::size_t{1}] += next[face];
    }
    const std::size_t begin = piece_.triangles.size();
    piece_.triangles.resize(begin + face_of.size());
    for (std::uint32_t i = 0; i < face_of.size(); ++i)
      piece_.triangles[begin + next[face_of[i]]++] = static_cast<std::uint32_t>(first + i);
  }

  void collect(std::span<const Skin::Edge> edges, std::size_t first, std::size_t end) {
    sides_.clear();
    const auto add = [&](std::uint32_t from, std::uint32_t to, bool is_edge, std::size_t number,
                         std::uint32_t apex) {
      sides_.push_back({std::min(from, to), std::max(from, to), from < to, is_edge,
                        static_cast<std::uint32_t>(number), apex});
    };
    for (std::size_t i = first; i < end; ++i) {
      auto t = skin_.surface.triangles[i];
      for (std::uint32_t& point : t) point = skin_.point_of_surface[point];
      for (std::size_t k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3], false, i - first, t[(k + 2) % 3]);
    }
    for (std::size_t i = 0; i < edges.size(); ++i) add(edges[i].from, edges[i].to, true, i, none);
    std::sort(sides_.begin(), sides_.end());
  }

  /// Unites triangles that have a side in common, and finds out beside which one each edge is.
  void connect(std::span<const Skin::Edge> edges, DisjointSets& classes) {
    std::vector<std::uint32_t> beside(edges.size(), none);
    bounds_.clear();
    for (const Skin::Edge& edge : edges) bounds_.push_back({0, edge.from, edge.to, none, false});
    for (std::size_t begin = 0, end = 0; begin < sides_.size(); begin = end) {
      while (end < sides_.size() && sides_[end].low == sides_[begin].low &&
             sides_[end].high == sides_[begin].high)
        ++end;
      std::uint32_t inner = none;  // a triangle with this side inside of the skin
      for (std::size_t i = begin; i < end; ++i) {
        const Side& side = sides_[i];
        if (side.is_edge) continue;
        const bool is_bound = i + 1 < end && sides_[i + 1].is_edge && sides_[i + 1].forward == side.forward;
        if (is_bound) {
          beside[sides_[i + 1].number] = side.number;
          bounds_[sides_[i + 1].number].apex = side.apex;
        } else if (inner == none) {
          inner = side.number;
        } else {
          classes.unite(inner, side.number);
        }
      }
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (beside[i] == none) throw std::logic_error("an edge of the boundary has no triangle");
      bounds_[i].component = classes.find(beside[i]);
    }
  }

  void add_face(std::uint32_t face, std::span<Bound> bounds) {
    find_cycles(bounds);
    if (cycles_.size() > 1) {
      const OrientedHyperplane outward = skin_.faces[face].outward;
      const auto outer = std::find_if(cycles_.begin(), cycles_.end(),
                                      [&](const auto& cycle) { return is_outer(outward, bounds, cycle); });
      if (outer == cycles_.end()) throw std::logic_error("a face of the boundary has no outline");
      std::rotate(cycles_.begin(), outer, outer + 1);
    }
    piece_.faces.push_back({0, static_cast<std::uint32_t>(cycles_.size())});
    for (const auto& cycle : cycles_) {
      piece_.loops.push_back(static_cast<std::uint32_t>(cycle.size()));
      for (const std::uint32_t i : cycle)
        all_.push_back({bounds[i].from, bounds[i].to, bounds[i].apex, face});
    }
  }

  /// The edges of a face as cycles that go through each vertex once. As the face is connected, its cycles
  /// have at most one vertex in common two by two, and are found whichever edge is taken there.
  void find_cycles(std::span<Bound> bounds) {
    cycles_.clear();
    for (std::uint32_t start = 0; start < bounds.size(); ++start) {
      if (bounds[start].is_used) continue;
      std::uint32_t next = start;
      do {
        bounds[next].is_used = true;
        position_[bounds[next].from] = static_cast<std::uint32_t>(path_.size());
        path_.push_back(next);
        const std::uint32_t vertex = bounds[next].to;
        if (position_[vertex] != none) close(bounds, position_[vertex]);
        next = path_.empty() ? none : unused_from(bounds, vertex);
      } while (next != none);
    }
  }
  /// The way from this position on is a cycle.
  void close(std::span<const Bound> bounds, std::uint32_t position) {
    const auto begin = path_.begin() + position;
    cycles_.emplace_back(begin, path_.end());
    for (auto at = begin; at != path_.end(); ++at) position_[bounds[*at].from] = none;
    path_.erase(begin, path_.end());
  }
  static std::uint32_t unused_from(std::span<const Bound> bounds, std::uint32_t vertex) {
    auto at = std::lower_bound(bounds.begin(), bounds.end(), vertex,
                               [](const Bound& bound, std::uint32_t v) { return bound.from < v; });
    while (at != bounds.end() && at->from == vertex && at->is_used) ++at;
    if (at == bounds.end() || at->from != vertex)
      throw std::logic_error("the boundary of a face does not close");
    return static_cast<std::uint32_t>(at - bounds.begin());
  }

  /// Whether a cycle turns counter-clockwise: as it does at the vertex that is farthest to the left.
  bool is_outer(OrientedHyperplane outward, std::span<const Bound> bounds,
                const std::vector<std::uint32_t>& cycle) {
    const PlaneFrame frame(exact_, outward);
    const auto at = [&](std::size_t i) -> const Vertex<3>& {
      return skin_.points.vertices[bounds[cycle[i % cycle.size()]].from];
    };
    std::size_t left = 0;
    for (std::size_t i = 1; i < cycle.size(); ++i)
      if (frame.is_left_of(at(i), at(left))) left = i;
    return frame.orientation(at(left + cycle.size() - 1), at(left), at(left + 1)) > 0;
  }
};

}  // namespace

std::vector<BoundOfFace> make_faces(ExactPoints& exact, const TriangulatedSkin& skin, BrepPiece& piece) {
  return FaceMaker(exact, skin, piece).run();
}

}  // namespace bsp2::geometry
