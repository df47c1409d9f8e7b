#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {
namespace {

class Coning {
 public:
  explicit Coning(const Complex& complex) : complex_(complex) { mesh_.points = complex.points; }

  Tetrahedra run() {
    std::vector<std::vector<std::uint32_t>> faces(complex_.cells());
    for (std::uint32_t face = 0; face < complex_.faces(); ++face) {
      geometry::Interruption::check();
      fan(face);
      faces[static_cast<std::size_t>(complex_.owner[face])].push_back(face);
      if (complex_.neighbour[face] != Complex::outside)
        faces[static_cast<std::size_t>(complex_.neighbour[face])].push_back(face);
    }
    for (std::uint32_t cell = 0; cell < faces.size(); ++cell) {
      geometry::Interruption::check();
      cone(cell, faces[cell]);
    }
    return std::move(mesh_);
  }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  const Complex& complex_;
  Tetrahedra mesh_;
  std::vector<Triangle> triangles_;  // of all faces, counter-clockwise seen from outside of the owner
  std::vector<std::size_t> begin_{0};
  std::map<std::tuple<std::uint32_t, std::int32_t, std::int32_t, bool>, std::uint32_t> sides_;

  void fan(std::uint32_t face) {
    const auto cycle = complex_.points_of(face);
    if (cycle.size() == 3) {
      triangles_.push_back({cycle[0], cycle[1], cycle[2]});
    } else {
      const auto middle = add_middle(cycle);
      for (std::size_t k = 0; k < cycle.size(); ++k)
        triangles_.push_back({cycle[k], cycle[(k + 1) % cycle.size()], middle});
    }
    begin_.push_back(triangles_.size());
    add_to_surface(face);
  }

  void add_to_surface(std::uint32_t face) {
    const std::int32_t part = complex_.part[static_cast<std::size_t>(complex_.owner[face])];
    const std::int32_t neighbour = complex_.neighbour[face];
    const bool is_outer = neighbour == Complex::outside;
    const std::int32_t other =
        is_outer ? PlaneSide::nothing : complex_.part[static_cast<std::size_t>(neighbour)];
    if (part == other) return;
    // An interface is seen from the part of the higher number.
    const bool is_reversed = !is_outer && other < part;
    const Point& normal = complex_.outward[face];
    PlaneSide side{complex_.plane[face], is_reversed ? other : part, is_reversed ? part : other, normal};
    if (is_reversed)
      for (double& x : side.outward) x = -x;
    const bool is_positive = side.outward > Point{};
    const auto [entry, is_new] = sides_.try_emplace({side.plane, side.part, side.other, is_positive},
                                                    static_cast<std::uint32_t>(mesh_.sides.size()));
    if (is_new) mesh_.sides.push_back(side);
    for (std::size_t i = begin_[face]; i < begin_[face + 1]; ++i) {
      Triangle triangle = triangles_[i];
      if (is_reversed) std::swap(triangle[0], triangle[1]);
      mesh_.triangles.push_back(triangle);
      mesh_.side.push_back(entry->second);
    }
  }

  void cone(std::uint32_t cell, const std::vector<std::uint32_t>& faces) {
    std::vector<std::uint32_t> points;
    bool all_triangles = true;
    for (const std::uint32_t face : faces) {
      const auto cycle = complex_.points_of(face);
      points.insert(points.end(), cycle.begin(), cycle.end());
      all_triangles = all_triangles && cycle.size() == 3;
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    const auto add = [&](std::uint32_t face, std::uint32_t apex) {
      const bool is_owner = complex_.owner[face] == static_cast<std::int32_t>(cell);
      for (std::size_t i = begin_[face]; i < begin_[face + 1]; ++i) {
        const Triangle& t = triangles_[i];
        // Seen from outside counter-clockwise: the normal points away from the apex.
        mesh_.tetrahedra.push_back(is_owner ? std::array{t[1], t[0], t[2], apex}
                                            : std::array{t[0], t[1], t[2], apex});
        mesh_.part.push_back(complex_.part[cell]);
      }
    };
    if (faces.size() == 4 && points.size() == 4 && all_triangles) {
      const auto first = complex_.points_of(faces[0]);
      for (const std::uint32_t point : points)
        if (std::find(first.begin(), first.end(), point) == first.end()) add(faces[0], point);
      return;
    }
    const auto middle = add_middle(points);
    for (const std::uint32_t face : faces) add(face, middle);
  }

  template <typename Points>
  std::uint32_t add_middle(const Points& points) {
    Point sum{};
    for (const std::uint32_t point : points)
      for (std::size_t k = 0; k < 3; ++k) sum[k] += mesh_.points[point][k];
    for (double& x : sum) x /= static_cast<double>(points.size());
    mesh_.points.push_back(sum);
    return static_cast<std::uint32_t>(mesh_.points.size() - 1);
  }
};

}  // namespace

Tetrahedra tetrahedra_of(const Complex& complex) { return Coning(complex).run(); }

Complex complex_of(const Tetrahedra& mesh, std::vector<std::uint32_t>& triangle_of_face) {
  struct Face {
    std::array<std::uint32_t, 3> sorted, points;
    std::int32_t cell;
  };
  const auto sorted = [](std::array<std::uint32_t, 3> points) {
    std::sort(points.begin(), points.end());
    return points;
  };
  std::vector<Face> faces;
  constexpr std::array<std::array<int, 3>, 4> outward{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
    for (const auto& [a, b, c] : outward) {
      const auto& t = mesh.tetrahedra[i];
      const std::array<std::uint32_t, 3> points{t[a], t[b], t[c]};
      faces.push_back({sorted(points), points, static_cast<std::int32_t>(i)});
    }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.sorted, a.cell) < std::tie(b.sorted, b.cell);
  });
  struct Pair {
    std::int32_t owner, neighbour;
    std::size_t face;
    std::uint32_t triangle;
  };
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> triangles;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    triangles.emplace_back(sorted(mesh.triangles[i]), i);
  std::sort(triangles.begin(), triangles.end());
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    geometry::Interruption::check();
    const bool has_two = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted;
    const auto triangle =
        std::lower_bound(triangles.begin(), triangles.end(), std::pair(faces[i].sorted, 0U));
    const bool is_side = triangle != triangles.end() && triangle->first == faces[i].sorted;
    pairs.push_back(
        {faces[i].cell, has_two ? faces[i + 1].cell : Complex::outside, i, is_side ? triangle->second : ~0U});
    if (has_two) ++i;
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::pair(a.owner, static_cast<std::uint32_t>(a.neighbour)) <
           std::pair(b.owner, static_cast<std::uint32_t>(b.neighbour));
  });
  Complex complex;
  complex.points = mesh.points;
  complex.part = mesh.part;
  triangle_of_face.clear();
  for (const Pair& pair : pairs) {
    const auto& points = faces[pair.face].points;
    complex.face_points.insert(complex.face_points.end(), points.begin(), points.end());
    complex.face_offset.push_back(static_cast<std::uint32_t>(complex.face_points.size()));
    complex.owner.push_back(pair.owner);
    complex.neighbour.push_back(pair.neighbour);
    triangle_of_face.push_back(pair.triangle);
    const bool is_side = pair.triangle != ~0U;
    complex.plane.push_back(is_side ? mesh.sides[mesh.side[pair.triangle]].plane : ~0U);
    complex.outward.push_back(is_side ? mesh.sides[mesh.side[pair.triangle]].outward : Point{});
  }
  return complex;
}

}  // namespace bsp2::meshing
