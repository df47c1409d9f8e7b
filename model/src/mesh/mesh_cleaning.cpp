#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "bsp2/model/mesh/cleaning.hpp"
#include "mesh/mesh_crossing.hpp"
#include "mesh/surface_cleaner.hpp"

namespace bsp2::model {
namespace {

using cleaning::Index;
using cleaning::none;
using cleaning::Shape;
using cleaning::SurfaceCleaner;
using cleaning::Triangle;
using geometry::TriangleSurface;

/// Whether there is anything to do.
bool is_clean(const TriangleSurface& surface, const CleanLength& length) {
  return std::ranges::none_of(surface.triangles, [&](const Triangle& t) {
    const Shape shape{{surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]}};
    return shape.thickness() < length.at(shape.farthest());  // the thickness is less than each side
  });
}

/// Triangles by their corners, ascending.
using Triangles = std::set<std::array<Point3, 3>>;

std::array<Point3, 3> sorted(std::array<Point3, 3> corners) {
  std::ranges::sort(corners);
  return corners;
}

geometry::Box3 box_around(const Point3& a, const Point3& b, const Point3& c) {
  geometry::Box3 box{a, a};
  box.unite({b, b});
  box.unite({c, c});
  return box;
}

/// A place where some triangles of a surface cross it; where the others do, is not looked for.
/// @param passed_over are as if they were not there.
std::optional<MeshCrossing> crossing_of(const TriangleSurface& surface, const std::vector<Index>& some,
                                        const Triangles& passed_over, unsigned threads) {
  const auto box_of = [&](const Triangle& t) {
    return box_around(surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]);
  };
  std::vector<geometry::Box3> boxes;
  for (const Index i : some) boxes.push_back(box_of(surface.triangles[i]));
  const geometry::BoxTree tree(std::move(boxes));
  TriangleMesh near;
  near.points = surface.points;
  for (const Triangle& t : surface.triangles) {
    if (!tree.visit_meeting(box_of(t), [](Index) { return true; })) continue;
    if (passed_over.contains(sorted({surface.points[t[0]], surface.points[t[1]], surface.points[t[2]]})))
      continue;
    near.triangles.push_back(t);
  }
  return self_crossing(near, threads);
}

/// Those of some triangles whose boxes meet that of another one.
std::vector<Point3> corners_near(const TriangleSurface& surface, const std::vector<Index>& some,
                                 const std::array<Point3, 3>& triangle) {
  const geometry::Box3 box = box_around(triangle[0], triangle[1], triangle[2]);
  std::vector<Point3> corners;
  for (const Index i : some) {
    const auto& [a, b, c] = surface.triangles[i];
    if (box_around(surface.points[a], surface.points[b], surface.points[c]).meets(box))
      corners.insert(corners.end(), {surface.points[a], surface.points[b], surface.points[c]});
  }
  return corners;
}

/// Fixes all corners that have become one of these places. @return whether any was not fixed before.
bool fix(const SurfaceCleaner& cleaner, std::vector<Point3> places, std::vector<bool>& fixed) {
  std::ranges::sort(places);
  bool is_new = false;
  for (Index i = 0; i < fixed.size(); ++i) {
    if (fixed[i]) continue;
    const Point3& now = cleaner.point(cleaner.representative(i));
    if (!std::ranges::binary_search(places, now)) continue;
    fixed[i] = is_new = true;
  }
  return is_new;
}

/// What of a surface hangs together, of one part where each is closed by itself, before and after.
class Pieces {
 public:
  Pieces(const TriangleSurface& before, const SurfaceCleaner& cleaner)
      : before_(before), cleaner_(cleaner), sets_(before.triangles.size() + cleaner.triangles()) {
    std::vector<Index> order(before.triangles.size() + cleaner.triangles());
    std::iota(order.begin(), order.end(), Index{0});
    if (before.closes_parts) std::ranges::stable_sort(order, {}, [&](Index i) { return owner(i); });
    unite(order);
    for (const Index i : order) measure(i);
  }

  /// Fixes the corners of those that are inside out now. @return whether there are any.
  bool fix_turned(std::vector<bool>& fixed) {
    bool is_any = false;
    for (Index i = 0; i < before_.triangles.size(); ++i) {
      const Volumes& volumes = volumes_[sets_.find(i)];
      const bool is_turned =
          (volumes.before < 0 && volumes.after > 0) || (volumes.before > 0 && volumes.after < 0);
      if (!is_turned) continue;
      is_any = true;
      for (const Index corner : before_.triangles[i]) fixed[corner] = true;
    }
    return is_any;
  }

 private:
  struct Volumes {
    double before = 0, after = 0;
  };
  const TriangleSurface& before_;
  const SurfaceCleaner& cleaner_;
  geometry::DisjointSets sets_;  // of the triangles before, and behind them those after
  std::unordered_map<Index, Volumes> volumes_;

  [[nodiscard]] bool was_before(Index i) const { return i < before_.triangles.size(); }
  [[nodiscard]] Index after(Index i) const { return i - static_cast<Index>(before_.triangles.size()); }
  [[nodiscard]] bool is_there(Index i) const { return was_before(i) || cleaner_.is_there(after(i)); }
  [[nodiscard]] const Triangle& triangle(Index i) const {
    return was_before(i) ? before_.triangles[i] : cleaner_.triangle(after(i));
  }
  [[nodiscard]] std::int32_t owner(Index i) const {
    return was_before(i) ? before_.owner[i] : cleaner_.owner(after(i));
  }
  [[nodiscard]] const Point3& point(Index i, std::size_t k) const {
    const Index corner = triangle(i)[k];
    return was_before(i) ? before_.points[corner] : cleaner_.point(corner);
  }

  void unite(const std::vector<Index>& order) {
    std::vector<Index> last(before_.points.size(), none);  // of each corner, the last one of the part
    for (const Index i : order) {
      if (!is_there(i)) continue;
      for (const Index corner : triangle(i)) {
        const Index other = std::exchange(last[cleaner_.representative(corner)], i);
        if (other != none && (!before_.closes_parts || owner(other) == owner(i))) sets_.unite(other, i);
      }
    }
  }
  void measure(Index i) {
    if (!is_there(i)) return;
    const Index piece = sets_.find(i);
    const Point3& origin = point(piece, 0);
    const Point3 a = minus(point(i, 0), origin), b = minus(point(i, 1), origin),
                 c = minus(point(i, 2), origin);
    Volumes& volumes = volumes_[piece];
    (was_before(i) ? volumes.before : volumes.after) += dot(a, cross(b, c)) / 6;
  }
};

/// Parts that one surface has and the other one has not.
std::vector<std::int32_t> parts_gone(const TriangleSurface& before, const TriangleSurface& after) {
  std::set<std::int32_t> gone(before.owner.begin(), before.owner.end());
  for (const std::int32_t owner : after.owner) gone.erase(owner);
  return {gone.begin(), gone.end()};
}

}  // namespace

CleanSurface cleaned(TriangleSurface surface, const CleanLength& length, unsigned threads) {
  CleanSurface result;
  double farthest = 0;
  for (const Point3& point : surface.points) farthest = std::max(farthest, cleaning::farthest_of(point));
  result.cleaning.length = length.at(farthest);
  if (is_clean(surface, length)) {
    result.surface = std::move(surface);
    return result;
  }
  constexpr int most_attempts = 24;
  std::vector<bool> fixed(surface.points.size());
  Triangles crossing_before;  // though nothing of them has changed
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    SurfaceCleaner cleaner(surface, length, fixed);
    cleaner.run();
    std::vector<Index> changed;
    TriangleSurface now = cleaner.result(changed);
    if (Pieces(surface, cleaner).fix_turned(fixed)) continue;
    const auto crossing = crossing_of(now, changed, crossing_before, threads);
    if (!crossing) {
      result.cleaning = cleaner.cleaning();
      result.cleaning.crossing_before.assign(crossing_before.begin(), crossing_before.end());
      result.cleaning.vanished = parts_gone(surface, now);
      result.cleaning.length = length.at(farthest);
      result.cleaning.volume = now.volume() - surface.volume();
      result.surface = std::move(now);
      return result;
    }
    std::vector<Point3> places(crossing->triangle.begin(), crossing->triangle.end());
    places.insert(places.end(), crossing->other.begin(), crossing->other.end());
    if (fix(cleaner, std::move(places), fixed)) continue;
    // Nothing of it has changed. What comes near to it may not either: whether that crosses it is not found
    // any more.
    crossing_before.insert(sorted(crossing->triangle));
    fix(cleaner, corners_near(now, changed, crossing->triangle), fixed);
  }
  result.cleaning.has_given_up = true;
  result.surface = std::move(surface);
  return result;
}

}  // namespace bsp2::model
