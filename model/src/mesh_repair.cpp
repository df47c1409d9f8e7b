#include "mesh_repair.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "disjoint_sets.hpp"

namespace bsp2::model {
namespace {

FaceCycles select(const FaceCycles& faces, const std::vector<bool>& dropped, const std::vector<bool>& reversed) {
  FaceCycles result;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (dropped[f]) continue;
    const auto face = faces[f];
    if (reversed[f])
      result.corners.insert(result.corners.end(), face.rbegin(), face.rend());
    else
      result.corners.insert(result.corners.end(), face.begin(), face.end());
    result.end_face();
  }
  return result;
}

double dot(const Point3& p, const Point3& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; }
Point3 minus(const Point3& p, const Point3& q) { return {p[0] - q[0], p[1] - q[1], p[2] - q[2]}; }
Point3 cross(const Point3& p, const Point3& q) { return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]}; }

/// Member i of Halton's sequence, in [0, 1): spread evenly, and always the same.
double halton(std::uint32_t i, std::uint32_t base) {
  double result = 0, share = 1;
  for (; i > 0; i /= base) {
    share /= base;
    result += share * (i % base);
  }
  return result;
}

/// What winds around the inside of a solid with a hole: 5/6 where a cube lacks a face, 1/2 at worst, in a shallow dish.
constexpr double least_share = 0.6;

/// Whether a part with caps is no solid.
bool is_sheet(const std::vector<Point3>& points, const std::vector<Triangle>& part, std::uint32_t first_apex) {
  std::vector<Triangle> own, caps;
  Point3 low = points[part[0][0]], high = low;
  for (const Triangle& triangle : part) {
    const bool is_cap = *std::max_element(triangle.begin(), triangle.end()) >= first_apex;
    (is_cap ? caps : own).push_back(triangle);
    for (const std::uint32_t corner : triangle)
      for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], points[corner][k]), high[k] = std::max(high[k], points[corner][k]);
  }
  if (caps.empty()) return false;
  const auto most = static_cast<std::uint32_t>(std::clamp<std::size_t>(40'000'000 / part.size(), 64, 8192));
  int inside = 0;
  double sum = 0;
  for (std::uint32_t i = 1; i <= most && inside < 64; ++i) {
    Point3 at;
    for (int k = 0; k < 3; ++k) at[k] = low[k] + halton(i, k == 0 ? 2 : k == 1 ? 3 : 5) * (high[k] - low[k]);
    const double open = winding_number(points, own, at);
    if (std::fabs(open + winding_number(points, caps, at)) < 0.5) continue;
    ++inside;
    sum += std::min(std::fabs(open), 1.0);
  }
  return sum < least_share * inside || inside == 0;
}

}  // namespace

FaceCycles without_duplicates(const FaceCycles& faces, std::size_t& dropped, std::size_t* first) {
  std::vector<std::pair<std::vector<std::uint32_t>, std::size_t>> cycles;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    std::vector<std::uint32_t> cycle(face.begin(), face.end());
    if (!cycle.empty()) std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
    cycles.emplace_back(std::move(cycle), f);
  }
  std::sort(cycles.begin(), cycles.end());
  std::vector<bool> drop(faces.size());
  dropped = 0;
  for (std::size_t i = 1; i < cycles.size(); ++i)
    if (cycles[i].first == cycles[i - 1].first) drop[cycles[i].second] = true, ++dropped;
  if (first != nullptr) *first = static_cast<std::size_t>(std::find(drop.begin(), drop.end(), true) - drop.begin());
  return select(faces, drop, std::vector<bool>(faces.size()));
}

FaceCycles consistently_wound(const FaceCycles& faces, std::size_t& turned) {
  struct Use {
    std::uint32_t low, high;
    std::size_t face;
    bool forward;
  };
  std::vector<Use> uses;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto face = faces[f];
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % face.size()];
      uses.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& x, const Use& y) { return std::tuple(x.low, x.high, x.face) < std::tuple(y.low, y.high, y.face); });
  std::vector<std::vector<std::pair<std::size_t, bool>>> neighbours(faces.size());  // and whether one of the two has to turn
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
    if (end - begin != 2) continue;
    const Use &x = uses[begin], &y = uses[begin + 1];
    neighbours[x.face].emplace_back(y.face, x.forward == y.forward);
    neighbours[y.face].emplace_back(x.face, x.forward == y.forward);
  }
  std::vector<bool> seen(faces.size()), reversed(faces.size());
  turned = 0;
  for (std::size_t first = 0; first < faces.size(); ++first) {
    if (seen[first]) continue;
    std::vector<std::size_t> part{first};
    seen[first] = true;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const auto& [next, turn] : neighbours[part[i]]) {
        if (seen[next]) continue;
        seen[next] = true;
        reversed[next] = reversed[part[i]] != turn;
        part.push_back(next);
      }
    auto count = static_cast<std::size_t>(std::count_if(part.begin(), part.end(), [&](std::size_t f) { return reversed[f]; }));
    if (2 * count > part.size()) {
      for (const std::size_t f : part) reversed[f] = !reversed[f];
      count = part.size() - count;
    }
    turned += count;
  }
  return select(faces, std::vector<bool>(faces.size()), reversed);
}

FaceCycles capped(std::vector<Point3>& points, const FaceCycles& faces, const std::vector<OpenEdge>& open) {
  DisjointSets rims(points.size());
  for (const OpenEdge& edge : open) rims.join(edge.a, edge.b);
  struct Sum {
    Point3 sum{};
    double weight = 0;
    std::uint32_t apex = 0;
  };
  std::map<std::uint32_t, Sum> apices;
  for (const OpenEdge& edge : open) {
    Sum& rim = apices[rims.of(edge.a)];
    for (const std::uint32_t end : {edge.a, edge.b})
      for (int k = 0; k < 3; ++k) rim.sum[k] += points[end][k];
    rim.weight += 2;
  }
  for (auto& [rim, apex] : apices) {
    apex.apex = static_cast<std::uint32_t>(points.size());
    points.push_back({apex.sum[0] / apex.weight, apex.sum[1] / apex.weight, apex.sum[2] / apex.weight});
  }
  FaceCycles result = faces;
  for (const OpenEdge& edge : open) {
    const std::uint32_t apex = apices[rims.of(edge.a)].apex;
    const auto [from, to] = edge.excess > 0 ? std::pair(edge.b, edge.a) : std::pair(edge.a, edge.b);
    for (int i = std::abs(edge.excess); i > 0; --i) {
      result.corners.insert(result.corners.end(), {from, to, apex});
      result.end_face();
    }
  }
  return result;
}

double winding_number(const std::vector<Point3>& points, const std::vector<Triangle>& triangles, const Point3& at) {
  double sum = 0;
  for (const Triangle& triangle : triangles) {
    // The solid angle: A. Van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
    const Point3 a = minus(points[triangle[0]], at), b = minus(points[triangle[1]], at), c = minus(points[triangle[2]], at);
    const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
    sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

std::vector<Triangle> without_sheets(const std::vector<Point3>& points, const std::vector<Triangle>& triangles, std::uint32_t first_apex,
                                     std::size_t& left_out) {
  DisjointSets groups(points.size());
  for (const Triangle& triangle : triangles) groups.join(triangle[0], triangle[1]), groups.join(triangle[0], triangle[2]);
  std::map<std::uint32_t, std::vector<Triangle>> parts;
  for (const Triangle& triangle : triangles) parts[groups.of(triangle[0])].push_back(triangle);
  std::vector<Triangle> solids;
  left_out = 0;
  for (const auto& [group, part] : parts) {
    if (is_sheet(points, part, first_apex))
      ++left_out;
    else
      solids.insert(solids.end(), part.begin(), part.end());
  }
  return solids;
}

}  // namespace bsp2::model
