#include "occt/shapes.hpp"

#include <BRep_Builder.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Precision.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace bsp2::io {
namespace {

using geometry::Brep;

class ShapeMaker {
 public:
  explicit ShapeMaker(const Brep& brep)
      : brep_(brep), place_of_use_(brep.uses.size()), edges_(brep.uses.size()) {
    for (std::uint32_t place = 0; place < brep.uses_of_edges.size(); ++place)
      place_of_use_[brep.uses_of_edges[place]] = place;
  }

  TopoDS_Shape solid(const Brep::Solid& solid) {
    TopoDS_Solid shape;
    builder_.MakeSolid(shape);
    for (std::uint32_t i = 0; i < solid.shells; ++i)
      builder_.Add(shape, shell(brep_.shells[solid.first_shell + i]));
    return shape;
  }

 private:
  const Brep& brep_;
  BRep_Builder builder_;
  std::vector<std::uint32_t> place_of_use_;                    // of each use, among those of its edge
  std::vector<TopoDS_Edge> edges_;                             // see wedge_of
  std::unordered_map<std::uint32_t, TopoDS_Vertex> vertices_;  // of the shell at hand

  TopoDS_Shell shell(const Brep::Shell& of) {
    vertices_.clear();
    TopoDS_Shell shape;
    builder_.MakeShell(shape);
    for (const Brep::Side& side : brep_.sides_of(of)) builder_.Add(shape, face(side));
    shape.Closed(true);
    return shape;
  }

  TopoDS_Face face(const Brep::Side& side) {
    const Brep::Face& of = brep_.faces[side.face];
    const auto loops = brep_.loops_of(of);
    // A point of the plane near the face: numbers stay small.
    const auto& near = brep_.points[brep_.from(brep_.uses_of(loops.front()).front())];
    const gp_Dir normal(of.normal[0], of.normal[1], of.normal[2]);
    const double off = of.normal[0] * near[0] + of.normal[1] * near[1] + of.normal[2] * near[2] + of.offset;
    const gp_Pnt origin(near[0] - off * of.normal[0], near[1] - off * of.normal[1],
                        near[2] - off * of.normal[2]);
    const gp_Pln plane(origin, side.is_front ? normal.Reversed() : normal);
    double tolerance = Precision::Confusion();
    for (const Brep::Loop& loop : loops)
      for (const Brep::Use& use : brep_.uses_of(loop)) {
        const auto& p = brep_.points[brep_.from(use)];
        tolerance = std::max(tolerance, 2 * plane.Distance(gp_Pnt(p[0], p[1], p[2])));
      }
    TopoDS_Face shape;
    builder_.MakeFace(shape, new Geom_Plane(plane), tolerance);
    for (const Brep::Loop& loop : loops) builder_.Add(shape, wire(loop, side.is_front));
    return shape;
  }

  TopoDS_Wire wire(const Brep::Loop& loop, bool is_front) {
    TopoDS_Wire shape;
    builder_.MakeWire(shape);
    const auto uses = brep_.uses_of(loop);
    for (std::size_t i = 0; i < uses.size(); ++i) {
      const std::size_t at = is_front ? uses.size() - 1 - i : i;
      const Brep::Use& use = uses[at];
      TopoDS_Edge& along = edges_[wedge_of(loop.first_use + static_cast<std::uint32_t>(at), is_front)];
      if (along.IsNull()) along = edge(brep_.edges[use.edge]);
      const bool is_forward = use.forward != is_front;
      builder_.Add(shape, along.Oriented(is_forward ? TopAbs_FORWARD : TopAbs_REVERSED));
    }
    shape.Closed(true);
    return shape;
  }

  /// Where the solid on this side of a face is about the edge of a use: between a use and the next one, of
  /// which this is the place. So both have one edge, which is nobody else's.
  [[nodiscard]] std::uint32_t wedge_of(std::uint32_t number, bool is_front) const {
    const Brep::Use& use = brep_.uses[number];
    const Brep::Edge& edge = brep_.edges[use.edge];
    const std::uint32_t place = place_of_use_[number];
    if (use.forward == is_front) return place;
    return place == edge.first ? edge.first + edge.count - 1 : place - 1;
  }

  TopoDS_Edge edge(const Brep::Edge& of) {
    const auto &from = brep_.points[of.ends[0]], &to = brep_.points[of.ends[1]];
    const gp_Pnt a(from[0], from[1], from[2]), b(to[0], to[1], to[2]);
    const double length = a.Distance(b);
    const gp_Dir along = length > 0 ? gp_Dir(gp_Vec(a, b)) : gp_Dir(1, 0, 0);
    TopoDS_Edge shape;
    builder_.MakeEdge(shape, new Geom_Line(a, along), Precision::Confusion());
    builder_.Range(shape, 0, length);
    builder_.Add(shape, vertex(of.ends[0]).Oriented(TopAbs_FORWARD));
    builder_.Add(shape, vertex(of.ends[1]).Oriented(TopAbs_REVERSED));
    return shape;
  }

  const TopoDS_Vertex& vertex(std::uint32_t number) {
    TopoDS_Vertex& shape = vertices_[number];
    const auto& p = brep_.points[number];
    if (shape.IsNull()) builder_.MakeVertex(shape, gp_Pnt(p[0], p[1], p[2]), Precision::Confusion());
    return shape;
  }
};

}  // namespace

std::vector<TopoDS_Shape> shapes_of(const Brep& brep) {
  ShapeMaker maker(brep);
  std::vector<TopoDS_Shape> shapes;
  shapes.reserve(brep.solids.size());
  for (const Brep::Solid& solid : brep.solids) shapes.push_back(maker.solid(solid));
  return shapes;
}

}  // namespace bsp2::io
