#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "simplices/shape.hpp"

namespace bsp2::meshing {

/// Where places of a surface have gone from where they were, as far as that is known: each by a vector in a
/// box, and by no more than a length. Moves that take each other back do not add up, as lengths alone would.
/// At first none has gone anywhere; what is united with such a one stays among those that have gone nowhere.
class Displacement {
 public:
  /// How far any of them is from where it was, at most.
  [[nodiscard]] double length() const {
    Point farthest{};
    for (std::size_t k = 0; k < 3; ++k) farthest[k] = std::max(-low_[k], high_[k]);
    return std::min(length_, std::sqrt(dot(farthest, farthest)));
  }
  [[nodiscard]] bool is_none() const { return length_ == 0; }

  /// Others are among them.
  void unite(const Displacement& other) {
    length_ = std::max(length(), other.length());
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], other.low_[k]);
      high_[k] = std::max(high_[k], other.high_[k]);
    }
  }
  /// All go on by this.
  [[nodiscard]] Displacement then(const Point& step) const { return plus(step, step, step); }
  /// Each goes on by some share of this, from none of it to all.
  [[nodiscard]] Displacement then_up_to(const Point& step) const {
    Point low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) (step[k] < 0 ? low : high)[k] = step[k];
    return plus(low, high, step);
  }
  /// Each goes on by that at most, whereto is not known.
  [[nodiscard]] Displacement then_within(double most) const {
    return plus({-most, -most, -most}, {most, most, most}, {most, 0, 0});
  }
  /// Each goes on as any of the others.
  [[nodiscard]] Displacement then_as(const Displacement& other) const {
    return plus(other.low_, other.high_, {other.length(), 0, 0});
  }

  /// Means of three: each is as if it had gone by the mean of one of each.
  [[nodiscard]] static Displacement mean(const std::array<Displacement, 3>& of,
                                         const std::array<double, 3>& weight) {
    Displacement mean;
    for (std::size_t i = 0; i < 3; ++i) {
      mean.length_ += weight[i] * of[i].length();
      for (std::size_t k = 0; k < 3; ++k) {
        mean.low_[k] += weight[i] * of[i].low_[k];
        mean.high_[k] += weight[i] * of[i].high_[k];
      }
    }
    return mean;
  }

 private:
  Point low_{}, high_{};
  double length_ = 0;

  [[nodiscard]] Displacement plus(const Point& low, const Point& high, const Point& farthest) const {
    Displacement sum = *this;
    sum.length_ = length() + std::sqrt(dot(farthest, farthest));
    for (std::size_t k = 0; k < 3; ++k) {
      sum.low_[k] += low[k];
      sum.high_[k] += high[k];
    }
    return sum;
  }
};

}  // namespace bsp2::meshing
