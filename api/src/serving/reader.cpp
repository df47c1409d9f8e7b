#include "serving/reader.hpp"

#include <algorithm>
#include <iterator>

namespace bsp2::api {
namespace {

std::vector<std::int32_t> hidden_of(const Detail& detail, const std::set<std::int32_t>& hidden) {
  std::vector<std::int32_t> both;
  std::set_intersection(detail.parts.begin(), detail.parts.end(), hidden.begin(), hidden.end(),
                        std::back_inserter(both));
  return both;
}

}  // namespace

const Scene::Entry* Levels::known(const Key& key) {
  const auto found = place_.find(key);
  if (found == place_.end()) return nullptr;
  kept_.splice(kept_.begin(), kept_, found->second);
  return &kept_.front().entry;
}

Scene::Entry Levels::keep(Key key, Scene::Entry entry) {
  bytes_ += entry.bytes->size();
  kept_.push_front({std::move(key), entry});
  place_[kept_.front().key] = kept_.begin();
  while (bytes_ > most_bytes_) {
    bytes_ -= kept_.back().entry.bytes->size();
    place_.erase(kept_.back().key);
    kept_.pop_back();
  }
  return entry;
}

Scene::Bytes Levels::at(const Scene::Entry& entry, int level) {
  if (!entry.detail || level <= entry.detail->finest) return entry.bytes;
  Key key{entry.number, level, {}};
  if (const auto* made = known(key)) return made->bytes;
  auto bytes = std::make_shared<const std::string>(entry.detail->coarser(*entry.bytes, level));
  return keep(std::move(key), {entry.number, std::move(bytes)}).bytes;
}

Scene::Entry Levels::without(const Scene::Entry& entry, const std::set<std::int32_t>& hidden) {
  const auto parts = hidden_of(*entry.detail, hidden);
  if (parts.empty() || !entry.detail->without) return entry;
  Key key{entry.number, 0, parts};
  if (const auto* made = known(key)) return *made;
  auto [bytes, detail] = entry.detail->without(*entry.bytes, {parts.begin(), parts.end()});
  return keep(std::move(key),
              {++last_, std::make_shared<const std::string>(std::move(bytes)), std::move(detail)});
}

void Reader::look(const Gaze& gaze) {
  gaze_ = gaze;
  shifts_ = Shifts(gaze, {});
  is_planned_ = is_told_ = false;
}

std::optional<Reader::Next> Reader::next() {
  if (const auto entry = scene_.after(at_)) {
    if (entry->detail && tells_ && !gaze_) return std::nullopt;
    at_ = entry->number;
    // Where all others lie tells where this one is moved, and what is cut open has changed.
    if (entry->detail && gaze_ && (gaze_->explode > 0 || !gaze_->planes.empty()))
      is_planned_ = is_told_ = false;
    return Next{take(*entry)};
  }
  if (!gaze_) return std::nullopt;
  if (!is_planned_) plan();
  if (Scene::Bytes bytes = next_section()) return Next{std::move(bytes)};
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

Scene::Bytes Reader::next_section() {
  if (!sections_) return nullptr;
  while (sections_to_come_ < gaze_->planes.size()) {
    const std::size_t plane = sections_to_come_++;
    auto& state = sections_held_.at(gaze_->planes[plane].axis);
    if (Scene::Bytes bytes = sections_(scene_, *gaze_, plane, state)) return bytes;
  }
  return nullptr;
}

/// What is moved nobody knows where is not seen: it is planned once all the others are there.
Gaze::Wanted Reader::wanted(const Detail& detail) const {
  const auto shift = shifts_.of(detail);
  const Gaze::Wanted wanted = gaze_->wanted(detail, scene_.run_of_surface(), shift.value_or(Gaze::Point{}));
  if (shift || wanted.level == Detail::nothing || wanted.level == detail.finest) return wanted;
  return {detail.coarsest, 0, false};
}

/// @return null if it is not needed, and would not be less than half of what the page has.
Scene::Bytes Reader::take(const Scene::Entry& entry, bool is_needed) {
  if (!entry.detail || !gaze_) return entry.bytes;
  Scene::Entry shown = entry;
  std::vector<std::int32_t> hidden;
  if (gaze_->shows(*entry.detail, scene_.run_of_surface())) {
    shown = levels_.without(entry, gaze_->hidden);
    hidden = hidden_of(*entry.detail, gaze_->hidden);
  }
  const int level = wanted(*shown.detail).level;
  Scene::Bytes bytes = levels_.at(shown, level);
  if (!is_needed && 2 * bytes->size() > held_[entry.number].bytes) return nullptr;
  held_[entry.number] = {level, bytes->size(), std::move(hidden), shown.detail};
  forget_old();
  return bytes;
}

/// A page that stands still makes no plans, and what it has got is replaced as long as a run goes on.
void Reader::forget_old() {
  constexpr std::size_t few = 1000;
  if (held_.size() <= 2 * scene_.size() + few) return;
  std::unordered_map<std::uint64_t, Held> held;
  for (const auto& [number, detail] : scene_.detailed())
    if (const auto found = held_.find(number); found != held_.end()) held.insert(std::move(*found));
  held_ = std::move(held);
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
  const auto all = scene_.detailed();
  shifts_ = Shifts(*gaze_, all);
  std::size_t bytes = 0;
  for (const auto& [number, detail] : all) {
    const auto found = held_.find(number);
    if (found == held_.end()) continue;
    const Held& has = held.insert(*found).first->second;
    // What it has of it, if it is without the same parts; else it is made anew.
    const bool is_other =
        gaze_->shows(*detail, scene_.run_of_surface()) && has.without != hidden_of(*detail, gaze_->hidden);
    const Gaze::Wanted wanted = this->wanted(is_other || !has.of ? *detail : *has.of);
    if (!wanted.is_seen) continue;
    const int difference = is_other || has.level > wanted.level ? 1 : has.level < wanted.level ? -1 : 0;
    seen.push_back({wanted.depth, number, difference, Detail::is_of_voxels(wanted.level)});
    bytes += has.bytes;
  }
  held_ = std::move(held);
  const bool gets_coarser = bytes > enough_;
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return std::pair(a.depth, a.number) > std::pair(b.depth, b.number);
  });
  to_come_.clear();
  sections_to_come_ = 0;
  // Voxels have no edges, and those of what is far away are all that one sees: all such pieces look alike, or
  // none.
  for (const Seen& each : seen)
    if (each.difference > 0 || (each.difference < 0 && (gets_coarser || each.is_of_voxels)))
      to_come_.push_back({each.number, each.difference > 0 || each.is_of_voxels});
}

}  // namespace bsp2::api
