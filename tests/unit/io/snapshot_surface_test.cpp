// The surface that is added to a snapshot comes back as it was, or is refused.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "support/full_disk.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;

class SnapshotOfASurface : public testing::Test {
 protected:
  samples::TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "run.h5";
  std::mt19937 random_{samples::new_seed()};

  SnapshotOfASurface() { write(); }
  void write() const {
    Snapshot snapshot;
    snapshot.head.source = "cube();";
    snapshot.tree.dimension = 3;
    write_snapshot(path_, snapshot);
  }
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(folder_.path()), {});
  }
};

/// The message, or nothing.
template <typename Body>
std::string refusal_of(const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

constexpr std::int32_t parts = 5;

/// Numbers of anything, but all within what they count.
geometry::TriangleSurface random_surface(std::mt19937& random, std::uint32_t points) {
  geometry::TriangleSurface surface;
  const auto number = [&] { return static_cast<double>(random()) / 7 - 1e8; };
  const auto corner = [&] { return static_cast<std::uint32_t>(random() % points); };
  for (std::uint32_t i = 0; i < points; ++i) {
    surface.points.push_back({number(), number(), number()});
    surface.triangles.push_back({corner(), corner(), corner()});
    surface.owner.push_back(static_cast<std::int32_t>(random() % (parts + 1)) - 1);
  }
  return surface;
}

void expect_same(const geometry::TriangleSurface& a, const geometry::TriangleSurface& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.owner, b.owner);
}

TEST_F(SnapshotOfASurface, HasTheLastOne) {
  EXPECT_FALSE(read_surface(path_, parts, true));
  for (const std::uint32_t points : {0U, 1U, 70000U, 20U}) {
    const auto surface = random_surface(random_, points);
    add_surface(path_, surface, nullptr);
    const auto found = read_surface(path_, parts, true);
    ASSERT_TRUE(found);
    expect_same(found->triangles, surface);
    EXPECT_FALSE(found->faces);
    EXPECT_TRUE(read_snapshot(path_, SnapshotPart::head).head.has_surface);
    EXPECT_FALSE(read_snapshot(path_, SnapshotPart::head).head.has_faces);
    EXPECT_EQ(read_snapshot(path_).head.source, "cube();");
    EXPECT_EQ(files(), 1);
  }
  write();
  EXPECT_FALSE(read_surface(path_, parts, true));
}

TEST_F(SnapshotOfASurface, WithoutRoomForItStaysAsItIs) {
  const std::string before = bytes();
  std::string message;
  {
    const samples::FullDisk disk(before.size() + 1000);
    message = refusal_of([&] { add_surface(path_, random_surface(random_, 5000), nullptr); });
  }
  EXPECT_NE(message.find("cannot add the surface"), std::string::npos) << message;
  EXPECT_TRUE(bytes() == before);
  EXPECT_EQ(files(), 1);
}

/// Checksums cannot tell of a program that writes what does not fit.
TEST_F(SnapshotOfASurface, RefusesOneThatDoesNotFit) {
  auto surface = random_surface(random_, 10);
  surface.triangles[3][1] = 10;
  add_surface(path_, surface, nullptr);
  EXPECT_NE(refusal_of([&] { read_surface(path_, parts, false); }).find("beyond its end"), std::string::npos);
  surface.triangles[3][1] = 9;
  surface.owner.pop_back();
  add_surface(path_, surface, nullptr);
  EXPECT_NE(refusal_of([&] { read_surface(path_, parts, false); }).find("incomplete"), std::string::npos);
  for (const std::int32_t part : {-2, parts, 1 << 30}) {
    surface.owner.resize(9);
    surface.owner.push_back(part);
    add_surface(path_, surface, nullptr);
    EXPECT_NE(refusal_of([&] { read_surface(path_, parts, false); }).find("parts"), std::string::npos)
        << part;
  }
  surface.owner.back() = 0;
  surface.points[2][1] = std::numeric_limits<double>::infinity();
  add_surface(path_, surface, nullptr);
  EXPECT_NE(refusal_of([&] { read_surface(path_, parts, false); }).find("nowhere"), std::string::npos);
}

/// A triangle, seen from both sides.
geometry::Brep two_faces() {
  geometry::Brep faces;
  faces.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  faces.edges = {{{0, 1}, 0, 2}, {{0, 2}, 2, 2}, {{1, 2}, 4, 2}};
  faces.faces = {{{0, 0, 1}, 0, 0, geometry::Brep::outside, 0, 1}, {{0, 0, -1}, 0, 0, -2, 1, 1}};
  faces.loops = {{0, 3}, {3, 3}};
  for (const std::uint32_t face : {0U, 1U})
    for (const std::uint32_t edge : {0U, 2U, 1U})
      faces.uses.push_back({edge, face, (face == 0) != (edge == 1), 0});
  faces.uses_of_edges = {0, 3, 2, 5, 1, 4};
  faces.shells = {{0, 0, 0, 2, false, 0}};
  faces.faces_of_shells = {{0, false}, {1, false}};
  faces.solids = {{0, 0, 1, 0}};
  faces.triangles = {{0, 1, 2}, {0, 2, 1}};
  faces.face_of_triangle = {0, 1};
  return faces;
}

TEST_F(SnapshotOfASurface, RefusesFacesThatDoNotFit) {
  using geometry::Brep;
  const auto surface = random_surface(random_, 10);
  const auto refused = [&](const std::function<void(Brep&)>& damage) {
    Brep faces = two_faces();
    damage(faces);
    add_surface(path_, surface, &faces);
    expect_same(read_surface(path_, parts, false)->triangles, surface);
    return !refusal_of([&] { read_surface(path_, parts, true); }).empty();
  };
  EXPECT_FALSE(refused([](Brep&) {}));
  EXPECT_TRUE(refused([](Brep& faces) { faces.faces[1].loops = 2; })) << "more loops than there are";
  EXPECT_TRUE(refused([](Brep& faces) { faces.faces[0].loops = 2, faces.faces[1].loops = 0; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.loops[0].uses = 6, faces.loops[1].uses = 0; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.solids[0].shells = 0; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.shells[0].count = 0; }));
  EXPECT_TRUE(refused([](Brep& faces) { std::swap(faces.uses_of_edges[0], faces.uses_of_edges[2]); }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.uses_of_edges[1] = 0; })) << "one use twice";
  EXPECT_TRUE(refused([](Brep& faces) { faces.uses[4].edge = 3; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.faces[0].part = parts; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.faces[0].other = -3; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.solids[0].part = Brep::outside; }));
  EXPECT_TRUE(refused([](Brep& faces) { faces.points[0][0] = std::numeric_limits<double>::quiet_NaN(); }));
}

}  // namespace
}  // namespace bsp2::io
