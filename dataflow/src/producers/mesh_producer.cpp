#include "producers/mesh_producer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "bsp2/geometry/support/vectors.hpp"
#include "shapes/facet_crossing.hpp"
#include "shapes/mesh_shape.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

namespace {

using Point = std::array<double, 3>;
/// Above so many facets, space is cut between them rather than along one of them.
constexpr std::size_t many_facets = 24;
constexpr Word dropped = ~Word{0};  // in the place of a facet

// --- the same exactly, for the rare cells thinner than doubles resolve: in units of 2^(grid_exponent - 53)
// ----------

using geometry::mp::cpp_int;
using ExactPoint = std::array<cpp_int, 3>;

/// @param x multiples of 2^grid_exponent.
ExactPoint exact_point(const Point& x, int grid_exponent) {
  ExactPoint point;
  for (int i = 0; i < 3; ++i) {
    int exponent = 0;
    const double mantissa = std::frexp(x[i], &exponent);
    point[i] = static_cast<std::int64_t>(std::ldexp(mantissa, 53));
    if (x[i] != 0) point[i] <<= static_cast<unsigned>(exponent - grid_exponent);
  }
  return point;
}

ExactPoint exact_corner(const Mesh& mesh, std::uint32_t corner) {
  const auto place = mesh.map.image(mesh.frame_points[corner]);
  return {cpp_int(place[0]), cpp_int(place[1]), cpp_int(place[2])};
}

/// A point in homogeneous coordinates: integers, since to reduce fractions takes longer than all else.
struct ExactMix {
  ExactPoint point;
  cpp_int weight = 1;  // > 0
};

/// The weighted mean of vertices. Its numbers have as many digits as those of all of them together.
ExactMix exact_mix(const geometry::HyperplaneTable<3>& table, std::span<const geometry::Vertex<3>> vertices,
                   std::span<const int> weights) {
  ExactMix sum;
  int total = 0;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    std::array<geometry::ExactCovector<3>, 3> planes;
    for (int i = 0; i < 3; ++i) planes[i] = table.exact(vertices[k].hyperplanes[i]);
    const auto vertex = geometry::meeting_point<3>(planes);
    const int sign = vertex[3].sign();
    const cpp_int weight = cpp_int(vertex[3]) * sign, share = sum.weight * sign * weights[k];
    for (int i = 0; i < 3; ++i) sum.point[i] = sum.point[i] * weight + cpp_int(vertex[i]) * share;
    sum.weight *= weight;
    total += weights[k];
  }
  for (cpp_int& x : sum.point) x <<= 53;
  sum.weight *= total;
  return sum;
}

using geometry::cross;
using geometry::dot;
using geometry::minus;

/// All determinants are linear in q, whose numbers are long, if everything is seen from p.
std::optional<int> exact_crossing(const ExactPoint& p, const ExactMix& q, const ExactPoint& a,
                                  const ExactPoint& b, const ExactPoint& c) {
  const ExactPoint pa = minus(a, p), pb = minus(b, p), pc = minus(c, p);
  const ExactPoint ab = cross(pa, pb), bc = cross(pb, pc), ca = cross(pc, pa);
  ExactPoint pq, normal;  // pq: times q's weight
  for (int i = 0; i < 3; ++i) {
    pq[i] = q.point[i] - q.weight * p[i];
    normal[i] = ab[i] + bc[i] + ca[i];
  }
  const cpp_int volume = dot(pa, bc);
  return crossing(volume.sign(), cpp_int(q.weight * volume - dot(pq, normal)).sign(),
                  {dot(pq, ab).sign(), dot(pq, bc).sign(), dot(pq, ca).sign()});
}

/// Four vertices of a cell that lie in no plane: three of a facet, and one that is not in it. What is a mix
/// of them is inside of the cell.
std::array<geometry::Vertex<3>, 4> vertices_around(const geometry::Cell<3>& cell, std::minstd_rand& random) {
  const auto vertices = cell.vertices();
  const auto of_facet = geometry::facet_vertices(cell, random() % cell.facet_count());
  const std::size_t first = random() % of_facet.size();
  std::array<geometry::Vertex<3>, 4> chosen;
  for (std::size_t k = 0; k < 3; ++k) chosen[k] = vertices[of_facet[(first + k) % of_facet.size()]];
  std::size_t other = random() % vertices.size();
  while (std::find(of_facet.begin(), of_facet.end(), other) != of_facet.end())
    other = (other + 1) % vertices.size();
  chosen[3] = vertices[other];
  return chosen;
}

void put_point(Words& out, std::size_t at, const Point& point) {
  for (int i = 0; i < 3; ++i) {
    const auto bits = std::bit_cast<std::uint64_t>(point[i]);
    out[at + 2 * i] = static_cast<Word>(bits);
    out[at + 2 * i + 1] = static_cast<Word>(bits >> 32);
  }
}

Point get_point(const Word* words) {
  Point point;
  for (int i = 0; i < 3; ++i)
    point[i] = std::bit_cast<double>(words[2 * i] | std::uint64_t{words[2 * i + 1]} << 32);
  return point;
}

// A cell's facets are in the order in which they were cut: those that a cell has had since it was asked about
// come after the one that was its last then. That one's mark: its hyperplane's id and 1; 0: none is known.

Word mark_of_last_facet(const geometry::Cell<3>& cell) {
  constexpr Word most = ~Word{0} >> 1;
  const HyperplaneId id = cell.facet_hyperplane(cell.facet_count() - 1).id();
  return id < most ? id + 1 : 0;
}

/// All count as new where the marked one is gone.
std::size_t first_new_facet(const geometry::Cell<3>& cell, Word mark) {
  if (mark == 0) return 0;
  for (std::size_t i = cell.facet_count(); i > 0; --i)
    if (cell.facet_hyperplane(i - 1).id() + 1 == mark) return i;
  return 0;
}

}  // namespace

template <typename Visit>
void MeshProducer::for_each_facet(const Word* leaf, Visit&& visit) const {
  if ((leaf[0] & Program::whole) != 0) {
    for (Word facet = 0; facet < mesh_.facets.size(); ++facet) visit(facet);
  } else {
    for (const Word* at = leaf + header; at != leaf + leaf[1]; ++at) visit(*at);
  }
}

Label MeshProducer::ask(const Word* leaf, CellView<3>& cell, Words& out) const {
  const bool whole = (leaf[0] & Program::whole) != 0;
  if (cell.box_test_only() && whole && cell.extent().contains(producer_)) {
    out.append({leaf, Program::header});
    return Label::fuzzy;
  }
  const std::size_t begin = out.size();
  out.push(leaf[0] & ~Program::whole, 0, leaf[2]);
  out.resize(begin + header);
  std::fill(out.begin() + begin + Program::header, out.end(), 0);
  for_each_facet(leaf, [&](Word facet) {
    if (may_meet(mesh_.facets[facet], cell)) out.push(facet);
  });
  Word looked_at = whole ? 0 : leaf[at_flag] >> 1;
  if (!cell.box_test_only()) {
    drop_beyond(cell, first_new_facet(cell.cell(), looked_at), out, begin + header);
    looked_at = mark_of_last_facet(cell.cell());
  }
  out[begin + at_flag] = looked_at << 1;
  std::optional<Reference> reference = reference_of(leaf);
  if (!reference || !is_inside(reference->point, cell.cell())) reference = new_reference(leaf, cell);
  if (out.size() == begin + header)
    return winding_within(leaf, cell, reference) != 0 ? Label::in : Label::out;
  if (reference) {
    out[begin + at_flag] |= 1;
    put_point(out, begin + at_point, reference->point);
    out[begin + at_winding] = static_cast<Word>(reference->winding);
  }
  return Label::fuzzy;
}

/// False only where the facet certainly has no point inside the cell: by boxes, and by the facet's plane.
bool MeshProducer::may_meet(const Mesh::Facet& facet, CellView<3>& cell) const {
  const CellExtent<3>& extent = cell.extent();
  const Point *a = &mesh_.points[facet.corners[0]], *b = &mesh_.points[facet.corners[1]],
              *c = &mesh_.points[facet.corners[2]];
  for (int i = 0; i < 3; ++i) {
    if (std::min({(*a)[i], (*b)[i], (*c)[i]}) - mesh_.error > extent.upper[i]) return false;
    if (std::max({(*a)[i], (*b)[i], (*c)[i]}) + mesh_.error < extent.lower[i]) return false;
  }
  if (extent.position(cell.table().rounded(facet.plane.id())) != Position::crossing) return false;
  return cell.box_test_only() || cell.crosses(facet.plane.id());
}

void MeshProducer::load(std::span<const Word> facets, geometry::TriangleColumns& triangles) const {
  triangles.resize(facets.size());
  for (std::size_t i = 0; i < facets.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) triangles.set(i, k, mesh_.points[mesh_.facets[facets[i]].corners[k]]);
}

/// Drops from a list, from its `first` entry on, the facets that are certainly outside of one side of the
/// cell, or on it.
void MeshProducer::drop_beyond(CellView<3>& cell, std::size_t first_side, Words& facets,
                               std::size_t first) const {
  if (first_side == cell.cell().facet_count()) return;
  constexpr std::size_t at_once = 1024;  // few enough to stay in the cache
  for (std::size_t at = first; at < facets.size(); at += at_once)
    mark_beyond(cell, first_side,
                {facets.begin() + at, facets.begin() + std::min(at + at_once, facets.size())});
  facets.resize(
      static_cast<std::size_t>(std::remove(facets.begin() + first, facets.end(), dropped) - facets.begin()));
}

/// Puts `dropped` in the place of those facets.
void MeshProducer::mark_beyond(CellView<3>& cell, std::size_t first_side, std::span<Word> facets) const {
  using geometry::TriangleColumns;
  TriangleColumns& triangles = cell.triangles();
  load(facets, triangles);
  for (std::size_t i = first_side; i < cell.cell().facet_count(); ++i) {
    const OrientedHyperplane plane = cell.cell().facet_hyperplane(i);
    const auto rounded = cell.table().rounded(plane.id());
    const geometry::Hyperplane<3> side =
        plane.flipped() ? rounded.opposite() : rounded;  // the cell is where it is negative
    const double outside = side.error + 2 * mesh_.error, reach = reach_of_points_on(side);
    const auto sides = triangles.sides(side, -reach, outside);
    const auto is_beyond = [&](std::uint32_t corner) {
      return side.at(mesh_.points[corner]) > outside || is_on(corner, plane.id());
    };
    for (std::size_t k = 0; k < facets.size(); ++k) {
      if ((sides[k] & TriangleColumns::below) != 0 || facets[k] == dropped) continue;
      if (sides[k] == TriangleColumns::above ||
          std::ranges::all_of(mesh_.facets[facets[k]].corners, is_beyond))
        facets[k] = dropped;
    }
  }
}

/// Where a hyperplane's value at a mesh point is larger, that is not on it. (The mesh may reach far beyond
/// the model, where values are rounded more.)
double MeshProducer::reach_of_points_on(const geometry::Hyperplane<3>& rounded) const {
  const double moved = network_.coincidence * network_.table.width();  // by merging, at most
  return rounded.error + 4 * (mesh_.error + moved);
}

/// Whether a mesh point is known to be on a hyperplane, that of a facet around it.
bool MeshProducer::is_on(std::uint32_t corner, HyperplaneId id) const {
  const auto first = mesh_.incident.begin() + mesh_.incident_offset[corner],
             last = mesh_.incident.begin() + mesh_.incident_offset[corner + 1];
  constexpr std::ptrdiff_t few = 16;
  if (last - first > few) return std::binary_search(first, last, id);
  bool found = false;  // without branches
  for (auto at = first; at != last; ++at) found |= *at == id;
  return found;
}

/// Whether a point is in the cell, and on the same side of the facets as the cell is of the hyperplanes that
/// represent them.
bool MeshProducer::is_inside(const Point& point, const geometry::Cell<3>& cell) const {
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    const OrientedHyperplane plane = cell.facet_hyperplane(facet);
    const auto h = network_.table.rounded(plane.id());
    const double value = plane.flipped() ? -h.at(point) : h.at(point);
    if (value > -2 * (h.error + moved_by(plane.id()))) return false;
  }
  return true;
}

/// How far corners of the mesh are at most from a hyperplane that represents facets of theirs.
double MeshProducer::moved_by(HyperplaneId id) const {
  const auto at = std::ranges::lower_bound(mesh_.moved, id, {}, &Mesh::Moved::plane);
  return at != mesh_.moved.end() && at->plane == id ? at->distance : 0;
}

/// A bound of the thickness of a cell none of whose points `is_inside` takes.
double MeshProducer::thickness_by_merging(const geometry::Cell<3>& cell) const {
  double most = 0;
  for (std::size_t facet = 0; facet < cell.facet_count() && !mesh_.moved.empty(); ++facet)
    most = std::max(most, moved_by(cell.facet_hyperplane(facet).id()));
  return 8 * most;
}

/// Of a cell that no facet crosses. Where no double lies in it for certain, it is far thinner than any
/// tolerance: a point beside it serves as well, unless facets are as near. Then it arose between hyperplanes
/// that merging has moved apart, the mesh's corners tell nothing about it, and the mesh calls it OUT. Where
/// merging has moved no facet of the mesh it is told exactly.
std::int32_t MeshProducer::winding_within(const Word* leaf, CellView<3>& cell,
                                          const std::optional<Reference>& reference) const {
  if (reference) return reference->winding;
  if (!mesh_.is_exact) return winding_beside(cell).value_or(0);
  const auto winding = winding_from_parent(leaf, cell);
  return winding ? *winding : exact_winding(cell);
}

/// The winding number in the middle of a cell without thickness, if no facet is that near. Such a cell may be
/// long, and lie askew: its middle is that of its vertices.
std::optional<std::int32_t> MeshProducer::winding_beside(const CellView<3>& view) const {
  double error = 2 * mesh_.error + 0x1p-50 * network_.table.radius() + thickness_by_merging(view.cell());
  Point centre{};
  const auto vertices = view.cell().vertices();
  for (const auto& vertex : vertices) {
    error += vertex.error;
    for (int i = 0; i < 3; ++i) centre[i] += vertex.x[i] / static_cast<double>(vertices.size());
  }
  std::minstd_rand random(2357);  // the same segments in every run
  const auto change_at = [&](const Point& far, const Mesh::Facet& facet) {
    const auto& [a, b, c] = facet.corners;
    return crossing(far, centre, mesh_.points[a], mesh_.points[b], mesh_.points[c], error);
  };
  const auto is_missed = [&](const Point& far, const Mesh::Facet& facet) {
    const auto& [a, b, c] = facet.corners;
    return SegmentAmongFacets(far, centre, error).misses(mesh_.points[a], mesh_.points[b], mesh_.points[c]);
  };
  const Mesh::Facet* open = nullptr;  // one that left it open: mostly the centre is too near to it, always
  for (int attempt = 0; attempt < 12; ++attempt) {
    const Point far = beyond(centre, random);
    if (open != nullptr && !is_missed(far, *open) && !change_at(far, *open)) continue;
    std::int32_t winding = 0;
    bool certain = true;
    for_each_facet_near(far, centre, error, [&](const Mesh::Facet& facet) {
      const auto change = change_at(far, facet);
      certain = change.has_value();
      if (!certain) open = &facet;
      winding += change.value_or(0);
      return certain;
    });
    if (certain) return winding;
  }
  return std::nullopt;
}

/// A whole mesh is seen from a point outside its bounds.
MeshProducer::Reference MeshProducer::outside() const {
  Reference reference{{}, 0};
  for (int i = 0; i < 3; ++i)
    reference.point[i] = producer_.upper[i] + (0.1 + 0.0137 * i) * (producer_.upper[i] - producer_.lower[i]);
  return reference;
}

/// Beyond the nearest side of the mesh's bounds, somewhat askew: little of the mesh lies in between.
MeshProducer::Point MeshProducer::point_outside(const Point& point) const {
  int nearest = 0;
  bool is_above = true;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i)
    for (const bool above : {true, false}) {
      const double distance = above ? producer_.upper[i] - point[i] : point[i] - producer_.lower[i];
      if (distance >= least) continue;
      least = distance;
      nearest = i;
      is_above = above;
    }
  Point far = point;
  const double away = std::max(0.0, least) + 0.01 * (producer_.upper[nearest] - producer_.lower[nearest]);
  far[nearest] += is_above ? away : -away;
  far[(nearest + 1) % 3] += 0.0137 * away;
  far[(nearest + 2) % 3] -= 0.0219 * away;
  return far;
}

std::optional<MeshProducer::Reference> MeshProducer::reference_of(const Word* leaf) const {
  if ((leaf[0] & Program::whole) != 0) return outside();
  if ((leaf[at_flag] & 1) == 0) return std::nullopt;
  return Reference{get_point(leaf + at_point), static_cast<std::int32_t>(leaf[at_winding])};
}

/// Calls visit(facet) for the facets that the segment does not certainly miss, until it answers false. Time:
/// it does not grow with the mesh but with what lies along the segment.
template <typename Visit>
void MeshProducer::for_each_facet_near(const Point& from, const Point& to, double error,
                                       Visit&& visit) const {
  const SegmentAmongFacets segment(from, to, error);
  facet_tree(mesh_).visit([&](const FacetTree::Box& box) { return segment.misses_box(box.low, box.high); },
                          [&](std::uint32_t index) {
                            const auto& [a, b, c] = mesh_.facets[index].corners;
                            return segment.misses(mesh_.points[a], mesh_.points[b], mesh_.points[c]) ||
                                   visit(mesh_.facets[index]);
                          });
}

std::optional<std::int32_t> MeshProducer::winding_around(const Point& point) const {
  return winding_anew(point);
}

std::optional<int> MeshProducer::change_across(std::uint32_t facet, const Point& from, const Point& to,
                                               double error) const {
  const auto& [a, b, c] = mesh_.facets[facet].corners;
  return crossing(from, to, mesh_.points[a], mesh_.points[b], mesh_.points[c],
                  error + 2 * mesh_.error + 0x1p-50 * network_.table.radius());
}

std::optional<std::int32_t> MeshProducer::winding_at(const Point& point, const Reference& from,
                                                     const Word* leaf) const {
  std::int32_t winding = from.winding;
  bool certain = true;
  const double error = mesh_.error * 2 + 0x1p-52 * network_.table.radius();
  for_each_facet(leaf, [&](Word index) {
    const auto& corners = mesh_.facets[index].corners;
    const auto change = crossing(from.point, point, mesh_.points[corners[0]], mesh_.points[corners[1]],
                                 mesh_.points[corners[2]], error);
    if (change)
      winding += *change;
    else
      certain = false;
  });
  if (!certain) return std::nullopt;
  return winding;
}

/// How often the mesh winds around a point, counted along a line from outside of its bounds; none if rounding
/// leaves that open.
std::optional<std::int32_t> MeshProducer::winding_anew(const Point& point) const {
  const Point from = point_outside(point);
  std::int32_t winding = 0;
  bool certain = true;
  const double error = mesh_.error * 2 + 0x1p-52 * network_.table.radius();
  for_each_facet_near(from, point, error, [&](const Mesh::Facet& facet) {
    const auto& [a, b, c] = facet.corners;
    const auto change = crossing(from, point, mesh_.points[a], mesh_.points[b], mesh_.points[c], error);
    certain = change.has_value();
    winding += change.value_or(0);
    return certain;
  });
  if (!certain) return std::nullopt;
  return winding;
}

/// A point inside the cell and the winding number there, by a segment from the parent's reference point that
/// meets no edge; several points are tried.
std::optional<MeshProducer::Reference> MeshProducer::new_reference(const Word* leaf,
                                                                   const CellView<3>& cell) const {
  const auto known =
      reference_of(leaf);          // the cell that this one is part of may have had none: then begin anew
  std::minstd_rand random(12345);  // the same points in every run
  Point point = cell.extent().centre;
  for (int attempt = 0; attempt < 12; ++attempt) {
    if (attempt > 0) {  // the centre moved towards a random mix of vertices
      Point mix{};
      double sum = 0;
      for (const auto& vertex : cell.cell().vertices()) {
        const double weight = 1 + static_cast<double>(random() % 1000);
        sum += weight;
        for (int i = 0; i < 3; ++i) mix[i] += weight * vertex.x[i];
      }
      for (int i = 0; i < 3; ++i) point[i] = mix[i] / sum;
    }
    if (!is_inside(point, cell.cell())) continue;
    if (const auto winding = known ? winding_at(point, *known, leaf) : winding_anew(point))
      return Reference{point, *winding};
  }
  return std::nullopt;
}

/// As `crossing`, to a point strictly within a cell that is known to `error` only: on which side of the
/// facet's plane it is, the cell tells exactly, unless the plane crosses it. So hardly any facet is asked in
/// long numbers.
std::optional<int> MeshProducer::crossing_into(CellView<3>& cell, const Point& from, const Point& to,
                                               const Mesh::Facet& facet, double error) const {
  const auto& [i, j, k] = facet.corners;
  const Point a = minus(mesh_.points[i], from), b = minus(mesh_.points[j], from),
              c = minus(mesh_.points[k], from), along = minus(to, from);
  const int from_side = sign_of_determinant(a, b, c, error);
  const Position where = cell.position(facet.plane);
  const int inside =
      mesh_.map.orientation() < 0 ? -1 : 1;  // where the map mirrors, corners turn the other way
  const int to_side = where == Position::crossing ? 0 : where == Position::negative ? inside : -inside;
  if (from_side != 0 && from_side == to_side) return 0;
  return crossing(from_side, to_side,
                  {sign_of_determinant(along, a, b, error), sign_of_determinant(along, b, c, error),
                   sign_of_determinant(along, c, a, error)});
}

/// From the reference point of the cell that this one is part of: only its facets can lie in between.
std::optional<std::int32_t> MeshProducer::winding_from_parent(const Word* leaf, CellView<3>& cell) const {
  const auto known = reference_of(leaf);
  if (!known || (leaf[0] & Program::whole) != 0) return std::nullopt;
  const Point& centre = cell.extent().centre;
  double error = 2 * mesh_.error + 0x1p-50 * network_.table.radius();
  for (const auto& vertex : cell.cell().vertices()) error = std::max(error, vertex.error);
  error *= 2;
  std::int32_t winding = known->winding;
  bool certain = true;
  for_each_facet(leaf, [&](Word index) {
    if (!certain) return;
    const auto change = crossing_into(cell, known->point, centre, mesh_.facets[index], error);
    certain = change.has_value();
    winding += change.value_or(0);
  });
  return certain ? std::optional(winding) : std::nullopt;
}

/// A point outside of the mesh's bounds, on the model's grid, beyond the nearer of those two sides that are
/// the closest to each other: between it and a point of a sheet lies hardly anything.
MeshProducer::Point MeshProducer::beyond(const Point& point, std::minstd_rand& random) const {
  const auto extent = [&](int i) { return producer_.upper[i] - producer_.lower[i]; };
  int across = 0;
  for (int i = 1; i < 3; ++i)
    if (extent(i) < extent(across)) across = i;
  const auto part = [&] { return (0.1 + static_cast<double>(random() % 1000) * 1e-3) * extent(across); };
  const bool above = point[across] - producer_.lower[across] > extent(across) / 2;
  Point far;
  for (int i = 0; i < 3; ++i) far[i] = point[i] + (random() % 2 == 0 ? part() : -part()) / 4;
  far[across] = above ? producer_.upper[across] + part() : producer_.lower[across] - part();
  for (double& x : far)
    x = std::ldexp(std::nearbyint(std::ldexp(x, -mesh_.grid_exponent)), mesh_.grid_exponent);
  return far;
}

/// For cells in which no double lies for certain: the winding number at an exact point, a mix of the cell's
/// exact vertices, by all facets that a segment from outside crosses. Facets for which rounding leaves that
/// open are asked exactly.
std::int32_t MeshProducer::exact_winding(CellView<3>& view) const {
  std::minstd_rand random(54321);  // the same points in every run
  for (int attempt = 0; attempt < 64; ++attempt) {
    const auto vertices = vertices_around(view.cell(), random);
    std::array<int, 4> weights{};
    double error = 0;
    int sum = 0;
    Point near{};
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      weights[k] = 1 + static_cast<int>(random() % 97);
      sum += weights[k];
      error = std::max(error, vertices[k].error);
      for (int i = 0; i < 3; ++i) near[i] += weights[k] * vertices[k].x[i];
    }
    for (double& x : near) x /= sum;
    const Point far = beyond(near, random);
    error += 2 * mesh_.error + 0x1p-50 * network_.table.radius();
    std::optional<ExactMix> exact_near;
    std::optional<ExactPoint> exact_far;
    std::int32_t winding = 0;
    bool certain = true;
    for_each_facet_near(far, near, error, [&](const Mesh::Facet& facet) {
      const auto& corners = facet.corners;
      auto change = crossing(far, near, mesh_.points[corners[0]], mesh_.points[corners[1]],
                             mesh_.points[corners[2]], error);
      if (!change) change = crossing_into(view, far, near, facet, error);
      if (!change) {
        if (!exact_near) {
          exact_near = exact_mix(network_.table, vertices, weights);
          exact_far = exact_point(far, mesh_.grid_exponent);
        }
        change = exact_crossing(*exact_far, *exact_near, exact_corner(mesh_, corners[0]),
                                exact_corner(mesh_, corners[1]), exact_corner(mesh_, corners[2]));
      }
      if (change)
        winding += *change;
      else
        certain = false;  // through an edge: another segment will not
      return certain;
    });
    if (certain) return winding;
  }
  throw std::logic_error("a mesh answers no segment: a cell lies in one of its facets");
}

Advice MeshProducer::advise(const Word* leaf, CellView<3>& cell) const {
  const auto parting = median(leaf, cell);
  return {geometry::oriented(parting ? *parting : best_plane(leaf, cell))};
}

namespace {

constexpr double clearance = 0x1p-11;  // a share of the cell's length

/// A cut across an axis at a corner's coordinate, or where the grid of cuts misses that and the model has no
/// hyperplane there, well beyond: between the corner and a cut that misses it by a step of the grid lie cells
/// thinner than anything in the model.
HyperplaneId cut_beside_corner(const Network<3>& network, int axis, double value, double length) {
  const auto& table = network.table;
  const HyperplaneId id = network.axial_cut(axis, value);
  const bool is_there =
      id < table.size() || table.axis_value(axis, table.axis_position(axis, value)) == value;
  return is_there ? id : network.axial_cut(axis, value + length * clearance);
}

}  // namespace

/// An axis-parallel cut that has many facets on either side.
std::optional<HyperplaneId> MeshProducer::median(const Word* leaf, CellView<3>& cell) const {
  const std::size_t count = undecided(leaf);
  if (count <= many_facets) return std::nullopt;
  std::vector<double> low, high;
  for (const int axis : cell.extent().axes_by_length()) {
    low.clear();
    high.clear();
    for_each_facet(leaf, [&](Word index) {
      const auto& corners = mesh_.facets[index].corners;
      const double a = mesh_.points[corners[0]][axis], b = mesh_.points[corners[1]][axis],
                   c = mesh_.points[corners[2]][axis];
      low.push_back(std::min({a, b, c}));
      high.push_back(std::max({a, b, c}));
    });
    std::vector<double> middle(high);
    std::nth_element(middle.begin(), middle.begin() + static_cast<std::ptrdiff_t>(count / 2), middle.end());
    const double value = middle[count / 2];
    const auto below = std::count_if(high.begin(), high.end(), [&](double x) { return x <= value; });
    const auto above = std::count_if(low.begin(), low.end(), [&](double x) { return x >= value; });
    // Progress on both sides, else a fan of facets around one point would be halved for ever.
    if (below * 5 < static_cast<std::ptrdiff_t>(count) || above * 5 < static_cast<std::ptrdiff_t>(count))
      continue;
    // Not again beside the same corner: cuts that come ever nearer to it leave ever thinner cells.
    if (cell.extent().upper[axis] - value < 8 * clearance * cell.extent().length(axis)) continue;
    const HyperplaneId id = cut_beside_corner(network_, axis, value, cell.extent().length(axis));
    return cell.crosses(id) ? std::optional(id) : std::nullopt;
  }
  return std::nullopt;
}

/// The plane of a facet that parts few others and leaves as many on either side.
HyperplaneId MeshProducer::best_plane(const Word* leaf, CellView<3>& cell) const {
  using geometry::TriangleColumns;
  std::array<Word, many_facets> list;
  const std::span<Word> facets{list.data(), std::min(undecided(leaf), many_facets)};
  for (std::size_t i = 0; i < facets.size(); ++i)
    facets[i] = (leaf[0] & Program::whole) != 0 ? static_cast<Word>(i) : leaf[header + i];
  TriangleColumns& triangles = cell.triangles();
  load(facets, triangles);
  HyperplaneId best = 0;
  int best_cost = -1;
  for (const Word candidate : facets) {
    const HyperplaneId id = mesh_.facets[candidate].plane.id();
    const auto h = cell.table().rounded(id);
    const double reach = reach_of_points_on(h);
    const auto sides = triangles.sides(h, -reach, reach);
    int cut = 0, negative = 0, positive = 0;
    for (std::size_t i = 0; i < facets.size(); ++i) {
      unsigned side = sides[i];
      if ((side & TriangleColumns::between) != 0)
        side |= sides_of_near_corners(mesh_.facets[facets[i]], mesh_.facets[candidate], h, reach);
      const int below = (side & TriangleColumns::below) != 0 ? 1 : 0,
                above = (side & TriangleColumns::above) != 0 ? 1 : 0;
      cut += below & above;
      negative += below;
      positive += above;
    }
    const int cost = 4 * cut + std::abs(negative - positive) + 1;
    if (best_cost < 0 || cost < best_cost) {
      best_cost = cost;
      best = id;
    }
  }
  return best;
}

/// The sides of those corners of a facet that are near another one's plane and not known to be on it, as far
/// as rounded numbers tell.
unsigned MeshProducer::sides_of_near_corners(const Mesh::Facet& facet, const Mesh::Facet& other,
                                             const geometry::Hyperplane<3>& plane, double reach) const {
  unsigned sides = 0;
  for (const std::uint32_t corner : facet.corners) {
    if (std::ranges::find(other.corners, corner) != other.corners.end())
      continue;  // as nearly all that are near
    const double value = plane.at(mesh_.points[corner]);
    if (std::fabs(value) > reach || is_on(corner, other.plane.id())) continue;
    sides |= value < 0 ? geometry::TriangleColumns::below : geometry::TriangleColumns::above;
  }
  return sides;
}

}  // namespace bsp2::dataflow
