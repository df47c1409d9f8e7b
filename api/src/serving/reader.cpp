#include "serving/reader.hpp"

#include <algorithm>

namespace bsp2::api {

Scene::Bytes Levels::at(const Scene::Entry& entry, int level) {
  if (!entry.detail || level <= entry.detail->finest) return entry.bytes;
  const Key key{entry.number, level};
  if (const auto found = place_.find(key); found != place_.end()) {
    kept_.splice(kept_.begin(), kept_, found->second);
    return kept_.front().second;
  }
  kept_.emplace_front(key, std::make_shared<const std::string>(entry.detail->coarser(*entry.bytes, level)));
  place_[key] = kept_.begin();
  const Scene::Bytes made = kept_.front().second;
  bytes_ += made->size();
  while (bytes_ > most_bytes_) {
    bytes_ -= kept_.back().second->size();
    place_.erase(kept_.back().first);
    kept_.pop_back();
  }
  return made;
}

void Reader::look(const Gaze& gaze) {
  gaze_ = gaze;
  is_planned_ = is_told_ = false;
}

std::optional<Reader::Next> Reader::next() {
  if (const auto entry = scene_.after(at_)) {
    if (entry->detail && tells_ && !gaze_) return std::nullopt;
    at_ = entry->number;
    return Next{take(*entry)};
  }
  if (!gaze_) return std::nullopt;
  if (!is_planned_) plan();
  while (!to_come_.empty()) {
    const Planned planned = to_come_.back();
    to_come_.pop_back();
    const auto entry = scene_.find(planned.number);
    if (!entry) continue;
    if (Scene::Bytes bytes = take(*entry, planned.is_needed)) return Next{std::move(bytes)};
  }
  if (std::exchange(is_told_, true)) return std::nullopt;
  return Next{std::make_shared<const std::string>("{\"seen\":" + std::to_string(gaze_->number) + "}"), true};
}

/// @return null if it is not needed, and would not be less than half of what the page has.
Scene::Bytes Reader::take(const Scene::Entry& entry, bool is_needed) {
  if (!entry.detail || !gaze_) return entry.bytes;
  const int level = gaze_->wanted(*entry.detail, scene_.run_of_surface()).level;
  Scene::Bytes bytes = levels_.at(entry, level);
  if (!is_needed && 2 * bytes->size() > held_[entry.number].bytes) return nullptr;
  held_[entry.number] = {level, bytes->size()};
  return bytes;
}

void Reader::plan() {
  is_planned_ = true;
  struct Seen {
    double depth;
    std::uint64_t number;
    int difference;     ///< of the level that it has to that which is wanted
    bool is_of_voxels;  ///< the one that is wanted
  };
  std::vector<Seen> seen;
  std::unordered_map<std::uint64_t, Held> held;  // without what is there no more
  const std::uint64_t run_of_surface = scene_.run_of_surface();
  std::size_t bytes = 0;
  for (const auto& [number, detail] : scene_.detailed()) {
    const auto found = held_.find(number);
    if (found == held_.end()) continue;
    held.insert(*found);
    const Gaze::Wanted wanted = gaze_->wanted(*detail, run_of_surface);
    if (!wanted.is_seen) continue;
    seen.push_back({wanted.depth, number,
                    found->second.level > wanted.level   ? 1
                    : found->second.level < wanted.level ? -1
                                                         : 0,
                    Detail::is_of_voxels(wanted.level)});
    bytes += found->second.bytes;
  }
  held_ = std::move(held);
  const bool is_even = gaze_->depth > 0, gets_coarser = is_even || bytes > enough_;
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return std::pair(a.depth, a.number) > std::pair(b.depth, b.number);
  });
  to_come_.clear();
  // Voxels have no edges, and those of what is far away are all that one sees: all such pieces look alike, or
  // none.
  for (const Seen& each : seen)
    if (each.difference > 0 || (each.difference < 0 && (gets_coarser || each.is_of_voxels)))
      to_come_.push_back({each.number, each.difference > 0 || is_even || each.is_of_voxels});
}

}  // namespace bsp2::api
