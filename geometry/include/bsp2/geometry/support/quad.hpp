#pragma once

#include <bit>
#include <cstdint>
#include <limits>

namespace bsp2::geometry {

/// Numbers with 113 bits: products of a few matrices of doubles lose nothing that the doubles express. Their
/// arithmetic is slow, as no processor has it: what can be told from the bits is.
__extension__ using Float128 = __float128;

/// Sign, exponent and fraction as IEEE 754 has them in binary128.
struct Float128Bits {
  __extension__ using Bits = unsigned __int128;
  static constexpr int fraction_size = 112, bias = 16383;
  Bits bits;

  explicit Float128Bits(Float128 x) : bits(std::bit_cast<Bits>(x)) {}
  [[nodiscard]] bool is_negative() const { return bits >> 127 != 0; }
  [[nodiscard]] int exponent_field() const {
    return static_cast<int>(bits >> fraction_size & 0x7fff);
  }  ///< 0: below 2^-16382; 0x7fff: not finite
  [[nodiscard]] Bits fraction() const { return bits & ((Bits{1} << fraction_size) - 1); }
};

inline bool is_zero(Float128 x) { return Float128Bits(x).bits << 1 == 0; }
inline bool is_one(Float128 x) {
  return Float128Bits(x).bits == Float128Bits::Bits{Float128Bits::bias} << Float128Bits::fraction_size;
}

/// The number in quadruple precision: static_cast without a call.
inline Float128 to_quad(double x) {
  using Bits = Float128Bits::Bits;
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const std::uint64_t field = bits >> 52 & 0x7ff;
  if (field == 0x7ff || (field == 0 && bits << 1 != 0))
    return static_cast<Float128>(x);  // not finite, or subnormal
  const Bits exponent = field == 0 ? 0 : field + (Float128Bits::bias - 1023);
  return std::bit_cast<Float128>(Bits{bits >> 63} << 127 | exponent << Float128Bits::fraction_size |
                                 Bits{bits & ((std::uint64_t{1} << 52) - 1)} << 60);
}

/// The nearest number, halves to even: static_cast without a call.
inline long double to_long_double(Float128 x) {
  using Bits = Float128Bits::Bits;
  if constexpr (std::numeric_limits<long double>::digits == 64) {
    const Float128Bits quad(x);
    const int field = quad.exponent_field();
    if (field != 0 && field < 0x7ffe) {
      // The fraction loses 49 bits, and an explicit first bit comes before it; a carry out of it makes the
      // exponent one more.
      const Bits whole =
          (Bits{static_cast<unsigned>(field)} << Float128Bits::fraction_size | quad.fraction());
      const Bits rounded = (whole + ((Bits{1} << 48) - 1) + (whole >> 49 & 1)) >> 49;
      const Bits mantissa = (rounded & ((Bits{1} << 63) - 1)) | Bits{1} << 63;
      return std::bit_cast<long double>(Bits{quad.is_negative()} << 79 | (rounded >> 63) << 64 | mantissa);
    }
    if (is_zero(x)) return quad.is_negative() ? -0.0L : 0.0L;
  }
  return static_cast<long double>(x);
}

}  // namespace bsp2::geometry
