#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace bsp2::dataflow {

/// A double-ended queue of pointers: its owner pushes and pops at the bottom, any thread steals from the top.
/// Source: Chase and Lev, "Dynamic circular work-stealing deque" (2005), with sequentially consistent
/// indices.
template <typename T>
class WorkDeque {
 public:
  WorkDeque() { grow(1024); }
  WorkDeque(const WorkDeque&) = delete;
  WorkDeque& operator=(const WorkDeque&) = delete;
  ~WorkDeque() = default;

  /// Owner only.
  void push(T* item) {
    const std::int64_t bottom = bottom_.load(std::memory_order_relaxed),
                       top = top_.load(std::memory_order_acquire);
    Ring* ring = ring_.load(std::memory_order_relaxed);
    if (bottom - top >= static_cast<std::int64_t>(ring->mask)) ring = grow(2 * (ring->mask + 1));
    ring->at(bottom).store(item, std::memory_order_relaxed);
    bottom_.store(bottom + 1, std::memory_order_release);
  }

  /// Owner only. @return null if the queue is empty.
  T* pop() {
    const std::int64_t bottom = bottom_.load(std::memory_order_relaxed) - 1;
    Ring* ring = ring_.load(std::memory_order_relaxed);
    bottom_.store(bottom, std::memory_order_seq_cst);
    std::int64_t top = top_.load(std::memory_order_seq_cst);
    if (top > bottom) {
      bottom_.store(bottom + 1, std::memory_order_relaxed);
      return nullptr;
    }
    T* item = ring->at(bottom).load(std::memory_order_relaxed);
    if (top != bottom) return item;
    // The last one: a thief may be after it.
    if (!top_.compare_exchange_strong(top, top + 1, std::memory_order_seq_cst)) item = nullptr;
    bottom_.store(bottom + 1, std::memory_order_relaxed);
    return item;
  }

  /// Any thread. @return null if there is nothing to steal or another thief was faster.
  T* steal() {
    std::int64_t top = top_.load(std::memory_order_seq_cst);
    const std::int64_t bottom = bottom_.load(std::memory_order_seq_cst);
    if (top >= bottom) return nullptr;
    T* item = ring_.load(std::memory_order_acquire)->at(top).load(std::memory_order_relaxed);
    return top_.compare_exchange_strong(top, top + 1, std::memory_order_seq_cst) ? item : nullptr;
  }

 private:
  struct Ring {
    explicit Ring(std::size_t size) : mask(size - 1), slots(std::make_unique<std::atomic<T*>[]>(size)) {}
    std::size_t mask;
    std::unique_ptr<std::atomic<T*>[]> slots;
    std::atomic<T*>& at(std::int64_t index) { return slots[static_cast<std::size_t>(index) & mask]; }
  };
  std::atomic<std::int64_t> top_{0}, bottom_{0};
  std::atomic<Ring*> ring_{nullptr};
  std::vector<std::unique_ptr<Ring>> rings_;  // outgrown ones too: a thief may still read them

  Ring* grow(std::size_t size) {
    rings_.push_back(std::make_unique<Ring>(size));
    Ring* next = rings_.back().get();
    if (Ring* old = ring_.load(std::memory_order_relaxed))
      for (std::int64_t i = top_.load(std::memory_order_acquire); i < bottom_.load(std::memory_order_relaxed);
           ++i)
        next->at(i).store(old->at(i).load(std::memory_order_relaxed), std::memory_order_relaxed);
    ring_.store(next, std::memory_order_release);
    return next;
  }
};

}  // namespace bsp2::dataflow
