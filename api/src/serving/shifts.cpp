#include "serving/shifts.hpp"

#include <algorithm>

namespace bsp2::api {
namespace {

Gaze::Point middle_of(const Gaze::Point& lower, const Gaze::Point& upper) {
  Gaze::Point middle{};
  for (std::size_t i = 0; i < 3; ++i) middle[i] = (lower[i] + upper[i]) / 2;
  return middle;
}

}  // namespace

Shifts::Shifts(const Gaze& gaze, const Details& all) : by_(gaze.explode), middle_(gaze.middle) {
  if (by_ == 0) return;
  std::map<std::pair<std::uint64_t, std::int32_t>, std::pair<Gaze::Point, Gaze::Point>> boxes;
  for (const auto& [number, detail] : all) {
    if (detail->kind != Detail::Kind::surface) continue;
    const Gaze::Point middle = middle_of(detail->lower, detail->upper);
    auto& [lower, upper] =
        boxes.try_emplace({detail->run, detail->part}, std::pair(middle, middle)).first->second;
    for (std::size_t i = 0; i < 3; ++i) {
      lower[i] = std::min(lower[i], middle[i]);
      upper[i] = std::max(upper[i], middle[i]);
    }
  }
  for (const auto& [part, box] : boxes) middles_[part] = middle_of(box.first, box.second);
}

std::optional<Gaze::Point> Shifts::of(const Detail& detail) const {
  Gaze::Point shift{};
  if (by_ == 0) return shift;
  if (detail.kind == Detail::Kind::cells) {
    shift = middle_of(detail.lower, detail.upper);
  } else {
    const auto found = middles_.find({detail.run, detail.part});
    if (found == middles_.end()) return std::nullopt;
    shift = found->second;
  }
  for (std::size_t i = 0; i < 3; ++i) shift[i] = by_ * (shift[i] - middle_[i]);
  return shift;
}

}  // namespace bsp2::api
