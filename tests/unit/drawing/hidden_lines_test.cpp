// What is drawn of a solid, against rays through its triangles.

#include "bsp2/drawing/lines/hidden_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "lines/joining.hpp"
#include "lines/round_faces.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::drawing {
namespace {

using dataflow::Kind;
using dataflow::Random;
using geometry::Brep;

Brep brep_of(const model::Expression& e) {
  const dataflow::Resolved r = dataflow::resolved(e, {});
  return geometry::brep_of(r.network.table, dataflow::skin_of(r.network, r.batches, nullptr));
}

std::vector<Piece> lines_of(const Brep& brep, ViewKind view, LineOptions options = {}) {
  return lines_of(brep, GridPoints(brep.points), axes_of(view), options);
}

std::array<std::size_t, line_kinds> counted(const std::vector<Piece>& pieces) {
  std::array<std::size_t, line_kinds> counts{};
  for (const Piece& piece : pieces) ++counts[static_cast<std::size_t>(piece.kind)];
  return counts;
}

/// A rotation by a quaternion.
std::vector<double> turned(Random& random) {
  std::normal_distribution<double> normal;
  std::array<double, 4> q{};
  double length = 0;
  for (double& x : q) x = normal(random), length += x * x;
  for (double& x : q) x /= std::sqrt(length);
  const auto [w, x, y, z] = q;
  return {1 - 2 * (y * y + z * z),
          2 * (x * y - w * z),
          2 * (x * z + w * y),
          0,
          2 * (x * y + w * z),
          1 - 2 * (x * x + z * z),
          2 * (y * z - w * x),
          0,
          2 * (x * z - w * y),
          2 * (y * z + w * x),
          1 - 2 * (x * x + y * y),
          0,
          0,
          0,
          0,
          1};
}

model::Expression moved(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}

TEST(HiddenLines, OfACubeInGeneralPositionAreThreeOfTwelve) {
  for (unsigned seed = 1; seed <= samples::rounds(100U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Brep brep = brep_of(model::transform(turned(random), model::cuboid({3, 2, 1})));
    for (const ViewKind view : all_views)
      EXPECT_EQ(counted(lines_of(brep, view)), (std::array<std::size_t, 3>{9, 0, 3}));
  }
}

std::array<std::size_t, line_kinds> strokes_of(const Brep& brep, ViewKind view, LineOptions options = {}) {
  std::uint64_t dropped = 0;
  std::array<std::size_t, line_kinds> counts{};
  std::vector<Piece> pieces = lines_of(brep, view, options);
  for (Piece& piece : pieces)  // so large that a sheet shows all facets
    for (Point2* end : {&piece.from, &piece.to})
      for (double& x : *end) x *= 100;
  for (const Stroke& stroke : joined(std::move(pieces), dropped)) {
    const std::size_t lines = stroke.points.size() - (stroke.is_closed ? 0 : 1);
    counts[static_cast<std::size_t>(stroke.kind)] += lines;
  }
  EXPECT_EQ(dropped, 0U);
  return counts;
}

TEST(HiddenLines, ThatLieBehindVisibleOnesAreDrawnOnce) {
  const Brep cube = brep_of(model::cuboid({10, 10, 10}));
  for (const ViewKind view : all_views) {
    const bool is_flat = view != ViewKind::iso;  // there the hidden corner is behind the one in front
    EXPECT_EQ(strokes_of(cube, view), (std::array<std::size_t, 3>{is_flat ? 4U : 9U, 0, is_flat ? 0U : 3U}))
        << name_of(view);
  }
  // A hole of which two edges are hidden, and two rims of which one is behind the other.
  const auto hole = moved(5, 5, -1, model::cylinder(12, 3, 3, 32, false));
  const Brep drilled = brep_of(model::subtract(std::vector{model::cuboid({10, 10, 10}), hole}));
  EXPECT_EQ(strokes_of(drilled, ViewKind::front), (std::array<std::size_t, 3>{4, 0, 2}));
  EXPECT_EQ(strokes_of(drilled, ViewKind::top), (std::array<std::size_t, 3>{36, 0, 0}));
  EXPECT_EQ(strokes_of(drilled, ViewKind::top, {.hidden = false}), (std::array<std::size_t, 3>{36, 0, 0}));
  // Without facets that are smooth all edges are drawn; half of those inside are behind others.
  EXPECT_EQ(strokes_of(drilled, ViewKind::front, {.smooth_angle = 0}),
            (std::array<std::size_t, 3>{4, 0, 17}));
}

TEST(HiddenLines, LeaveOfSomethingRoundItsContour) {
  const Brep cylinder = brep_of(model::cylinder(10, 3, 3, 64, false));
  EXPECT_EQ(strokes_of(cylinder, ViewKind::front), (std::array<std::size_t, 3>{4, 0, 0}));
  EXPECT_EQ(strokes_of(cylinder, ViewKind::front, {.smooth_edges = true})[1], 31U);
  EXPECT_EQ(strokes_of(cylinder, ViewKind::top), (std::array<std::size_t, 3>{64, 0, 0}));
}

/// Rays towards who looks, through all triangles.
class Rays {
 public:
  Rays(const Brep& brep, const ViewAxes& axes) : brep_(brep) {
    for (std::size_t i = 0; i < 3; ++i) {
      double length = 0;
      for (std::size_t k = 0; k < 3; ++k) length += static_cast<double>(axes[i][k] * axes[i][k]);
      for (std::size_t k = 0; k < 3; ++k) frame_[i][k] = static_cast<double>(axes[i][k]) / std::sqrt(length);
    }
    for (const Point3& p : brep.points)
      for (const double x : p) size_ = std::max(size_, std::fabs(x));
  }

  [[nodiscard]] double size() const { return size_; }
  [[nodiscard]] Point3 in_view(const Point3& p) const {
    Point3 at{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) at[i] += frame_[i][k] * p[k];
    return at;
  }

  /// Whether something is in front of a point; nothing where that is hard to tell.
  [[nodiscard]] std::optional<bool> is_hidden(const Point3& point) const {
    const double near = 1e-6 * size_;
    const Point3 p = in_view(point);
    bool is_hidden = false, is_unclear = false;
    for (const auto& triangle : brep_.triangles) {
      std::array<Point3, 3> t;
      for (std::size_t i = 0; i < 3; ++i) t[i] = in_view(brep_.points[triangle[i]]);
      double nearest_side = 1e300;
      for (std::size_t i = 0; i < 3; ++i)
        nearest_side = std::min(nearest_side, distance(p, t[i], t[(i + 1) % 3]));
      const double area = cross(t[0], t[1], t[2]);
      if (std::fabs(area) < near * size_) {
        // Seen from its edge: it hides nothing, but near it nothing is clear.
        if (nearest_side < near && std::max({t[0][2], t[1][2], t[2][2]}) > p[2] + near) is_unclear = true;
        continue;
      }
      const std::array weight{cross(t[1], t[2], p) / area, cross(t[2], t[0], p) / area,
                              cross(t[0], t[1], p) / area};
      const double depth = weight[0] * t[0][2] + weight[1] * t[1][2] + weight[2] * t[2][2];
      const bool is_inside = weight[0] > 0 && weight[1] > 0 && weight[2] > 0;
      if (nearest_side < near) {
        if (std::max({t[0][2], t[1][2], t[2][2]}) > p[2] + near) is_unclear = true;
        continue;
      }
      if (!is_inside || depth < p[2] - near) continue;
      if (depth > p[2] + near)
        is_hidden = true;
      else if (distance_to_plane(t, p) > 1e-9 * size_)
        is_unclear = true;
    }
    if (is_hidden) return true;
    if (is_unclear) return std::nullopt;
    return false;
  }

 private:
  const Brep& brep_;
  std::array<Point3, 3> frame_{};
  double size_ = 0;

  static double cross(const Point3& a, const Point3& b, const Point3& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  }
  /// In the picture.
  static double distance(const Point3& p, const Point3& a, const Point3& b) {
    const double dx = b[0] - a[0], dy = b[1] - a[1], squared = dx * dx + dy * dy;
    const double s =
        squared > 0 ? std::clamp(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / squared, 0.0, 1.0) : 0.0;
    return std::hypot(p[0] - a[0] - s * dx, p[1] - a[1] - s * dy);
  }
  static double distance_to_plane(const std::array<Point3, 3>& t, const Point3& p) {
    Point3 u{}, v{}, w{};
    for (std::size_t k = 0; k < 3; ++k)
      u[k] = t[1][k] - t[0][k], v[k] = t[2][k] - t[0][k], w[k] = p[k] - t[0][k];
    const Point3 n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    return std::fabs(n[0] * w[0] + n[1] * w[1] + n[2] * w[2]) / std::hypot(n[0], n[1], n[2]);
  }
};

/// Whether a piece goes through a place of the picture in a direction. @param beyond its ends it does, too.
bool goes_through(const Piece& piece, const Point2& place, const Point2& along, double near, double beyond) {
  const double dx = piece.to[0] - piece.from[0], dy = piece.to[1] - piece.from[1],
               length = std::hypot(dx, dy);
  const double size = std::hypot(along[0], along[1]);
  if (!(length > 0) || std::fabs(dx * along[1] - dy * along[0]) > 1e-6 * length * size) return false;
  const double px = place[0] - piece.from[0], py = place[1] - piece.from[1];
  const double s = (px * dx + py * dy) / length;
  return std::fabs(px * dy - py * dx) <= near * length && s >= -beyond && s <= length + beyond;
}

struct Judged {
  std::size_t visible = 0, hidden = 0, unclear = 0;
};

/// Points of all sharp edges are drawn as rays say, and what is drawn there is nothing else.
void check_view(const Brep& brep, ViewKind view, Random& random, Judged& judged) {
  const Rays rays(brep, axes_of(view));
  const std::vector<Piece> pieces = lines_of(brep, view, {.smooth_angle = 0});
  std::uniform_real_distribution<double> somewhere(0.02, 0.98);
  const double near = 1e-8 * rays.size();
  for (const Brep::Edge& edge : brep.edges) {
    const Point3 &a = brep.points[edge.ends[0]], &b = brep.points[edge.ends[1]];
    const Point3 from = rays.in_view(a), to = rays.in_view(b);
    if (std::hypot(to[0] - from[0], to[1] - from[1]) < 1e-5 * rays.size()) continue;
    const double s = somewhere(random);
    Point3 p{};
    for (std::size_t k = 0; k < 3; ++k) p[k] = a[k] + s * (b[k] - a[k]);
    const auto is_hidden = rays.is_hidden(p);
    if (!is_hidden) {
      ++judged.unclear;
      continue;
    }
    ++(*is_hidden ? judged.hidden : judged.visible);
    const LineKind kind = *is_hidden ? LineKind::hidden : LineKind::visible;
    const Point2 place = seen(axes_of(view), p), along{to[0] - from[0], to[1] - from[1]};
    const auto is_it = [&](const Piece& piece) {
      return piece.kind == kind && goes_through(piece, place, along, near, near);
    };
    ASSERT_TRUE(std::any_of(pieces.begin(), pieces.end(), is_it))
        << name_of(view) << (*is_hidden ? " hidden" : " visible") << " at " << p[0] << ", " << p[1] << ", "
        << p[2];
  }
}

class HiddenLinesOfRandomSolids : public ::testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Of, HiddenLinesOfRandomSolids, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& p) { return p.param == Kind::solids ? "Solids" : "GridBoxes"; });

TEST_P(HiddenLinesOfRandomSolids, AreThoseThatRaysDoNotReach) {
  Judged judged;
  const unsigned rounds = samples::rounds(60U);
  for (unsigned seed = 1; seed <= rounds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Brep brep = brep_of(dataflow::random_expression(random, 3, GetParam(), 2));
    if (brep.points.empty() || brep.edges.size() > 1000) continue;
    for (const ViewKind view : {ViewKind::front, ViewKind::top, ViewKind::right, ViewKind::iso})
      ASSERT_NO_FATAL_FAILURE(check_view(brep, view, random, judged));
  }
  // Where all lies on a grid most edges are in line with others; still enough is clear.
  EXPECT_GT(judged.visible, rounds * 8);
  EXPECT_GT(judged.hidden, rounds * 4);
}

TEST(HiddenLines, DoNotDependOnThreads) {
  for (unsigned seed = 1; seed <= samples::rounds(5U); ++seed) {
    Random random(seed);
    std::vector<model::Expression> boxes;
    for (int i = 0; i < 40; ++i)
      boxes.push_back(model::transform(dataflow::free_matrix(random, 3, 2),
                                       dataflow::random_primitive(random, 3, Kind::solids)));
    const Brep brep = brep_of(model::unite(boxes));
    const auto one = lines_of(brep, ViewKind::iso, {.threads = 1}),
               four = lines_of(brep, ViewKind::iso, {.threads = 4});
    ASSERT_EQ(one.size(), four.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_EQ(one[i].from, four[i].from);
      EXPECT_EQ(one[i].to, four[i].to);
      EXPECT_EQ(one[i].kind, four[i].kind);
    }
  }
}

/// Whatever parts of the edges are looked at, together they have what all have, each piece once.
TEST(HiddenLines, OfPartsAreThoseOfAll) {
  for (unsigned seed = 1; seed <= samples::rounds(10U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Brep brep = brep_of(dataflow::random_expression(random, 3, Kind::solids, 3));
    const auto sorted = [](const std::vector<Piece>& pieces) {
      std::vector<std::tuple<Point2, Point2, LineKind>> all;
      for (const Piece& piece : pieces) all.emplace_back(piece.from, piece.to, piece.kind);
      std::sort(all.begin(), all.end());
      return all;
    };
    const std::size_t of = 1 + random() % 5;
    std::vector<Piece> together;
    for (std::size_t first = 0, end = 0; first < of; first = end) {
      end = std::min(of, first + random() % 3);  // may be none
      const auto some = lines_of(brep, ViewKind::iso, {.part = {first, end, of}});
      together.insert(together.end(), some.begin(), some.end());
    }
    EXPECT_EQ(sorted(together), sorted(lines_of(brep, ViewKind::iso)));
  }
}

/// Lines on a few places, so that many are in line.
std::vector<Piece> random_pieces(Random& random) {
  std::vector<Piece> pieces;
  std::uniform_int_distribution<int> grid(0, 6), kind(0, 2);
  for (int i = 0; i < 60; ++i) {
    const Point2 from{10.0 * grid(random), 10.0 * grid(random)};
    const std::array<Point2, 4> ways{{{10, 0}, {0, 10}, {10, 10}, {20, 10}}};
    const Point2 way = ways[static_cast<std::size_t>(grid(random)) % 4];
    const double length = 1 + grid(random) / 2.0;
    pieces.push_back(
        {from, {from[0] + length * way[0], from[1] + length * way[1]}, static_cast<LineKind>(kind(random))});
  }
  return pieces;
}

TEST(Joining, DrawsEachPlaceOnceAndAsTheStrongest) {
  for (unsigned seed = 1; seed <= samples::rounds(100U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const std::vector<Piece> pieces = random_pieces(random);
    std::uint64_t dropped = 0;
    std::vector<Piece> drawn;
    for (const Stroke& stroke : joined(pieces, dropped))
      for (std::size_t i = 0; i + (stroke.is_closed ? 0 : 1) < stroke.points.size(); ++i)
        drawn.push_back({stroke.points[i], stroke.points[(i + 1) % stroke.points.size()], stroke.kind});
    EXPECT_EQ(dropped, 0U);
    std::uniform_real_distribution<double> somewhere(0.001, 0.999);
    const auto check = [&](const std::vector<Piece>& from_these) {
      for (const Piece& piece : from_these) {
        const double s = somewhere(random);
        const Point2 along{piece.to[0] - piece.from[0], piece.to[1] - piece.from[1]};
        const Point2 place{piece.from[0] + s * along[0], piece.from[1] + s * along[1]};
        auto strongest = LineKind::hidden;
        for (const Piece& other : pieces)
          if (goes_through(other, place, along, 1e-9, 0)) strongest = std::min(strongest, other.kind);
        std::size_t here = 0;
        for (const Piece& other : drawn)
          if (goes_through(other, place, along, 1e-9, 1e-9)) {
            ++here;
            EXPECT_EQ(other.kind, strongest);
          }
        EXPECT_EQ(here, 1U);
      }
    };
    check(pieces);
    check(drawn);
  }
}

TEST(RoundFaces, HaveTheirAxesWhateverTheyAreCutFrom) {
  for (unsigned seed = 1; seed <= samples::rounds(20U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    std::uniform_real_distribution<double> size(1, 3), place(-1, 1);
    std::uniform_int_distribution<std::uint32_t> sides(16, 60);
    const double radius = size(random), x = place(random), y = place(random);
    const auto hole = moved(x, y, -50, model::cylinder(100, radius, radius, sides(random), false));
    // A slanted slab, so that no rim is a circle.
    const auto slab = model::transform(turned(random), model::cuboid({20, 20, 20}, true));
    const std::vector<double> map = turned(random);
    const Brep brep = brep_of(model::transform(map, model::subtract(std::vector{slab, hole})));
    const auto axes = round_axes(brep, 30);
    ASSERT_EQ(axes.size(), 1U);
    EXPECT_NEAR(axes[0].radius, radius, 1e-6);
    // The axis goes through the images of (x, y, z).
    for (const Point3& end : {axes[0].from, axes[0].to}) {
      Point3 back{};
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) back[k] += map[4 * i + k] * end[i];
      EXPECT_NEAR(back[0], x, 1e-6);
      EXPECT_NEAR(back[1], y, 1e-6);
    }
  }
  EXPECT_TRUE(round_axes(brep_of(model::cuboid({1, 2, 3})), 30).empty());
}

TEST(RoundFaces, OfHolesFarFromTheOriginHaveAnAxisEach) {
  const auto hole = [](double x, double y, double r) {
    return moved(x, y, -1, model::cylinder(10, r, r, 64, false));
  };
  const auto plate =
      model::subtract(std::vector{model::cuboid({40, 20, 5}), hole(6, 6, 1), hole(9, 6, 1), hole(30, 10, 2)});
  for (const double away : {0.0, 1e6}) {
    auto axes = round_axes(brep_of(moved(away, away, 0, plate)), 30);
    ASSERT_EQ(axes.size(), 3U) << away;
    std::sort(axes.begin(), axes.end(), [](const auto& a, const auto& b) { return a.from[0] < b.from[0]; });
    EXPECT_NEAR(axes[0].from[0] - away, 6, 1e-4);
    EXPECT_NEAR(axes[2].from[0] - away, 30, 1e-4);
    EXPECT_NEAR(axes[2].from[1] - away, 10, 1e-4);
  }
}

TEST(RoundFaces, OfConesAndSpheresHaveOneAxis) {
  for (unsigned seed = 1; seed <= samples::rounds(20U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    std::uniform_int_distribution<std::uint32_t> sides(16, 48);
    const std::vector<double> map = turned(random);
    for (const auto& solid :
         {model::cylinder(5, 3, 1, sides(random), false), model::cylinder(5, 2, 0, sides(random), true),
          model::sphere(3, sides(random))}) {
      const auto axes = round_axes(brep_of(model::transform(map, solid)), 30);
      ASSERT_EQ(axes.size(), 1U);
      const Point3 along{axes[0].to[0] - axes[0].from[0], axes[0].to[1] - axes[0].from[1],
                         axes[0].to[2] - axes[0].from[2]};
      const double length = std::hypot(along[0], along[1], along[2]);
      // The image of z.
      EXPECT_NEAR(std::fabs(along[0] * map[2] + along[1] * map[6] + along[2] * map[10]), length, 1e-6);
    }
  }
}

}  // namespace
}  // namespace bsp2::drawing
