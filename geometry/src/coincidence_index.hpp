#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/hyperplane.hpp"

namespace bsp2::geometry {

/// Numbers by 32 bits of hash, in one array: most look-ups read one place of memory. Grows; nothing is taken out.
class HashIndex {
 public:
  HashIndex() : entries_(std::size_t{1} << 6) {}

  /// @param tag well mixed in all of its bits.
  void add(std::uint32_t tag, std::uint32_t value) {
    if (3 * ++count_ > 2 * entries_.size()) grow();
    put({tag, value});
  }
  /// Calls `visit` with the values of all entries of the tag, in the order in which they came.
  template <typename Visit>
  void find(std::uint32_t tag, Visit&& visit) const {
    for (std::size_t at = place(tag); entries_[at].value != none; at = (at + 1) & (entries_.size() - 1))
      if (entries_[at].tag == tag) visit(entries_[at].value);
  }
  void prefetch(std::uint32_t tag) const { __builtin_prefetch(&entries_[place(tag)]); }

 private:
  static constexpr std::uint32_t none = ~0u;
  struct Entry {
    std::uint32_t tag = 0, value = none;
  };
  std::vector<Entry> entries_;  // at the place that the first bits of the tag say, or behind it
  std::size_t count_ = 0;
  unsigned shift_ = 32 - 6;

  [[nodiscard]] std::size_t place(std::uint32_t tag) const { return tag >> shift_; }
  void put(const Entry& entry) {
    std::size_t at = place(entry.tag);
    while (entries_[at].value != none) at = (at + 1) & (entries_.size() - 1);
    entries_[at] = entry;
  }
  /// Places keep their order, so this goes through memory from the front to the back.
  void grow() {
    std::vector<Entry> old(2 * entries_.size());
    old.swap(entries_);
    --shift_;
    // Entries that went round the end come behind those that they had to give way to.
    std::size_t first = 0;
    while (old[first].value != none) ++first;
    for (std::size_t i = 0; i < old.size(); ++i)
      if (const Entry& entry = old[(first + i) & (old.size() - 1)]; entry.value != none) put(entry);
  }
};

/// Finds hyperplanes that are close to one: three linear forms of their coefficients, each cut into buckets.
///
/// A bucket with many hyperplanes keeps those that come last by classes: of the same normal but for its last bits, as models have
/// them that are full of boxes along the axes, or of one solid at many places. Those of a class are found by where they pass.
template <int D>
class CoincidenceIndex {
 public:
  /// @param centre, size of the model.
  /// @param bucket width of one, as a share of the size.
  /// @param reach hyperplanes are looked for that are at most so far apart at a point.
  CoincidenceIndex(const std::array<double, D>& centre, double size, double radius, double bucket, double reach)
      : width_(bucket), centre_(centre), size_(size), radius_(radius), reach_(reach), cell_(4 * std::max({reach, class_width * size, 0x1p-46 * radius})) {}

  /// Turning a normal by 1 in all, as a sum over the axes, changes no form by more where it moves the hyperplane by half the
  /// model's size at the centre: 0.868 + 0.618 / 2.
  static constexpr double sensitivity = 1.2;

  /// Where a hyperplane is looked for.
  struct Key {
    double value;                 // at the centre
    std::array<double, 3> forms;
    double sign;                  // that makes the first form positive
    double margin;                // how far the forms, with that sign, are from those of the next bucket or the other sign
    std::uint32_t tag;            // of the bucket
  };
  [[nodiscard]] Key key(const Hyperplane<D>& h) const {
    Key key;
    key.value = h.at(centre_);
    const double value = key.value / size_;
    key.forms = {0.618033988749895 * value, 0.414213562373095 * value, -0.302775637731995 * value};
    constexpr std::array<std::array<double, 6>, 3> weights{{{0.754877666, -0.569840291, 0.324717957, 0.219149, -0.8192, 0.4656},
                                                            {-0.465571232, 0.682327804, 0.867653, -0.3473, 0.2956, 0.7321},
                                                            {0.5436890127, 0.295597743, -0.8392867, 0.6180, 0.1323, -0.3813}}};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < D; ++i) key.forms[k] += weights[k][i] * h.normal[i];
    key.sign = key.forms[0] < 0 ? -1 : 1;
    key.margin = std::fabs(key.forms[0]) / 2;
    std::array<std::int64_t, 3> at;
    for (int i = 0; i < 3; ++i) {
      const double form = key.sign * key.forms[i];
      at[i] = bucket(form);
      const double within = form - static_cast<double>(at[i]) * width_;
      key.margin = std::min({key.margin, within, width_ - within});
    }
    key.tag = tag_of(at);
    return key;
  }
  /// Fetches from memory what `find` will begin with.
  void prefetch(const Key& key) const { buckets_.prefetch(key.tag); }

  /// Calls `visit` with each id whose hyperplane, or the opposite one, is within `window` of h in all forms and within the reach
  /// of it at `point`; and with some others.
  template <typename Visit>
  void find(const Hyperplane<D>& h, const Key& key, const std::array<double, D>& point, double window, Visit&& visit) const {
    const auto visit_entry = [&](std::uint32_t entry) {
      if ((entry & class_bit) == 0)
        visit(entry);
      else
        find_in_class(entry & ~class_bit, h, key, point, visit);
    };
    if (window < key.margin) return buckets_.find(key.tag, visit_entry);  // as mostly
    for (const double sign : {1.0, -1.0}) {
      if (sign * key.forms[0] < -2 * window) continue;  // entries have the sign that makes the first form positive
      std::array<std::int64_t, 3> low, high, at;
      for (int i = 0; i < 3; ++i) {
        low[i] = bucket(sign * key.forms[i] - window);
        high[i] = bucket(sign * key.forms[i] + window);
      }
      for (at[0] = low[0]; at[0] <= high[0]; ++at[0])
        for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
          for (at[2] = low[2]; at[2] <= high[2]; ++at[2]) buckets_.find(tag_of(at), visit_entry);
    }
  }

  void add(const Hyperplane<D>& h, const Key& key, std::uint32_t id) {
    std::size_t alone = 0;
    bool has_classes = false;
    buckets_.find(key.tag, [&](std::uint32_t entry) { (entry & class_bit) == 0 ? void(++alone) : void(has_classes = true); });
    if (!has_classes && alone < crowd) return buckets_.add(key.tag, id);  // as mostly
    std::array<double, D> normal;
    for (int i = 0; i < D; ++i) normal[i] = std::nearbyint(key.sign * h.normal[i] / class_width) * class_width + 0.0;  // one zero
    std::uint32_t own = class_bit;
    buckets_.find(key.tag, [&](std::uint32_t entry) {
      if ((entry & class_bit) != 0 && classes_[entry & ~class_bit] == normal) own = entry & ~class_bit;
    });
    if (own == class_bit && alone < crowd) return buckets_.add(key.tag, id);
    if (own == class_bit) {
      own = static_cast<std::uint32_t>(classes_.size());
      classes_.push_back(normal);
      buckets_.add(key.tag, own | class_bit);
    }
    members_.add(tag_of(own, cell(key.sign * key.value)), id);
  }

 private:
  static constexpr std::uint32_t class_bit = 1u << 31;
  static constexpr double class_width = 0x1p-43;  // normals of a class: much more than their rounding, much less than tolerances
  static constexpr std::size_t crowd = 4;  // hyperplanes without a class in one bucket
  double width_;  // of a bucket
  std::array<double, D> centre_;
  double size_, radius_, reach_, cell_;
  HashIndex buckets_;  // ids, and classes with `class_bit`
  std::vector<std::array<double, D>> classes_;  // their normals
  HashIndex members_;  // ids by class and value at the centre

  template <typename Visit>
  void find_in_class(std::uint32_t number, const Hyperplane<D>& h, const Key& key, const std::array<double, D>& point, Visit&& visit) const {
    const std::array<double, D>& normal = classes_[number];
    double dot = 0;
    for (int i = 0; i < D; ++i) dot += h.normal[i] * normal[i];
    const double sign = dot < 0 ? -1 : 1;
    // What a member has at the centre if it equals h at the point; and how far that may be off: by rounding, and since the
    // class's normal is not quite the member's. A primitive that comes from farther away than the model is large is so large
    // itself that hyperplanes that coincide all over it differ at the centre by little more than the reach.
    double value = key.value, slack = reach_ + 0x1p-48 * (radius_ + std::fabs(h.offset));
    for (int i = 0; i < D; ++i) {
      const double step = point[i] - centre_[i];
      if (std::fabs(step) > size_) {
        slack += 2 * reach_;
        continue;
      }
      value += (h.normal[i] - sign * normal[i]) * step;
      slack += class_width * std::fabs(step);
    }
    for (std::int64_t at = cell(sign * value - slack), last = cell(sign * value + slack); at <= last; ++at) members_.find(tag_of(number, at), visit);
  }

  [[nodiscard]] std::int64_t bucket(double f) const { return floor_of(f / width_); }
  [[nodiscard]] std::int64_t cell(double value) const { return floor_of(value / cell_); }
  /// Of what is far away, too.
  static std::int64_t floor_of(double x) {
    const double near = std::clamp(x, -0x1p60, 0x1p60);
    const auto whole = static_cast<std::int64_t>(near);  // towards 0
    return whole - (static_cast<double>(whole) > near ? 1 : 0);
  }
  static std::uint64_t mix(std::uint64_t hash, std::uint64_t x) {
    hash = (hash ^ x) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 32;
  }
  static std::uint32_t tag_of(const std::array<std::int64_t, 3>& at) {
    std::uint64_t hash = 0;
    for (const std::int64_t x : at) hash = mix(hash, static_cast<std::uint64_t>(x));
    return static_cast<std::uint32_t>(hash * 0x9e3779b97f4a7c15u >> 32);
  }
  static std::uint32_t tag_of(std::uint32_t number, std::int64_t cell) {
    return static_cast<std::uint32_t>(mix(mix(0, number + 1), static_cast<std::uint64_t>(cell)) * 0x9e3779b97f4a7c15u >> 32);
  }
};

}  // namespace bsp2::geometry
