#include "bsp2/geometry/surface/contact.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "bsp2/geometry/surface/exact_points.hpp"
#include "surface/plane_skin.hpp"

// Notation. On one hyperplane h, the facets of cells on its negative side, N_i, have disjoint interiors, and
// so have those on its positive side, P_j. The cells touch in N_i * P_j. The skin that looks to the positive
// side is the sum of the N_i minus that of all N_i * P_j; its boundary is the same sum of boundaries, which
// is all that is ever computed: what edges do not cancel bound the merged faces. The skin that looks to the
// negative side likewise with the P_j.

namespace bsp2::geometry {
namespace {

using Corner = FacetSet::Corner;

struct Facet {
  std::uint32_t number;  // in the set
  std::uint32_t first_corner, corner_count;
  std::array<double, 3> low, high;
  double area;
  bool reversed;  // the corners turn the wrong way round
  bool covered;   // all of it, by one facet of the other side
  std::uint32_t first_exact;
};

/// Twice the area vector.
template <typename Position>
std::array<double, 3> newell(std::size_t count, const Position& at) {
  std::array<double, 3> sum{};
  const std::array<double, 3>& o = at(0);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const std::array<double, 3>&p = at(i), &q = at(i + 1);
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      sum[k] += (p[l] - o[l]) * (q[m] - o[m]) - (p[m] - o[m]) * (q[l] - o[l]);
    }
  }
  return sum;
}

double length(const std::array<double, 3>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// A hash of a set of corners, in whatever order they are.
std::uint64_t hash_of(std::span<const Corner> corners) {
  std::uint64_t sum = 0;
  for (const Corner& corner : corners) {
    std::uint64_t hash = 0;
    for (const double x : corner.x) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(x + 0.0)) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 31;
    }
    sum += hash;
  }
  return sum;
}

}  // namespace

struct FacetMatcher::Implementation {
  Implementation(const HyperplaneTable<3>& t, bool interfaces)
      : table(t), has_interfaces(interfaces), exact(t), plane_skin(exact) {}

  const HyperplaneTable<3>& table;
  const bool has_interfaces;
  ExactPoints exact;
  PlaneSkin plane_skin;

  // Of the hyperplane at hand.
  const FacetSet* set = nullptr;
  HyperplaneId plane = 0;
  std::vector<Contact>* contacts = nullptr;
  std::array<std::vector<Facet>, 2> facets;  // N and P; those that are not known to be covered
  std::vector<PlaneCorner> exact_corners;    // of all of these
  std::vector<std::pair<std::uint64_t, std::uint32_t>> hashes;
  std::vector<int> signs;
  std::array<std::vector<std::uint32_t>, 2> order, active;  // of the sweep: numbers in `facets`
  std::vector<PlaneCorner> clipped, scratch;

  std::span<const Corner> corners_of(const Facet& facet) const {
    return {set->corners.data() + facet.first_corner, facet.corner_count};
  }
  const FacetSet::Facet& source(const Facet& facet) const { return set->facets[facet.number]; }

  void match(const FacetSet& facet_set, std::vector<Contact>* found, Skin* skin) {
    set = &facet_set;
    plane = facet_set.hyperplane;
    contacts = found;
    exact_corners.clear();
    plane_skin.clear(plane);
    load();
    cancel_equal_facets();
    const bool overlay = !facets[0].empty() && !facets[1].empty();
    if (!overlay && skin == nullptr) return;
    for (auto& side : facets)
      for (Facet& facet : side) find_exact_corners(facet);
    if (overlay) overlay_facets(skin != nullptr);
    if (skin == nullptr) return;
    for (int side = 0; side < 2; ++side)
      for (const Facet& facet : facets[side])
        if (!facet.covered)
          plane_skin.add_loop(polygon(facet), plane_skin.face_of(side == 1, source(facet).owner), true);
    plane_skin.append_to(*skin);
  }

  void load() {
    facets[0].clear();
    facets[1].clear();
    std::uint32_t begin = 0;
    for (std::uint32_t i = 0; i < set->facets.size(); ++i) {
      const std::uint32_t end = set->facets[i].end;
      Facet facet{i, begin, end - begin, set->corners[begin].x, set->corners[begin].x, 0, false, false, 0};
      begin = end;
      const auto corners = corners_of(facet);
      for (const Corner& corner : corners)
        for (int k = 0; k < 3; ++k) {
          facet.low[k] = std::min(facet.low[k], corner.x[k]);
          facet.high[k] = std::max(facet.high[k], corner.x[k]);
        }
      const auto vector =
          newell(corners.size(), [&](std::size_t k) -> const std::array<double, 3>& { return corners[k].x; });
      facet.area = length(vector) / 2;
      facet.reversed = turns_backwards(facet, vector);
      facets[set->facets[i].positive ? 1 : 0].push_back(facet);
    }
  }

  /// A cell that is as thin as its corners are rounded may have been written inside out.
  bool turns_backwards(const Facet& facet, const std::array<double, 3>& twice_area) {
    const auto normal = table.rounded(plane).normal;
    const double sign = source(facet).positive ? -1 : 1;
    const double turn =
        sign * (normal[0] * twice_area[0] + normal[1] * twice_area[1] + normal[2] * twice_area[2]);
    double extent = 0;
    for (int k = 0; k < 3; ++k) extent += facet.high[k] - facet.low[k];
    if (turn > extent * table.radius() * (16 * largest_vertex_error))
      return false;  // more than corners that are off may make of it
    const double sine = turn_of_corner(facet);
    return sine != 0 ? sine < 0 : exact_turn(facet) < 0;
  }

  /// The sine of the turn at the corner whose edges differ most in direction, from the normals alone: it
  /// knows nothing of how close the corners are. Positive if the corners turn the right way round, 0 if
  /// rounding leaves that open.
  double turn_of_corner(const Facet& facet) {
    const auto corners = corners_of(facet);
    const std::array<double, 3> n = outward_normal(oriented(plane, source(facet).positive));
    double largest = 0, error = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      // Along the edge on a, on the way that has the facet on its left, b rises.
      const OrientedHyperplane on_a = corners[i].across,
                               on_b = corners[i + 1 < corners.size() ? i + 1 : 0].across;
      const std::array<double, 3> a = outward_normal(on_a), b = outward_normal(on_b);
      const double sine = b[0] * (n[1] * a[2] - n[2] * a[1]) + b[1] * (n[2] * a[0] - n[0] * a[2]) +
                          b[2] * (n[0] * a[1] - n[1] * a[0]);
      if (std::fabs(sine) <= std::fabs(largest)) continue;
      largest = sine;
      error = table.rounded(on_a.id()).error + table.rounded(on_b.id()).error;
    }
    // A normal is off by its hyperplane's error at the rim of the model over the model's radius.
    const double bound = 4 * (error + table.rounded(plane).error) / table.radius() + 0x1p-48;
    return std::fabs(largest) > bound ? largest : 0;
  }
  std::array<double, 3> outward_normal(OrientedHyperplane outward) const {
    auto normal = table.rounded(outward.id()).normal;
    if (outward.flipped())
      for (double& x : normal) x = -x;
    return normal;
  }

  int exact_turn(const Facet& facet) {
    const auto corners = corners_of(facet);
    const std::size_t n = corners.size();
    const auto vertex = [&](std::size_t i) {
      return canonical_vertex(table, {plane, corners[(i + n - 1) % n].across.id(), corners[i].across.id()});
    };
    return PlaneFrame(exact, oriented(plane, source(facet).positive))
        .orientation(vertex(0), vertex(1), vertex(2));
  }

  // --- facets that are equal ---

  /// Most facets are those of two cells that one split made and none changed since.
  void cancel_equal_facets() {
    if (facets[0].empty() || facets[1].empty()) return;
    hashes.clear();
    for (std::uint32_t i = 0; i < facets[0].size(); ++i)
      hashes.emplace_back(hash_of(corners_of(facets[0][i])), i);
    std::sort(hashes.begin(), hashes.end());
    std::vector<bool> covered(facets[0].size(), false);
    std::erase_if(facets[1], [&](const Facet& positive) {
      const std::uint64_t hash = hash_of(corners_of(positive));
      for (auto at = std::lower_bound(hashes.begin(), hashes.end(), std::pair(hash, 0u));
           at != hashes.end() && at->first == hash; ++at) {
        const Facet& negative = facets[0][at->second];
        if (covered[at->second] || is_interface(negative, positive) || !are_equal(negative, positive))
          continue;
        covered[at->second] = true;
        add_contact(negative, positive, negative.area);
        return true;
      }
      return false;
    });
    std::size_t i = 0;
    std::erase_if(facets[0], [&](const Facet&) { return covered[i++]; });
  }

  [[nodiscard]] bool is_interface(const Facet& negative, const Facet& positive) const {
    return has_interfaces && source(negative).owner != source(positive).owner;
  }

  /// Corner by corner, the one the other way round: rounded coordinates first, which prove nothing, then each
  /// edge on the other's plane.
  bool are_equal(const Facet& negative, const Facet& positive) {
    const auto a = corners_of(negative), b = corners_of(positive);
    const std::size_t n = a.size();
    if (b.size() != n || negative.reversed != positive.reversed) return false;
    std::size_t first = 0;
    while (first < n && b[first].x != a[0].x) ++first;
    if (first == n) return false;
    for (std::size_t i = 0; i < n; ++i)
      if (b[(first + n - i) % n].x != a[i].x) return false;
    for (std::size_t i = 0; i < n; ++i) {
      const HyperplaneId own = a[i].across.id(), other = b[(first + n - i - 1) % n].across.id();
      if (own == other) continue;
      const HyperplaneId before = a[(i + n - 1) % n].across.id(), after = a[(i + 1) % n].across.id();
      if (exact.side(canonical_vertex(table, {plane, before, own}), other) != 0 ||
          exact.side(canonical_vertex(table, {plane, own, after}), other) != 0)
        return false;
    }
    return true;
  }

  void add_contact(const Facet& negative, const Facet& positive, double area) {
    if (contacts == nullptr) return;
    const auto &n = source(negative), &p = source(positive);
    contacts->push_back({{n.cell, p.cell}, {n.number, p.number}, plane, area});
  }

  // --- facets that are not ---

  void find_exact_corners(Facet& facet) {
    const auto corners = corners_of(facet);
    const std::size_t n = corners.size();
    facet.first_exact = static_cast<std::uint32_t>(exact_corners.size());
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at =
          facet.reversed ? n - 1 - i : i;  // backwards, corner `at` is followed by the edge before it
      const HyperplaneId before = corners[(at + n - 1) % n].across.id(), after = corners[at].across.id();
      exact_corners.push_back({plane_skin.points().find(before, after), facet.reversed ? before : after});
    }
  }
  std::span<const PlaneCorner> polygon(const Facet& facet) const {
    return {exact_corners.data() + facet.first_exact, facet.corner_count};
  }
  const Vertex<3>& vertex(const PlaneCorner& corner) const {
    return plane_skin.points().vertices()[corner.point];
  }

  void overlay_facets(bool with_skin) {
    // Sweep along the axis in which the facets extend farthest.
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const auto& side : facets)
      for (const Facet& facet : side)
        for (int k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], facet.low[k]);
          high[k] = std::max(high[k], facet.high[k]);
        }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    for (int side = 0; side < 2; ++side) {
      order[side].clear();
      active[side].clear();
      for (std::uint32_t i = 0; i < facets[side].size(); ++i) order[side].push_back(i);
      std::sort(order[side].begin(), order[side].end(), [&](std::uint32_t a, std::uint32_t b) {
        return facets[side][a].low[axis] < facets[side][b].low[axis];
      });
    }
    std::array<std::size_t, 2> next{};
    while (next[0] < order[0].size() || next[1] < order[1].size()) {
      const int side = next[1] >= order[1].size() ||
                               (next[0] < order[0].size() && facets[0][order[0][next[0]]].low[axis] <=
                                                                 facets[1][order[1][next[1]]].low[axis])
                           ? 0
                           : 1;
      const std::uint32_t entering = order[side][next[side]++];
      Facet& facet = facets[side][entering];
      std::erase_if(active[1 - side], [&](std::uint32_t other) {
        return facets[1 - side][other].covered ||
               facets[1 - side][other].high[axis] + slack() < facet.low[axis];
      });
      for (const std::uint32_t other : active[1 - side]) {
        if (facet.covered) break;
        Facet& opposite = facets[1 - side][other];
        if (boxes_meet(facet, opposite))
          side == 0 ? meet(facet, opposite, with_skin) : meet(opposite, facet, with_skin);
      }
      active[side].push_back(entering);
    }
  }

  /// Boxes are rounded: one corner may be in two places that are twice its error apart.
  double slack() const { return table.radius() * (4 * largest_vertex_error); }
  bool boxes_meet(const Facet& a, const Facet& b) const {
    for (int k = 0; k < 3; ++k)
      if (a.low[k] > b.high[k] + slack() || b.low[k] > a.high[k] + slack()) return false;
    return true;
  }

  enum class Overlap { nothing, some, all };

  /// How much of the polygon is on the inner side of the facet's edges; `some` where no single edge tells.
  Overlap overlap(const Facet& facet, std::span<const PlaneCorner> polygon) {
    bool has_outer = false;
    for (const Corner& corner : corners_of(facet)) {
      const auto rounded = table.rounded(corner.across.id());
      bool has_inner = false;
      for (const PlaneCorner& c : polygon) {
        const int side = side_of(c.point, corner.across, rounded);
        has_inner = has_inner || side < 0;
        has_outer = has_outer || side > 0;
        if (has_inner && has_outer) break;
      }
      if (!has_inner) return Overlap::nothing;
    }
    return has_outer ? Overlap::some : Overlap::all;
  }
  /// Remembers what it finds out about points that are on it.
  int side_of(std::uint32_t point, OrientedHyperplane inside, const Hyperplane<3>& rounded) {
    const Vertex<3>& vertex = plane_skin.points().vertices()[point];
    const int side = exact.side(vertex, inside.id(), rounded);
    if (side == 0 && std::find(vertex.hyperplanes.begin(), vertex.hyperplanes.end(), inside.id()) ==
                         vertex.hyperplanes.end())
      plane_skin.add_incidence(point, inside.id());
    return inside.flipped() ? -side : side;
  }

  void meet(Facet& negative, Facet& positive, bool with_skin) {
    const Overlap of_negative = overlap(positive, polygon(negative));
    if (of_negative == Overlap::nothing) return;
    const Overlap of_positive = overlap(negative, polygon(positive));
    if (of_positive == Overlap::nothing) return;
    negative.covered = of_negative == Overlap::all;
    positive.covered = of_positive == Overlap::all;
    const std::int32_t owner_of_negative = source(negative).owner, owner_of_positive = source(positive).owner;
    if (negative.covered || positive.covered) {
      add_contact(negative, positive, negative.covered ? negative.area : positive.area);
      if (!with_skin) return;
      if (is_interface(negative, positive)) {
        const std::uint32_t face = plane_skin.face_of(false, owner_of_negative, owner_of_positive);
        plane_skin.add_loop(polygon(negative.covered ? negative : positive), face, negative.covered);
      }
      // The smaller one is gone; from the larger one it is taken away, which looks at it from the other side.
      if (!positive.covered)
        plane_skin.add_loop(polygon(negative), plane_skin.face_of(true, owner_of_positive), true);
      if (!negative.covered)
        plane_skin.add_loop(polygon(positive), plane_skin.face_of(false, owner_of_negative), true);
      return;
    }
    clipped.assign(polygon(negative).begin(), polygon(negative).end());
    for (const Corner& corner : corners_of(positive)) clip(corner.across);
    const auto twice_area = newell(
        clipped.size(), [&](std::size_t i) -> const std::array<double, 3>& { return vertex(clipped[i]).x; });
    add_contact(negative, positive, length(twice_area) / 2);
    if (!with_skin) return;
    plane_skin.add_loop(clipped, plane_skin.face_of(false, owner_of_negative), false);
    plane_skin.add_loop(clipped, plane_skin.face_of(true, owner_of_positive), true);
    if (is_interface(negative, positive))
      plane_skin.add_loop(clipped, plane_skin.face_of(false, owner_of_negative, owner_of_positive), true);
  }

  /// Keeps what of `clipped` is on the negative side. @pre something is.
  /// Source: Sutherland, Hodgman, "Reentrant polygon clipping" (1974).
  void clip(OrientedHyperplane inside) {
    const auto rounded = table.rounded(inside.id());
    signs.clear();
    bool cut = false;
    for (const PlaneCorner& corner : clipped) {
      signs.push_back(side_of(corner.point, inside, rounded));
      cut = cut || signs.back() > 0;
    }
    if (!cut) return;
    scratch.clear();
    for (std::size_t i = 0; i < clipped.size(); ++i) {
      const int here = signs[i], next = signs[i + 1 < signs.size() ? i + 1 : 0];
      if (here <= 0)
        scratch.push_back({clipped[i].point, here == 0 && next > 0 ? inside.id() : clipped[i].across});
      if (here * next < 0)
        scratch.push_back({plane_skin.points().find(clipped[i].across, inside.id()),
                           here < 0 ? inside.id() : clipped[i].across});
    }
    std::swap(clipped, scratch);
  }
};

FacetMatcher::FacetMatcher(const HyperplaneTable<3>& table, bool with_interfaces)
    : implementation_(std::make_unique<Implementation>(table, with_interfaces)) {}
FacetMatcher::~FacetMatcher() = default;

void FacetMatcher::match(const FacetSet& facets, std::vector<Contact>* contacts, Skin* skin) {
  implementation_->match(facets, contacts, skin);
}

}  // namespace bsp2::geometry
