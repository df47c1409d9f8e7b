#include "mesh/mesh_repair.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <ranges>
#include <span>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/disjoint_sets.hpp"

namespace bsp2::model {
namespace {

FaceCycles select(const FaceCycles& faces, const std::vector<bool>& dropped,
                  const std::vector<bool>& reversed) {
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

/// Member i of Halton's sequence, in [0, 1): spread evenly, and always the same.
double halton(std::uint32_t i, std::uint32_t base) {
  double result = 0, share = 1;
  for (; i > 0; i /= base) {
    share /= base;
    result += share * (i % base);
  }
  return result;
}

/// What winds around the inside of a solid with a hole: 5/6 where a cube lacks a face, 1/2 at worst, in a
/// shallow dish.
constexpr double least_share = 0.6;

/// A connected part of a mesh with its caps.
struct Part {
  std::vector<Triangle> own, caps;
};

constexpr std::size_t enough_samples = 64;

/// Whether the caps are the faces seen from the other side, as those of a single face are.
bool is_cancelled(const Part& part) {
  if (part.own.size() != part.caps.size()) return false;
  const auto sorted = [](std::vector<Triangle> triangles, bool turned) {
    for (Triangle& t : triangles) {
      if (turned) std::swap(t[1], t[2]);
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
  };
  return sorted(part.own, false) == sorted(part.caps, true);
}

/// Whether a part is no solid. @param most samples.
bool is_sheet(const std::vector<Point3>& points, const Part& part, std::size_t most) {
  if (part.caps.empty()) return false;
  if (part.own.empty() || is_cancelled(part)) return true;
  Point3 low = points[part.own[0][0]], high = low;
  for (const auto* triangles : {&part.own, &part.caps})
    for (const Triangle& triangle : *triangles)
      for (const std::uint32_t corner : triangle)
        for (int k = 0; k < 3; ++k)
          low[k] = std::min(low[k], points[corner][k]), high[k] = std::max(high[k], points[corner][k]);
  std::size_t inside = 0;
  double sum = 0;
  for (std::uint32_t i = 1; i <= most && inside < enough_samples; ++i) {
    Point3 at;
    for (int k = 0; k < 3; ++k) at[k] = low[k] + halton(i, k == 0 ? 2 : k == 1 ? 3 : 5) * (high[k] - low[k]);
    const double open = winding_number(points, part.own, at);
    if (std::fabs(open + winding_number(points, part.caps, at)) < 0.5) continue;
    ++inside;
    sum += std::min(std::fabs(open), 1.0);
  }
  return inside == 0 || sum < least_share * static_cast<double>(inside);
}

/// The cycle from its smallest corner on, in the direction in which the smaller of that one's neighbours
/// follows. @param turned whether that is not the face's own direction.
std::vector<std::uint32_t> undirected(std::span<const std::uint32_t> face, bool& turned) {
  std::vector<std::uint32_t> cycle(face.begin(), face.end());
  turned = false;
  if (cycle.size() < 3) return cycle;
  std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
  turned = cycle.back() < cycle[1];
  if (turned) std::reverse(cycle.begin() + 1, cycle.end());
  return cycle;
}

/// How many of these faces lie at each edge.
class EdgeUses {
 public:
  template <typename Faces>
  explicit EdgeUses(const Faces& faces) {
    for (const auto& face : faces)
      for (std::size_t i = 0; i < face.size(); ++i)
        edges_.push_back(key(face[i], face[(i + 1) % face.size()]));
    std::sort(edges_.begin(), edges_.end());
  }
  [[nodiscard]] std::size_t of(std::uint32_t a, std::uint32_t b) const {
    const auto [first, last] = std::equal_range(edges_.begin(), edges_.end(), key(a, b));
    return static_cast<std::size_t>(last - first);
  }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }
  std::vector<std::uint64_t> edges_;
};

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
  if (first != nullptr)
    *first = static_cast<std::size_t>(std::find(drop.begin(), drop.end(), true) - drop.begin());
  return select(faces, drop, std::vector<bool>(faces.size()));
}

FaceCycles without_copies(const FaceCycles& faces, std::size_t& dropped) {
  struct Copy {
    std::vector<std::uint32_t> cycle;
    std::size_t face;
    bool turned;
  };
  std::vector<Copy> copies(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    copies[f].cycle = undirected(faces[f], copies[f].turned);
    copies[f].face = f;
  }
  std::sort(copies.begin(), copies.end(), [](const Copy& x, const Copy& y) {
    return std::tie(x.cycle, x.face) < std::tie(y.cycle, y.face);
  });
  std::vector<std::span<const Copy>> groups;
  std::vector<std::span<const std::uint32_t>> firsts;
  for (std::size_t begin = 0, end = 0; begin < copies.size(); begin = end) {
    while (end < copies.size() && copies[end].cycle == copies[begin].cycle) ++end;
    groups.push_back(std::span<const Copy>(copies).subspan(begin, end - begin));
    firsts.emplace_back(copies[begin].cycle);
  }
  dropped = 0;
  std::vector<bool> drop(faces.size());
  if (groups.size() == copies.size()) return faces;
  const EdgeUses uses(firsts);
  for (const auto& group : groups) {
    if (group.size() == 1) continue;
    const auto& cycle = group.front().cycle;
    const auto turned = static_cast<std::size_t>(std::ranges::count_if(group, &Copy::turned));
    bool is_wall = 2 * turned == group.size();
    for (std::size_t i = 0; i < cycle.size() && is_wall; ++i)
      is_wall = uses.of(cycle[i], cycle[(i + 1) % cycle.size()]) != 2;
    if (is_wall) continue;
    const bool majority = 2 * turned > group.size();  // the first one that is wound as most of them are stays
    const auto kept = std::ranges::find(group, majority, &Copy::turned);
    for (const Copy& copy : group)
      if (copy.face != kept->face) drop[copy.face] = true, ++dropped;
  }
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
  std::sort(uses.begin(), uses.end(), [](const Use& x, const Use& y) {
    return std::tuple(x.low, x.high, x.face) < std::tuple(y.low, y.high, y.face);
  });
  std::vector<std::vector<std::pair<std::size_t, bool>>> neighbours(
      faces.size());  // and whether one of the two has to turn
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
    auto count = static_cast<std::size_t>(
        std::count_if(part.begin(), part.end(), [&](std::size_t f) { return reversed[f]; }));
    if (2 * count > part.size()) {
      for (const std::size_t f : part) reversed[f] = !reversed[f];
      count = part.size() - count;
    }
    turned += count;
  }
  return select(faces, std::vector<bool>(faces.size()), reversed);
}

double winding_number(const std::vector<Point3>& points, const std::vector<Triangle>& triangles,
                      const Point3& at) {
  double sum = 0;
  for (const Triangle& triangle : triangles) {
    // The solid angle: A. Van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
    const Point3 a = minus(points[triangle[0]], at), b = minus(points[triangle[1]], at),
                 c = minus(points[triangle[2]], at);
    const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
    sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

std::size_t leave_out_sheets(const std::vector<Point3>& points, std::vector<Triangle>& own,
                             std::vector<Triangle>& caps) {
  geometry::DisjointSets groups(points.size());
  for (const auto* triangles : {&own, &caps})
    for (const Triangle& triangle : *triangles)
      groups.unite(triangle[0], triangle[1]), groups.unite(triangle[0], triangle[2]);
  std::map<std::uint32_t, Part> parts;
  for (const Triangle& triangle : own) parts[groups.find(triangle[0])].own.push_back(triangle);
  for (const Triangle& triangle : caps) parts[groups.find(triangle[0])].caps.push_back(triangle);
  // As many samples as may be needed where one part is small, fewer where there are lots of parts.
  constexpr std::size_t most_work = 40'000'000, most_samples = 8192;
  std::size_t to_look_at = 0, left_out = 0;
  for (const auto& [group, part] : parts)
    to_look_at += part.caps.empty() ? 0 : part.own.size() + part.caps.size();
  const std::size_t most =
      std::clamp(most_work / std::max<std::size_t>(to_look_at, 1), enough_samples, most_samples);
  own.clear();
  caps.clear();
  for (const auto& [group, part] : parts) {
    if (is_sheet(points, part, most)) {
      ++left_out;
    } else {
      own.insert(own.end(), part.own.begin(), part.own.end());
      caps.insert(caps.end(), part.caps.begin(), part.caps.end());
    }
  }
  return left_out;
}

}  // namespace bsp2::model
