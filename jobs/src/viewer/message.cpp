#include "viewer/message.hpp"

#include <bit>
#include <cstring>

namespace bsp2::jobs {

static_assert(std::endian::native == std::endian::little,
              "the page reads numbers as this machine writes them");

Message::Message(const char* kind, std::uint64_t run) : header_{{"kind", kind}, {"run", run}} {}

std::string Message::bytes() const {
  // A name in another encoding than UTF-8 is shown as well as can be.
  std::string header = header_.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  header.append((4 - header.size() % 4) % 4, ' ');
  const auto length = static_cast<std::uint32_t>(header.size());
  std::string bytes(sizeof length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  return bytes + header + arrays_;
}

}  // namespace bsp2::jobs
