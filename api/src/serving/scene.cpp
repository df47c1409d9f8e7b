#include "serving/scene.hpp"

#include <utility>

namespace bsp2::api {

void Scene::tell() {
  const std::lock_guard lock(listening_);
  if (on_change_) on_change_();
}

void Scene::listen(std::function<void()> on_change) {
  const std::lock_guard lock(listening_);
  on_change_ = std::move(on_change);
}

void Scene::forget_listener() { listen({}); }

void Scene::put(const std::string& key, Entry entry, bool is_first) {
  {
    const std::lock_guard lock(mutex_);
    bytes_ += entry.bytes->size();
    if (is_first) first_ = entry.bytes;
    if (entry.detail && entry.detail->kind == Detail::Kind::surface) run_of_surface_ = entry.detail->run;
    std::uint64_t& number = number_of_[key];
    messages_.erase(number);
    number = entry.number = ++last_;
    messages_.emplace(number, std::move(entry));
  }
  tell();
}

void Scene::put(const std::string& key, std::string bytes, std::shared_ptr<const Detail> detail) {
  put(key, Entry{0, std::make_shared<const std::string>(std::move(bytes)), std::move(detail)}, false);
}

void Scene::put_first(const std::string& key, std::string bytes) {
  put(key, Entry{0, std::make_shared<const std::string>(std::move(bytes))}, true);
}

void Scene::remove(std::string_view beginning) {
  const std::lock_guard lock(mutex_);
  for (auto at = number_of_.lower_bound(beginning);
       at != number_of_.end() && std::string_view(at->first).starts_with(beginning);) {
    messages_.erase(at->second);
    at = number_of_.erase(at);
  }
}

std::optional<Scene::Entry> Scene::after(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  if (number < number_of_first && first_) return Entry{number_of_first, first_};
  const auto found = messages_.upper_bound(number);
  if (found == messages_.end()) return std::nullopt;
  return found->second;
}

std::optional<Scene::Entry> Scene::find(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto found = messages_.find(number);
  return found == messages_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<std::pair<std::uint64_t, std::shared_ptr<const Detail>>> Scene::detailed() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<std::uint64_t, std::shared_ptr<const Detail>>> all;
  for (const auto& [number, entry] : messages_)
    if (entry.detail) all.emplace_back(number, entry.detail);
  return all;
}

std::uint64_t Scene::run_of_surface() const {
  const std::lock_guard lock(mutex_);
  return run_of_surface_;
}

std::size_t Scene::size() const {
  const std::lock_guard lock(mutex_);
  return messages_.size();
}

std::uint64_t Scene::bytes_put() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace bsp2::api
