#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/threads.hpp"

namespace bsp2::geometry {

/// Parts 0 ... count - 1 into ranges of `grain`, which threads take one after the other, and calls
/// `work(first, end)` for each. One of the threads is the one that calls; it waits for the others, and passes
/// on what one throws. @throws Interrupted between ranges, if the work of the caller is to end.
template <typename Work>
void for_each_range(std::size_t count, std::size_t grain, unsigned threads, const Work& work) {
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> is_over = false;  // also for the others, where one has failed
  const auto take_ranges = [&](bool is_caller) {
    try {
      for (std::size_t first; !is_over.load(std::memory_order_relaxed) &&
                              (first = next.fetch_add(grain, std::memory_order_relaxed)) < count;) {
        work(first, std::min(first + grain, count));
        if (is_caller) Interruption::check();
      }
    } catch (...) {
      is_over = true;
      throw;
    }
  };
  const std::size_t ranges = (count + grain - 1) / grain;
  Threads others;
  for (std::size_t i = 1; i < std::min<std::size_t>(threads, ranges); ++i)
    others.start([&] { take_ranges(false); }, Threads::Begin::elsewhere);
  take_ranges(true);
  others.join();
}

/// Items 0 ... count - 1 that some threads make ahead, while the one that calls uses them in their order. Few
/// are held at a time.
template <typename Item>
class OrderedPipeline {
 public:
  /// Calls `make(i, item)` and then `use(item)` for each, with items that were used before. One thread makes
  /// and uses them in turns. Passes on what is thrown, when all threads have ended.
  template <typename Make, typename Use>
  static void run(std::size_t count, unsigned threads, const Make& make, const Use& use) {
    OrderedPipeline ahead(count, threads);
    Threads others;
    ahead.attempt([&] {  // also where a thread cannot be started: those that were wait for items to be used
      for (std::size_t i = 1; i < std::min<std::size_t>(threads, count); ++i)
        others.start([&] { ahead.attempt([&] { ahead.make_all(make); }); }, Threads::Begin::elsewhere);
      ahead.use_all(make, use);
    });
    others.join();
  }

 private:
  struct Slot {
    Item item;
    bool is_made = false;
  };
  std::size_t count_;
  std::vector<Slot> slots_;  // that of item i is number i modulo their number
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t taken_ = 0, used_ = 0;  // items that somebody makes or has made, and that were used
  bool failed_ = false;

  OrderedPipeline(std::size_t count, unsigned threads)
      : count_(count), slots_(std::min<std::size_t>(count, threads <= 1 ? 1 : 2 * std::size_t{threads})) {}

  [[nodiscard]] Slot& slot(std::size_t i) { return slots_[i % slots_.size()]; }

  /// Others must not wait for what does not come.
  template <typename Work>
  void attempt(const Work& work) {
    try {
      work();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failed_ = true;
      changed_.notify_all();
      throw;
    }
  }

  /// Makes the next item, without the lock. @pre one is left, and its slot is free.
  template <typename Make>
  void make_next(const Make& make, std::unique_lock<std::mutex>& lock) {
    const std::size_t i = taken_++;
    lock.unlock();
    make(i, slot(i).item);
    lock.lock();
    slot(i).is_made = true;
    changed_.notify_all();
  }

  template <typename Make>
  void make_all(const Make& make) {
    std::unique_lock lock(mutex_);
    while (!failed_ && taken_ < count_) {
      if (taken_ - used_ < slots_.size())
        make_next(make, lock);
      else
        changed_.wait(lock);
    }
  }

  template <typename Make, typename Use>
  void use_all(const Make& make, const Use& use) {
    std::unique_lock lock(mutex_);
    while (!failed_ && used_ < count_) {
      Slot& next = slot(used_);
      if (next.is_made) {
        lock.unlock();
        use(next.item);
        lock.lock();
        next.is_made = false;
        ++used_;
        changed_.notify_all();
      } else if (taken_ < count_ && taken_ - used_ < slots_.size()) {
        make_next(make, lock);
      } else {
        changed_.wait(lock);
      }
    }
  }
};

}  // namespace bsp2::geometry
