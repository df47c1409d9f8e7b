#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace bsp2::api {

/// What the page is told: a header in JSON, and arrays of numbers.
///
/// Shape of the bytes: the length of the header (32 bits, little-endian), the header, padded with spaces to a
/// multiple of 4, then the arrays, each padded likewise. The header's `arrays` has for each name its type (as
/// in "u16"), its first byte, counted from the end of the header, its length, and its stride: if that is
/// above 0, each number but the first ones is the difference to the one so many before it, modulo the range
/// of the type. Such numbers take fewer bytes on their way, where the server compresses them.
class Message {
 public:
  /// @param kind what the page does with it. @param run the number of the run that it is about.
  Message(const char* kind, std::uint64_t run);
  nlohmann::json& operator[](const char* name) { return header_[name]; }
  void add(const char* name, const std::vector<std::uint8_t>& numbers) { add(name, "u8", numbers, 0); }
  void add(const char* name, const std::vector<std::uint16_t>& numbers, std::size_t stride = 0) {
    add(name, "u16", differences(numbers, stride), stride);
  }
  void add(const char* name, const std::vector<std::uint32_t>& numbers, std::size_t stride = 0) {
    add(name, "u32", differences(numbers, stride), stride);
  }
  void add(const char* name, const std::vector<std::int32_t>& numbers) { add(name, "i32", numbers, 0); }
  void add(const char* name, const std::vector<float>& numbers) { add(name, "f32", numbers, 0); }
  /// Whole numbers, in as few bytes as the largest of them needs.
  void add_small(const char* name, const std::vector<std::uint32_t>& numbers, std::size_t stride = 0);
  /// Likewise; in two or four bytes, as graphics cards like them.
  void add_indices(const char* name, const std::vector<std::uint32_t>& indices, std::size_t stride = 0);
  [[nodiscard]] std::string bytes() const;

 private:
  nlohmann::json header_;
  std::string arrays_;

  template <class Number>
  static std::vector<Number> differences(std::vector<Number> numbers, std::size_t stride) {
    for (std::size_t i = numbers.size(); stride > 0 && i-- > stride;)
      numbers[i] = static_cast<Number>(numbers[i] - numbers[i - stride]);
    return numbers;
  }
  template <class Number>
  void add(const char* name, const char* type, const std::vector<Number>& numbers, std::size_t stride) {
    header_["arrays"][name] = {type, arrays_.size(), numbers.size(), stride};
    arrays_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    arrays_.append((4 - arrays_.size() % 4) % 4, '\0');
  }
};

}  // namespace bsp2::api
