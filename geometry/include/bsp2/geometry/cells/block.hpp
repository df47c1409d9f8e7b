#pragma once

#include <cstddef>
#include <utility>

namespace bsp2::geometry {

/// An owned piece of raw memory, aligned for any scalar, that comes from and returns to a cache of the
/// calling thread: in the steady state of splitting and dropping cells nothing is allocated. May be released
/// on another thread.
class Block {
 public:
  Block() = default;
  explicit Block(std::size_t size);
  Block(Block&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Block& operator=(Block&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~Block() {
    if (data_ != nullptr) release();
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// The objects of type T, one or several, that start `offset` bytes into the block.
  template <typename T>
  [[nodiscard]] T* at(std::size_t offset) {
    return reinterpret_cast<T*>(data_ + offset);
  }
  template <typename T>
  [[nodiscard]] const T* at(std::size_t offset) const {
    return reinterpret_cast<const T*>(data_ + offset);
  }

 private:
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  void release() noexcept;
};

}  // namespace bsp2::geometry
