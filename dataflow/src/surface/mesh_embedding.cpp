#include "surface/mesh_embedding.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bsp2/geometry/support/vectors.hpp"
#include "producers/mesh_producer.hpp"
#include "shapes/facet_crossing.hpp"
#include "shapes/mesh_shape.hpp"

namespace bsp2::dataflow {

using Point = std::array<double, 3>;

// --- MeshTopology ---

MeshTopology::MeshTopology(const Mesh& mesh) : mesh_(&mesh), mirrored_(mesh.map.orientation() < 0) {
  find_corners();
  find_neighbours();
}

void MeshTopology::find_corners() {
  const auto count = static_cast<std::uint32_t>(mesh_->facets.size());
  begin_.assign(mesh_->points.size() + 2, 0);
  for (const Mesh::Facet& facet : mesh_->facets)
    for (const std::uint32_t corner : facet.corners) ++begin_[corner + std::size_t{2}];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  corners_.resize(3 * std::size_t{count});
  for (std::uint32_t facet = 0; facet < count; ++facet)
    for (std::uint32_t k = 0; k < 3; ++k)
      corners_[begin_[point(facet, k) + std::size_t{1}]++] = {facet, k, point(facet, (k + 1) % 3),
                                                              point(facet, (k + 2) % 3)};
  begin_.pop_back();
}

void MeshTopology::find_neighbours() {
  beyond_.resize(corners_.size());
  for (std::uint32_t at = 0; at + 1 < begin_.size() && is_manifold_; ++at)
    for (const FacetCorner& corner : around(at)) {
      unsigned found = 0, alike = 0;
      for (const FacetCorner& other : around(at)) {
        alike += other.next == corner.next ? 1 : 0;
        if (other.previous != corner.next) continue;
        ++found;
        beyond_[3 * std::size_t{corner.facet} + corner.number] = other.facet;
      }
      if (found != 1 || alike != 1) is_manifold_ = false;
    }
}

namespace {

using geometry::cross;
using geometry::dot;
double size_of(const Point& u) { return std::fabs(u[0]) + std::fabs(u[1]) + std::fabs(u[2]); }

/// See doubtful_facets.
class Embedding {
 public:
  Embedding(const Network<3>& network, const Producer<3>& producer, const MeshTopology& topology)
      : network_(network),
        producer_(producer),
        mesh_(network.meshes[producer.index]),
        topology_(topology),
        error_(2 * mesh_.error),
        is_doubtful_(mesh_.facets.size()) {}

  [[nodiscard]] std::optional<std::vector<std::uint32_t>> doubtful() {
    for (std::uint32_t point = 0; point < mesh_.points.size() && !are_many(); ++point)
      if (!is_terrain(point) && !are_apart_around(point))
        for (const FacetCorner& corner : topology_.around(point)) doubt(corner.facet);
    if (!are_many()) doubt_what_is_not_apart();
    if (!are_many()) doubt_what_winds_otherwise();
    if (are_many()) return std::nullopt;
    std::vector<std::uint32_t> facets;
    for (std::uint32_t facet = 0; facet < is_doubtful_.size() && doubts_ > 0; ++facet)
      if (is_doubtful_[facet]) facets.push_back(facet);
    return facets;
  }

 private:
  const Network<3>& network_;
  const Producer<3>& producer_;
  const Mesh& mesh_;
  const MeshTopology& topology_;
  double error_;  // of differences of coordinates
  std::vector<bool> is_doubtful_;
  std::size_t doubts_ = 0;

  void doubt(std::uint32_t facet) {
    doubts_ += is_doubtful_[facet] ? 0 : 1;
    is_doubtful_[facet] = true;
  }
  /// Then cells would be made nearly everywhere.
  [[nodiscard]] bool are_many() const { return doubts_ > mesh_.facets.size() / 8; }

  [[nodiscard]] Point normal_of(std::uint32_t facet) const {
    const auto plane = mesh_.facets[facet].plane;
    const auto h = network_.table.rounded(plane.id());
    return plane.flipped() ? h.opposite().normal : h.normal;
  }

  /// Whether the facets around a point are seen side by side, once around it, from some direction: then they
  /// have no more than the edges there in common. As nearly everywhere.
  [[nodiscard]] bool is_terrain(std::uint32_t at) const {
    constexpr double least = 0.01;
    const auto around = topology_.around(at);
    if (around.empty()) return true;
    Point up{};
    for (const FacetCorner& corner : around) {
      const Point normal = normal_of(corner.facet);
      for (std::size_t k = 0; k < 3; ++k) up[k] += normal[k];
    }
    for (const FacetCorner& corner : around)
      if (!(dot(normal_of(corner.facet), up) > least * size_of(up))) return false;
    Point across{};  // any direction across
    const std::size_t smallest = std::fabs(up[0]) < std::fabs(up[1])
                                     ? (std::fabs(up[0]) < std::fabs(up[2]) ? 0 : 2)
                                     : (std::fabs(up[1]) < std::fabs(up[2]) ? 1 : 2);
    across[smallest] = 1;
    across = cross(up, across);
    const double own = dot(across, mesh_.points[at]);
    const auto is_beyond = [&](std::uint32_t point) { return dot(across, mesh_.points[point]) >= own; };
    unsigned turns = 0;
    for (const FacetCorner& corner : around)
      turns += !is_beyond(corner.next) && is_beyond(corner.previous) ? 1 : 0;
    return turns == 1;
  }

  /// Whether the facets at a point have no more than the edges there in common, by each pair of them.
  [[nodiscard]] bool are_apart_around(std::uint32_t at) const {
    const auto around = topology_.around(at);
    constexpr std::size_t most = 1024;
    if (around.size() > most) return false;
    for (const FacetCorner& a : around)
      for (const FacetCorner& b : around) {
        if (&a >= &b) continue;
        const bool ahead = a.next == b.previous, behind = a.previous == b.next;
        if (ahead && behind) return false;
        const bool are_apart = ahead    ? is_not_folded(at, a.next, a.previous, b.next)
                               : behind ? is_not_folded(at, a.previous, a.next, b.previous)
                                        : are_cones_apart(at, a, b);
        if (!are_apart) return false;
      }
    return true;
  }

  [[nodiscard]] int side(const Point& u, const Point& v, const Point& w) const {
    return sign_of_determinant(u, v, w, error_);
  }
  [[nodiscard]] Point seen_from(std::uint32_t at, std::uint32_t point) const {
    return minus(mesh_.points[point], mesh_.points[at]);
  }

  /// Two facets at the edge from p to q, with the third corners r and s.
  [[nodiscard]] bool is_not_folded(std::uint32_t p, std::uint32_t q, std::uint32_t r, std::uint32_t s) const {
    const Point edge = seen_from(p, q), u = seen_from(p, r), v = seen_from(p, s);
    if (side(edge, u, v) != 0) return true;
    // About in one plane: they have to be on different sides of the edge.
    const Point m = cross(edge, u), n = cross(edge, v);
    constexpr double clearly = 1e-6;
    return dot(m, n) < -clearly * size_of(m) * size_of(n);
  }

  /// Whether a plane through the point has one facet on one side and the other on the other one.
  [[nodiscard]] bool are_cones_apart(std::uint32_t at, const FacetCorner& a, const FacetCorner& b) const {
    const std::array<Point, 2> p{seen_from(at, a.next), seen_from(at, a.previous)},
        q{seen_from(at, b.next), seen_from(at, b.previous)};
    const int q0 = side(p[0], p[1], q[0]), q1 = side(p[0], p[1], q[1]);
    if (q0 != 0 && q0 == q1) return true;
    const int p0 = side(q[0], q[1], p[0]), p1 = side(q[0], q[1], p[1]);
    if (p0 != 0 && p0 == p1) return true;
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t k = 0; k < 2; ++k) {
        const int of_p = side(p[i], q[k], p[1 - i]), of_q = side(p[i], q[k], q[1 - k]);
        if (of_p != 0 && of_p == -of_q) return true;
      }
    return are_cones_side_by_side(p, q);
  }

  /// About in one plane: whether another one, upright on theirs, leads through an edge of one facet and parts
  /// that from the other.
  [[nodiscard]] bool are_cones_side_by_side(const std::array<Point, 2>& p,
                                            const std::array<Point, 2>& q) const {
    Point up = cross(p[0], p[1]);
    const double reach = (size_of(p[0]) + size_of(p[1])) / size_of(up);
    for (double& x : up) x *= reach;
    const auto parts = [&](const Point& edge, const Point& own, const std::array<Point, 2>& other) {
      const int at = side(edge, up, own);
      return at != 0 && side(edge, up, other[0]) == -at && side(edge, up, other[1]) == -at;
    };
    return parts(p[0], p[1], q) || parts(p[1], p[0], q) || parts(q[0], q[1], p) || parts(q[1], q[0], p);
  }

  /// Of facets without a common corner.
  void doubt_what_is_not_apart() {
    facet_tree(mesh_).visit_pairs(error_, [&](std::uint32_t a, std::uint32_t b) {
      const auto &p = mesh_.facets[a].corners, &q = mesh_.facets[b].corners;
      for (const std::uint32_t corner : p)
        if (corner == q[0] || corner == q[1] || corner == q[2]) return true;
      if (are_apart(p, q)) return true;
      doubt(a);
      doubt(b);
      return !are_many();
    });
  }

  /// Whether two triangles are clearly on different sides of a plane.
  [[nodiscard]] bool are_apart(const std::array<std::uint32_t, 3>& a,
                               const std::array<std::uint32_t, 3>& b) const {
    std::array<Point, 3> p, q, u, v;
    double extent = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = seen_from(a[0], a[i]);
      q[i] = seen_from(a[0], b[i]);
      extent = std::max({extent, size_of(p[i]), size_of(q[i])});
    }
    const double margin = 2 * error_ + 0x1p-48 * extent;
    const auto parts = [&](const Point& axis) {
      const double p0 = dot(axis, p[0]), p1 = dot(axis, p[1]), p2 = dot(axis, p[2]), q0 = dot(axis, q[0]),
                   q1 = dot(axis, q[1]), q2 = dot(axis, q[2]);
      const double least = margin * size_of(axis);
      return std::min({q0, q1, q2}) - std::max({p0, p1, p2}) > least ||
             std::min({p0, p1, p2}) - std::max({q0, q1, q2}) > least;
    };
    for (std::size_t i = 0; i < 3; ++i) {
      u[i] = minus(p[(i + 1) % 3], p[i]);
      v[i] = minus(q[(i + 1) % 3], q[i]);
    }
    const Point m = cross(u[0], u[1]), n = cross(v[0], v[1]);
    for (std::size_t i = 0; i < 3; ++i)
      if (parts(cross(u[i], m)) || parts(cross(v[i], n))) return true;
    if (parts(m) || parts(n)) return true;
    for (const Point& one : u)
      for (const Point& other : v)
        if (parts(cross(one, other))) return true;
    return false;
  }

  /// Where facets that are beyond each other's edges cross no others, one of them tells of all.
  void doubt_what_winds_otherwise() {
    std::vector<std::uint32_t> part(mesh_.facets.size());
    std::iota(part.begin(), part.end(), 0U);
    const auto find = [&](std::uint32_t facet) {
      while (part[facet] != facet) facet = part[facet] = part[part[facet]];
      return facet;
    };
    for (std::uint32_t facet = 0; facet < part.size(); ++facet)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = topology_.beyond(facet, k);
        if (is_doubtful_[facet] || is_doubtful_[other]) continue;
        const std::uint32_t a = find(facet), b = find(other);
        part[std::max(a, b)] = std::min(a, b);
      }
    constexpr std::uint8_t most_asked = 4, is_free = 255;
    std::vector<std::uint8_t> known(part.size());  // of each part: so many of its facets have told nothing
    for (std::uint32_t facet = 0; facet < part.size(); ++facet) {
      std::uint8_t& asked = known[find(facet)];
      if (is_doubtful_[facet] || asked == is_free || asked == most_asked) continue;
      asked = is_free_before(facet) ? is_free : asked + 1;
    }
    for (std::uint32_t facet = 0; facet < part.size(); ++facet)
      if (known[find(facet)] != is_free) doubt(facet);
  }

  /// Whether the mesh does not wind around the points right before a facet.
  [[nodiscard]] bool is_free_before(std::uint32_t facet) const {
    const auto& [a, b, c] = mesh_.facets[facet].corners;
    const Point normal = normal_of(facet), u = seen_from(a, b), v = seen_from(a, c);
    Point from = mesh_.points[a], to;
    for (std::size_t k = 0; k < 3; ++k) from[k] += (u[k] + v[k]) / 3;
    for (double distance = (size_of(u) + size_of(v)) / 8, i = 0; i < 8; distance /= 8, ++i) {
      for (std::size_t k = 0; k < 3; ++k) to[k] = from[k] + distance * normal[k];
      if (!is_visible(from, to, facet)) continue;
      const auto winding = MeshProducer(network_, producer_).winding_around(to);
      if (winding) return *winding == 0;
    }
    return false;
  }

  /// Whether only this facet can lie between two points.
  [[nodiscard]] bool is_visible(const Point& from, const Point& to, std::uint32_t own) const {
    const double error = error_ + 0x1p-50 * network_.table.radius();
    const SegmentAmongFacets segment(from, to, error);
    bool is_free = true;
    facet_tree(mesh_).visit([&](const FacetTree::Box& box) { return segment.misses_box(box.low, box.high); },
                            [&](std::uint32_t facet) {
                              const auto& [i, j, k] = mesh_.facets[facet].corners;
                              const Point &a = mesh_.points[i], &b = mesh_.points[j], &c = mesh_.points[k];
                              is_free = facet == own || segment.misses(a, b, c) ||
                                        crossing(from, to, a, b, c, error) == 0;
                              return is_free;
                            });
    return is_free;
  }
};

}  // namespace

std::optional<std::vector<std::uint32_t>> doubtful_facets(const Network<3>& network,
                                                          const Producer<3>& producer,
                                                          const MeshTopology& topology) {
  return Embedding(network, producer, topology).doubtful();
}

}  // namespace bsp2::dataflow
