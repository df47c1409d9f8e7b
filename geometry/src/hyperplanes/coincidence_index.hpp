#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "bsp2/geometry/exact/hyperplane.hpp"
#include "support/vector_lanes.hpp"

namespace bsp2::geometry {

/// Numbers by 32 bits of hash, in one array: most look-ups read one place of memory. Grows; nothing is taken
/// out.
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
  [[gnu::always_inline]] void find(std::uint32_t tag, Visit&& visit) const {
    for (std::size_t at = place(tag); entries_[at].value != none; at = (at + 1) & (entries_.size() - 1))
      if (entries_[at].tag == tag) visit(entries_[at].value);
  }
  /// The value of the entry in the tag's own place, if it is one of the tag.
  [[nodiscard]] std::optional<std::uint32_t> first(std::uint32_t tag) const {
    const Entry& entry = entries_[place(tag)];
    return entry.tag == tag && entry.value != none ? std::optional(entry.value) : std::nullopt;
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
/// A bucket with many hyperplanes keeps those that come last by classes: of the same normal but for its last
/// bits, as models have them that are full of boxes along the axes, or of one solid at many places. Those of
/// a class are found by where they pass.
template <int D>
class CoincidenceIndex {
  using Forms = Lanes;  // three of them

 public:
  /// @param centre, size of the model.
  /// @param bucket width of one, as a share of the size; the power of two below it is taken.
  CoincidenceIndex(const std::array<double, D>& centre, double size, double radius, double bucket)
      : width_(std::ldexp(1.0, std::ilogb(bucket))),
        per_width_(1 / width_),
        centre_(centre),
        size_(size),
        radius_(radius) {}

  /// Before any is added: hyperplanes are looked for that are at most so far apart at a point.
  void set_reach(double reach) {
    reach_ = reach;
    cell_ = 4 * std::max({reach, class_width * size_, 0x1p-46 * radius_});
  }

  /// Turning a normal by 1 in all, as a sum over the axes, changes no form by more where it moves the
  /// hyperplane by half the model's size at the centre: 0.868 + 0.618 / 2.
  static constexpr double sensitivity = 1.2;

  /// Where a hyperplane is looked for.
  struct Key {
    double margin;  // how far the forms, with the sign that makes the first one positive, are from those of
                    // the next bucket or the other sign
    std::uint32_t tag;  // of the bucket
  };
  /// Any number of threads may ask.
  [[nodiscard]] Key key(const Hyperplane<D>& h) const {
    const Place place(*this, h);
    const Forms forms = place.forms * place.sign;
    Forms scaled = forms * per_width_;
    if (std::fabs(place.value) > far * size_ * width_)
        [[unlikely]]  // forms are at most 1.5 more than 0.62 of value by size
      clamp(scaled);
    const Forms middle = scaled + to_whole;
    const Forms off = (scaled - (middle - to_whole)) * width_;  // exact: the width is a power of two
    const double farthest = std::max({std::fabs(off[0]), std::fabs(off[1]), std::fabs(off[2])});
    return {std::min(forms[0] / 2, width_ / 2 - farthest), tag_of(reinterpret_cast<Bits>(middle))};
  }
  /// Fetches from memory what `find` will begin with.
  void prefetch(const Key& key) const { buckets_.prefetch(key.tag); }
  /// The first hyperplane in its bucket, if it can be told from one look.
  [[nodiscard]] std::optional<std::uint32_t> first(const Key& key) const {
    const auto entry = buckets_.first(key.tag);
    return entry && (*entry & class_bit) == 0 ? entry : std::nullopt;
  }

  /// Calls `visit` with each id whose hyperplane, or the opposite one, is within `window` of h in all forms
  /// and within the reach of it at `point`; and with some others.
  template <typename Visit>
  void find(const Hyperplane<D>& h, const Key& key, const std::array<double, D>& point, double window,
            Visit&& visit) const {
    const auto visit_entry = [&](std::uint32_t entry) {
      if ((entry & class_bit) == 0)
        visit(entry);
      else
        find_in_class(entry & ~class_bit, h, point, visit);
    };
    if (window < key.margin) return buckets_.find(key.tag, visit_entry);  // as mostly
    find_widely(Place(*this, h), window, visit_entry);
  }

  void add(const Hyperplane<D>& h, const Key& key, std::uint32_t id) {
    std::size_t alone = 0;
    bool has_classes = false;
    buckets_.find(key.tag, [&](std::uint32_t entry) {
      (entry & class_bit) == 0 ? void(++alone) : void(has_classes = true);
    });
    if (!has_classes && alone < crowd) return buckets_.add(key.tag, id);  // as mostly
    const Place place(*this, h);
    std::array<double, D> normal;
    for (int i = 0; i < D; ++i)
      normal[i] = std::nearbyint(place.sign * h.normal[i] / class_width) * class_width + 0.0;  // one zero
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
    members_.add(tag_of(own, cell(place.sign * place.value)), id);
  }

 private:
  static constexpr std::uint32_t class_bit = 1u << 31;
  static constexpr double class_width =
      0x1p-43;  // normals of a class: much more than their rounding, much less than tolerances
  static constexpr std::size_t crowd = 4;  // hyperplanes without a class in one bucket
  double width_, per_width_;               // of a bucket, and 1 by it: powers of two
  std::array<double, D> centre_;
  double size_, radius_, reach_ = 0, cell_ = 0;
  HashIndex buckets_;                           // ids, and classes with `class_bit`
  std::vector<std::array<double, D>> classes_;  // their normals
  HashIndex members_;                           // ids by class and value at the centre

  /// Where a hyperplane is in the space of the forms.
  struct Place {
    double value;  // at the centre
    Forms forms;
    double sign;  // that makes the first form positive

    Place(const CoincidenceIndex& index, const Hyperplane<D>& h) : value(h.at(index.centre_)) {
      static constexpr Forms of_value{0.618033988749895, 0.414213562373095, -0.302775637731995};
      static constexpr Forms of_normal[]{{0.754877666, -0.465571232, 0.5436890127},
                                         {-0.569840291, 0.682327804, 0.295597743},
                                         {0.324717957, 0.867653, -0.8392867},
                                         {0.219149, -0.3473, 0.6180},
                                         {-0.8192, 0.2956, 0.1323},
                                         {0.4656, 0.7321, -0.3813}};
      forms = of_value * (value / index.size_);
      for (int i = 0; i < D; ++i) forms += of_normal[i] * h.normal[i];
      sign = forms[0] < 0 ? -1 : 1;
    }
  };

  /// In all buckets that the window touches.
  template <typename Visit>
  [[gnu::noinline]] void find_widely(const Place& place, double window, const Visit& visit) const {
    for (const double sign : {1.0, -1.0}) {
      if (sign * place.forms[0] < -2 * window)
        continue;  // entries have the sign that makes the first form positive
      Forms first = (place.forms * sign - window) * per_width_,
            last = (place.forms * sign + window) * per_width_;
      clamp(first);
      clamp(last);
      const auto low = reinterpret_cast<Bits>(first + to_whole),
                 high = reinterpret_cast<Bits>(last + to_whole);
      Bits at = low;
      for (at[0] = low[0]; at[0] <= high[0]; ++at[0])
        for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
          for (at[2] = low[2]; at[2] <= high[2]; ++at[2]) buckets_.find(tag_of(at), visit);
    }
  }

  template <typename Visit>
  void find_in_class(std::uint32_t number, const Hyperplane<D>& h, const std::array<double, D>& point,
                     Visit&& visit) const {
    const std::array<double, D>& normal = classes_[number];
    double dot = 0;
    for (int i = 0; i < D; ++i) dot += h.normal[i] * normal[i];
    const double sign = dot < 0 ? -1 : 1;
    // What a member has at the centre if it equals h at the point; and how far that may be off: by rounding,
    // and since the class's normal is not quite the member's. A primitive that comes from farther away than
    // the model is large is so large itself that hyperplanes that coincide all over it differ at the centre
    // by little more than the reach.
    double value = h.at(centre_), slack = reach_ + 0x1p-48 * (radius_ + std::fabs(h.offset));
    for (int i = 0; i < D; ++i) {
      const double step = point[i] - centre_[i];
      if (std::fabs(step) > size_) {
        slack += 2 * reach_;
        continue;
      }
      value += (h.normal[i] - sign * normal[i]) * step;
      slack += class_width * std::fabs(step);
    }
    for (std::int64_t at = cell(sign * value - slack), last = cell(sign * value + slack); at <= last; ++at)
      members_.find(tag_of(number, at), visit);
  }

  // Buckets are the whole numbers nearest to forms by the width: they have this added, as numbers of its size
  // are whole, and follow each other as their bits do.
  static constexpr double to_whole = 0x1.8p52, far = 0x1p50;
  static void clamp(Forms& scaled) {
    for (int i = 0; i < 3; ++i) scaled[i] = std::clamp(scaled[i], -far, far);
  }
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
  [[gnu::always_inline]] static std::uint32_t tag_of(const Bits& at) {
    std::uint64_t hash = 0;
    for (int i = 0; i < 3; ++i) hash = mix(hash, at[i]);
    return static_cast<std::uint32_t>(hash * 0x9e3779b97f4a7c15u >> 32);
  }
  static std::uint32_t tag_of(std::uint32_t number, std::int64_t cell) {
    return static_cast<std::uint32_t>(
        mix(mix(0, number + 1), static_cast<std::uint64_t>(cell)) * 0x9e3779b97f4a7c15u >> 32);
  }
};

}  // namespace bsp2::geometry
