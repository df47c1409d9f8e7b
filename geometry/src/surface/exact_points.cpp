#include "bsp2/geometry/surface/exact_points.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

constexpr std::array<double, 3> sorting_direction{0.6180339887498949, 0.5291502622129181, 0.5814370241526847};

std::array<HyperplaneId, 3> sorted(std::array<HyperplaneId, 3> ids) {
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Holds a determinant of three homogeneous points: two coordinates of at most 1520 bits each and a weight of
/// 1400 (exact.hpp).
using WideInteger = FixedInteger<4608>;

[[gnu::noinline]] WideInteger widen(const ExactInteger<3>& value) {
  return WideInteger(value);
}  // inlined, it confuses GCC 12's bounds check

}  // namespace

double place_along(const std::array<double, 3>& x) {
  return sorting_direction[0] * x[0] + sorting_direction[1] * x[1] + sorting_direction[2] * x[2];
}

void PointSet::clear() {
  vertices.clear();
  offset.assign(1, 0);
  planes.clear();
}

void PointSet::add(const Vertex<3>& vertex, std::span<const HyperplaneId> known) {
  vertices.push_back(vertex);
  planes.insert(planes.end(), known.begin(), known.end());
  offset.push_back(static_cast<std::uint32_t>(planes.size()));
}

Vertex<3> canonical_vertex(const HyperplaneTable<3>& table, std::array<HyperplaneId, 3> ids) {
  std::uint64_t unused = 0;
  return make_vertex<3>(table, sorted(ids), unused);
}

const ExactCovector<3>& ExactCoordinates::covector(HyperplaneId id) {
  if (covectors_.empty()) covectors_.resize(kept);
  Covector& entry = covectors_[(id * 0x9e3779b1u >> 12) % kept];
  if (entry.id != id) {
    entry.value = table_.exact(id);
    divide_by_common_power_of_two(entry.value);
    entry.id = id;
  }
  return entry.value;
}

const ExactCovector<3>& ExactCoordinates::point(const Vertex<3>& vertex) {
  const auto& ids = vertex.hyperplanes;
  if (points_.empty()) points_.resize(kept);
  Point& entry = points_[((ids[0] * 0x9e3779b1u ^ ids[1] * 0x85ebca6bu ^ ids[2] * 0xc2b2ae35u) >> 12) % kept];
  if (entry.ids != ids) {
    std::array<ExactCovector<3>, 3> rows;
    for (int i = 0; i < 3; ++i) rows[i] = covector(ids[i]);
    entry.value = meeting_point<3>(rows);
    entry.ids = ids;
  }
  return entry.value;
}

int ExactPoints::exact_side(const Vertex<3>& vertex, HyperplaneId id) {
  const auto& point = coordinates_.point(vertex);
  const auto& h = coordinates_.covector(id);
  ExactInteger<3> sum = h[3] * point[3];
  for (int i = 0; i < 3; ++i)
    if (!h[i].is_zero() && !point[i].is_zero()) sum += h[i] * point[i];
  return sum.sign() * point[3].sign();
}

int ExactPoints::side(const Vertex<3>& vertex, HyperplaneId id, const Hyperplane<3>& rounded) {
  const double value = rounded.at(vertex.x), bound = rounded.error + vertex.error * (1 + 0x1p-40);
  if (value > bound) return 1;
  if (value < -bound) return -1;
  for (const HyperplaneId own : vertex.hyperplanes)
    if (own == id) return 0;
  return exact_side(vertex, id);
}

int ExactPoints::side(const PointSet& points, std::size_t point, HyperplaneId id,
                      const Hyperplane<3>& rounded) {
  const Vertex<3>& vertex = points.vertices[point];
  const double value = rounded.at(vertex.x), bound = rounded.error + vertex.error * (1 + 0x1p-40);
  if (value > bound) return 1;
  if (value < -bound) return -1;
  return points.is_known_on(point, id) ? 0 : exact_side(vertex, id);
}

bool ExactPoints::is_known(std::uint32_t list, HyperplaneId plane) const {
  for (; list != none; list = known_[list].next)
    if (known_[list].plane == plane) return true;
  return false;
}

/// Two points are equal if one is on three independent hyperplanes of the other.
bool ExactPoints::equals(const PointSet& points, std::uint32_t point, const Cluster& cluster) {
  const Vertex<3>&a = points.vertices[point], &b = points.vertices[cluster.point];
  const double reach = (a.error + b.error) * (1 + 0x1p-40);
  for (int k = 0; k < 3; ++k)
    if (std::fabs(a.x[k] - b.x[k]) > reach) return false;
  for (const HyperplaneId plane : a.hyperplanes) {
    const bool is_on =
        cluster.known == none ? points.is_known_on(cluster.point, plane) : is_known(cluster.known, plane);
    if (!is_on && side(b, plane) != 0) return false;
  }
  return true;
}

namespace {

/// Sorts by the upper half: three times by eleven bits of it at most.
void sort_by_upper_half(std::vector<std::uint64_t>& items) {
  constexpr unsigned bits = 11;
  std::vector<std::uint64_t> sorted(items.size());
  for (unsigned shift = 32; shift < 64; shift += bits) {
    std::array<std::uint32_t, (1U << bits) + 1> begin{};
    const auto digit = [&](std::uint64_t item) { return item >> shift & ((1U << bits) - 1); };
    for (const std::uint64_t item : items) ++begin[digit(item) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const std::uint64_t item : items) sorted[begin[digit(item)]++] = item;
    items.swap(sorted);
  }
}

}  // namespace

/// Points along a direction in which different points hardly ever agree. By name where they do: the order in
/// which the points came shall not matter.
void ExactPoints::sort_keys(const PointSet& points) {
  keys_.clear();
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    keys_.emplace_back(place_along(points.vertices[i].x), i);
    low = std::min(low, keys_.back().first);
    high = std::max(high, keys_.back().first);
  }
  const auto is_before = [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first
                              : points.vertices[a.second].hyperplanes < points.vertices[b.second].hyperplanes;
  };
  constexpr std::size_t few = 4096;
  if (keys_.size() < few || !(high / 2 - low / 2 > 0)) {
    std::sort(keys_.begin(), keys_.end(), is_before);
    return;
  }
  // Roughly by counting first, then those that this does not tell apart.
  std::vector<std::uint64_t> items(keys_.size());
  const double half = high / 2 - low / 2;
  for (const auto& [key, i] : keys_)
    items[i] =
        std::uint64_t{static_cast<std::uint32_t>((key / 2 - low / 2) / half * 0x0.ffffffffp32)} << 32 | i;
  sort_by_upper_half(items);
  std::vector<std::pair<double, std::uint32_t>> sorted(keys_.size());
  for (std::size_t k = 0; k < items.size(); ++k) sorted[k] = keys_[static_cast<std::uint32_t>(items[k])];
  keys_.swap(sorted);
  for (std::size_t begin = 0, end = 0; begin < items.size(); begin = end) {
    while (end < items.size() && items[end] >> 32 == items[begin] >> 32) ++end;
    if (end - begin > 1)
      std::sort(keys_.begin() + static_cast<std::ptrdiff_t>(begin),
                keys_.begin() + static_cast<std::ptrdiff_t>(end), is_before);
  }
}

/// @return of each point its cluster.
std::vector<std::uint32_t> ExactPoints::find_clusters(const PointSet& points) {
  sort_keys(points);
  clusters_.clear();
  clusters_.reserve(points.size());
  known_.clear();
  double largest_error = 0;
  for (const Vertex<3>& vertex : points.vertices) largest_error = std::max(largest_error, vertex.error);
  std::vector<std::uint32_t> map(points.size());
  const double slack = 0x1p-49 * table_.radius();
  // A cluster's key is that of its first member, which is at most its error below the exact one: keys ascend.
  for (const auto& [key, i] : keys_) {
    const Vertex<3>& vertex = points.vertices[i];
    const double lowest = key - vertex.error - largest_error - slack;
    std::uint32_t found = none;
    for (std::size_t k = clusters_.size(); k-- > 0 && clusters_[k].key >= lowest && found == none;)
      if (vertex.hyperplanes == points.vertices[clusters_[k].point].hyperplanes ||
          equals(points, i, clusters_[k]))
        found = static_cast<std::uint32_t>(k);
    if (found == none) {
      found = static_cast<std::uint32_t>(clusters_.size());
      clusters_.push_back({i, none, key});
    } else {
      merge(points, i, clusters_[found]);
    }
    map[i] = found;
  }
  return map;
}

void ExactPoints::merge(const PointSet& points, std::uint32_t point, Cluster& cluster) {
  const auto take = [&](std::uint32_t member) {
    for (const HyperplaneId plane : points.planes_of(member))
      if (!is_known(cluster.known, plane)) {
        known_.push_back({plane, cluster.known});
        cluster.known = static_cast<std::uint32_t>(known_.size() - 1);
      }
  };
  if (cluster.known == none) take(cluster.point);
  take(point);
  if (points.vertices[point].hyperplanes < points.vertices[cluster.point].hyperplanes) cluster.point = point;
}

/// With its planes in their order, each once, whatever order they were found in.
void ExactPoints::add_united(const PointSet& points, const Cluster& cluster) {
  std::vector<HyperplaneId>& planes = united_.planes;
  const auto begin = static_cast<std::ptrdiff_t>(planes.size());
  if (cluster.known == none) {
    const auto own = points.planes_of(cluster.point);
    planes.insert(planes.end(), own.begin(), own.end());
  }
  for (std::uint32_t at = cluster.known; at != none; at = known_[at].next) planes.push_back(known_[at].plane);
  if (std::adjacent_find(planes.begin() + begin, planes.end(), std::greater_equal<>()) != planes.end()) {
    std::sort(planes.begin() + begin, planes.end());
    planes.erase(std::unique(planes.begin() + begin, planes.end()), planes.end());
  }
  united_.vertices.push_back(points.vertices[cluster.point]);
  united_.offset.push_back(static_cast<std::uint32_t>(planes.size()));
}

std::vector<std::uint32_t> ExactPoints::unify(PointSet& points) {
  std::vector<std::uint32_t> map = find_clusters(points);
  united_.clear();
  for (const Cluster& cluster : clusters_) add_united(points, cluster);
  std::swap(points, united_);
  return map;
}

std::vector<std::uint32_t> ExactPoints::unify_in_order(PointSet& points, std::vector<std::uint32_t>& rank) {
  std::vector<std::uint32_t> map = find_clusters(points);
  const std::vector<std::uint32_t> rank_of_cluster = order_clusters(points);
  if (clusters_.size() == points.size()) {  // all are different
    rank.resize(map.size());
    for (std::uint32_t point = 0; point < map.size(); ++point) {
      rank[point] = rank_of_cluster[map[point]];
      map[point] = point;
    }
    return map;
  }
  std::vector<std::uint32_t> place(clusters_.size(), none);
  rank.clear();
  united_.clear();
  for (std::uint32_t& cluster : map) {
    if (place[cluster] == none) {
      place[cluster] = static_cast<std::uint32_t>(rank.size());
      rank.push_back(rank_of_cluster[cluster]);
      add_united(points, clusters_[cluster]);
    }
    cluster = place[cluster];
  }
  std::swap(points, united_);
  return map;
}

/// @return the rank of each cluster. They were found in the order of whichever name came first, which is
/// nearly that of the names that stay.
std::vector<std::uint32_t> ExactPoints::order_clusters(const PointSet& points) {
  keys_.clear();
  for (std::uint32_t i = 0; i < clusters_.size(); ++i)
    keys_.emplace_back(place_along(points.vertices[clusters_[i].point].x), i);
  const auto is_before = [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    const Vertex<3>&u = points.vertices[clusters_[a.second].point],
          &v = points.vertices[clusters_[b.second].point];
    return u.x != v.x ? u.x < v.x : u.hyperplanes < v.hyperplanes;
  };
  if (!std::is_sorted(keys_.begin(), keys_.end(), is_before))
    std::sort(keys_.begin(), keys_.end(), is_before);
  std::vector<std::uint32_t> rank(keys_.size());
  for (std::uint32_t i = 0; i < keys_.size(); ++i) rank[keys_[i].second] = i;
  return rank;
}

namespace {

/// -1 or 1: which of two points comes first along the longest axis of a direction; 0 if their errors do not
/// tell.
int rounded_order(const Vertex<3>& a, const Vertex<3>& b, const std::array<double, 3>& direction) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(direction[k]) > std::fabs(direction[axis])) axis = k;
  const double difference = direction[axis] < 0 ? a.x[axis] - b.x[axis] : b.x[axis] - a.x[axis];
  const double bound = (a.error + b.error) * (1 + 0x1p-40);
  return difference > bound ? -1 : difference < -bound ? 1 : 0;
}

}  // namespace

bool ExactPoints::is_before(const PointSet& points, std::uint32_t a, std::uint32_t b, std::uint32_t v) {
  const Vertex<3>&va = points.vertices[a], &vb = points.vertices[b], &vv = points.vertices[v];
  const std::array<double, 3> direction{vv.x[0] - va.x[0], vv.x[1] - va.x[1], vv.x[2] - va.x[2]};
  double size = 0;
  for (const double d : direction) size = std::max(size, std::fabs(d));
  if (size > va.error + vv.error)  // the direction is known along its longest axis
    if (const int order = rounded_order(va, vb, direction)) return order < 0;
  // Seen from a, b is on v's side of a plane that crosses the line in a.
  for (const HyperplaneId plane : va.hyperplanes)
    if (const int s = side(points, v, plane)) return side(points, b, plane) == s;
  return false;  // cannot be: a's three planes have no line in common
}

int ExactPoints::axis_of_line(const PointSet& points, std::uint32_t a, std::uint32_t b) {
  const Vertex<3>&va = points.vertices[a], &vb = points.vertices[b];
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(va.x[k] - vb.x[k]) > std::fabs(va.x[axis] - vb.x[axis])) axis = k;
  return std::fabs(va.x[axis] - vb.x[axis]) > (va.error + vb.error) * (1 + 0x1p-40) ? axis : -1;
}

int ExactPoints::compare(const PointSet& points, std::uint32_t a, std::uint32_t b, int axis) {
  const Vertex<3>&va = points.vertices[a], &vb = points.vertices[b];
  const double difference = va.x[axis] - vb.x[axis], bound = (va.error + vb.error) * (1 + 0x1p-40);
  if (difference > bound) return 1;
  if (difference < -bound) return -1;
  const auto p = coordinates_.point(va);
  const auto& q = coordinates_.point(vb);
  const WideInteger value = widen(p[axis]) * widen(q[3]) - widen(q[axis]) * widen(p[3]);
  return value.sign() * p[3].sign() * q[3].sign();
}

bool ExactPoints::is_between(const PointSet& points, std::uint32_t u, std::uint32_t w, std::uint32_t v) {
  return is_before(points, u, w, v) && is_before(points, v, w, u);
}

// --- PlaneFrame ---

PlaneFrame::PlaneFrame(ExactPoints& exact, OrientedHyperplane outward)
    : coordinates_(exact.coordinates()), plane_(outward.id()) {
  const auto normal = exact.table().rounded(outward.id()).normal;
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(normal[k]) > std::fabs(normal[axis])) axis = k;
  u_ = (axis + 1) % 3;
  v_ = (axis + 2) % 3;
  if ((normal[axis] < 0) != outward.flipped()) std::swap(u_, v_);
}

int PlaneFrame::orientation(const Vertex<3>& a, const Vertex<3>& b, const Vertex<3>& c) const {
  const double bu = b.x[u_] - a.x[u_], bv = b.x[v_] - a.x[v_], cu = c.x[u_] - a.x[u_], cv = c.x[v_] - a.x[v_];
  const double left = bu * cv, right = bv * cu, determinant = left - right;
  // Each difference is off by the errors of its two points; the last term is for the rounding of all
  // operations.
  const double eb = 2 * (a.error + b.error), ec = 2 * (a.error + c.error);
  const double bound = (std::fabs(bu) + std::fabs(bv)) * ec + (std::fabs(cu) + std::fabs(cv)) * eb +
                       2 * eb * ec + 0x1p-50 * (std::fabs(left) + std::fabs(right));
  if (determinant > bound) return 1;
  if (determinant < -bound) return -1;
  std::array<std::array<WideInteger, 3>, 3> rows;
  int sign = 1;
  const std::array<const Vertex<3>*, 3> points{&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    const auto& point = coordinates_.point(*points[i]);
    rows[i] = {widen(point[u_]), widen(point[v_]), widen(point[3])};
    sign *= point[3].sign();
  }
  const auto minor = [&](int i, int j, int k, int l) -> WideInteger {
    return rows[i][k] * rows[j][l] - rows[i][l] * rows[j][k];
  };
  const WideInteger value =
      rows[0][2] * minor(1, 2, 0, 1) - rows[1][2] * minor(0, 2, 0, 1) + rows[2][2] * minor(0, 1, 0, 1);
  return sign * value.sign();
}

bool PlaneFrame::is_left_of(const Vertex<3>& a, const Vertex<3>& b) const {
  constexpr int along = 1000003, across = 618029;
  const double du = b.x[u_] - a.x[u_], dv = b.x[v_] - a.x[v_];
  const double difference = along * du + across * dv;
  const double bound =
      (along + across) * (2 * (a.error + b.error) + 0x1p-50 * (std::fabs(du) + std::fabs(dv)));
  if (difference > bound) return true;
  if (difference < -bound) return false;
  const auto p = coordinates_.point(a);
  const auto& q = coordinates_.point(b);
  const auto order = [&](int cu, int cv) {  // sign of q - p
    const WideInteger at_p = widen(p[u_]) * cu + widen(p[v_]) * cv,
                      at_q = widen(q[u_]) * cu + widen(q[v_]) * cv;
    const WideInteger value = at_q * widen(p[3]) - at_p * widen(q[3]);
    return value.sign() * p[3].sign() * q[3].sign();
  };
  const int first = order(along, across);
  return first != 0 ? first > 0 : order(0, 1) > 0;
}

}  // namespace bsp2::geometry
