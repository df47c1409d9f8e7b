#include "bsp2/dataflow/mesh_producer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;
using geometry::OrientedHyperplane;
using geometry::Position;

namespace {

using Point = std::array<double, 3>;
/// Above so many facets, space is cut between them rather than along one of them.
constexpr std::size_t many_facets = 24;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// Sign of the determinant of three vectors whose entries are off by at most `error`; 0 where it is uncertain.
int sign_of_determinant(const Point& u, const Point& v, const Point& w, double error) {
  const double x = u[0] * (v[1] * w[2] - v[2] * w[1]), y = u[1] * (v[2] * w[0] - v[0] * w[2]), z = u[2] * (v[0] * w[1] - v[1] * w[0]);
  const auto reach = [](const Point& p) { return std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])}); };
  const double a = reach(u), b = reach(v), c = reach(w);
  const double bound = 6 * error * (a * b + b * c + c * a) * 1.01 + 12 * 0x1p-52 * a * b * c + 6 * error * error * (a + b + c + error);
  const double value = x + y + z;
  return value > bound ? 1 : value < -bound ? -1 : 0;
}

/// How the winding number changes from p to q across a facet: -1, 0, +1, or nothing if rounding leaves it open.
std::optional<int> crossing(const Point& p, const Point& q, const Point& a, const Point& b, const Point& c, double error) {
  const Point pa = minus(a, p), pb = minus(b, p), pc = minus(c, p), pq = minus(q, p);
  const Point qa = minus(a, q), qb = minus(b, q), qc = minus(c, q);
  const int p_side = sign_of_determinant(pa, pb, pc, error), q_side = sign_of_determinant(qa, qb, qc, error);
  if (p_side != 0 && p_side == q_side) return 0;
  const int s1 = sign_of_determinant(pq, pa, pb, error), s2 = sign_of_determinant(pq, pb, pc, error), s3 = sign_of_determinant(pq, pc, pa, error);
  if ((s1 > 0 || s2 > 0 || s3 > 0) && (s1 < 0 || s2 < 0 || s3 < 0)) return 0;  // the line misses the facet
  if (p_side == 0 || q_side == 0 || s1 == 0 || s2 == 0 || s3 == 0) return std::nullopt;
  // Seen from outside the corners turn counter-clockwise: the determinant of a facet seen from outside is negative.
  return p_side < 0 ? 1 : -1;
}

void put_point(std::vector<Word>& out, std::size_t at, const Point& point) {
  for (int i = 0; i < 3; ++i) {
    const auto bits = std::bit_cast<std::uint64_t>(point[i]);
    out[at + 2 * i] = static_cast<Word>(bits);
    out[at + 2 * i + 1] = static_cast<Word>(bits >> 32);
  }
}

Point get_point(const Word* words) {
  Point point;
  for (int i = 0; i < 3; ++i) point[i] = std::bit_cast<double>(words[2 * i] | std::uint64_t{words[2 * i + 1]} << 32);
  return point;
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

Label MeshProducer::ask(const Word* leaf, CellView<3>& cell, std::vector<Word>& out) const {
  const bool whole = (leaf[0] & Program::whole) != 0;
  if (cell.quick() && whole && cell.extent().contains(producer_)) {
    out.insert(out.end(), leaf, leaf + Program::header);
    return Label::fuzzy;
  }
  const std::size_t begin = out.size();
  out.insert(out.end(), {leaf[0] & ~Program::whole, 0, leaf[2]});
  out.resize(begin + header, 0);
  for_each_facet(leaf, [&](Word facet) {
    if (may_meet(mesh_.facets[facet], cell)) out.push_back(facet);
  });
  std::optional<Reference> reference = reference_of(leaf);
  if (!reference || !is_inside(reference->point, cell.cell())) reference = new_reference(leaf, cell);
  if (out.size() == begin + header)
    return (reference ? reference->winding : winding_without_reference(cell)) != 0 ? Label::in : Label::out;
  if (reference) {
    out[begin + at_flag] = 1;
    put_point(out, begin + at_point, reference->point);
    out[begin + at_winding] = static_cast<Word>(reference->winding);
  }
  return Label::fuzzy;
}

/// False only where the facet certainly has no point inside the cell.
bool MeshProducer::may_meet(const Mesh::Facet& facet, CellView<3>& cell) const {
  const CellExtent<3>& extent = cell.extent();
  const Point *a = &mesh_.points[facet.corners[0]], *b = &mesh_.points[facet.corners[1]], *c = &mesh_.points[facet.corners[2]];
  for (int i = 0; i < 3; ++i) {
    if (std::min({(*a)[i], (*b)[i], (*c)[i]}) - mesh_.error > extent.upper[i]) return false;
    if (std::max({(*a)[i], (*b)[i], (*c)[i]}) + mesh_.error < extent.lower[i]) return false;
  }
  const auto h = cell.table().rounded(facet.plane.id());
  if (extent.position(h) != Position::crossing) return false;
  if (cell.quick()) return true;
  if (!cell.crosses(facet.plane.id())) return false;
  for (std::size_t side = 0; side < cell.cell().facet_count(); ++side) {
    const OrientedHyperplane plane = cell.cell().facet_hyperplane(side);
    if (corner_side(facet.corners[0], plane) >= 0 && corner_side(facet.corners[1], plane) >= 0 &&
        corner_side(facet.corners[2], plane) >= 0)
      return false;
  }
  return true;
}

/// Side of a mesh point; -1 also where it is uncertain. A point lies on the hyperplanes of the facets around it.
int MeshProducer::corner_side(std::uint32_t corner, OrientedHyperplane plane) const {
  const auto h = network_.table.rounded(plane.id());
  const double value = plane.flipped() ? -h.at(mesh_.points[corner]) : h.at(mesh_.points[corner]);
  const double bound = h.error + 2 * mesh_.error;
  if (value > bound) return 1;
  const auto first = mesh_.incident.begin() + mesh_.incident_offset[corner], last = mesh_.incident.begin() + mesh_.incident_offset[corner + 1];
  return std::binary_search(first, last, plane.id()) ? 0 : -1;
}

bool MeshProducer::is_inside(const Point& point, const geometry::Cell<3>& cell) const {
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    const OrientedHyperplane plane = cell.facet_hyperplane(facet);
    const auto h = network_.table.rounded(plane.id());
    const double value = plane.flipped() ? -h.at(point) : h.at(point);
    if (value > -2 * h.error) return false;
  }
  return true;
}

/// A whole mesh is seen from a point outside its bounds.
std::optional<MeshProducer::Reference> MeshProducer::reference_of(const Word* leaf) const {
  if ((leaf[0] & Program::whole) != 0) {
    Point outside;
    for (int i = 0; i < 3; ++i) outside[i] = producer_.upper[i] + (0.1 + 0.0137 * i) * (producer_.upper[i] - producer_.lower[i]);
    return Reference{outside, 0};
  }
  if (leaf[at_flag] == 0) return std::nullopt;
  return Reference{get_point(leaf + at_point), static_cast<std::int32_t>(leaf[at_winding])};
}

std::optional<std::int32_t> MeshProducer::winding_at(const Point& point, const Reference& from, const Word* leaf) const {
  std::int32_t winding = from.winding;
  bool certain = true;
  const double error = mesh_.error * 2 + 0x1p-52 * network_.table.radius();
  for_each_facet(leaf, [&](Word index) {
    const auto& corners = mesh_.facets[index].corners;
    const auto change = crossing(from.point, point, mesh_.points[corners[0]], mesh_.points[corners[1]], mesh_.points[corners[2]], error);
    if (change)
      winding += *change;
    else
      certain = false;
  });
  if (!certain) return std::nullopt;
  return winding;
}

/// A point inside the cell and the winding number there, by a segment from the parent's reference point that meets no
/// edge; several points are tried.
std::optional<MeshProducer::Reference> MeshProducer::new_reference(const Word* leaf, const CellView<3>& cell) const {
  const auto from = reference_of(leaf);
  if (!from) return std::nullopt;
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
    if (const auto winding = winding_at(point, *from, leaf)) return Reference{point, *winding};
  }
  return std::nullopt;
}

/// For cells so thin that no double is certainly inside: all facets are asked, along rays from the centre.
std::int32_t MeshProducer::winding_without_reference(const CellView<3>& cell) const {
  const Word whole[Program::header] = {Program::kind_leaf | Program::whole, Program::header, 0};
  std::minstd_rand random(54321);
  const double size = std::max({producer_.upper[0] - producer_.lower[0], producer_.upper[1] - producer_.lower[1], producer_.upper[2] - producer_.lower[2]});
  for (int attempt = 0; attempt < 64; ++attempt) {
    Point far;
    for (int i = 0; i < 3; ++i) far[i] = producer_.upper[i] + size * (0.1 + static_cast<double>(random() % 1000) * 1e-3);
    if (const auto winding = winding_at(cell.extent().centre, {far, 0}, whole)) return *winding;
  }
  return 0;
}

Advice MeshProducer::advise(const Word* leaf, CellView<3>& cell) const {
  const auto parting = median(leaf, cell);
  return {geometry::oriented(parting ? *parting : best_plane(leaf))};
}

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
      const double a = mesh_.points[corners[0]][axis], b = mesh_.points[corners[1]][axis], c = mesh_.points[corners[2]][axis];
      low.push_back(std::min({a, b, c}));
      high.push_back(std::max({a, b, c}));
    });
    std::vector<double> middle(high);
    std::nth_element(middle.begin(), middle.begin() + static_cast<std::ptrdiff_t>(count / 2), middle.end());
    const double value = middle[count / 2];
    const auto below = std::count_if(high.begin(), high.end(), [&](double x) { return x <= value; });
    const auto above = std::count_if(low.begin(), low.end(), [&](double x) { return x >= value; });
    // Progress on both sides, else a fan of facets around one point would be halved for ever.
    if (below * 5 < static_cast<std::ptrdiff_t>(count) || above * 5 < static_cast<std::ptrdiff_t>(count)) continue;
    const auto& table = cell.table();
    const HyperplaneId id = table.axis_hyperplane(axis, table.axis_position(axis, value));
    return cell.crosses(id) ? std::optional(id) : std::nullopt;
  }
  return std::nullopt;
}

HyperplaneId MeshProducer::best_plane(const Word* leaf) const {
  std::vector<Word> facets;
  for_each_facet(leaf, [&](Word facet) { facets.push_back(facet); });
  if (facets.size() > many_facets) facets.resize(many_facets);
  HyperplaneId best = 0;
  long best_cost = -1;
  for (const Word candidate : facets) {
    const OrientedHyperplane plane = mesh_.facets[candidate].plane;
    const auto h = network_.table.rounded(plane.id());
    long cut = 0, negative = 0, positive = 0;
    for (const Word other : facets) {
      int low = 0, high = 0;
      for (const std::uint32_t corner : mesh_.facets[other].corners) {
        const double value = h.at(mesh_.points[corner]);
        const auto first = mesh_.incident.begin() + mesh_.incident_offset[corner], last = mesh_.incident.begin() + mesh_.incident_offset[corner + 1];
        if (std::binary_search(first, last, plane.id())) continue;
        (value < 0 ? low : high) = 1;
      }
      cut += low & high;
      negative += low;
      positive += high;
    }
    const long cost = 4 * cut + std::labs(negative - positive) + 1;
    if (best_cost < 0 || cost < best_cost) {
      best_cost = cost;
      best = plane.id();
    }
  }
  return best;
}

}  // namespace bsp2::dataflow
