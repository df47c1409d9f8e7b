#include "surface/triangulated_skin.hpp"

#include <stdexcept>
#include <thread>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "surface/no_index.hpp"
#include "surface/skin_steps.hpp"
#include "surface/whole_triangles.hpp"

namespace bsp2::geometry {
namespace {

/// Tells how far a work of several steps is, on the thread that made it alone.
class Steps {
 public:
  explicit Steps(const ToldShare& told) : told_(told), thread_(std::this_thread::get_id()) {}
  /// The next step leads from one share to another one.
  void begin(double from, double to) {
    from_ = from;
    to_ = to;
    Interruption::check();
    if (told_) told_(from);
  }
  void within(std::size_t done, std::size_t all) const {
    constexpr std::size_t seldom = 1024;
    if (std::this_thread::get_id() != thread_ || ++calls_ % seldom != 0) return;
    Interruption::check();
    if (told_) told_(from_ + (to_ - from_) * static_cast<double>(done) / static_cast<double>(all));
  }

 private:
  const ToldShare& told_;
  std::thread::id thread_;
  double from_ = 0, to_ = 0;
  mutable std::size_t calls_ = 0;
};

}  // namespace

TriangulatedSkin with_surface(TriangulatedSkin skin, const FaceTriangles& triangles) {
  TriangleSurface& surface = skin.surface;
  surface.points.reserve(skin.points.size());
  surface.triangles.reserve(triangles.triangles.size());
  surface.owner.reserve(triangles.triangles.size());
  skin.face_of_triangle.reserve(triangles.triangles.size());
  std::vector<std::uint32_t> number(skin.points.size(), none);
  std::size_t done = 0;
  for (const auto& [first_edge, end] : triangles.faces)
    for (const std::uint32_t face = skin.edges[first_edge].face; done < end; ++done) {
      auto triangle = triangles.triangles[done];
      for (std::uint32_t& point : triangle) {
        if (number[point] == none) {
          number[point] = static_cast<std::uint32_t>(surface.points.size());
          skin.point_of_surface.push_back(point);
          const auto& x = skin.points.vertices[point].x;
          surface.points.push_back({x[0] + 0.0, x[1] + 0.0, x[2] + 0.0});  // no negative zeros
        }
        point = number[point];
      }
      surface.triangles.push_back(triangle);
      surface.owner.push_back(skin.faces[face].owner);
      skin.face_of_triangle.push_back(face);
    }
  return skin;
}

TriangulatedSkin triangulated(const HyperplaneTable<3>& table, Skin skin, const ToldShare& told,
                              unsigned threads) {
  Steps steps(told);
  ExactPoints exact(table);
  sort_faces(skin);
  WholeTriangles whole(skin);
  whole.renumber(skin.weld());
  PointSet points = take_points(table, threads, skin);
  whole.renumber(unite_points(table, points, skin));
  steps.begin(0.25, 0.4);
  add_up_lines(exact, threads, points, skin);
  add_up(skin.edges);
  steps.begin(0.4, 0.55);
  EdgeSplitter(exact, threads).split(points, skin.faces, skin.edges);
  add_up(skin.edges);
  steps.begin(0.55, 0.7);
  join_straight_edges(exact, threads, points, skin.faces.size(), skin);
  for (std::vector<std::uint8_t> is_named = whole.put_back(table, threads, points, skin);;) {
    rename_points(exact, threads, points, skin, std::exchange(is_named, {}));
    const std::size_t known = points.size();
    steps.begin(0.7, 1);
    const auto triangles =
        triangulated_faces(exact, threads, points, skin.faces, skin.edges,
                           [&](std::size_t done) { steps.within(done, skin.edges.size()); });
    if (points.size() == known)
      return with_surface({std::move(points), std::move(skin.faces), std::move(skin.edges), {}, {}, {}},
                          triangles);
    const std::size_t undivided = skin.edges.size();
    divide_at(exact, points, known, skin);
    if (skin.edges.size() <= undivided)
      throw std::logic_error("edges of a face of the boundary that cross cannot be divided");
  }
}

}  // namespace bsp2::geometry
