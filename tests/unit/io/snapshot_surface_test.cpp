// The surface that is added to a snapshot comes back as it was, or is refused.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "support/full_disk.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;

class SnapshotOfASurface : public testing::Test {
 protected:
  samples::TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "run.h5";
  std::mt19937 random_{std::random_device{}()};

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

/// Numbers of anything, but all within what they count.
geometry::TriangleSurface random_surface(std::mt19937& random, std::uint32_t points) {
  geometry::TriangleSurface surface;
  const auto number = [&] { return static_cast<double>(random()) / 7 - 1e8; };
  const auto corner = [&] { return static_cast<std::uint32_t>(random() % points); };
  for (std::uint32_t i = 0; i < points; ++i) {
    surface.points.push_back({number(), number(), number()});
    surface.triangles.push_back({corner(), corner(), corner()});
    surface.owner.push_back(static_cast<std::int32_t>(random()));
  }
  return surface;
}

void expect_same(const geometry::TriangleSurface& a, const geometry::TriangleSurface& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.owner, b.owner);
}

TEST_F(SnapshotOfASurface, HasTheLastOne) {
  EXPECT_FALSE(read_surface(path_, true));
  for (const std::uint32_t points : {0U, 1U, 70000U, 20U}) {
    const auto surface = random_surface(random_, points);
    add_surface(path_, surface, nullptr);
    const auto found = read_surface(path_, true);
    ASSERT_TRUE(found);
    expect_same(found->triangles, surface);
    EXPECT_FALSE(found->faces);
    EXPECT_TRUE(read_snapshot(path_, SnapshotPart::head).head.has_surface);
    EXPECT_FALSE(read_snapshot(path_, SnapshotPart::head).head.has_faces);
    EXPECT_EQ(read_snapshot(path_).head.source, "cube();");
    EXPECT_EQ(files(), 1);
  }
  write();
  EXPECT_FALSE(read_surface(path_, true));
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
  EXPECT_NE(refusal_of([&] { read_surface(path_, false); }).find("beyond its end"), std::string::npos);
  surface.triangles[3][1] = 9;
  surface.owner.pop_back();
  add_surface(path_, surface, nullptr);
  EXPECT_NE(refusal_of([&] { read_surface(path_, false); }).find("incomplete"), std::string::npos);
  // Faces whose loops are more than there are.
  surface.owner.push_back(0);
  geometry::Brep faces;
  faces.points = surface.points;
  faces.faces.resize(2);
  faces.faces[1].loops = 1;
  add_surface(path_, surface, &faces);
  EXPECT_NE(refusal_of([&] { read_surface(path_, true); }).find("do not fit"), std::string::npos);
  expect_same(read_surface(path_, false)->triangles, surface);
}

}  // namespace
}  // namespace bsp2::io
