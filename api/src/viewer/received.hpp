#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

namespace bsp2::api {

using Numbers = std::vector<std::uint32_t>;

/// A message, to be read; its bytes must outlive it.
class Received {
 public:
  explicit Received(const std::string& bytes) : header_(header_of(bytes)) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), sizeof length);
    arrays_ = bytes.data() + sizeof length + length;
  }
  static nlohmann::json header_of(const std::string& bytes) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), sizeof length);
    return nlohmann::json::parse(bytes.data() + sizeof length, bytes.data() + sizeof length + length);
  }
  [[nodiscard]] const nlohmann::json& header() const { return header_; }
  [[nodiscard]] bool is_piece() const { return header_["kind"] == "piece"; }
  /// Whose each triangle is.
  [[nodiscard]] Numbers owners() const {
    Numbers owners;
    const Numbers of_owner = whole(is_piece() ? "ofFace" : "ofCell");
    for (std::uint32_t owner = 0; owner < of_owner.size(); ++owner)
      owners.insert(owners.end(), of_owner[owner], owner);
    return owners;
  }
  [[nodiscard]] bool has(const char* name) const { return header_["arrays"].contains(name); }
  [[nodiscard]] Numbers whole(const char* name) const {
    const std::string type = header_["arrays"][name][0];
    if (type == "u8") return numbers<std::uint8_t, std::uint32_t>(name);
    if (type == "u16") return numbers<std::uint16_t, std::uint32_t>(name);
    return numbers<std::uint32_t, std::uint32_t>(name);
  }
  template <typename Stored, typename Number = Stored>
  [[nodiscard]] std::vector<Number> numbers(const char* name) const {
    const nlohmann::json& place = header_["arrays"][name];
    std::vector<Stored> stored(place[2].get<std::size_t>());
    if (!stored.empty())
      std::memcpy(stored.data(), arrays_ + place[1].get<std::size_t>(), stored.size() * sizeof(Stored));
    const std::size_t stride = place[3];
    if constexpr (std::is_integral_v<Stored>)
      for (std::size_t i = stride; stride > 0 && i < stored.size(); ++i)
        stored[i] = static_cast<Stored>(stored[i] + stored[i - stride]);
    return {stored.begin(), stored.end()};
  }

 private:
  nlohmann::json header_;
  const char* arrays_;
};

}  // namespace bsp2::api
