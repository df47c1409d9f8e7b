#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

namespace bsp2::dataflow {

/// A queue of limited length between threads: a full one holds its producers back.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Waits for room. After `close`, drops the item.
  void push(T item) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
    if (closed_) return;
    items_.push_back(std::move(item));
    filled_.notify_one();
  }

  /// Waits for an item, at most so long or until nudged.
  std::optional<T> pop(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, timeout, [&] { return nudged_ || !items_.empty(); });
    nudged_ = false;
    if (items_.empty()) return std::nullopt;
    T item = std::move(items_.front());
    items_.pop_front();
    room_.notify_one();
    return item;
  }

  /// Lets every waiting producer go on; nothing is accepted any more.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    items_.clear();
    room_.notify_all();
  }

  /// Wakes the waiting consumer, e.g. because all producers are done.
  void nudge() {
    const std::lock_guard lock(mutex_);
    nudged_ = true;
    filled_.notify_all();
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable room_, filled_;
  std::deque<T> items_;
  bool closed_ = false, nudged_ = false;
};

}  // namespace bsp2::dataflow
