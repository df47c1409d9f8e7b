#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

namespace bsp2::dataflow {

/// A queue of limited length between threads: a full one holds its producers back. Its consumer is not woken
/// for each item, which would cost more than the item, but for an eighth of the capacity; fewer wait until it
/// looks by itself.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity)
      : capacity_(capacity), worth_waking_(std::max<std::size_t>(1, capacity / 8)) {}

  /// Waits for room. After `close`, drops the item.
  void push(T item) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
    if (closed_) return;
    items_.push_back(std::move(item));
    const bool wakes = items_.size() == worth_waking_;
    lock.unlock();
    if (wakes) filled_.notify_one();
  }

  /// Waits for items, at most so long or until nudged. @return all that there are.
  std::vector<T> pop_all(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, timeout, [&] { return nudged_ || items_.size() >= worth_waking_; });
    nudged_ = false;
    std::vector<T> items = std::exchange(items_, {});
    lock.unlock();
    room_.notify_all();
    return items;
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
  std::size_t capacity_, worth_waking_;
  std::mutex mutex_;
  std::condition_variable room_, filled_;
  std::vector<T> items_;
  bool closed_ = false, nudged_ = false;
};

}  // namespace bsp2::dataflow
