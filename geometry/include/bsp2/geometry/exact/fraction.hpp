#pragma once

#include <array>
#include <cstdint>

#include "bsp2/geometry/exact/exact.hpp"

namespace bsp2::geometry {

/// A multiple of 2^-192 between -1/2 and 1/2. Sums are exact; what is made a fraction loses less than 2^-192,
/// a product less than 6 * 2^-192.
///
/// Most signs that doubles leave open are those of values far above what this resolves, and three words are
/// many times faster than the exact numbers.
class Fraction {
 public:
  static constexpr int bits = 192;

  Fraction() = default;
  /// value * 2^exponent, rounded towards 0.
  template <typename Integer>
  static Fraction scaled(const Integer& value, long exponent) {
    const auto& limbs = value.backend();
    static_assert(sizeof(*limbs.limbs()) == sizeof(Word));
    const auto limb = [&](long i) {
      return i >= 0 && i < static_cast<long>(limbs.size()) ? limbs.limbs()[i] : 0;
    };
    Fraction result;
    for (int k = 0; k < 3; ++k) {
      const long bit = 64 * k - exponent - bits;  // of the value, which becomes the first one of the word
      const long first = bit >> 6;
      const int shift = static_cast<int>(bit & 63);
      result.word_[k] = limb(first) >> shift | (shift == 0 ? 0 : limb(first + 1) << (64 - shift));
    }
    result.negate_if(value.sign() < 0 ? ~Word{0} : 0);
    return result;
  }

  [[nodiscard]] bool is_zero() const { return (word_[0] | word_[1] | word_[2]) == 0; }
  [[nodiscard]] bool is_negative() const { return word_[2] >> 63 != 0; }
  /// Is the size of the value 2^-exponent or more? exponent in (128, 192].
  [[nodiscard]] bool is_at_least(int exponent) const {
    Fraction size = *this;
    size.negate_if(sign_mask());
    return (size.word_[1] | size.word_[2] | size.word_[0] >> (bits - exponent)) != 0;
  }

  Fraction operator-() const {
    Fraction result;
    return result -= *this;
  }
  Fraction& operator+=(const Fraction& other) { return add(other, 0); }
  Fraction& operator-=(const Fraction& other) { return add(other, ~Word{0}); }
  friend Fraction operator*(const Fraction& a, const Fraction& b) {
    const auto product = [&](int i, int k) { return Double{a.word_[i]} * b.word_[k]; };
    const auto low = [](Double x) { return static_cast<Word>(x); };
    const auto high = [](Double x) { return static_cast<Word>(x >> 64); };
    // What is below 2^-192 is left out, and so are the carries that come from there.
    const Double p12 = product(1, 2), p21 = product(2, 1), p22 = product(2, 2);
    const Double lowest =
        Double{high(product(0, 2))} + high(product(1, 1)) + high(product(2, 0)) + low(p12) + low(p21);
    const Double middle = Double{high(lowest)} + high(p12) + high(p21) + low(p22);
    Fraction result;
    result.word_ = {low(lowest), low(middle), high(p22) + high(middle)};
    // Read without their signs, the words of a negative factor are those of one that is larger by 1.
    result -= b.masked(a.sign_mask());
    return result -= a.masked(b.sign_mask());
  }

 private:
  using Word = std::uint64_t;
  __extension__ using Double = unsigned __int128;
  std::array<Word, 3> word_{};  // two's complement, the least significant first

  [[nodiscard]] Word sign_mask() const { return -(word_[2] >> 63); }
  [[nodiscard]] Fraction masked(Word mask) const {
    Fraction result;
    result.word_ = {word_[0] & mask, word_[1] & mask, word_[2] & mask};
    return result;
  }
  void negate_if(Word mask) {
    Fraction result;
    word_ = result.add(*this, mask).word_;
  }
  /// Adds the other one, or subtracts it if all bits of the mask are set.
  Fraction& add(const Fraction& other, Word mask) {
    Double carry = mask & 1;
    for (int k = 0; k < 3; ++k) {
      carry += Double{word_[k]} + (other.word_[k] ^ mask);
      word_[k] = static_cast<Word>(carry);
      carry >>= 64;
    }
    return *this;
  }
};

}  // namespace bsp2::geometry
