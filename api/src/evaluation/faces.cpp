#include "bsp2/geometry/surface/brep.hpp"
#include "evaluation/result.hpp"

namespace bsp2 {
namespace {

template <typename Number, std::size_t N>
std::vector<Number> copied(const std::vector<std::array<Number, N>>& rows) {
  const auto numbers = flat(rows);
  return {numbers.begin(), numbers.end()};
}

void add_edges(const geometry::Brep& from, Brep& to) {
  for (const auto& edge : from.edges) {
    to.edges.insert(to.edges.end(), edge.ends.begin(), edge.ends.end());
    to.around_offset.push_back(edge.first);
  }
  to.around_offset.push_back(static_cast<std::uint32_t>(from.uses_of_edges.size()));
  to.around = from.uses_of_edges;
}

void add_faces(const geometry::Brep& from, Brep& to) {
  for (const auto& face : from.faces) {
    to.normals.insert(to.normals.end(), face.normal.begin(), face.normal.end());
    to.offsets.push_back(face.offset);
    to.parts.insert(to.parts.end(), {face.part, face.other});
    to.loop_offset.push_back(face.first_loop);
  }
  to.loop_offset.push_back(static_cast<std::uint32_t>(from.loops.size()));
  for (const auto& loop : from.loops) to.use_offset.push_back(loop.first_use);
  to.use_offset.push_back(static_cast<std::uint32_t>(from.uses.size()));
  for (const auto& use : from.uses) {
    to.uses.push_back(use.edge);
    to.forward.push_back(use.forward ? 1 : 0);
    to.angles.push_back(use.angle);
  }
}

void add_solids(const geometry::Brep& from, Brep& to) {
  for (const auto& solid : from.solids) {
    to.solid_parts.push_back(solid.part);
    to.solid_volumes.push_back(solid.volume);
    to.shell_offset.push_back(solid.first_shell);
  }
  to.shell_offset.push_back(static_cast<std::uint32_t>(from.shells.size()));
  for (const auto& shell : from.shells) {
    to.shell_volumes.push_back(shell.volume);
    to.side_offset.push_back(shell.first);
  }
  to.side_offset.push_back(static_cast<std::uint32_t>(from.faces_of_shells.size()));
  for (const auto& side : from.faces_of_shells) {
    to.sides.push_back(side.face);
    to.is_front.push_back(side.is_front ? 1 : 0);
  }
}

}  // namespace

Brep Result::faces() const {
  return guarded([&] {
    static_assert(Brep::outside == geometry::Brep::outside);
    implementation_->find_surface(true);
    const geometry::Brep& found = implementation_->result.faces.value();
    Brep faces;
    faces.points = copied(found.points);
    add_edges(found, faces);
    add_faces(found, faces);
    add_solids(found, faces);
    faces.triangles = copied(found.triangles);
    faces.triangle_faces = found.face_of_triangle;
    faces.closed = found.is_closed;
    return faces;
  });
}

}  // namespace bsp2
