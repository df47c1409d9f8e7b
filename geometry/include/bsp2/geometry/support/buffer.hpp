#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

namespace bsp2::geometry {

/// A growing array of plain values for the innermost loops: it keeps its memory when it is cleared, `resize`
/// leaves new values as they are, and `push` is a store and a test that almost never fails.
template <typename T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Buffer() = default;
  Buffer(std::initializer_list<T> values) { append({values.begin(), values.end()}); }
  explicit Buffer(std::span<const T> values) { append(values); }
  Buffer(const Buffer& other) { append(other); }
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(const Buffer& other) {
    if (this != &other) assign(other);
    return *this;
  }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer() = default;
  void swap(Buffer& other) noexcept {
    data_.swap(other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }
  friend bool operator==(const Buffer& a, const Buffer& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T* data() { return data_.get(); }
  [[nodiscard]] const T* data() const { return data_.get(); }
  [[nodiscard]] T* begin() { return data_.get(); }
  [[nodiscard]] const T* begin() const { return data_.get(); }
  [[nodiscard]] T* end() { return data_.get() + size_; }
  [[nodiscard]] const T* end() const { return data_.get() + size_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  void clear() { size_ = 0; }
  void reserve(std::size_t capacity) {
    if (capacity > capacity_) grow(capacity);
  }
  /// One value or several. They are stored one by one: a list of them would be stored first, and read again
  /// in other pieces.
  template <typename... Values>
  [[gnu::always_inline]] void push(const T& first, const Values&... others) {
    constexpr std::size_t count = 1 + sizeof...(others);
    if (size_ + count > capacity_) [[unlikely]]
      grow(size_ + count);
    T* next = data_.get() + size_;
    *next = first;
    ((*++next = others), ...);
    size_ += count;
  }
  /// @pre the values are not in this buffer.
  void append(std::span<const T> values) {
    const std::size_t size = size_;
    resize(size + values.size());
    std::copy(values.begin(), values.end(), data_.get() + size);
  }
  void assign(std::span<const T> values) {
    clear();
    append(values);
  }
  /// New values are undefined.
  void resize(std::size_t size) {
    if (size > capacity_) [[unlikely]]
      grow(size);
    size_ = size;
  }

 private:
  std::unique_ptr<T[]> data_;
  std::size_t size_ = 0, capacity_ = 0;

  [[gnu::noinline]] void grow(std::size_t least) {
    const std::size_t capacity = std::max({least, 2 * capacity_, std::size_t{64}});
    auto data = std::make_unique_for_overwrite<T[]>(capacity);
    std::copy_n(data_.get(), size_, data.get());
    data_ = std::move(data);
    capacity_ = capacity;
  }
};

}  // namespace bsp2::geometry
