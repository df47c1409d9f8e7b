#include "occt/shapes.hpp"

#include <BRep_Builder.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Precision.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>

#include "bsp2/geometry/support/disjoint_sets.hpp"

namespace bsp2::io {
namespace {

using geometry::Brep;

/// What is shorter is a point, and what is thinner a line, as Open CASCADE has it.
const double a_point = Precision::Confusion();

class ShapeMaker {
 public:
  ShapeMaker(const Brep& brep, const std::vector<bool>& wanted, bool (*is_over)())
      : brep_(brep),
        wanted_(wanted),
        is_over_(is_over),
        place_of_use_(brep.uses.size()),
        vertex_(brep.points.size()),
        edge_(brep.uses.size()),
        edges_(brep.uses.size()) {
    for (std::uint32_t place = 0; place < brep.uses_of_edges.size(); ++place)
      place_of_use_[brep.uses_of_edges[place]] = place;
    std::set<std::uint32_t> short_edges;
    for (const Brep::Shell& shell : brep.shells)
      if (wanted[shell.solid])
        for (const Brep::Side& side : brep.sides_of(shell)) unite_ends(brep.faces[side.face], short_edges);
    shapes_.short_edges = short_edges.size();
    for (const Brep::Face& face : brep.faces) unite_corners(face);
    for (const Brep::Shell& shell : brep.shells)
      for (const Brep::Side& side : brep.sides_of(shell)) wires_of(side);
  }

  /// @return what there is when it is to end.
  Shapes run() {
    for (std::size_t number = 0; number < brep_.solids.size() && !is_over_(); ++number) {
      const Brep::Solid& of = brep_.solids[number];
      if (!wanted_[number]) {
        shapes_.solids.emplace_back();
        continue;
      }
      TopoDS_Solid shape;
      builder_.MakeSolid(shape);
      bool is_there = false;
      for (std::uint32_t i = 0; i < of.shells; ++i) {
        const TopoDS_Shell walls = shell(brep_.shells[of.first_shell + i]);
        if (walls.IsNull() && i == 0) break;  // then cavities are in nothing
        if (walls.IsNull()) continue;
        builder_.Add(shape, walls);
        is_there = true;
      }
      if (!is_there) ++shapes_.thin_solids;
      shapes_.solids.push_back(is_there ? shape : TopoDS_Solid());
    }
    return std::move(shapes_);
  }

 private:
  /// One side of a face on an edge that is long enough, in the order of the loop.
  struct Side {
    std::uint32_t from, to;  // vertices that stand for all that are one with them
    std::uint32_t edge;      // see wedge_of
  };

  using Sides = std::vector<Side>;

  const Brep& brep_;
  const std::vector<bool>& wanted_;
  bool (*is_over_)();
  BRep_Builder builder_;
  Shapes shapes_;
  std::vector<std::uint32_t> place_of_use_;  // of each use, among those of its edge
  geometry::DisjointSets vertex_, edge_;
  std::vector<TopoDS_Edge> edges_;                             // by the number that stands for it
  std::unordered_map<std::uint32_t, TopoDS_Vertex> vertices_;  // of the shell at hand

  [[nodiscard]] gp_Pnt point(std::uint32_t number) const {
    const auto& p = brep_.points[number];
    return {p[0], p[1], p[2]};
  }

  /// Ends of edges that are one point.
  void unite_ends(const Brep::Face& face, std::set<std::uint32_t>& short_edges) {
    for (const Brep::Loop& loop : brep_.loops_of(face))
      for (const Brep::Use& use : brep_.uses_of(loop)) {
        const auto& [from, to] = brep_.edges[use.edge].ends;
        if (point(from).Distance(point(to)) > a_point) continue;
        vertex_.unite(from, to);
        short_edges.insert(use.edge);
      }
  }

  /// Corners of a face that are one point: where it is a line, between an outline and its hole or along a
  /// part of itself, which no short edge tells.
  void unite_corners(const Brep::Face& face) {
    const gp_XYZ askew(0.48, 0.64, 0.6);  // of length 1; few corners have one place along it
    std::vector<std::pair<double, std::uint32_t>> corners;
    for (const Brep::Loop& loop : brep_.loops_of(face))
      for (const Brep::Use& use : brep_.uses_of(loop))
        corners.emplace_back(askew.Dot(point(brep_.from(use)).XYZ()), brep_.from(use));
    std::sort(corners.begin(), corners.end());
    for (auto a = corners.begin(); a != corners.end(); ++a)
      for (auto b = a + 1; b != corners.end() && b->first - a->first <= a_point; ++b)
        if (point(a->second).Distance(point(b->second)) <= a_point) vertex_.unite(a->second, b->second);
  }

  /// The outline of a side of a face, and its holes: but for a hole that is all of the outline or of another
  /// hole, backwards. Between these the face is a line, and their edges are one.
  std::vector<Sides> wires_of(const Brep::Side& side) {
    std::vector<Sides> wires;
    for (const Brep::Loop& loop : brep_.loops_of(brep_.faces[side.face])) {
      Sides sides = sides_of(loop, side.is_front);
      const auto same =
          std::find_if(wires.begin(), wires.end(), [&](Sides& wire) { return cancel(wire, sides); });
      if (same == wires.end())
        wires.push_back(std::move(sides));
      else
        same->clear();
    }
    return wires;
  }

  /// @return whether one goes back where the other came from, all the way; then each two of their edges are
  /// one.
  bool cancel(const Sides& one, const Sides& other) {
    if (one.empty() || one.size() != other.size()) return false;
    const std::size_t n = one.size();
    const auto is_back = [](const Side& a, const Side& b) { return a.from == b.to && a.to == b.from; };
    const auto first =
        std::find_if(other.begin(), other.end(), [&](const Side& b) { return is_back(one[0], b); });
    if (first == other.end()) return false;
    const auto at = [&](std::size_t i) -> const Side& {
      return other[(static_cast<std::size_t>(first - other.begin()) + n - i) % n];
    };
    for (std::size_t i = 0; i < n; ++i)
      if (!is_back(one[i], at(i))) return false;
    for (std::size_t i = 0; i < n; ++i) edge_.unite(one[i].edge, at(i).edge);
    return true;
  }

  /// What of a loop is longer than a point, and does not go back at once. Where it does, the face is a line
  /// there, and the two edges are one.
  Sides sides_of(const Brep::Loop& loop, bool is_front) {
    Sides sides;
    const auto uses = brep_.uses_of(loop);
    for (std::size_t i = 0; i < uses.size(); ++i) {
      const std::size_t at = is_front ? uses.size() - 1 - i : i;
      const Brep::Edge& edge = brep_.edges[uses[at].edge];
      const bool forward = uses[at].forward != is_front;
      const Side side{vertex_.find(edge.ends[forward ? 0 : 1]), vertex_.find(edge.ends[forward ? 1 : 0]),
                      wedge_of(loop.first_use + static_cast<std::uint32_t>(at), is_front)};
      if (side.from == side.to) continue;
      if (!sides.empty() && sides.back().from == side.to) {
        edge_.unite(sides.back().edge, side.edge);
        sides.pop_back();
      } else {
        sides.push_back(side);
      }
    }
    while (sides.size() >= 2 && sides.front().from == sides.back().to &&
           sides.front().to == sides.back().from) {
      edge_.unite(sides.front().edge, sides.back().edge);
      sides.erase(sides.begin());
      sides.pop_back();
    }
    return sides;
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

  /// @return none if it bounds nothing: what has a volume has four faces.
  TopoDS_Shell shell(const Brep::Shell& of) {
    vertices_.clear();
    TopoDS_Shell shape;
    builder_.MakeShell(shape);
    int faces = 0;
    for (const Brep::Side& side : brep_.sides_of(of)) {
      if (is_over_()) break;
      const TopoDS_Face part = face(side);
      if (part.IsNull()) continue;
      builder_.Add(shape, part);
      ++faces;
    }
    shape.Closed(true);
    return faces >= 4 ? shape : TopoDS_Shell();
  }

  TopoDS_Face face(const Brep::Side& side) {
    const Brep::Face& of = brep_.faces[side.face];
    const std::vector<Sides> wires = wires_of(side);
    TopoDS_Face shape;
    const Sides& outline = wires.front();
    if (outline.size() < 3) return shape;
    // A point of the plane near the face: numbers stay small.
    const gp_Pnt near = point(outline.front().from);
    const gp_Dir normal(of.normal[0], of.normal[1], of.normal[2]);
    const double off = gp_Vec(normal).Dot(gp_Vec(near.XYZ())) + of.offset;
    const gp_Pln plane(near.Translated(gp_Vec(normal) * -off), side.is_front ? normal.Reversed() : normal);
    double tolerance = a_point;
    for (const Side& edge : outline) tolerance = std::max(tolerance, 2 * plane.Distance(point(edge.from)));
    builder_.MakeFace(shape, new Geom_Plane(plane), tolerance);
    builder_.Add(shape, wire(outline, tolerance));
    for (std::size_t i = 1; i < wires.size(); ++i)
      if (wires[i].size() >= 3) builder_.Add(shape, wire(wires[i], tolerance));
    return shape;
  }

  TopoDS_Wire wire(const Sides& sides, double tolerance) {
    TopoDS_Wire shape;
    builder_.MakeWire(shape);
    for (const Side& side : sides) {
      const std::uint32_t number = edge_.find(side.edge);
      // All that are one edge have one direction: from the lower vertex to the higher one.
      const bool is_forward = side.from < side.to;
      if (edges_[number].IsNull())
        edges_[number] = edge(std::min(side.from, side.to), std::max(side.from, side.to));
      if (tolerance > a_point) widen(edges_[number], tolerance);
      builder_.Add(shape, edges_[number].Oriented(is_forward ? TopAbs_FORWARD : TopAbs_REVERSED));
    }
    shape.Closed(true);
    return shape;
  }

  /// Vertices are off the plane of a face, by a point: so much is allowed around them, and the edges.
  void widen(const TopoDS_Edge& along, double tolerance) {
    builder_.UpdateEdge(along, tolerance);
    for (TopoDS_Iterator end(along); end.More(); end.Next())
      builder_.UpdateVertex(TopoDS::Vertex(end.Value()), tolerance);
  }

  TopoDS_Edge edge(std::uint32_t from, std::uint32_t to) {
    const gp_Pnt a = point(from), b = point(to);
    TopoDS_Edge shape;
    builder_.MakeEdge(shape, new Geom_Line(a, gp_Dir(gp_Vec(a, b))), a_point);
    builder_.Range(shape, 0, a.Distance(b));
    builder_.Add(shape, vertex(from).Oriented(TopAbs_FORWARD));
    builder_.Add(shape, vertex(to).Oriented(TopAbs_REVERSED));
    return shape;
  }

  const TopoDS_Vertex& vertex(std::uint32_t number) {
    TopoDS_Vertex& shape = vertices_[number];
    if (shape.IsNull()) builder_.MakeVertex(shape, point(number), a_point);
    return shape;
  }
};

}  // namespace

Shapes shapes_of(const Brep& brep, const std::vector<bool>& wanted, bool (*is_over)()) {
  return ShapeMaker(brep, wanted, is_over).run();
}

}  // namespace bsp2::io
