#include "hdf5/fletcher32.hpp"

#include <algorithm>

namespace bsp2::io::hdf5 {
namespace {

constexpr std::uint64_t modulus = 65535;

/// The remainder, where only nothing is 0: so HDF5's way to fold its sums leaves them.
std::uint32_t folded(std::uint64_t sum) {
  return sum == 0 ? 0 : static_cast<std::uint32_t>((sum - 1) % modulus + 1);
}

}  // namespace

void Fletcher32::add_sums(std::uint64_t simple, std::uint64_t weighted) {
  simple_ = folded(simple_ + simple);
  weighted_ = folded(weighted_ + weighted);
}

void Fletcher32::add(std::size_t at, const void* data, std::size_t bytes) {
  const auto* byte = static_cast<const std::uint8_t*>(data);
  const auto add_alone = [&](std::size_t place, std::uint64_t value) {
    const std::uint64_t word = place % 2 == 0 ? value << 8 : value;
    add_sums(word, word * (words_ - place / 2));
  };
  if (at % 2 == 1 && bytes > 0) {
    add_alone(at++, *byte++);
    --bytes;
  }
  constexpr std::size_t most = std::size_t{1} << 20;  // words of which the sums surely fit into 64 bits
  for (std::size_t words = bytes / 2; words > 0;) {
    const std::size_t part = std::min(words, most);
    std::uint64_t simple = 0, weighted = 0;
    for (const auto* end = byte + 2 * part; byte != end; byte += 2)
      weighted += simple += static_cast<std::uint64_t>(byte[0] << 8 | byte[1]);
    words -= part;
    at += 2 * part;
    add_sums(simple, weighted + simple % modulus * (words_ - at / 2));
  }
  if (bytes % 2 == 1) add_alone(at, *byte);
}

void Fletcher32::add(const Fletcher32& other) { add_sums(other.simple_, other.weighted_); }

}  // namespace bsp2::io::hdf5
