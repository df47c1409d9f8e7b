#include "builder/polyhedron.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "builder/convex_hull.hpp"
#include "builder/mesh_shells.hpp"
#include "mesh/mesh_merging.hpp"
#include "mesh/mesh_patching.hpp"
#include "mesh/mesh_repair.hpp"
#include "mesh/mesh_triangulation.hpp"

namespace bsp2::model {
namespace {

std::string text_of(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr};
}

/// Three digits.
std::string short_text_of(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x, std::chars_format::general, 3).ptr};
}

std::string left_out_text(std::size_t count) {
  return counted(count, "# face[s] that [was|were] there already [is|are] left out");
}

std::string turned_text(std::size_t count) {
  return counted(count, "# face[s] wound unlike [its neighbours is|their neighbours are] turned");
}

std::string text_of(const Point3& p) {
  std::string text = "(";
  text += text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]);
  return text += ")";
}

void check_input(const std::vector<Point3>& points, const FaceCycles& faces) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const double x : points[i])
      if (!(std::fabs(x) <= largest_coordinate))
        throw Error("polyhedron: point " + std::to_string(i) + " " + text_of(points[i]) +
                    " is not finite or too large");
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (const std::uint32_t corner : faces[f])
      if (corner >= points.size())
        throw Error("polyhedron: face " + std::to_string(f) + " names point " + std::to_string(corner) +
                    ", but there are " + counted(points.size(), "# point[s], the first being 0"));
}

/// Index of the first point at the same place, for every point.
std::vector<std::uint32_t> first_equal(const std::vector<Point3>& points) {
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> slots(std::bit_ceil(2 * points.size() + 1), none), first(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::uint64_t hash = 0;
    for (const double x : points[i]) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(x + 0.0)) *
             0x9E3779B97F4A7C15ull;  // -0 == 0, so it hashes as 0
      hash ^= hash >> 32;
    }
    std::size_t at = hash & (slots.size() - 1);
    while (slots[at] != none && points[slots[at]] != points[i]) at = (at + 1) & (slots.size() - 1);
    if (slots[at] == none) slots[at] = i;
    first[i] = slots[at];
  }
  return first;
}

/// The cycles counter-clockwise seen from outside, over points that all differ.
FaceCycles oriented(const std::vector<Point3>& points, const FaceCycles& faces) {
  const std::vector<std::uint32_t> first = first_equal(points);
  FaceCycles result = faces;
  for (std::size_t f = 0, begin = 0; f < faces.size(); begin = faces.ends[f++])
    std::reverse(result.corners.begin() + static_cast<std::ptrdiff_t>(begin),
                 result.corners.begin() + static_cast<std::ptrdiff_t>(faces.ends[f]));
  for (std::uint32_t& corner : result.corners) corner = first[corner];
  return without_degenerate(points, result);
}

std::string text_of(const std::vector<Point3>& points, const std::vector<OpenEdge>& open) {
  const OpenEdge& edge = open.front();
  std::string text = "not closed: the edge from point " + std::to_string(edge.a) + " " +
                     text_of(points[edge.a]) + " to point " + std::to_string(edge.b) + " " +
                     text_of(points[edge.b]) + " has no matching face on its other side";
  if (open.size() > 1) text += "; " + counted(open.size() - 1, "# more edge[s] [is|are] open");
  return text;
}

[[noreturn]] void throw_open(const std::vector<Point3>& points, const std::vector<OpenEdge>& open) {
  throw OpenMesh(text_of(points, open));
}

/// Closes the faces with as little tolerance as it takes: exactly; then on OpenSCAD's grid of 2^-20, made
/// finer for models smaller than 1; then within the rounding of a text that gives six digits.
/// @return nothing if some edge stays open.
std::optional<FaceCycles> closed(const std::vector<Point3>& points, const FaceCycles& faces) {
  const std::vector<OpenEdge> open = open_edges(faces);
  if (open.empty()) return faces;
  double extent = 0;
  for (int k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(
        points.begin(), points.end(), [k](const Point3& p, const Point3& q) { return p[k] < q[k]; });
    extent = std::max(extent, (*high)[k] - (*low)[k]);
  }
  const Tolerance none{}, grid{0x1p-20 * std::min(1.0, extent), 0}, digits{0, 1.1e-5};
  const std::pair<Tolerance, Tolerance> attempts[] = {
      {none, none}, {grid, grid}, {grid, digits}, {digits, digits}};
  for (const auto& [welding, splitting] : attempts) {
    FaceCycles attempt = welding.exact() ? faces : without_degenerate(points, weld(points, faces, welding));
    attempt = split_at_t_vertices(points, std::move(attempt), splitting);
    if (open_edges(attempt).empty()) return without_degenerate(points, attempt);
  }
  return std::nullopt;
}

FaceCycles as_faces(const std::vector<Triangle>& triangles) {
  FaceCycles faces;
  faces.corners.reserve(3 * triangles.size());
  for (const Triangle& triangle : triangles) {
    faces.corners.insert(faces.corners.end(), triangle.begin(), triangle.end());
    faces.end_face();
  }
  return faces;
}

std::vector<Triangle> triangulated(const std::vector<Point3>& points, const FaceCycles& faces) {
  std::vector<Triangle> triangles;
  triangles.reserve(faces.corners.size());
  Triangulator triangulator(points);
  for (std::size_t f = 0; f < faces.size(); ++f) triangulator.triangulate(faces[f], triangles);
  return triangles;
}

/// Removes pairs of equal triangles wound in opposite ways: they bound nothing together.
/// @return whether some triangle is there more often than that takes away.
bool cancel_opposite(std::size_t points, std::vector<Triangle>& triangles) {
  struct Key {
    std::uint32_t low, high;  // the corners beside the smallest one
    bool even;
    std::uint32_t index;
  };
  const auto key_of = [&](std::uint32_t i) {
    const Triangle& t = triangles[i];
    const std::size_t least = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
    const std::uint32_t b = t[(least + 1) % 3], c = t[(least + 2) % 3];
    return Key{std::min(b, c), std::max(b, c), b < c, i};
  };
  // Sorted by the smallest corner, by counting; then the few triangles of each.
  std::vector<std::uint32_t> ends(points + 1);
  for (const Triangle& t : triangles) ++ends[*std::min_element(t.begin(), t.end()) + std::size_t{1}];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<Key> keys(triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    keys[ends[*std::min_element(triangles[i].begin(), triangles[i].end())]++] = key_of(i);
  std::vector<bool> dropped(triangles.size());
  bool any = false, is_repeated = false;
  for (std::size_t corner = 0, from = 0; corner < points; from = ends[corner++]) {
    const std::span<Key> own(keys.data() + from, ends[corner] - from);
    std::sort(own.begin(), own.end(), [](const Key& a, const Key& b) {
      return std::tie(a.low, a.high, a.even, a.index) < std::tie(b.low, b.high, b.even, b.index);
    });
    for (std::size_t begin = 0, end = 0; begin < own.size(); begin = end) {
      while (end < own.size() && own[end].low == own[begin].low && own[end].high == own[begin].high) ++end;
      std::size_t middle = begin;
      while (middle < end && !own[middle].even) ++middle;
      is_repeated |= std::max(middle - begin, end - middle) > std::min(middle - begin, end - middle) + 1;
      for (std::size_t k = 0; k < std::min(middle - begin, end - middle); ++k)
        any = dropped[own[begin + k].index] = dropped[own[middle + k].index] = true;
    }
  }
  if (!any) return is_repeated;
  std::size_t size = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (!dropped[i]) triangles[size++] = triangles[i];
  triangles.resize(size);
  return is_repeated;
}

/// Triangles without any that is flat, as far as that keeps the mesh closed.
/// @param has_flat whether there may be a flat one among the faces. @param is_repeated gets whether some
/// triangle is there twice.
std::vector<Triangle> closed_triangles(const std::vector<Point3>& points, FaceCycles faces,
                                       bool has_flat = false, bool* is_repeated = nullptr) {
  std::vector<Triangle> triangles = triangulated(points, faces);
  if (triangles.size() != faces.size()) has_flat = true;  // of those that faces of more corners were cut into
  const bool repeated = cancel_opposite(points.size(), triangles);
  if (is_repeated != nullptr) *is_repeated = repeated;
  for (int round = 0; round < 4 && has_flat; ++round) {
    faces = without_degenerate(points, as_faces(triangles));
    if (faces.size() == triangles.size()) break;
    // The long edge of a flat triangle has its third corner as a T-vertex.
    faces = split_at_t_vertices(points, std::move(faces), {});
    if (!open_edges(faces).empty()) break;
    triangles = triangulated(points, faces);
    cancel_opposite(points.size(), triangles);
  }
  return triangles;
}

/// Keeps the points in use, in their order.
TriangleMesh compact(const std::vector<Point3>& points, std::vector<Triangle> triangles) {
  std::vector<std::uint32_t> id(points.size());
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t corner : triangle) id[corner] = 1;
  TriangleMesh mesh;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (id[i] == 0) continue;
    id[i] = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back({points[i][0] + 0.0, points[i][1] + 0.0, points[i][2] + 0.0});  // no -0
  }
  for (Triangle& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = id[corner];
  mesh.triangles = std::move(triangles);
  return mesh;
}

}  // namespace

namespace {

/// Triangles of closed faces as a mesh. @throws bsp2::Error if flat ones could not be taken out without
/// opening it.
std::optional<TriangleMesh> mesh_of(const std::vector<Point3>& points, std::vector<Triangle> triangles) {
  if (triangles.empty()) return std::nullopt;
  if (const auto open = open_edges(as_faces(triangles)); !open.empty()) throw_open(points, open);
  return compact(points, std::move(triangles));
}

/// Wound the wrong way round as a whole: the solid is the same, so turn it.
std::optional<TriangleMesh> outward(std::optional<TriangleMesh> mesh) {
  if (mesh && signed_volume(mesh->points, mesh->triangles) < 0)
    for (Triangle& triangle : mesh->triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Faces of a file that are closed as they stand: each of them once, if they are closed then as well.
std::vector<Triangle> single_triangles(const std::vector<Point3>& points, const FaceCycles& solid,
                                       const std::function<void(std::string)>& warn) {
  bool is_repeated = false;
  std::vector<Triangle> triangles = closed_triangles(points, solid, false, &is_repeated);
  if (!is_repeated) return triangles;
  std::size_t count = 0, first = 0;
  const FaceCycles once = without_duplicates(solid, count, &first);
  if (count == 0 || !open_edges(once).empty()) return triangles;  // where it covers itself that is told later
  std::string face;
  for (const std::uint32_t corner : solid[first])
    face += (face.empty() ? "" : ", ") + text_of(points[corner]);
  warn("made of faces that are there more than once, the first of them " + face +
       ". Repaired: " + left_out_text(count));
  return closed_triangles(points, once);
}

/// The mesh of a file, whose shells all have their solid inside.
std::optional<TriangleMesh> with_turned_shells(std::optional<TriangleMesh> mesh,
                                               const std::function<void(std::string)>& warn) {
  if (!mesh) return mesh;
  const ShellFaults faults = turn_shells(*mesh);
  const std::string all = counted(faults.shells, "# shell[s]");
  if (faults.turned > 0)
    warn("inside out: the shell with the corner " + text_of(faults.turned_at) +
         ". Repaired: " + counted(faults.turned, "# of ") + all + counted(faults.turned, " [is|are] turned"));
  if (faults.nested > 0)
    warn("wound around more than once: the shell with the corner " + text_of(faults.nested_at) +
         " lies in another one and is wound like it, so it is no cavity but counts as inside. That holds "
         "for " +
         std::to_string(faults.nested) + " of " + all);
  return mesh;
}

/// A mesh closed by each repair as far as it helps, and what was done.
struct Mended {
  std::vector<Point3> points;
  std::vector<Triangle> triangles;
  std::vector<std::string> repairs;
};

/// Faces at which single edges are split at corners that lie on them, if that leaves fewer of them open.
FaceCycles joined(const std::vector<Point3>& points, const FaceCycles& faces, double tolerance) {
  const std::size_t open = open_edges(faces).size();
  if (open == 0) return faces;
  FaceCycles split = without_degenerate(points, split_at_t_vertices(points, faces, {tolerance, 0}));
  return open_edges(split).size() < open ? split : faces;
}

/// For a mesh that no single repair closes: merges, turns, caps and leaves out, each where it helps.
Mended mended_mesh(const std::vector<Point3>& given, FaceCycles faces) {
  Mended mended{given, {}, {}};
  std::size_t count = 0;
  MergedCorners merged = merged_corners(given, faces);
  if (merged.count > 0)
    mended.repairs.push_back(
        counted(merged.count, "# corner[s] that [is|are] up to ") + short_text_of(merged.distance) +
        counted(merged.count, " apart from [another one is|others are] merged with [it|these]"));
  faces = without_copies(merged.faces, count);
  if (count > 0) mended.repairs.push_back(left_out_text(count));
  FaceCycles wound = consistently_wound(faces, count);
  if (count > 0 && open_edges(wound).size() < open_edges(faces).size()) {
    mended.repairs.push_back(turned_text(count));
    faces = std::move(wound);
  }
  faces = joined(given, faces, merged.distance);
  const std::vector<OpenEdge> open = open_edges(faces);
  if (open.empty()) {
    mended.triangles = closed_triangles(given, std::move(faces), true);
    return mended;
  }
  Patches patches = patches_of(mended.points, faces, open);
  std::vector<Triangle> own = triangulated(mended.points, faces);
  mended.repairs.push_back(counted(open.size(), "# open edge[s] [is|are] closed by caps"));
  count = leave_out_sheets(mended.points, own, patches.triangles);
  if (count > 0)
    mended.repairs.push_back(counted(count,
                                     "# part[s] that [is an open sheet and encloses nothing is|are open "
                                     "sheets and enclose nothing are] left out"));
  own.insert(own.end(), patches.triangles.begin(), patches.triangles.end());
  mended.triangles = closed_triangles(mended.points, as_faces(own), true);
  return mended;
}

}  // namespace

double signed_volume(const std::vector<Point3>& points, const std::vector<Triangle>& triangles) {
  double sum = 0;
  if (triangles.empty()) return 0;
  const Point3& o = points[triangles[0][0]];
  for (const Triangle& t : triangles) {
    Point3 e[3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) e[i][k] = points[t[i]][k] - o[k];
    sum += e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
           e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
           e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
  }
  return sum / 6;
}

std::optional<TriangleMesh> closed_mesh(const std::vector<Point3>& points, const FaceCycles& faces) {
  check_input(points, faces);
  const FaceCycles cycles = oriented(points, faces);
  const auto solid = closed(points, cycles);
  if (!solid) throw_open(points, open_edges(cycles));
  return outward(mesh_of(points, closed_triangles(points, *solid)));
}

std::optional<TriangleMesh> repaired_mesh(const std::vector<Point3>& given, const FaceCycles& faces,
                                          Holes holes, const std::function<void(std::string)>& warn) {
  check_input(given, faces);
  const FaceCycles all = oriented(given, faces);
  const auto finished = [&](std::optional<TriangleMesh> mesh) {
    return holes == Holes::cap ? with_turned_shells(std::move(mesh), warn) : outward(std::move(mesh));
  };
  if (const auto solid = closed(given, all))
    return finished(mesh_of(given, holes == Holes::cap ? single_triangles(given, *solid, warn)
                                                       : closed_triangles(given, *solid)));
  const std::string what = text_of(given, open_edges(all));
  std::vector<std::string> repairs;
  const auto tell = [&](const std::vector<std::string>& made) {
    std::string text = what + ". Repaired: ";
    for (const std::string& repair : made) text += (&repair == made.data() ? "" : ". ") + repair;
    warn(text);
  };
  const auto told = [&](const std::string& last) {
    repairs.push_back(last);
    tell(repairs);
  };

  std::size_t count = 0;
  FaceCycles cycles = all;
  const FaceCycles once = without_duplicates(cycles, count);
  if (count > 0) {
    const std::string repair = left_out_text(count);
    if (const auto solid = closed(given, once))
      return told(repair), finished(mesh_of(given, closed_triangles(given, *solid)));
    repairs.push_back(repair);
    cycles = once;
  }
  const FaceCycles wound = consistently_wound(cycles, count);
  if (count > 0 && open_edges(wound).size() < open_edges(cycles).size()) {
    const std::string repair = turned_text(count);
    if (const auto solid = closed(given, wound))
      return told(repair), finished(mesh_of(given, closed_triangles(given, *solid)));
    repairs.push_back(repair);
    cycles = wound;
  }
  if (holes == Holes::refuse) throw OpenMesh(what);
  Mended mended = mended_mesh(given, all);
  tell(mended.repairs);
  return finished(mesh_of(mended.points, std::move(mended.triangles)));
}

Primitive spanned(const std::vector<Point3>& points) {
  if (auto hull = hull_mesh(points)) return *std::move(hull);
  std::vector<double> numbers;
  for (const Point3& point : points) numbers.insert(numbers.end(), point.begin(), point.end());
  return flat_polytope(3, numbers);
}

Expression polyhedron(const std::vector<std::array<double, 3>>& points,
                      const std::vector<std::vector<std::uint32_t>>& faces) {
  FaceCycles cycles;
  for (const auto& face : faces) {
    cycles.corners.insert(cycles.corners.end(), face.begin(), face.end());
    cycles.end_face();
  }
  try {
    std::optional<TriangleMesh> mesh = closed_mesh(points, cycles);
    return mesh ? Expression(std::make_shared<Node>(3, std::move(*mesh))) : Expression(3);
  } catch (const OpenMesh& error) {
    throw Error(std::string("polyhedron: ") + error.what());
  }
}

}  // namespace bsp2::model
