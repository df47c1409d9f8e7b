// What is near in space is put near in memory.

#include <algorithm>
#include <limits>
#include <utility>

#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

/// 21 bits, each followed by two that are 0.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// Places along a curve that fills a cube.
/// Source: Morton, "A computer oriented geodetic data base and a new technique in file sequencing" (1966).
class Curve {
 public:
  void include(const Point& x) {
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], x[k]);
      high_[k] = std::max(high_[k], x[k]);
    }
  }
  [[nodiscard]] std::uint64_t place_of(const Point& x) const {
    constexpr double last = (1 << 21) - 1;
    double size = 0;
    for (std::size_t k = 0; k < 3; ++k) size = std::max(size, high_[k] - low_[k]);
    std::uint64_t place = 0;
    for (std::size_t k = 0; k < 3 && size > 0; ++k)
      place |= spread(static_cast<std::uint64_t>(last * ((x[k] - low_[k]) / size))) << k;
    return place;
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  Point low_{infinity, infinity, infinity}, high_{-infinity, -infinity, -infinity};
};

template <typename Value>
void reorder(std::vector<Value>& values, const std::vector<std::uint32_t>& order) {
  std::vector<Value> ordered;
  ordered.reserve(order.size());
  for (const std::uint32_t i : order) ordered.push_back(values[i]);
  values = std::move(ordered);
}

}  // namespace

std::vector<std::uint32_t> Editor::arrange() {
  Curve curve;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places;
  for (std::uint32_t p = 0; p < points_.size(); ++p)
    if (!star_[p].empty()) curve.include(points_[p]);
  for (std::uint32_t p = 0; p < points_.size(); ++p)
    if (!star_[p].empty()) places.emplace_back(curve.place_of(points_[p]), p);
  std::sort(places.begin(), places.end());
  std::vector<std::uint32_t> map(points_.size(), none), order;
  for (const auto& [place, p] : places) {
    map[p] = static_cast<std::uint32_t>(order.size());
    order.push_back(p);
  }
  places = {};
  reorder(points_, order);
  reorder(kind_, order);
  reorder(changed_, order);
  reorder(settled_, order);
  star_.assign(order.size(), {});
  arrange_tetrahedra(map);
  return map;
}

/// By the lowest of their points. @param map the new numbers of points.
void Editor::arrange_tetrahedra(const std::vector<std::uint32_t>& map) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> places;
  for (std::uint32_t t = 0; t < tetrahedra_.size(); ++t) {
    if (tetrahedra_[t].is_gone()) continue;
    for (std::uint32_t& p : tetrahedra_[t].point) p = map[p];
    places.emplace_back(std::ranges::min(tetrahedra_[t].point), t);
  }
  std::sort(places.begin(), places.end());
  std::vector<std::uint32_t> order;
  for (const auto& [lowest, t] : places) order.push_back(t);
  places = {};
  reorder(tetrahedra_, order);
  free_.clear();
  std::vector<std::uint32_t> count(star_.size(), 0);
  for (const Tetrahedron& tet : tetrahedra_)
    for (const std::uint32_t p : tet.point) ++count[p];
  for (std::size_t p = 0; p < star_.size(); ++p) star_[p].reserve(count[p]);
  for (std::uint32_t t = 0; t < tetrahedra_.size(); ++t)
    for (const std::uint32_t p : tetrahedra_[t].point) star_[p].push_back(t);
}

}  // namespace bsp2::meshing
