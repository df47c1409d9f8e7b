// Catmull-Clark and Loop surfaces: FUZZY cells that hold points of the limit, intervals that hold the volume.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dataflow/refined/spline_samples.hpp"

namespace bsp2::dataflow {
namespace {

using model::SubdivisionSurface;
using Subdivision = Seeded;

struct ControlNet {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::uint32_t>> faces;
  [[nodiscard]] Expression surface(SubdivisionSurface::Scheme scheme) const {
    SubdivisionSurface s{scheme, {}, faces};
    for (const auto& p : points) s.points.insert(s.points.end(), p.begin(), p.end());
    return model::subdivision_surface(3, std::move(s));
  }
};

std::array<double, 3> sum(std::initializer_list<std::pair<double, std::array<double, 3>>> terms) {
  std::array<double, 3> total{};
  for (const auto& [w, p] : terms)
    for (std::size_t i = 0; i < 3; ++i) total[i] += w * p[i];
  return total;
}

/// One step of either scheme over the whole mesh, and points of the limit, by the published masks: another
/// way than the producer's.
class Subdivider {
 public:
  explicit Subdivider(ControlNet net) : net_(std::move(net)) { connect(); }

  void catmull_clark() {
    ControlNet fine;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const double n = static_cast<double>(faces_of_[v].size());
      std::array<double, 3> q{}, r{};
      for (const auto f : faces_of_[v]) q = sum({{1, q}, {1 / n, centre(f)}});
      for (const auto w : neighbours_[v])
        r = sum({{1, r}, {0.5 / n, net_.points[v]}, {0.5 / n, net_.points[w]}});
      fine.points.push_back(sum({{1 / n, q}, {2 / n, r}, {(n - 3) / n, net_.points[v]}}));
    }
    for (std::size_t e = 0; e < edges_.size(); e += 2)
      fine.points.push_back(sum({{0.25, net_.points[edges_[e].ends.first]},
                                 {0.25, net_.points[edges_[e].ends.second]},
                                 {0.25, centre(edges_[e].face)},
                                 {0.25, centre(edges_[e + 1].face)}}));
    for (std::size_t f = 0; f < net_.faces.size(); ++f) fine.points.push_back(centre(f));
    const auto base = static_cast<std::uint32_t>(net_.points.size()),
               faces = base + static_cast<std::uint32_t>(edges_.size() / 2);
    for (std::size_t f = 0; f < net_.faces.size(); ++f) {
      const auto& face = net_.faces[f];
      for (std::size_t i = 0; i < face.size(); ++i)
        fine.faces.push_back({face[i], base + number(face[i], face[(i + 1) % face.size()]),
                              faces + static_cast<std::uint32_t>(f),
                              base + number(face[(i + face.size() - 1) % face.size()], face[i])});
    }
    net_ = std::move(fine);
    connect();
  }

  void loop() {
    ControlNet fine;
    for (std::size_t v = 0; v < net_.points.size(); ++v)
      fine.points.push_back(weighted(v, beta(neighbours_[v].size())));
    for (std::size_t e = 0; e < edges_.size(); e += 2)
      fine.points.push_back(sum({{0.375, net_.points[edges_[e].ends.first]},
                                 {0.375, net_.points[edges_[e].ends.second]},
                                 {0.125, net_.points[edges_[e].third]},
                                 {0.125, net_.points[edges_[e + 1].third]}}));
    const auto base = static_cast<std::uint32_t>(net_.points.size());
    for (const auto& face : net_.faces) {
      const std::uint32_t a = base + number(face[0], face[1]), b = base + number(face[1], face[2]),
                          c = base + number(face[2], face[0]);
      fine.faces.insert(fine.faces.end(), {{face[0], a, c}, {face[1], b, a}, {face[2], c, b}, {a, b, c}});
    }
    net_ = std::move(fine);
    connect();
  }

  [[nodiscard]] std::vector<std::array<double, 3>> catmull_clark_limits() const {
    std::vector<std::array<double, 3>> limits;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const double n = static_cast<double>(neighbours_[v].size()), w = 1 / (n * (n + 5));
      auto limit = sum({{n * n * w, net_.points[v]}});
      for (const auto e : neighbours_[v]) limit = sum({{1, limit}, {4 * w, net_.points[e]}});
      for (const auto f : faces_of_[v]) {
        const auto& face = net_.faces[f];
        const auto at = static_cast<std::size_t>(std::find(face.begin(), face.end(), v) - face.begin());
        limit = sum({{1, limit}, {w, net_.points[face[(at + 2) % 4]]}});
      }
      limits.push_back(limit);
    }
    return limits;
  }
  [[nodiscard]] std::vector<std::array<double, 3>> loop_limits() const {
    std::vector<std::array<double, 3>> limits;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const std::size_t n = neighbours_[v].size();
      limits.push_back(weighted(v, 1 / (3 / (8 * beta(n)) + static_cast<double>(n))));
    }
    return limits;
  }
  /// Six times the volume enclosed by the mesh of limit points, by tetrahedra.
  [[nodiscard]] double volume(const std::vector<std::array<double, 3>>& at) const {
    double six = 0;
    for (const auto& face : net_.faces)
      for (std::size_t i = 1; i + 1 < face.size(); ++i) {
        const auto &a = at[face[0]], &b = at[face[i]], &c = at[face[i + 1]];
        six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
      }
    return std::fabs(six) / 6;
  }

 private:
  ControlNet net_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::vector<std::vector<std::size_t>> faces_of_;
  struct Side {
    std::pair<std::uint32_t, std::uint32_t> ends;
    std::size_t face;
    std::uint32_t third;  // corner of the face
  };
  std::vector<Side> edges_;  // sorted: each edge has two next to each other

  void connect() {
    neighbours_.assign(net_.points.size(), {});
    faces_of_.assign(net_.points.size(), {});
    edges_.clear();
    for (std::size_t f = 0; f < net_.faces.size(); ++f) {
      const auto& face = net_.faces[f];
      for (std::size_t i = 0; i < face.size(); ++i) {
        const std::uint32_t a = face[i], b = face[(i + 1) % face.size()], c = face[(i + 2) % face.size()];
        neighbours_[a].push_back(b);
        faces_of_[a].push_back(f);
        edges_.push_back({std::minmax(a, b), f, c});
      }
    }
    std::sort(edges_.begin(), edges_.end(), [](const Side& a, const Side& b) { return a.ends < b.ends; });
  }
  [[nodiscard]] std::uint32_t number(std::uint32_t a, std::uint32_t b) const {
    const std::pair<std::uint32_t, std::uint32_t> ends = std::minmax(a, b);
    const auto at = std::lower_bound(
        edges_.begin(), edges_.end(), ends,
        [](const Side& side, const std::pair<std::uint32_t, std::uint32_t>& e) { return side.ends < e; });
    return static_cast<std::uint32_t>(at - edges_.begin()) / 2;
  }
  [[nodiscard]] std::array<double, 3> centre(std::size_t f) const {
    std::array<double, 3> mean{};
    for (const auto v : net_.faces[f])
      mean = sum({{1, mean}, {1.0 / static_cast<double>(net_.faces[f].size()), net_.points[v]}});
    return mean;
  }
  static double beta(std::size_t n) {
    const double c = 3.0 / 8 + std::cos(2 * pi / static_cast<double>(n)) / 4;
    return (5.0 / 8 - c * c) / static_cast<double>(n);
  }
  [[nodiscard]] std::array<double, 3> weighted(std::size_t v, double weight) const {
    auto point = sum({{1 - weight * static_cast<double>(neighbours_[v].size()), net_.points[v]}});
    for (const auto w : neighbours_[v]) point = sum({{1, point}, {weight, net_.points[w]}});
    return point;
  }
};

/// A house, of squares and pentagons, with corners of three and four edges; its corners moved about.
ControlNet house(Random& random) {
  ControlNet net{{{0, 0, 0},
                  {2, 0, 0},
                  {2, 0, 2},
                  {1, 0, 3},
                  {0, 0, 2},
                  {0, 3, 0},
                  {2, 3, 0},
                  {2, 3, 2},
                  {1, 3, 3},
                  {0, 3, 2}},
                 {{0, 1, 2, 3, 4}, {9, 8, 7, 6, 5}}};
  for (std::uint32_t i = 0; i < 5; ++i) net.faces.push_back({(i + 1) % 5, i, i + 5, (i + 1) % 5 + 5});
  for (auto& p : net.points)
    for (double& x : p) x += uniform(random, -0.2, 0.2);
  return net;
}

/// A double pyramid over a polygon of so many corners.
ControlNet double_pyramid(Random& random, std::uint32_t sides) {
  ControlNet net{{{0, 0, 1.5}, {0, 0, -1.5}}, {}};
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * pi * i / sides;
    net.points.push_back(
        {std::cos(angle) + uniform(random, -0.1, 0.1), std::sin(angle), uniform(random, -0.2, 0.2)});
    net.faces.push_back({0, 2 + i, 2 + (i + 1) % sides});
    net.faces.push_back({1, 2 + (i + 1) % sides, 2 + i});
  }
  return net;
}

/// @param fine the net, refined many times. @param limits the limit points of its vertices. @param share of
/// the volume that is certain.
void check_surface(const Expression& surface, Subdivider& fine,
                   const std::vector<std::array<double, 3>>& limits, double tolerance, double share) {
  const double volume = fine.volume(limits);
  const VolumeInterval now = check_points<3>(surface, limits, thinner_than(tolerance));
  EXPECT_LE(now.in, volume * (1 + 1e-3));  // the mesh of limit points is inside of what is convex, a little
  EXPECT_GE(now.high(), volume * (1 - 1e-3));
  EXPECT_GT(now.in, volume * share);
}

TEST_F(Subdivision, CatmullClarkSurfacesHoldTheirPointsAndBoundTheirVolume) {
  const ControlNet net = house(random);
  Subdivider fine(net);
  for (int step = 0; step < 7; ++step) fine.catmull_clark();
  check_surface(net.surface(SubdivisionSurface::Scheme::catmull_clark), fine, fine.catmull_clark_limits(),
                0.2, 1.0 / 2);
}

TEST_F(Subdivision, LoopSurfacesHoldTheirPointsAndBoundTheirVolume) {
  const ControlNet net = double_pyramid(random, 7);
  Subdivider fine(net);
  for (int step = 0; step < 7; ++step) fine.loop();
  check_surface(net.surface(SubdivisionSurface::Scheme::loop), fine, fine.loop_limits(), 0.1, 1.0 / 3);
}

}  // namespace
}  // namespace bsp2::dataflow
