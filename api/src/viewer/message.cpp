#include "viewer/message.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace bsp2::api {

static_assert(std::endian::native == std::endian::little,
              "the page reads numbers as this machine writes them");

Message::Message(const char* kind, std::uint64_t run) : header_{{"kind", kind}, {"run", run}} {}

void Message::add_small(const char* name, const std::vector<std::uint32_t>& numbers, std::size_t stride) {
  const std::uint32_t largest = numbers.empty() ? 0 : *std::max_element(numbers.begin(), numbers.end());
  if (largest <= 0xff)
    add(name, std::vector<std::uint8_t>(numbers.begin(), numbers.end()));
  else
    add_indices(name, numbers, stride);
}

void Message::add_indices(const char* name, const std::vector<std::uint32_t>& indices, std::size_t stride) {
  const std::uint32_t largest = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end());
  if (largest <= 0xffff)
    add(name, std::vector<std::uint16_t>(indices.begin(), indices.end()), stride);
  else
    add(name, indices, stride);
}

std::string Message::bytes() const {
  // A name in another encoding than UTF-8 is shown as well as can be.
  std::string header = header_.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  header.append((4 - header.size() % 4) % 4, ' ');
  const auto length = static_cast<std::uint32_t>(header.size());
  std::string bytes(sizeof length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  return bytes + header + arrays_;
}

}  // namespace bsp2::api
