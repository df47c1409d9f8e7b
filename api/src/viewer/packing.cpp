#include "viewer/packing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "bsp2/supersteps/render/hidden_facets.hpp"
#include "viewer/message.hpp"

namespace bsp2::api {
namespace {

using geometry::CellBatch;
using geometry::Label;
using Point = std::array<double, 3>;

struct Box {
  Point lower{}, upper{};
  bool is_empty = true;
  void add(const Point& point) {
    for (std::size_t i = 0; i < 3; ++i) {
      lower[i] = is_empty ? point[i] : std::min(lower[i], point[i]);
      upper[i] = is_empty ? point[i] : std::max(upper[i], point[i]);
    }
    is_empty = false;
  }
};

Box box_of(std::span<const LooseTriangle> triangles) {
  Box box;
  for (const LooseTriangle& triangle : triangles)
    for (const Point& corner : triangle.corners) box.add(corner);
  return box;
}

std::uint64_t mixed(std::uint64_t h) {
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93U;
  return h ^ (h >> 29);
}

std::uint64_t code_of(const Lattice::Place& place) {
  return std::uint64_t{place[0]} | std::uint64_t{place[1]} << 16 | std::uint64_t{place[2]} << 32;
}

/// A vertex is where it is, and what it looks like.
struct VertexKey {
  std::uint64_t place;
  std::uint32_t looks;
  friend bool operator==(const VertexKey&, const VertexKey&) = default;
};
struct VertexHash {
  std::size_t operator()(const VertexKey& key) const { return mixed(key.place + mixed(key.looks + 1)); }
};

/// Packs with so many bits of each coordinate.
PackedTriangles packed_with(std::span<const LooseTriangle> triangles, std::uint32_t owners,
                            const Lattice& lattice, unsigned bits, std::size_t most) {
  PackedTriangles packed;
  packed.of_owner.assign(owners, 0);
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> vertices;
  std::unordered_set<VertexKey, VertexHash> seen;  // where points have become one, so may triangles
  const unsigned lost = Lattice::bits - bits;
  const auto coarse = [&](std::uint16_t x) {
    if (lost == 0) return x;
    const std::uint32_t half = 1U << (lost - 1);
    return static_cast<std::uint16_t>(std::min<std::uint32_t>(0xffff, ((x + half) >> lost) << lost));
  };
  for (const LooseTriangle& triangle : triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      Lattice::Place place = lattice.place(triangle.corners[i]);
      for (auto& x : place) x = coarse(x);
      const VertexKey key{code_of(place), std::uint32_t{triangle.part} | std::uint32_t{triangle.tint} << 16};
      const auto [found, is_new] = vertices.try_emplace(key, static_cast<std::uint32_t>(packed.parts.size()));
      corners[i] = found->second;
      if (!is_new) continue;
      packed.positions.insert(packed.positions.end(), place.begin(), place.end());
      packed.parts.push_back(triangle.part);
      packed.tints.push_back(triangle.tint);
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    if (lost > 0) {
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      if (!seen.insert({std::uint64_t{corners[0]} << 32 | corners[1], corners[2]}).second) continue;
    }
    if (packed.triangles.size() >= 3 * most && bits > 3) return packed;  // too many: others will be tried
    packed.triangles.insert(packed.triangles.end(), corners.begin(), corners.end());
    ++packed.of_owner[triangle.owner];
  }
  return packed;
}

/// Adds what is common to all messages with triangles.
/// @param finest the step of the lattice that points are on.
void add_triangles(Message& message, const Lattice& lattice, const Box& box, const PackedTriangles& packed,
                   double finest, bool is_coarse) {
  message["origin"] = lattice.origin();
  message["step"] = lattice.step();
  message["box"] = {box.lower, box.upper};
  message["finest"] = std::ilogb(finest);
  if (is_coarse) message["coarse"] = true;
  message.add("positions", packed.positions, 3);
  message.add_indices("triangles", packed.triangles, 1);
}

/// Corners of a convex polygon in the plane, counter-clockwise.
std::vector<Point> outline_of(const CellBatch& batch, std::size_t cell) {
  const auto points = batch.cell_points(cell);
  std::vector<Point> corners;
  double x = 0, y = 0;
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    corners.push_back({points[i], points[i + 1], 0});
    x += points[i];
    y += points[i + 1];
  }
  x /= static_cast<double>(corners.size());
  y /= static_cast<double>(corners.size());
  std::sort(corners.begin(), corners.end(), [&](const Point& a, const Point& b) {
    return std::atan2(a[1] - y, a[0] - x) < std::atan2(b[1] - y, b[0] - x);
  });
  return corners;
}

/// Triangles of the cells of one label.
class CellTriangles {
 public:
  CellTriangles(const std::vector<std::shared_ptr<const CellBatch>>& batches, const Looks& looks)
      : batches_(batches),
        looks_(looks),
        hidden_(mesh_of(batches), Label::in, true),
        hidden_fuzzy_(mesh_of(batches), Label::fuzzy) {}

  void add(Label label) {
    for (const auto& batch : batches_)
      for (std::size_t cell = 0; cell < batch->size(); ++cell)
        if (batch->label[cell] == label) add(*batch, cell);
  }
  std::vector<LooseTriangle> triangles;
  std::vector<std::int32_t> parts;
  std::vector<std::uint16_t> levels;
  std::vector<float> volumes;
  [[nodiscard]] std::uint32_t cells() const { return static_cast<std::uint32_t>(levels.size()); }

 private:
  const std::vector<std::shared_ptr<const CellBatch>>& batches_;
  const Looks& looks_;
  supersteps::HiddenFacets hidden_, hidden_fuzzy_;

  static supersteps::SolidMesh mesh_of(const std::vector<std::shared_ptr<const CellBatch>>& batches) {
    return {batches.empty() ? 3 : batches.front()->dimension, batches};
  }

  void add(const CellBatch& batch, std::size_t cell) {
    const std::int32_t primitive = batch.primitive[cell], part = batch.part[cell];
    LooseTriangle like{.owner = cells(),
                       .part = part < 0 || part >= no_number ? no_number : static_cast<std::uint16_t>(part),
                       .tint = no_number};
    if (primitive >= 0 && static_cast<std::size_t>(primitive) < looks_.tint_of_primitive.size())
      like.tint = looks_.tint_of_primitive[static_cast<std::size_t>(primitive)];
    parts.push_back(part);
    levels.push_back(batch.level[cell]);
    volumes.push_back(static_cast<float>(batch.volume[cell]));
    if (batch.dimension == 2) {
      add_fan(outline_of(batch, cell), like);
      return;
    }
    const double* points = batch.cell_points(cell).data();
    for (std::size_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
      if (hidden_.contains(batch, cell, facet) || hidden_fuzzy_.contains(batch, cell, facet)) continue;
      std::vector<Point> corners;
      for (const std::uint16_t v : batch.vertices_of_facet(facet))
        corners.push_back({points[3 * v], points[3 * v + 1], points[3 * v + 2]});
      add_fan(corners, like);
    }
  }

  void add_fan(const std::vector<Point>& corners, LooseTriangle like) {
    for (std::size_t i = 2; i < corners.size(); ++i) {
      like.corners = {corners[0], corners[i - 1], corners[i]};
      triangles.push_back(like);
    }
  }
};

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double area_of(const Point& a, const Point& b, const Point& c) {
  const Point u = minus(b, a), v = minus(c, a);
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

/// Places along a curve that stays near where it is.
std::uint64_t interleaved(const Lattice::Place& place) {
  std::uint64_t code = 0;
  for (int bit = 15; bit >= 0; --bit)
    for (const std::uint16_t x : place) code = code << 1 | ((x >> bit) & 1U);
  return code;
}

/// A side of a face that is shown: of `part`, which is behind it, or of the other one, seen from there.
struct ShownFace {
  std::int32_t part;
  std::uint64_t where;
  std::uint32_t face;
  bool is_turned;
  friend auto operator<=>(const ShownFace&, const ShownFace&) = default;
};

/// The nearest point that is not beyond bounds.
Point within(Point point, const supersteps::Bounds& bounds) {
  for (std::size_t i = 0; i < bounds.lower.size() && i < point.size(); ++i)
    point[i] = std::clamp(point[i], bounds.lower[i], bounds.upper[i]);
  return point;
}

/// What is asked of a complex again and again.
class Faces {
 public:
  explicit Faces(const geometry::Brep& brep)
      : brep_(brep), first_triangle_(brep.faces.size() + 1, 0), solid_(2 * brep.faces.size()) {
    for (const std::uint32_t face : brep.face_of_triangle) ++first_triangle_[face + 1];
    std::partial_sum(first_triangle_.begin(), first_triangle_.end(), first_triangle_.begin());
    for (const auto& shell : brep.shells)
      for (const auto& side : brep.sides_of(shell))
        solid_[2 * side.face + (side.is_front ? 1 : 0)] = shell.solid;
  }
  [[nodiscard]] std::span<const std::array<std::uint32_t, 3>> triangles(std::uint32_t face) const {
    return std::span(brep_.triangles)
        .subspan(first_triangle_[face], first_triangle_[face + 1] - first_triangle_[face]);
  }
  [[nodiscard]] std::uint32_t solid(const ShownFace& shown) const {
    return solid_[2 * shown.face + (shown.is_turned ? 1 : 0)];
  }
  [[nodiscard]] const Point& point(std::uint32_t i) const { return brep_.points[i]; }
  [[nodiscard]] float area(std::uint32_t face) const {
    double area = 0;
    for (const auto& [a, b, c] : triangles(face)) area += area_of(point(a), point(b), point(c));
    return static_cast<float>(area);
  }
  /// All that is shown, part by part and along a curve through space.
  [[nodiscard]] std::vector<ShownFace> shown() const {
    Box box;
    for (const Point& point : brep_.points) box.add(point);
    const Lattice lattice(box.lower, box.upper);
    std::vector<ShownFace> all;
    for (std::uint32_t i = 0; i < brep_.faces.size(); ++i) {
      if (triangles(i).empty()) continue;
      const std::uint64_t where = interleaved(lattice.place(point(triangles(i).front()[0])));
      all.push_back({brep_.faces[i].part, where, i, false});
      if (brep_.faces[i].other != geometry::Brep::outside)
        all.push_back({brep_.faces[i].other, where, i, true});
    }
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  const geometry::Brep& brep_;
  std::vector<std::uint32_t> first_triangle_, solid_;
};

/// Whether people take an edge for one: where two faces meet that are turned against each other, or more of
/// them.
bool is_feature(const geometry::Brep& brep, const geometry::Brep::Edge& edge) {
  constexpr double least = feature_degrees * std::numbers::pi / 180;
  if (edge.count != 2) return true;
  const double angle = brep.uses[brep.uses_of_edges[edge.first]].angle;
  return std::abs(angle - std::numbers::pi) > least;
}

/// The feature edges on some faces, each once, as pairs of the vertices of their triangles.
/// @param points of the complex, where they go.
std::vector<std::uint32_t> edges_of(const geometry::Brep& brep, const std::vector<Point>& points,
                                    std::span<const ShownFace> faces, const Lattice& lattice,
                                    const PackedTriangles& triangles) {
  std::vector<std::uint32_t> edges;
  for (const ShownFace& shown : faces)
    for (const auto& loop : brep.loops_of(brep.faces[shown.face]))
      for (const auto& use : brep.uses_of(loop))
        if (is_feature(brep, brep.edges[use.edge])) edges.push_back(use.edge);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::unordered_map<std::uint64_t, std::uint32_t> vertices;
  for (std::uint32_t i = 0; i < triangles.parts.size(); ++i) {
    const std::uint16_t* place = triangles.positions.data() + 3 * std::size_t{i};
    vertices.emplace(code_of({place[0], place[1], place[2]}), i);
  }
  std::vector<std::uint32_t> pairs;
  for (const std::uint32_t edge : edges) {
    const auto& [a, b] = brep.edges[edge].ends;
    const auto from = vertices.find(code_of(lattice.place(points[a]))),
               to = vertices.find(code_of(lattice.place(points[b])));
    if (from == vertices.end() || to == vertices.end() || from->second == to->second)
      continue;  // a coarse one
    pairs.push_back(from->second);
    pairs.push_back(to->second);
  }
  return pairs;
}

/// What is a piece of a surface, and where its points are.
struct Piece {
  std::span<const ShownFace> faces;
  double step = 0;
};

std::vector<Piece> pieces_of(const Faces& faces, std::span<const ShownFace> shown) {
  constexpr std::size_t triangles_of_a_piece = 12000;
  std::vector<Piece> pieces;
  for (std::size_t begin = 0, end = 0; begin < shown.size(); begin = end) {
    std::size_t count = 0;
    for (end = begin; end < shown.size() && shown[end].part == shown[begin].part; ++end) {
      const std::size_t more = faces.triangles(shown[end].face).size();
      if (end > begin && count + more > triangles_of_a_piece) break;
      count += more;
    }
    pieces.push_back({shown.subspan(begin, end - begin)});
  }
  return pieces;
}

double rounded(double x, double step) { return step > 0 ? std::round(x / step) * step : x; }

/// Points as they are with a step for all of them.
std::vector<Point> rounded(std::vector<Point> points, double step) {
  for (Point& point : points)
    for (double& x : point) x = rounded(x, step);
  return points;
}

/// The points of a complex, some of them as one if there are more than `most` triangles.
/// @return with the step of their lattice; 0: there is none.
std::pair<std::vector<Point>, double> coarse_points(const geometry::Brep& brep, const Faces& faces,
                                                    std::span<const ShownFace> shown, std::size_t most) {
  constexpr double first_coarse = 1024;  // steps along the longest axis
  std::size_t count = 0;
  for (const ShownFace& each : shown) count += faces.triangles(each.face).size();
  if (count <= most) return {brep.points, 0};
  Box box;
  for (const Point& point : brep.points) box.add(point);
  double step = std::exp2(std::ceil(std::log2(
      std::max({box.upper[0] - box.lower[0], box.upper[1] - box.lower[1], box.upper[2] - box.lower[2]}) /
      first_coarse)));
  for (;; step *= 2) {
    std::vector<Point> points = rounded(brep.points, step);
    count = 0;
    for (const ShownFace& each : shown)
      for (const auto& [a, b, c] : faces.triangles(each.face))
        if (points[a] != points[b] && points[b] != points[c] && points[c] != points[a]) ++count;
    if (count <= most) return {std::move(points), step};
  }
}

/// Chooses the lattices of pieces, and moves each point to the coarsest of those that it is on. What is on a
/// lattice is on all finer ones, so it has one place in all of its pieces.
void fit_lattices(const geometry::Brep& brep, const Faces& faces, std::vector<Piece>& pieces,
                  std::vector<Point>& points) {
  const std::vector<Point> exact = points;
  for (bool changed = true; changed;) {
    std::vector<double> step(points.size(), 0);
    const auto for_each_point = [&](const Piece& piece, const auto& use) {
      for (const ShownFace& each : piece.faces) {
        for (const auto& triangle : faces.triangles(each.face))
          for (const std::uint32_t v : triangle) use(v);
        for (const auto& loop : brep.loops_of(brep.faces[each.face]))
          for (const auto& use_of_edge : brep.uses_of(loop)) use(brep.from(use_of_edge));
      }
    };
    for (const Piece& piece : pieces)
      for_each_point(piece, [&](std::uint32_t v) { step[v] = std::max(step[v], piece.step); });
    for (std::size_t v = 0; v < points.size(); ++v)
      for (std::size_t i = 0; i < 3; ++i) points[v][i] = rounded(exact[v][i], step[v]);
    changed = false;
    for (Piece& piece : pieces) {
      Box box;
      for_each_point(piece, [&](std::uint32_t v) { box.add(points[v]); });
      const double needed = Lattice(box.lower, box.upper, piece.step).step();
      changed = changed || needed != piece.step;
      piece.step = needed;
    }
  }
}

std::string piece_message(std::uint64_t run, std::size_t number, const geometry::Brep& brep,
                          const Faces& faces, const Piece& piece, const std::vector<Point>& points,
                          double coarse_step) {
  std::vector<LooseTriangle> triangles;
  std::vector<std::uint32_t> names, solids;
  std::vector<float> areas;
  Box box;
  for (const ShownFace& face : piece.faces) {
    for (auto [a, b, c] : faces.triangles(face.face)) {
      if (face.is_turned) std::swap(b, c);
      triangles.push_back({{points[a], points[b], points[c]}, static_cast<std::uint32_t>(names.size())});
    }
    names.push_back(face.face);
    solids.push_back(faces.solid(face));
    areas.push_back(faces.area(face.face));
    for (const auto& loop : brep.loops_of(brep.faces[face.face]))
      for (const auto& use : brep.uses_of(loop)) box.add(points[brep.from(use)]);
  }
  const Lattice lattice(box.lower, box.upper, piece.step);
  const auto packing =
      packed(triangles, static_cast<std::uint32_t>(names.size()), lattice, triangles.size()).first;
  Message message("piece", run);
  message["piece"] = number;
  message["part"] = piece.faces.front().part;
  message["area"] = std::accumulate(areas.begin(), areas.end(), 0.0);
  message["ofFaces"] = names.size();
  add_triangles(message, lattice, box, packing, std::max(lattice.step(), coarse_step), coarse_step > 0);
  message.add_small("ofFace", packing.of_owner);
  message.add_small("faces", names, 1);
  message.add_small("solids", solids, 1);
  message.add("areas", areas);
  message.add_indices("edges", edges_of(brep, points, piece.faces, lattice, packing), 1);
  return message.bytes();
}

}  // namespace

Lattice::Lattice(const std::array<double, 3>& lower, const std::array<double, 3>& upper, double least)
    : origin_(lower) {
  double extent = 0;
  for (std::size_t i = 0; i < 3; ++i) extent = std::max(extent, upper[i] - lower[i]);
  constexpr double steps = 0xfffe;  // one is lost to the origin, which is on the lattice, too
  step_ = extent > 0 ? std::exp2(std::ceil(std::log2(extent / steps))) : least > 0 ? least : 1;
  step_ = std::max(step_, least);
  for (double& x : origin_) x = std::floor(x / step_) * step_;
}

Lattice::Place Lattice::place(const std::array<double, 3>& point) const {
  Place place{};
  for (std::size_t i = 0; i < 3; ++i)
    place[i] =
        static_cast<std::uint16_t>(std::clamp(std::round((point[i] - origin_[i]) / step_), 0.0, 65535.0));
  return place;
}

std::pair<PackedTriangles, unsigned> packed(std::span<const LooseTriangle> triangles, std::uint32_t owners,
                                            const Lattice& lattice, std::size_t most) {
  constexpr unsigned coarsest = 3, first_coarse = 10;
  unsigned bits = Lattice::bits;
  if (triangles.size() > most) bits = first_coarse;
  for (;; --bits) {
    PackedTriangles result = packed_with(triangles, owners, lattice, bits, most);
    if (bits == coarsest || result.triangles.size() < 3 * most || triangles.size() <= most)
      return {std::move(result), bits};
  }
}

std::string region_message(std::uint64_t run, std::uint32_t region,
                           const std::vector<std::shared_ptr<const CellBatch>>& batches, const Looks& looks,
                           std::size_t most, const std::optional<Fresh>& fresh) {
  CellTriangles cells(batches, looks);
  cells.add(Label::in);
  const std::uint32_t in_cells = cells.cells();
  const std::size_t in_triangles = cells.triangles.size();
  cells.add(Label::fuzzy);
  const Box box = box_of(cells.triangles);
  const Lattice lattice(box.lower, box.upper);
  // Of each kind in its share: what is undecided must not hide that something is.
  const auto share = [&](std::size_t count) {
    return std::max<std::size_t>(12, most * count / std::max<std::size_t>(1, cells.triangles.size()));
  };
  const std::span all(cells.triangles);
  auto fuzzy = std::vector<LooseTriangle>(all.begin() + static_cast<std::ptrdiff_t>(in_triangles), all.end());
  for (LooseTriangle& triangle : fuzzy) {
    triangle.owner -= in_cells;
    for (Point& corner : triangle.corners) corner = within(corner, looks.bounds);
  }
  auto [packing, bits] = packed(all.first(in_triangles), in_cells, lattice, share(in_triangles));
  const auto [more, fewer_bits] = packed(fuzzy, cells.cells() - in_cells, lattice, share(fuzzy.size()));
  const auto vertices = static_cast<std::uint32_t>(packing.parts.size());
  const std::size_t opaque = packing.triangles.size() / 3;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(packing.positions, more.positions);
  append(packing.parts, more.parts);
  append(packing.tints, more.tints);
  append(packing.of_owner, more.of_owner);
  for (const std::uint32_t v : more.triangles) packing.triangles.push_back(v + vertices);

  Message message(fresh ? "fresh" : "region", run);
  if (fresh) {
    message["number"] = fresh->number;
    message["ofStep"] = fresh->step;
  }
  message["region"] = region;
  message["rank"] = region < looks.rank_of_region.size() ? looks.rank_of_region[region] : 0;
  message["opaque"] = opaque;
  message["inCells"] = in_cells;
  const unsigned lost = Lattice::bits - std::min(bits, fewer_bits);
  add_triangles(message, lattice, box, packing, std::ldexp(lattice.step(), static_cast<int>(lost)), lost > 0);
  message.add("parts", packing.parts);
  if (!looks.tint_of_primitive.empty()) message.add("tints", packing.tints);
  message.add_small("ofCell", packing.of_owner);
  message.add("cellParts", cells.parts);
  message.add("levels", cells.levels);
  message.add("volumes", cells.volumes);
  return message.bytes();
}

std::vector<std::string> surface_messages(std::uint64_t run, const geometry::Brep& brep, std::size_t most) {
  const Faces faces(brep);
  const std::vector<ShownFace> shown = faces.shown();
  auto [points, coarse_step] = coarse_points(brep, faces, shown, most);
  std::vector<Piece> pieces = pieces_of(faces, shown);
  fit_lattices(brep, faces, pieces, points);
  std::vector<std::string> messages;
  for (const Piece& piece : pieces)
    messages.push_back(piece_message(run, messages.size(), brep, faces, piece, points, coarse_step));
  return messages;
}

}  // namespace bsp2::api
