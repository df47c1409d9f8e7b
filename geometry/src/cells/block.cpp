#include "bsp2/geometry/cells/block.hpp"

#include <array>
#include <cstdlib>
#include <new>

namespace bsp2::geometry {
namespace {

constexpr std::size_t granule = 256, class_count = 48, kept_per_class = 512;

std::size_t size_class(std::size_t size) { return (size + granule - 1) / granule; }

thread_local bool closed = false;  // the thread's cache is gone; blocks in static storage may outlive it

/// Free blocks of one thread, chained through their own memory, by size in granules.
class BlockCache {
 public:
  BlockCache() = default;
  BlockCache(const BlockCache&) = delete;
  BlockCache& operator=(const BlockCache&) = delete;
  ~BlockCache() {
    for (Free*& list : lists_)
      while (list != nullptr) std::free(std::exchange(list, list->next));
    closed = true;
  }
  void* take(std::size_t size) {
    const std::size_t index = size_class(size);
    if (index < class_count && lists_[index] != nullptr) {
      --counts_[index];
      return std::exchange(lists_[index], lists_[index]->next);
    }
    void* data = std::malloc(index * granule);
    if (data == nullptr) throw std::bad_alloc();
    return data;
  }
  void give(void* data, std::size_t size) noexcept {
    const std::size_t index = size_class(size);
    if (index >= class_count || counts_[index] >= kept_per_class) return std::free(data);
    lists_[index] = new (data) Free{lists_[index]};
    ++counts_[index];
  }

 private:
  struct Free {
    Free* next;
  };
  std::array<Free*, class_count> lists_{};
  std::array<std::size_t, class_count> counts_{};
};

BlockCache& cache() {
  thread_local BlockCache local;
  return local;
}

}  // namespace

Block::Block(std::size_t size) : data_(static_cast<std::byte*>(cache().take(size))), size_(size) {}

void Block::release() noexcept {
  if (closed)
    std::free(data_);
  else
    cache().give(data_, size_);
}

}  // namespace bsp2::geometry
