#include "complex/point_register.hpp"

#include <algorithm>
#include <bit>

namespace bsp2::meshing {

using geometry::HyperplaneId;

/// Where these planes are, or would be.
std::size_t PointRegister::place_of(const std::array<HyperplaneId, 3>& ids) const {
  std::uint64_t hash = ids[0];
  for (int k = 1; k < 3; ++k) hash = (hash ^ hash >> 31) * 0x9e3779b97f4a7c15u + ids[k];
  const std::size_t mask = known_.size() - 1;
  std::size_t at = (hash ^ hash >> 29) * 0x9e3779b97f4a7c15u >> 32 & mask;
  while (known_[at].point != none && known_[at].ids != ids) at = (at + 1) & mask;
  return at;
}

void PointRegister::reserve(std::size_t names) {
  if (const std::size_t places = std::bit_ceil(2 * names); names > 0 && places > known_.size()) grow(places);
}

void PointRegister::grow(std::size_t places) {
  std::vector<Entry> before(places);
  before.swap(known_);
  for (const Entry& entry : before)
    if (entry.point != none) known_[place_of(entry.ids)] = entry;
}

std::uint32_t PointRegister::find(const std::array<HyperplaneId, 3>& ids,
                                  std::span<const HyperplaneId> planes) {
  if (2 * count_ >= known_.size()) grow(std::max<std::size_t>(2 * known_.size(), 1024));
  Entry& entry = known_[place_of(ids)];
  if (entry.point == none) {
    ++count_;
    entry = {ids, static_cast<std::uint32_t>(points_.size())};
    points_.add(geometry::canonical_vertex(exact_.table(), ids), planes);
  } else if (planes.size() > 3) {
    for (const HyperplaneId plane : planes)
      if (!points_.is_known_on(entry.point, plane)) more_.emplace_back(entry.point, plane);
  }
  return entry.point;
}

std::uint32_t PointRegister::append(const geometry::PointSet& points) {
  const auto first = static_cast<std::uint32_t>(points_.size());
  const auto base = static_cast<std::uint32_t>(points_.planes.size());
  points_.vertices.insert(points_.vertices.end(), points.vertices.begin(), points.vertices.end());
  points_.planes.insert(points_.planes.end(), points.planes.begin(), points.planes.end());
  for (std::size_t i = 1; i < points.offset.size(); ++i) points_.offset.push_back(base + points.offset[i]);
  return first;
}

/// What was found out about points after they were made.
void PointRegister::take_in_more() {
  if (more_.empty()) return;
  std::sort(more_.begin(), more_.end());
  more_.erase(std::unique(more_.begin(), more_.end()), more_.end());
  std::vector<HyperplaneId> planes;
  planes.reserve(points_.planes.size() + more_.size());
  auto next = more_.begin();
  std::uint32_t begin = 0;
  for (std::uint32_t point = 0; point < points_.size(); ++point) {
    const auto first = planes.size();
    const std::uint32_t end = points_.offset[point + 1];
    planes.insert(planes.end(), points_.planes.begin() + begin, points_.planes.begin() + end);
    begin = end;
    for (; next != more_.end() && next->first == point; ++next) planes.push_back(next->second);
    std::sort(planes.begin() + static_cast<std::ptrdiff_t>(first), planes.end());
    points_.offset[point + 1] = static_cast<std::uint32_t>(planes.size());
  }
  points_.planes.swap(planes);
  more_.clear();
}

std::vector<std::uint32_t> PointRegister::unify() {
  take_in_more();
  std::vector<std::uint32_t> map = exact_.unify_in_order(points_, rank_);
  for (Entry& entry : known_)
    if (entry.point != none) entry.point = map[entry.point];
  return map;
}

}  // namespace bsp2::meshing
