#include "surface/face_triangulation.hpp"

#include <algorithm>
#include <exception>
#include <stdexcept>

#include "surface/shared_ranges.hpp"
#include "surface/sweep_triangulation.hpp"

namespace bsp2::geometry {
namespace {

/// Where edges of one face cross though none ends there: three lines through a point with every other one of
/// the six sectors in the face, so that each line goes straight on. Looked for only where a face could not be
/// triangulated.
void add_crossings(ExactPoints& exact, std::span<const Skin::Edge> edges, OrientedHyperplane outward,
                   PointSet& points) {
  const auto part = [&](const Skin::Edge& a, const Skin::Edge& b) {
    return exact.side(points, a.from, b.across) * exact.side(points, a.to, b.across) < 0;
  };
  // Most edges of a large face are far from each other, which their boxes tell.
  std::vector<std::array<double, 6>> boxes;
  for (const Skin::Edge& edge : edges) {
    const Vertex<3>&u = points.vertices[edge.from], &v = points.vertices[edge.to];
    std::array<double, 6> box{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box[axis] = std::min(u.x[axis] - u.error, v.x[axis] - v.error);
      box[3 + axis] = std::max(u.x[axis] + u.error, v.x[axis] + v.error);
    }
    boxes.push_back(box);
  }
  const auto are_apart = [&](std::size_t i, std::size_t k) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (boxes[i][axis] > boxes[k][3 + axis] || boxes[k][axis] > boxes[i][3 + axis]) return true;
    return false;
  };
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (are_apart(i, k) || !part(edges[i], edges[k]) || !part(edges[k], edges[i])) continue;
      const Vertex<3> vertex =
          canonical_vertex(exact.table(), {outward.id(), edges[i].across, edges[k].across});
      points.add(vertex, vertex.hyperplanes);
    }
}

/// What one thread makes of some faces.
struct Part {
  FaceTriangles made;  // ends count within the part
  std::vector<std::pair<std::span<const Skin::Edge>, std::exception_ptr>> failed;
};

std::span<const Skin::Edge> face_at(std::span<const Skin::Edge> edges, std::size_t first) {
  std::size_t end = first;
  while (end < edges.size() && edges[end].face == edges[first].face) ++end;
  return edges.subspan(first, end - first);
}

/// Of the faces that begin in a range of the edges.
void triangulate_some(ExactPoints& exact, const PointSet& points, std::span<const Skin::Face> faces,
                      std::span<const Skin::Edge> edges, std::size_t first, std::size_t last,
                      const std::function<void(std::size_t)>& done, Part& part) {
  SweepTriangulator triangulator;
  auto& [triangles, ends] = part.made;
  if (first > 0)
    while (first < last && edges[first].face == edges[first - 1].face) ++first;
  while (first < last) {
    done(first);
    const auto face = face_at(edges, first);
    const std::size_t before = triangles.size();
    try {
      triangulator.triangulate(exact, points, faces[face[0].face].outward, face, triangles);
    } catch (const std::logic_error&) {
      triangles.resize(before);
      part.failed.emplace_back(face, std::current_exception());
    }
    ends.emplace_back(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(triangles.size()));
    first += face.size();
  }
}

}  // namespace

FaceTriangles triangulated_faces(ExactPoints& exact, unsigned threads, PointSet& points,
                                 std::span<const Skin::Face> faces, std::span<const Skin::Edge> edges,
                                 const std::function<void(std::size_t)>& done) {
  const SharedRanges ranges(edges.size(), threads);
  std::vector<Part> parts(ranges.size());
  ranges.run(exact, [&](ExactPoints& own, std::size_t range, std::size_t first, std::size_t last) {
    triangulate_some(own, points, faces, edges, first, last, done, parts[range]);
  });
  for (const Part& part : parts)
    for (const auto& [face, failure] : part.failed) {
      const std::size_t before = points.size();
      add_crossings(exact, face, faces[face[0].face].outward, points);
      if (points.size() == before) std::rethrow_exception(failure);
    }
  if (parts.size() == 1) return std::move(parts[0].made);
  FaceTriangles all;
  for (Part& part : parts) {
    const auto before = static_cast<std::uint32_t>(all.triangles.size());
    const auto& [triangles, ends] = part.made;
    all.triangles.insert(all.triangles.end(), triangles.begin(), triangles.end());
    for (const auto& [first, end] : ends) all.faces.emplace_back(first, before + end);
    part = {};
  }
  return all;
}

}  // namespace bsp2::geometry
