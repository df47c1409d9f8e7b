#include "viewer/voxels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace bsp2::api {
namespace {

using Point = Voxels::Point;

constexpr unsigned bits_of_axis = 20;  // of a place in a code

std::uint64_t code_of(const std::array<std::int32_t, 3>& place) {
  return static_cast<std::uint64_t>(place[2]) << 2 * bits_of_axis |
         static_cast<std::uint64_t>(place[1]) << bits_of_axis | static_cast<std::uint64_t>(place[0]);
}

std::array<std::int32_t, 3> place_of(std::uint64_t code) {
  constexpr std::uint64_t mask = (1U << bits_of_axis) - 1;
  return {static_cast<std::int32_t>(code & mask), static_cast<std::int32_t>(code >> bits_of_axis & mask),
          static_cast<std::int32_t>(code >> 2 * bits_of_axis & mask)};
}

struct CodeHash {
  std::size_t operator()(std::uint64_t code) const {
    code = (code ^ (code >> 31)) * 0xd6e8feb86659fd93U;
    return code ^ (code >> 29);
  }
  std::size_t operator()(const std::pair<std::uint64_t, std::uint32_t>& key) const {
    return (*this)(key.first + (*this)(std::uint64_t{key.second} + 1));
  }
};

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Twice the area along the normal of a triangle.
Point normal_of(const Point& a, const Point& b, const Point& c) {
  Point u{}, v{};
  for (std::size_t i = 0; i < 3; ++i) {
    u[i] = b[i] - a[i];
    v[i] = c[i] - a[i];
  }
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// What is left of a triangle between planes: convex but for rounding, so with at most 9 corners that matter.
struct Polygon {
  std::array<Point, 12> corners;
  std::size_t count = 0;
  void add(const Point& corner) {
    if (count < corners.size()) corners[count++] = corner;
  }
  [[nodiscard]] std::pair<double, double> range(std::size_t axis) const {
    double low = corners[0][axis], high = low;
    for (std::size_t i = 1; i < count; ++i) {
      low = std::min(low, corners[i][axis]);
      high = std::max(high, corners[i][axis]);
    }
    return {low, high};
  }
};

/// What is below a plane, and what is above it; corners on it are of both.
std::pair<Polygon, Polygon> cut(const Polygon& polygon, std::size_t axis, double at) {
  Polygon below, above;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Point &from = polygon.corners[i], &to = polygon.corners[(i + 1) % polygon.count];
    if (from[axis] <= at) below.add(from);
    if (from[axis] >= at) above.add(from);
    if (from[axis] == at || to[axis] == at || (from[axis] < at) == (to[axis] < at)) continue;
    const double share = (at - from[axis]) / (to[axis] - from[axis]);
    Point between{};
    for (std::size_t k = 0; k < 3; ++k) {
      constexpr double fractions = 1024;  // so a corner that lies in a plane is not a little beside it
      between[k] = std::round((from[k] + share * (to[k] - from[k])) * fractions) / fractions;
    }
    between[axis] = at;
    below.add(between);
    above.add(between);
  }
  return {below, above};
}

}  // namespace

/// Puts triangles into voxels.
class Voxels::Marking {
 public:
  Marking(std::vector<Voxel>& voxels, int exponent) : voxels_(voxels), edge_(std::exp2(exponent)) {}

  void add(const Point& a, const Point& b, const Point& c, std::uint32_t owner) {
    owner_ = owner;
    normal_ = normal_of(a, b, c);
    Polygon triangle;
    for (const Point& corner : {a, b, c}) triangle.add(corner);
    divide(triangle, 0);
  }

 private:
  std::vector<Voxel>& voxels_;
  double edge_;
  std::unordered_map<std::uint64_t, std::size_t, CodeHash> known_;
  std::uint32_t owner_ = 0;
  Point normal_{};
  Place place_{};

  /// Cuts what is left of the triangle by the planes across an axis, and those after it.
  void divide(const Polygon& polygon, std::size_t axis) {
    if (axis == 3) return mark(polygon);
    const auto [low, high] = polygon.range(axis);
    auto first = static_cast<std::int32_t>(std::floor(low / edge_));
    auto last = static_cast<std::int32_t>(std::ceil(high / edge_)) - 1;
    if (last < first) first = last = std::max(0, normal_[axis] > 0 ? first - 1 : first);  // in a plane
    place_[axis] = first;
    if (first == last) return divide(polygon, axis + 1);
    Polygon rest = polygon;
    for (std::int32_t at = first; at <= last; ++at) {
      place_[axis] = at;
      if (at == last) return divide(rest, axis + 1);
      auto [below, above] = cut(rest, axis, (at + 1) * edge_);
      divide(below, axis + 1);
      rest = above;
    }
  }

  void mark(const Polygon& polygon) {
    const auto [found, is_new] = known_.try_emplace(code_of(place_), voxels_.size());
    if (is_new) {
      voxels_.push_back({.code = found->first, .lower = polygon.corners[0], .upper = polygon.corners[0]});
      voxels_.back().owner = owner_;
    }
    Voxel& voxel = voxels_[found->second];
    for (std::size_t i = 0; i < polygon.count; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        voxel.lower[k] = std::min(voxel.lower[k], polygon.corners[i][k]);
        voxel.upper[k] = std::max(voxel.upper[k], polygon.corners[i][k]);
      }
    for (std::size_t k = 0; k < 3; ++k)
      if (normal_[k] != 0) voxel.faced |= static_cast<std::uint8_t>(1U << (2 * k + (normal_[k] > 0 ? 1 : 0)));
    double whole = 0;
    for (std::size_t i = 2; i < polygon.count; ++i) {
      const std::array<Point, 3> part{polygon.corners[0], polygon.corners[i - 1], polygon.corners[i]};
      const Point normal = normal_of(part[0], part[1], part[2]);
      const double area = std::sqrt(dot(normal, normal));
      whole += area;
      for (std::size_t k = 0; k < 3; ++k) {
        voxel.normal[k] += normal[k];
        voxel.moment[k] += area * (part[0][k] + part[1][k] + part[2][k]) / 3;
      }
    }
    voxel.area += whole;
    if (whole > voxel.area_of_owner) {
      voxel.area_of_owner = whole;
      voxel.owner = owner_;
    }
  }
};

Voxels::Voxels(std::span<const std::uint32_t> places, std::span<const std::uint32_t> corners,
               std::span<const std::uint32_t> owners, int exponent)
    : exponent_(exponent) {
  Marking marking(voxels_, exponent);
  const auto point = [&](std::uint32_t v) {
    return Point{double(places[3 * v]), double(places[3 * v + 1]), double(places[3 * v + 2])};
  };
  for (std::size_t i = 0; i < owners.size(); ++i)
    marking.add(point(corners[3 * i]), point(corners[3 * i + 1]), point(corners[3 * i + 2]), owners[i]);
  std::sort(voxels_.begin(), voxels_.end(), [](const auto& a, const auto& b) { return a.code < b.code; });
  find_shown();
}

int Voxels::first_exponent(std::span<const std::uint32_t> places, std::span<const std::uint32_t> corners) {
  constexpr int most_bits = 7;  // of a place
  const std::uint32_t largest = places.empty() ? 0 : *std::max_element(places.begin(), places.end());
  double area = 0;
  const auto point = [&](std::uint32_t v) {
    return Point{double(places[3 * v]), double(places[3 * v + 1]), double(places[3 * v + 2])};
  };
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const Point normal = normal_of(point(corners[i]), point(corners[i + 1]), point(corners[i + 2]));
    area += std::sqrt(dot(normal, normal)) / 2;
  }
  const double each = area / std::max(1.0, static_cast<double>(corners.size()) / 3);
  return std::max(
      {0, static_cast<int>(std::bit_width(largest)) - most_bits, each > 1 ? std::ilogb(each) / 2 : 0});
}

void Voxels::coarsen() {
  ++exponent_;
  for (Voxel& voxel : voxels_) {
    Place place = place_of(voxel.code);
    for (std::int32_t& x : place) x /= 2;
    voxel.code = code_of(place);
  }
  std::stable_sort(voxels_.begin(), voxels_.end(),
                   [](const auto& a, const auto& b) { return a.code < b.code; });
  std::size_t left = 0;
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    const Voxel& more = voxels_[i];
    if (left == 0 || voxels_[left - 1].code != more.code) {
      voxels_[left++] = more;
      continue;
    }
    Voxel& voxel = voxels_[left - 1];
    for (std::size_t k = 0; k < 3; ++k) {
      voxel.normal[k] += more.normal[k];
      voxel.moment[k] += more.moment[k];
      voxel.lower[k] = std::min(voxel.lower[k], more.lower[k]);
      voxel.upper[k] = std::max(voxel.upper[k], more.upper[k]);
    }
    voxel.area += more.area;
    voxel.faced |= more.faced;
    if (more.area_of_owner > voxel.area_of_owner) {
      voxel.area_of_owner = more.area_of_owner;
      voxel.owner = more.owner;
    }
  }
  voxels_.resize(left);
  find_shown();
}

const Voxels::Voxel* Voxels::at(const Place& place) const {
  if (std::min({place[0], place[1], place[2]}) < 0) return nullptr;
  const std::uint64_t code = code_of(place);
  const auto found =
      std::lower_bound(voxels_.begin(), voxels_.end(), code,
                       [](const Voxel& voxel, std::uint64_t other) { return voxel.code < other; });
  return found != voxels_.end() && found->code == code ? &*found : nullptr;
}

void Voxels::find_shown() {
  for (Voxel& voxel : voxels_) voxel.shown = voxel.faced;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t stride = std::uint64_t{1} << axis * bits_of_axis;
    std::size_t beside = 0;
    for (Voxel& voxel : voxels_) {  // by code, so what is beside them comes in this order, too
      while (beside < voxels_.size() && voxels_[beside].code < voxel.code + stride) ++beside;
      if (beside == voxels_.size()) break;
      if (voxels_[beside].code != voxel.code + stride) continue;
      Voxel& other = voxels_[beside];
      // What lies in the plane between them hides nothing: it may be a sheet without thickness.
      const double plane = std::ldexp(place_of(other.code)[axis], exponent_);
      if (other.upper[axis] > plane) voxel.shown &= static_cast<std::uint8_t>(~(2U << 2 * axis));
      if (voxel.lower[axis] < plane) other.shown &= static_cast<std::uint8_t>(~(1U << 2 * axis));
    }
  }
}

std::size_t Voxels::count() const {
  std::size_t sides = 0;
  for (const Voxel& voxel : voxels_) sides += static_cast<std::size_t>(std::popcount(voxel.shown));
  return 2 * sides;
}

/// Where corners of voxels go.
class Voxels::Corners {
 public:
  Corners(const Voxels& of, std::span<const std::uint32_t> look_of_owner, Hull& hull)
      : of_(of), look_of_owner_(look_of_owner), hull_(hull) {}

  /// The point of the hull for a corner as an owner looks.
  std::uint32_t of(const Place& place, std::uint32_t owner) {
    const std::uint32_t look = look_of_owner_.empty() ? 0 : look_of_owner_[owner];
    const auto [found, is_new] =
        known_.try_emplace(std::pair(code_of(place), look), static_cast<std::uint32_t>(hull_.looks.size()));
    if (is_new) {
      hull_.points.push_back(moved(place));
      hull_.looks.push_back(look);
    }
    return found->second;
  }

 private:
  const Voxels& of_;
  std::span<const std::uint32_t> look_of_owner_;
  Hull& hull_;
  std::unordered_map<std::pair<std::uint64_t, std::uint32_t>, std::uint32_t, CodeHash> known_;

  [[nodiscard]] Point moved(const Place& place) const {
    const double edge = std::exp2(of_.exponent_);
    Voxel about;
    bool is_first = true;
    for (std::int32_t i = 0; i < 8; ++i) {
      const Voxel* voxel = of_.at({place[0] - (i & 1), place[1] - (i >> 1 & 1), place[2] - (i >> 2)});
      if (voxel == nullptr) continue;
      about.area += voxel->area;
      for (std::size_t k = 0; k < 3; ++k) {
        about.normal[k] += voxel->normal[k];
        about.moment[k] += voxel->moment[k];
        about.lower[k] = is_first ? voxel->lower[k] : std::min(about.lower[k], voxel->lower[k]);
        about.upper[k] = is_first ? voxel->upper[k] : std::max(about.upper[k], voxel->upper[k]);
      }
      is_first = false;
    }
    const Point corner{edge * place[0], edge * place[1], edge * place[2]};
    Point at = corner;
    const double length = std::sqrt(dot(about.normal, about.normal));
    if (length > 0) {  // the more all face one way, the nearer to their plane
      double beyond = 0;
      for (std::size_t k = 0; k < 3; ++k)
        beyond += (corner[k] - about.moment[k] / about.area) * about.normal[k] / length;
      for (std::size_t k = 0; k < 3; ++k) at[k] -= beyond * about.normal[k] / about.area;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = std::clamp(at[k], corner[k] - edge / 2, corner[k] + edge / 2);
      at[k] = std::clamp(at[k], about.lower[k], about.upper[k]);
    }
    return at;
  }
};

Voxels::Hull Voxels::hull(std::span<const std::uint32_t> look_of_owner) const {
  std::vector<const Voxel*> by_owner;
  for (const Voxel& voxel : voxels_) by_owner.push_back(&voxel);
  std::stable_sort(by_owner.begin(), by_owner.end(),
                   [](const Voxel* a, const Voxel* b) { return a->owner < b->owner; });
  Hull hull;
  Corners corners(*this, look_of_owner, hull);
  for (const Voxel* voxel : by_owner)
    for (std::size_t side = 0; side < 6; ++side) {  // along -x, x, -y, y, -z, z
      if ((voxel->shown >> side & 1U) == 0) continue;
      const std::size_t axis = side / 2, next = (axis + 1) % 3, last = (axis + 2) % 3;
      Place place = place_of(voxel->code);
      place[axis] += static_cast<std::int32_t>(side % 2);
      std::array<std::uint32_t, 4> quad{};
      for (std::size_t i = 0; i < 4; ++i) {  // counter-clockwise, as seen against the axis
        Place corner = place;
        corner[next] += i == 1 || i == 2 ? 1 : 0;
        corner[last] += i >= 2 ? 1 : 0;
        quad[i] = corners.of(corner, voxel->owner);
      }
      if (side % 2 == 0) std::swap(quad[1], quad[3]);
      hull.triangles.insert(hull.triangles.end(), {quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]});
      hull.owners.insert(hull.owners.end(), 2, voxel->owner);
    }
  return hull;
}

}  // namespace bsp2::api
