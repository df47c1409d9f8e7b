#include "readers/cad_mesh.hpp"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IMeshTools_Parameters.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Precision.hxx>
#include <ShapeFix_Shape.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Cone.hxx>
#include <gp_Cylinder.hxx>
#include <gp_Pnt2d.hxx>
#include <gp_Sphere.hxx>
#include <gp_Torus.hxx>
#include <numbers>
#include <optional>
#include <utility>

namespace bsp2::model {
namespace {

double size_of(const TopoDS_Shape& shape) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box, false);
  return box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
}

/// How far triangles may be from faces, and by how much two sides of an arc may turn.
///
/// `deflection` is the first, and `$fn` the second. `$fa` and `$fs` tell a side of an arc: as far as that is
/// from the arc may all be, or a part of the size of the solid that goes with `$fa`. That is finer than the
/// circles of OpenSCAD, for what has been drawn as a curve is no circle of few corners. (The mesher's own
/// limit to the length of sides opens holes in splines.)
IMeshTools_Parameters parameters_of(const TopoDS_Shape& shape, const ReadRequest& request) {
  constexpr double usual = 0.5, widest = 2 * std::numbers::pi / 3, finest = 1e-4, shortest = 1e-6;
  const double size = size_of(shape);
  IMeshTools_Parameters parameters;
  parameters.InParallel = false;  // the same triangles each time
  parameters.Relative = false;
  parameters.Angle = usual;
  if (request.deflection > 0) {
    parameters.Deflection = request.deflection;
  } else if (request.fn > 0) {
    parameters.Angle = std::clamp(2 * std::numbers::pi / request.fn, finest, widest);
    parameters.Deflection = size / 2 * (1 - std::cos(parameters.Angle / 2));
  } else {
    const double angle = std::clamp(request.fa * std::numbers::pi / 180, finest, widest);
    parameters.Deflection =
        std::min(std::max(request.fs / 2 * std::tan(angle / 4), size * (1 - std::cos(angle / 2)) / 11),
                 size / 200);  // of what is as small as $fs
  }
  parameters.Deflection = std::max(parameters.Deflection, std::min(shortest, 1e-6 * size));
  parameters.Deflection = std::max(parameters.Deflection, Precision::Confusion());  // which it wants
  return parameters;
}

class Mesher {
 public:
  CadMesh run(const TopoDS_Shape& shape, const ReadRequest& request) {
    BRepTools::Clean(shape);  // what a file brings along
    BRepMesh_IncrementalMesh mesher;
    mesher.SetShape(shape);
    mesher.ChangeParameters() = parameters_of(shape, request);
    mesher.Perform();
    for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next())
      add(TopoDS::Face(face.Current()));
    return std::move(mesh_);
  }

 private:
  static constexpr std::uint32_t none = ~std::uint32_t{0};
  CadMesh mesh_;
  TopTools_IndexedMapOfShape vertices_, edges_;
  std::vector<std::uint32_t> point_of_vertex_;
  std::vector<std::vector<std::uint32_t>> points_of_edge_;  // along it

  std::uint32_t add_point(const gp_Pnt& p) {
    mesh_.points.push_back({p.X(), p.Y(), p.Z()});
    return static_cast<std::uint32_t>(mesh_.points.size() - 1);
  }

  std::uint32_t point_of(const TopoDS_Vertex& vertex) {
    const auto number = static_cast<std::size_t>(vertices_.Add(vertex));
    if (number > point_of_vertex_.size()) point_of_vertex_.push_back(add_point(BRep_Tool::Pnt(vertex)));
    return point_of_vertex_[number - 1];
  }

  void add(const TopoDS_Face& face) {
    ++mesh_.faces;
    TopLoc_Location place;
    const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, place);
    if (triangles.IsNull()) {
      ++mesh_.faces_lost;
      return;
    }
    std::vector<std::uint32_t> points(static_cast<std::size_t>(triangles->NbNodes()) + 1, none);
    for (TopExp_Explorer edge(face, TopAbs_EDGE); edge.More(); edge.Next())
      take_edge(TopoDS::Edge(edge.Current()), triangles, place, points);
    for (int i = 1; i <= triangles->NbNodes(); ++i)
      if (std::uint32_t& point = points[static_cast<std::size_t>(i)]; point == none)
        point = add_point(triangles->Node(i).Transformed(place.Transformation()));
    const bool is_turned = (face.Orientation() == TopAbs_REVERSED) != place.Transformation().IsNegative();
    for (int i = 1; i <= triangles->NbTriangles(); ++i) {
      std::array<int, 3> node{};
      triangles->Triangle(i).Get(node[0], node[1], node[2]);
      if (is_turned) std::swap(node[1], node[2]);
      std::array<std::uint32_t, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) corners[k] = points[static_cast<std::size_t>(node[k])];
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
        mesh_.triangles.push_back(corners);
    }
    look_at(face, *triangles);
  }

  /// Both faces at an edge have the points along it in one order: they are made for the first one.
  void take_edge(const TopoDS_Edge& edge, const Handle(Poly_Triangulation) & triangles,
                 const TopLoc_Location& place, std::vector<std::uint32_t>& points) {
    const Handle(Poly_PolygonOnTriangulation) line =
        BRep_Tool::PolygonOnTriangulation(edge, triangles, place);
    if (line.IsNull()) return;
    const TColStd_Array1OfInteger& nodes = line->Nodes();
    const auto number = static_cast<std::size_t>(edges_.Add(edge));
    if (number > points_of_edge_.size()) {
      points_of_edge_.emplace_back();
      std::vector<std::uint32_t>& along = points_of_edge_.back();
      const TopoDS_Vertex first = TopExp::FirstVertex(edge), last = TopExp::LastVertex(edge);
      for (int i = nodes.Lower(); i <= nodes.Upper(); ++i) {
        if ((i == nodes.Lower() || BRep_Tool::Degenerated(edge)) && !first.IsNull())
          along.push_back(point_of(first));
        else if (i == nodes.Upper() && !last.IsNull())
          along.push_back(point_of(last));
        else
          along.push_back(add_point(triangles->Node(nodes(i)).Transformed(place.Transformation())));
      }
      if (!BRep_Tool::Degenerated(edge)) look_at(edge, *line, along);
    }
    const std::vector<std::uint32_t>& along = points_of_edge_[number - 1];
    if (along.size() != static_cast<std::size_t>(nodes.Length())) return;  // then the repair has to close it
    for (int i = nodes.Lower(); i <= nodes.Upper(); ++i)
      points[static_cast<std::size_t>(nodes(i))] = along[static_cast<std::size_t>(i - nodes.Lower())];
  }

  [[nodiscard]] gp_Pnt at(std::uint32_t point) const {
    const auto& p = mesh_.points[point];
    return {p[0], p[1], p[2]};
  }

  /// How far an edge is from its polyline in the middle of each side.
  void look_at(const TopoDS_Edge& edge, const Poly_PolygonOnTriangulation& line,
               const std::vector<std::uint32_t>& along) {
    if (!line.HasParameters()) return;
    const BRepAdaptor_Curve curve(edge);
    if (curve.GetType() == GeomAbs_Line) return;
    const TColStd_Array1OfReal& t = line.Parameters()->Array1();
    for (int i = t.Lower(); i < t.Upper(); ++i) {
      const auto k = static_cast<std::size_t>(i - t.Lower());
      if (k + 1 >= along.size()) return;
      const gp_Pnt a = at(along[k]), b = at(along[k + 1]), middle = curve.Value((t(i) + t(i + 1)) / 2);
      const gp_Vec side(a, b), from(a, middle);
      const double length = side.SquareMagnitude();
      const double s = length > 0 ? std::clamp(side.Dot(from) / length, 0.0, 1.0) : 0;
      note(middle.Distance(a.Translated(side * s)));
    }
  }

  void note(double distance) {
    if (std::isfinite(distance)) mesh_.deviation = std::max(mesh_.deviation, distance);
  }

  /// How far a curved face is from the middles of its triangles and of their sides.
  void look_at(const TopoDS_Face& face, const Poly_Triangulation& triangles) {
    if (!triangles.HasUVNodes()) return;
    const BRepAdaptor_Surface surface(face, false);
    if (surface.GetType() == GeomAbs_Plane) return;
    TopLoc_Location place;
    BRep_Tool::Triangulation(face, place);
    for (int i = 1; i <= triangles.NbTriangles(); ++i) {
      std::array<int, 3> node{};
      triangles.Triangle(i).Get(node[0], node[1], node[2]);
      std::array<gp_XYZ, 3> p;
      std::array<gp_XY, 3> uv;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = triangles.Node(node[k]).Transformed(place.Transformation()).XYZ();
        uv[k] = triangles.UVNode(node[k]).XY();
      }
      note_if_larger(surface, (p[0] + p[1] + p[2]) / 3, (uv[0] + uv[1] + uv[2]) / 3, uv);
      for (std::size_t k = 0; k < 3; ++k)
        note_if_larger(surface, (p[k] + p[(k + 1) % 3]) / 2, (uv[k] + uv[(k + 1) % 3]) / 2, uv);
    }
  }

  /// The distance of a point from what is round, where there is a formula for it.
  static std::optional<double> distance_from(const BRepAdaptor_Surface& surface, const gp_Pnt& from) {
    const auto along_and_off = [&](const gp_Ax3& position) {  // of the axis
      const gp_Vec away(position.Location(), from);
      const double along = away.Dot(gp_Vec(position.Direction()));
      return std::pair(along, std::sqrt(std::max(away.SquareMagnitude() - along * along, 0.0)));
    };
    switch (surface.GetType()) {
      case GeomAbs_Sphere:
        return std::fabs(from.Distance(surface.Sphere().Location()) - surface.Sphere().Radius());
      case GeomAbs_Cylinder:
        return std::fabs(along_and_off(surface.Cylinder().Position()).second - surface.Cylinder().Radius());
      case GeomAbs_Cone: {  // both halves, from the tip
        const gp_Cone cone = surface.Cone();
        const auto [along, off] = along_and_off(cone.Position());
        const double c = std::cos(cone.SemiAngle()), s = std::sin(cone.SemiAngle());
        return std::min(std::fabs((off - cone.RefRadius()) * c - along * s),
                        std::fabs((-off - cone.RefRadius()) * c - along * s));
      }
      case GeomAbs_Torus: {  // that may go through itself
        const gp_Torus torus = surface.Torus();
        const auto [along, off] = along_and_off(torus.Position());
        return std::min(std::fabs(std::hypot(off - torus.MajorRadius(), along) - torus.MinorRadius()),
                        std::fabs(std::hypot(-off - torus.MajorRadius(), along) - torus.MinorRadius()));
      }
      default:
        return std::nullopt;
    }
  }

  /// Where that is farther than all so far, the nearest point of the surface decides: looked for from the
  /// middle, then from the corners, for there are surfaces on which the middle of the parameters is
  /// elsewhere.
  void note_if_larger(const BRepAdaptor_Surface& surface, const gp_XYZ& from, const gp_XY& middle,
                      const std::array<gp_XY, 3>& corners) {
    if (const auto distance = distance_from(surface, gp_Pnt(from))) return note(*distance);
    double nearest = nearest_from(surface, from, middle);
    for (std::size_t k = 0; k < 3 && nearest > mesh_.deviation; ++k)
      nearest = std::min(nearest, nearest_from(surface, from, corners[k]));
    note(nearest);
  }

  /// The distance from the surface as Gauss and Newton find it; above the largest so far, or not at all.
  [[nodiscard]] double nearest_from(const BRepAdaptor_Surface& surface, const gp_XYZ& from, gp_XY uv) const {
    gp_Pnt on;
    gp_Vec du, dv;
    double nearest = surface.Value(uv.X(), uv.Y()).Distance(gp_Pnt(from));
    for (int step = 0; step < 6 && nearest > mesh_.deviation; ++step) {
      surface.D1(uv.X(), uv.Y(), on, du, dv);
      const gp_Vec away(on, gp_Pnt(from));
      const double a = du.SquareMagnitude(), b = du.Dot(dv), c = dv.SquareMagnitude(), e = du.Dot(away),
                   f = dv.Dot(away), determinant = a * c - b * b;
      if (!(determinant > 0)) break;
      uv += gp_XY((c * e - b * f) / determinant, (a * f - b * e) / determinant);
      const double now = surface.Value(uv.X(), uv.Y()).Distance(gp_Pnt(from));
      if (!(now < nearest)) break;
      nearest = now;
    }
    return nearest;
  }
};

int count_of_faces(const TopoDS_Shape& shape) {
  int count = 0;
  for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) ++count;
  return count;
}

}  // namespace

/// Faces whose wires touch themselves are not meshed as they are. (Those of STEP and IGES files have been
/// mended when they were read.)
CadMesh mesh_of(const TopoDS_Shape& shape, const ReadRequest& request) {
  CadMesh mesh = Mesher().run(shape, request);
  if (mesh.faces_lost == 0) return mesh;
  try {
    ShapeFix_Shape fix(shape);
    {
      const MendingLimit limit(request.path);
      fix.Perform();
    }
    CadMesh mended = Mesher().run(fix.Shape(), request);
    const bool has_all = count_of_faces(fix.Shape()) >= count_of_faces(shape);
    return has_all && mended.faces_lost < mesh.faces_lost ? mended : mesh;
  } catch (const Standard_Failure&) {
    return mesh;  // what cannot be mended is told as lost
  }
}

}  // namespace bsp2::model
