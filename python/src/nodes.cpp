#include "nodes.hpp"

#include <optional>

#include "released.hpp"

namespace bsp2::python {
namespace {

using py::arg;

constexpr double default_fa = 12, default_fs = 2;

Corners corners(double fn, double fa, double fs) { return {.fn = fn, .fa = fa, .fs = fs}; }

/// A number for all axes, or one each.
Vector lengths(const py::object& given, std::size_t count) {
  if (PyFloat_Check(given.ptr()) != 0 || PyLong_Check(given.ptr()) != 0 ||
      (PySequence_Check(given.ptr()) == 0 && PyNumber_Check(given.ptr()) != 0))
    return Vector(count, given.cast<double>());
  return given.cast<Vector>();
}

void add_expression(py::module_& m) {
  py::class_<Expression> type(
      m, "Expression",
      "A solid of 1 to 6 dimensions as an expression: immutable, and cheap to copy.\n\n"
      "a + b union, a - b difference, a & b intersection, a ^ b symmetric difference, ~a "
      "complement, a * b product.\nprint(a) shows it in the language of .csg files.");
  type.def(py::init<>(), "The empty solid of three dimensions.")
      .def_property_readonly("dimension", &Expression::dimension, "How many dimensions it has, 1 to 6.")
      .def("to_text", &Expression::to_text, "The expression in the language of .csg files, with all digits.")
      .def("__str__", &Expression::to_text)
      .def("__repr__",
           [](const Expression& self) {
             return "<bsp2.Expression of dimension " + std::to_string(self.dimension()) + ">";
           })
      .def(
          "__add__", [](const Expression& a, const Expression& b) { return a + b; }, py::is_operator())
      .def(
          "__radd__",
          [](const Expression& self, int zero) {
            if (zero != 0) throw py::type_error("a solid and a number have no sum");
            return self;
          },
          "So that sum(solids) is their union.", py::is_operator())
      .def(
          "__sub__", [](const Expression& a, const Expression& b) { return a - b; }, py::is_operator())
      .def(
          "__and__", [](const Expression& a, const Expression& b) { return a & b; }, py::is_operator())
      .def(
          "__or__", [](const Expression& a, const Expression& b) { return a + b; }, py::is_operator())
      .def(
          "__xor__", [](const Expression& a, const Expression& b) { return a ^ b; }, py::is_operator())
      .def(
          "__mul__", [](const Expression& a, const Expression& b) { return a * b; }, py::is_operator())
      .def(
          "__invert__", [](const Expression& a) { return ~a; }, py::is_operator())
      .def(
          "translate", [](const Expression& self, const Vector& by) { return self.translate(by); }, arg("by"),
          "Moved by a list of D lengths.")
      .def(
          "rotate",
          [](const Expression& self, const py::object& degrees,
             const std::optional<std::array<double, 3>>& axis) {
            if (axis) return self.rotate(degrees.cast<double>(), *axis);
            if (PySequence_Check(degrees.ptr()) != 0)
              return self.rotate(degrees.cast<std::array<double, 3>>());
            return self.rotate(degrees.cast<double>());
          },
          arg("degrees"), arg("axis") = py::none(),
          "Turned: a number of degrees about the origin of the plane, about z, or about `axis`; or three "
          "numbers, about "
          "x, then y, then z.")
      .def("rotate_plane", &Expression::rotate_plane, arg("degrees"), arg("from_axis"), arg("to_axis"),
           "Turned in any dimension: one axis towards another one; they count from 1.")
      .def(
          "scale",
          [](const Expression& self, const py::object& by) {
            return self.scale(lengths(by, static_cast<std::size_t>(self.dimension())));
          },
          arg("by"), "Scaled from the origin by a number, or by a list of D numbers.")
      .def("mirror", &Expression::mirror, arg("normal"),
           "Mirrored at the hyperplane through the origin with this normal of D numbers.")
      .def(
          "transform",
          [](const Expression& self, const py::object& matrix) {
            return self.transform(vectors_of(matrix, "matrix"));
          },
          arg("matrix"), "x becomes A x + b; the matrix of (D+1) x (D+1) numbers is [[A, b], [0, 1]].")
      .def(
          "projective",
          [](const Expression& self, const py::object& matrix) {
            return self.projective(span_of(rows_of(matrix, "matrix")));
          },
          arg("matrix"),
          "x becomes (A x + b) / (c x + d); the matrix of (D+1) x (D+1) numbers is [[A, b], [c, d]].")
      .def("resize", &Expression::resize, arg("size"), arg("auto") = std::array<bool, 3>{},
           "OpenSCAD's resize: what is 0 stays, or is scaled along where `auto` says.")
      .def("part", &Expression::part, arg("name"), "As one part of the model with a name.")
      .def("measure", &Expression::measure, arg("name"),
           "Its volume and moments are in Result.named_measures under this name.")
      .def(
          "color",
          [](const Expression& self, const py::object& color, double alpha) {
            if (py::isinstance<py::str>(color)) return self.color(color.cast<std::string>(), alpha);
            auto channels = color.cast<Vector>();
            if (channels.size() == 3) channels.push_back(alpha);
            if (channels.size() != 4) throw py::value_error("a colour has three or four numbers, or a name");
            return self.color(channels[0], channels[1], channels[2], channels[3]);
          },
          arg("color"), arg("alpha") = 1.0,
          "Of a colour: a name as CSS has them, '#rrggbb', or three or four numbers in [0, 1].")
      .def(py::pickle([](const Expression& self) { return py::make_tuple(self.to_text()); },
                      [](const py::tuple& state) { return parse(state[0].cast<std::string>()); }));
}

void add_primitives(py::module_& m) {
  m.def(
      "cube", [](const py::object& size, bool center) { return cuboid(lengths(size, 3), center); },
      arg("size") = 1.0, arg("center") = false,
      "The box [0, size], or around 0, in space. size: a number, or three.");
  m.def(
      "square", [](const py::object& size, bool center) { return cuboid(lengths(size, 2), center); },
      arg("size") = 1.0, arg("center") = false,
      "The rectangle [0, size], or around 0. size: a number, or two.");
  m.def(
      "cuboid", [](const py::object& size, bool center) { return cuboid(lengths(size, 1), center); },
      arg("size"), arg("center") = false,
      "The box [0, size], or around 0, of as many dimensions as there are lengths.");
  m.def(
      "sphere",
      [](double r, std::optional<double> d, double fn, double fa, double fs) {
        return sphere(d ? *d / 2 : r, corners(fn, fa, fs));
      },
      arg("r") = 1.0, arg("d") = py::none(), arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
      "OpenSCAD's sphere, a polyhedron of fn corners around; truly round: ball, or evaluate(curved=True).");
  m.def(
      "circle",
      [](double r, std::optional<double> d, double fn, double fa, double fs) {
        return circle(d ? *d / 2 : r, corners(fn, fa, fs));
      },
      arg("r") = 1.0, arg("d") = py::none(), arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
      "OpenSCAD's circle, a polygon of fn corners; truly round: ball(2), or evaluate(curved=True).");
  m.def(
      "cylinder",
      [](double h, double r, std::optional<double> r1, std::optional<double> r2, std::optional<double> d,
         bool center, double fn, double fa, double fs) {
        if (d) r = *d / 2;
        return cylinder(h, r1.value_or(r), r2.value_or(r), center, corners(fn, fa, fs));
      },
      arg("h") = 1.0, arg("r") = 1.0, arg("r1") = py::none(), arg("r2") = py::none(), arg("d") = py::none(),
      arg("center") = false, arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
      "OpenSCAD's cylinder or frustum along z, a prism of fn corners around; truly round: d_cylinder, cone.");
  m.def(
      "polygon",
      [](const py::object& points, const py::object& paths) {
        return polygon(vectors_of(points, "points"), indices_of(paths));
      },
      arg("points"), arg("paths") = py::none(),
      "All points of the plane inside an odd number of paths. points: n x 2. paths: lists of indices from 0; "
      "none: one "
      "through all.");
  m.def(
      "polyhedron",
      [](const py::object& points, const py::object& faces) {
        return polyhedron(vectors_of(points, "points"), indices_of(faces));
      },
      arg("points"), arg("faces"),
      "The solid inside closed faces, OpenSCAD's way: each a list of indices, clockwise as seen from "
      "outside. points: n x "
      "3.");
  m.def(
      "mesh",
      [](const py::object& points, const py::object& triangles) {
        const Doubles rows = rows_of(points, "points");
        if (rows.shape(1) != 3) throw py::value_error("points are n x 3 numbers");
        return mesh(span_of(rows), triangles_of(triangles, "triangles"));
      },
      arg("points"), arg("triangles"),
      "The solid that triangles bound, counter-clockwise as seen from outside. points: n x 3. triangles: m x "
      "3 indices.");
  m.def(
      "text",
      [](const std::string& of, double size, const py::kwargs& more) {
        return text(of, size, arguments_of(more));
      },
      arg("text"), arg("size") = 10.0,
      "Letters in the plane. More keywords: font, halign, valign, spacing, direction, language, script, fn.");
  m.def(
      "imported",
      [](const std::filesystem::path& path, const py::kwargs& more) {
        return imported(path, arguments_of(more));
      },
      arg("path"),
      "A mesh or a drawing of a file, read when it is evaluated. More keywords: layer, origin, scale, dpi, "
      "id, center.");
  m.def("surface", &surface, arg("path"), arg("center") = false, arg("invert") = false,
        "Heights of a picture (.png) or of a table (.dat).");
  m.def(
      "simplex",
      [](int dimension, double size, const py::object& points) {
        return points.is_none() ? simplex(dimension, size) : simplex(vectors_of(points, "points"));
      },
      arg("dimension") = 3, arg("size") = 1.0, arg("points") = py::none(),
      "All x with x_i >= 0 and x_1 + ... + x_D <= size; or the simplex with these D + 1 corners.");
  m.def(
      "polytope",
      [](const py::object& points) {
        const Doubles rows = rows_of(points, "points");
        return polytope(span_of(rows), static_cast<int>(rows.shape(1)));
      },
      arg("points"), "The convex hull of points: n x D numbers.");
  m.def("ball", &ball, arg("dimension") = 3, arg("r") = 1.0, arg("fn") = 0U,
        "The points within r of the origin, truly round. fn: corners of the polytopes that enclose it in "
        "sums, hulls and the like.");
  m.def(
      "d_cylinder",
      [](int dimension, double r, const py::object& h, bool center, unsigned fn) {
        return d_cylinder(dimension, r, lengths(h, 1), center, fn);
      },
      arg("dimension") = 3, arg("r") = 1.0, arg("h") = 1.0, arg("center") = false, arg("fn") = 0U,
      "A ball times an interval, or times a box if h is a list; truly round.");
  m.def("cone", &cone, arg("h") = 1.0, arg("r1") = 1.0, arg("r2") = 0.0, arg("center") = false,
        arg("fn") = 0U, "A truly round cone or frustum along z.");
  m.def("torus", &torus, arg("R") = 2.0, arg("r") = 1.0, arg("fn") = 0U, "A truly round torus around z.");
  m.def("paraboloid", &paraboloid, arg("h") = 1.0, arg("r") = 1.0, arg("dimension") = 3, arg("fn") = 0U,
        "The truly round dish whose radius at the height z is r sqrt(z / h), up to h.");
  m.def(
      "bezier",
      [](const py::object& points, const py::object& weights) {
        return bezier(value_of(points), weights.is_none() ? std::nullopt : std::optional(value_of(weights)));
      },
      arg("points"), arg("weights") = py::none(),
      "The image of a segment, square or cube: control points in lists, lists of lists, ... of D numbers.");
  m.def(
      "bspline",
      [](const py::object& points, const py::kwargs& more) {
        return bspline(value_of(points), arguments_of(more));
      },
      arg("points"), "A B-spline, or a NURBS with weights. More keywords: degree, knots, weights, closed.");
  m.def(
      "subdivision",
      [](const py::object& points, const py::object& faces, const std::string& scheme) {
        return subdivision(vectors_of(points, "points"), indices_of(faces), scheme);
      },
      arg("points"), arg("faces"), arg("scheme") = "catmull-clark",
      "The limit of a closed mesh under subdivision: catmull-clark, or loop.");
}

void add_constructs(py::module_& m) {
  m.def(
      "union", [](const py::args& solids) { return unite(operands_of(solids)); },
      "What is in one of the solids (given one by one, or as a list).");
  m.def(
      "intersection", [](const py::args& solids) { return intersect(operands_of(solids)); },
      "What is in all solids.");
  m.def(
      "difference", [](const py::args& solids) { return subtract(operands_of(solids)); },
      "The first solid without all others.");
  m.def(
      "symmetric_difference",
      [](const py::args& solids) { return symmetric_difference(operands_of(solids)); },
      "What is in an odd number of solids.");
  m.def("complement", &complement, arg("solid"),
        "What is not in the solid: without bounds, so intersect it.");
  m.def(
      "product", [](const py::args& solids) { return product(operands_of(solids)); },
      "All (x_1, x_2, ...) with x_i in solid i: as many dimensions as all together.");
  m.def(
      "hull", [](const py::args& solids) { return hull(operands_of(solids)); },
      "The convex hull of all solids.");
  m.def(
      "minkowski", [](const py::args& solids) { return minkowski(operands_of(solids)); },
      "All sums of a point of each solid.");
  m.def("fill", &fill, arg("plane"), "A plane solid without its holes.");
  m.def(
      "offset",
      [](const Expression& plane, std::optional<double> r, std::optional<double> delta, bool chamfer,
         double fn, double fa, double fs) {
        if (r.has_value() == delta.has_value())
          throw py::value_error("offset takes either r (round) or delta");
        const Join join = r ? Join::round : chamfer ? Join::chamfer : Join::mitre;
        return offset(plane, r ? *r : *delta, join, corners(fn, fa, fs));
      },
      arg("plane"), arg("r") = py::none(), arg("delta") = py::none(), arg("chamfer") = false, arg("fn") = 0.0,
      arg("fa") = default_fa, arg("fs") = default_fs,
      "A plane solid grown (or shrunk, if below 0) by r, with round corners, or by delta.");
  m.def(
      "linear_extrude",
      [](const Expression& plane, double height, bool center, double twist, const py::object& scale,
         unsigned slices, double fn, double fa, double fs) {
        const Vector factors = lengths(scale, 2);
        if (factors.size() != 2) throw py::value_error("scale is a number, or two");
        return linear_extrude(plane, LinearExtrusion{.height = height,
                                                     .center = center,
                                                     .twist = twist,
                                                     .scale = {factors[0], factors[1]},
                                                     .slices = slices,
                                                     .corners = corners(fn, fa, fs)});
      },
      arg("plane"), arg("height") = 100.0, arg("center") = false, arg("twist") = 0.0, arg("scale") = 1.0,
      arg("slices") = 0U, arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
      "A plane solid raised along z, turned by `twist` degrees and scaled on the way.");
  m.def(
      "rotate_extrude",
      [](const Expression& plane, double angle, double fn, double fa, double fs) {
        return rotate_extrude(plane, angle, corners(fn, fa, fs));
      },
      arg("plane"), arg("angle") = 360.0, arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
      "A plane solid turned about z by `angle` degrees.");
  m.def(
      "roof",
      [](const Expression& plane, const std::string& method, double fn, double fa, double fs) {
        if (method != "voronoi" && method != "straight")
          throw py::value_error("the method is 'voronoi' or 'straight'");
        return roof(plane, method == "straight", corners(fn, fa, fs));
      },
      arg("plane"), arg("method") = "voronoi", arg("fn") = 0.0, arg("fa") = default_fa,
      arg("fs") = default_fs, "A roof over a plane solid.");
  m.def("projection", &projection, arg("solid"), arg("cut") = false,
        "The shadow on the plane z = 0; or what is there, if `cut`.");
  m.def(
      "extrude",
      [](const Expression& solid, const py::object& h, bool center) {
        return extrude(solid, lengths(h, 1), center);
      },
      arg("solid"), arg("h"), arg("center") = false,
      "The product with an interval, or with a box if h is a list.");
  m.def("embed", &embed, arg("solid"), arg("dimension"), arg("thickness"),
        "The solid on the first axes of a larger space, as thick as that.");
  m.def(
      "project",
      [](const Expression& solid, std::optional<int> dimension, const std::optional<std::vector<int>>& axes) {
        if (dimension.has_value() == axes.has_value())
          throw py::value_error("project takes either dimension or axes");
        return dimension ? project(solid, *dimension) : project(solid, *axes);
      },
      arg("solid"), arg("dimension") = py::none(), arg("axes") = py::none(),
      "The shadow on the first axes, or on these, which count from 1.");
  m.def("section", &section, arg("solid"), arg("axis"), arg("at") = 0.0,
        "What is at x_axis = at, without that axis; axes count from 1.");
  const auto growth = [](auto along_axes, auto round, const char* name) {
    return [=](const Expression& solid, std::optional<double> delta, std::optional<double> r, double fn,
               double fa, double fs) {
      if (delta.has_value() == r.has_value())
        throw py::value_error(std::string(name) + " takes either delta or r");
      return delta ? along_axes(solid, *delta) : round(solid, *r, corners(fn, fa, fs));
    };
  };
  m.def("grow", growth(&grow, &grow_round, "grow"), arg("solid"), arg("delta") = py::none(),
        arg("r") = py::none(), arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
        "All points within delta along the axes, or within about r.");
  m.def("shrink", growth(&shrink, &shrink_round, "shrink"), arg("solid"), arg("delta") = py::none(),
        arg("r") = py::none(), arg("fn") = 0.0, arg("fa") = default_fa, arg("fs") = default_fs,
        "What is left if all that is within delta, or about r, of the outside goes.");
  m.def(
      "sweep",
      [](const Expression& solid, const py::object& path) { return sweep(solid, vectors_of(path, "path")); },
      arg("solid"), arg("path"), "All sums of a point of the solid and one of a polyline: n x D numbers.");
  m.def(
      "node",
      [](const std::string& name, const py::args& solids, std::optional<int> dimension,
         const py::kwargs& arguments) {
        return Expression::node(name, arguments_of(arguments), operands_of(solids), dimension);
      },
      arg("name"), arg("dimension") = py::none(),
      "Any node of the language by its name: node('grow', solid, delta=0.5). dimension: that it has, if not "
      "that of the first solid.");
}

}  // namespace

void add_nodes(py::module_& m) {
  add_expression(m);
  add_primitives(m);
  add_constructs(m);
  m.def("load", &load, arg("path"), py::call_guard<Released>(),
        "What a file holds: a model (.csg, .scad), a mesh (.stl, .off, .obj, .ply, .3mf, .amf, .glb, .gltf, "
        ".vtp, "
        ".msh), the solids of a CAD program (.step, .iges, .brep) or a drawing (.dxf, .svg).");
  m.def(
      "parse", [](const std::string& text, const std::string& name) { return parse(text, name); },
      arg("text"), arg("name") = "model", py::call_guard<Released>(),
      "A model in the language of .csg files. name: what it is called in messages; relative paths in it are "
      "found from its folder.");
}

}  // namespace bsp2::python
