#include "mesh/mesh_merging.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/point_tree.hpp"

namespace bsp2::model {
namespace {

constexpr double largest_share = 1e-3;  ///< of the mesh's size, that corners may be apart
constexpr double share_of_edge = 0.5;   ///< of the shortest edge there
constexpr int exponents[] = {
    -16, -12, -9, -7, -5,
    -4,  -3,  -2, -1, 0};  ///< of two, of the distances that are tried: shares of the largest one
constexpr std::size_t most_near = 256;   ///< corners that one is held against at a time
constexpr std::size_t most_seen = 4096;  ///< of those in the boxes around them
constexpr double least_gain = 0.01;      ///< a larger distance has to close so much more

double distance_of(const Point3& p, const Point3& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

/// Along the axis along which it is largest, but for the outermost corners: a damaged file may have some that
/// lie anywhere.
double size_of(const std::vector<Point3>& points, const FaceCycles& faces) {
  constexpr std::size_t outermost = 50;  // one in so many, at either end
  std::vector<double> x(faces.corners.size());
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = points[faces.corners[i]][k];
    const auto skipped = static_cast<std::ptrdiff_t>(x.size() / outermost);
    std::nth_element(x.begin(), x.begin() + skipped, x.end());
    const double low = x[static_cast<std::size_t>(skipped)];
    std::nth_element(x.begin(), x.end() - 1 - skipped, x.end());
    size = std::max(size, x[x.size() - 1 - static_cast<std::size_t>(skipped)] - low);
  }
  return size;
}

/// The corners merged so far: which one stands for each.
class Clusters {
 public:
  Clusters(const std::vector<Point3>& points, const FaceCycles& faces)
      : points_(points), root_(points.size()), uses_(points.size()), limit_(points.size()) {
    std::iota(root_.begin(), root_.end(), 0u);
    std::fill(limit_.begin(), limit_.end(), std::numeric_limits<double>::infinity());
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const auto face = faces[f];
      for (std::size_t i = 0; i < face.size(); ++i) {
        const std::uint32_t a = face[i], b = face[(i + 1) % face.size()];
        const double reach = share_of_edge * distance_of(points[a], points[b]);
        limit_[a] = std::min(limit_[a], reach);
        limit_[b] = std::min(limit_[b], reach);
        ++uses_[a];
      }
    }
  }

  std::uint32_t of(std::uint32_t i) {
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
  }

  /// Merges those of these corners that are no more than this apart. @return what stands for them now.
  std::vector<std::uint32_t> merge(std::vector<std::uint32_t> corners, double distance) {
    const PointTree tree(points_, corners);
    for (const std::uint32_t p : corners) {
      std::size_t near = 0, seen = 0;
      const double reach = std::min(distance, limit_[p]);
      tree.visit_near(points_[p], reach, [&](std::uint32_t q) {
        const double apart = distance_of(points_[p], points_[q]);
        if (apart <= std::min(reach, limit_[q])) join(p, q, distance);
        near += apart <= reach ? 1 : 0;
        return near < most_near && ++seen < most_seen;
      });
    }
    std::erase_if(corners, [&](std::uint32_t corner) { return root_[corner] != corner; });
    return corners;
  }

  /// How many corners are merged so far.
  [[nodiscard]] std::size_t merged() const { return joins_.size(); }

  /// Takes back all but the first of them.
  void keep(std::size_t merged) {
    joins_.resize(merged);
    std::iota(root_.begin(), root_.end(), 0u);
    for (const auto& [gone, standing] : joins_) root_[gone] = standing;
  }

 private:
  const std::vector<Point3>& points_;
  std::vector<std::uint32_t> root_, uses_;
  std::vector<double> limit_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      joins_;  // a corner that is gone, and what stands for it

  /// Those that stand for them have to be as near: else a chain of corners would make one of the ends of an
  /// edge.
  void join(std::uint32_t a, std::uint32_t b, double distance) {
    a = of(a), b = of(b);
    if (a == b || distance_of(points_[a], points_[b]) > std::min({distance, limit_[a], limit_[b]})) return;
    if (std::pair(uses_[b], a) > std::pair(uses_[a], b)) std::swap(a, b);
    root_[b] = a;
    joins_.emplace_back(b, a);
    limit_[a] = std::min(limit_[a], limit_[b]);
  }
};

/// Edges, by their ends, at which a single face lies; `of` says what stands for a corner.
template <typename Of>
std::vector<std::pair<std::uint32_t, std::uint32_t>> lone_edges(const FaceCycles& faces, Of&& of) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(faces.corners.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = of(face[i]), b = of(face[(i + 1) % face.size()]);
      if (a != b) edges.emplace_back(std::min(a, b), std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t size = 0;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end] == edges[begin]) ++end;
    if (end - begin == 1) edges[size++] = edges[begin];
  }
  edges.resize(size);
  return edges;
}

}  // namespace

MergedCorners merged_corners(const std::vector<Point3>& points, const FaceCycles& faces) {
  MergedCorners result{faces};
  if (faces.size() == 0) return result;
  const auto lone = lone_edges(faces, [](std::uint32_t corner) { return corner; });
  std::vector<std::uint32_t> corners;
  for (const auto& [a, b] : lone) corners.insert(corners.end(), {a, b});
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());

  Clusters clusters(points, faces);
  struct Attempt {
    std::size_t open, merged;
  };
  std::vector<Attempt> attempts{{lone.size(), 0}};
  const double largest = size_of(points, faces) * largest_share;
  for (const int exponent : exponents) {
    const std::size_t before = corners.size();
    corners = clusters.merge(std::move(corners), std::ldexp(largest, exponent));
    if (corners.size() == before) continue;
    const auto of = [&](std::uint32_t corner) { return clusters.of(corner); };
    attempts.push_back({lone_edges(faces, of).size(), clusters.merged()});
  }
  const auto least =
      std::min_element(attempts.begin(), attempts.end(), [](const Attempt& x, const Attempt& y) {
        return x.open < y.open;
      })->open;
  const double enough = static_cast<double>(least) + least_gain * static_cast<double>(lone.size() - least);
  const auto chosen = std::find_if(attempts.begin(), attempts.end(), [&](const Attempt& attempt) {
    return static_cast<double>(attempt.open) <= enough;
  });
  clusters.keep(chosen->merged);
  for (std::uint32_t& corner : result.faces.corners) corner = clusters.of(corner);
  std::vector<bool> seen(points.size());
  for (std::size_t i = 0; i < faces.corners.size(); ++i) {
    const std::uint32_t from = faces.corners[i], to = result.faces.corners[i];
    if (from == to || seen[from]) continue;
    seen[from] = true;
    ++result.count;
    result.distance = std::max(result.distance, distance_of(points[from], points[to]));
  }
  if (result.count > 0) result.faces = without_degenerate(points, result.faces);
  return result;
}

}  // namespace bsp2::model
