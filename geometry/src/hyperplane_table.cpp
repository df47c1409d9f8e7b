#include "bsp2/geometry/hyperplane_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace bsp2::geometry {
namespace {

constexpr double roundoff = 0x1p-53;

/// Exponent e with 2^e >= |x|.
int exponent_above(double x) {
  int e = 0;
  std::frexp(x, &e);
  return e;
}

}  // namespace

template <int D>
HyperplaneTable<D>::HyperplaneTable(const std::array<double, D>& lower, const std::array<double, D>& upper, double reach) {
  double largest = reach;
  for (int i = 0; i < D; ++i) {
    size_ = std::max(size_, upper[i] - lower[i]);
    largest = std::max({largest, std::fabs(lower[i]), std::fabs(upper[i])});
  }
  if (size_ <= 0) size_ = largest > 0 ? largest : 1;
  for (int i = 0; i < D; ++i) {
    // Margin on all sides, so that no face of the model nearly coincides with the root cell. The step is a power of
    // two and the origin a multiple of it: all positions are exact doubles.
    const double extent = std::max(upper[i] - lower[i], size_ * 0x1p-20);
    step_[i] = std::max(std::ldexp(1.0, exponent_above(extent * (1 + 0x1p-4)) - static_cast<int>(axis_bits)),
                        std::ldexp(1.0, exponent_above(largest + size_) - 50));
    const double width = step_[i] * axis_steps;
    origin_[i] = std::floor((lower[i] - (width - extent) / 2) / step_[i]) * step_[i];
    centre_[i] = origin_[i] + width / 2;
    radius_ = std::max({radius_, std::fabs(origin_[i]), std::fabs(origin_[i] + width)});
  }
  grid_exponent_ = exponent_above(std::max(largest, size_)) - 100;
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_map(const Matrix<D>& matrix) {
  maps_.emplace_back(matrix, grid_exponent_);
  return static_cast<std::uint32_t>(maps_.size() - 1);
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_covectors(std::span<const Covector<D>> covectors) {
  const auto first = static_cast<std::uint32_t>(covectors_.size());
  covectors_.insert(covectors_.end(), covectors.begin(), covectors.end());
  return first;
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_occurrence(std::uint32_t map, std::uint32_t covector) {
  sources_.push_back({map, covector});
  hyperplanes_.push_back(round(sources_.back()));
  return static_cast<std::uint32_t>(sources_.size() - 1);
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::round(const Source& source) const {
  const auto world = maps_[source.map].map_rounded(covectors_[source.covector]);
  long double square = 0, normal_error = 0;
  for (int i = 0; i < D; ++i) {
    square += world.value[i] * world.value[i];
    normal_error = std::max(normal_error, world.error[i]);
  }
  const long double length = std::sqrt(square);
  if (!(normal_error * D < length * 0x1p-50L)) return round_exactly(source);
  Hyperplane<D> result;
  const long double unit = std::ldexp(1.0L, grid_exponent_);
  for (int i = 0; i < D; ++i) result.normal[i] = static_cast<double>(world.value[i] / length);
  result.offset = static_cast<double>(world.value[D] / length * unit);
  const double constant_error = static_cast<double>(world.error[D] / length * unit);
  const double coefficient_error = static_cast<double>(2 * normal_error * D / length) + 2 * roundoff;
  // Rounding of the coefficients, then of the D products and sums of `at`, each at most 2^-53 of the sizes involved.
  result.error = D * radius_ * coefficient_error + constant_error + 2 * roundoff * std::fabs(result.offset) +
                 (D + 2) * roundoff * (D * radius_ + std::fabs(result.offset));
  // A covector of the frame that is far away from its primitive would be rounded badly; never seen, but kept exact.
  if (constant_error > 0x1p-48 * (radius_ + std::fabs(result.offset))) return round_exactly(source);
  return result;
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::round_exactly(const Source& source) const {
  ExactCovector<D> world;
  maps_[source.map].map(covectors_[source.covector], world);
  long top = 0;
  for (int i = 0; i < D; ++i)
    if (!world[i].is_zero()) top = std::max(top, static_cast<long>(mp::msb(ExactInteger<D>(mp::abs(world[i])))));
  std::array<double, D> normal;
  double square = 0;
  for (int i = 0; i < D; ++i) {
    normal[i] = scaled_to_double(world[i], top);
    square += normal[i] * normal[i];
  }
  const double length = std::sqrt(square);
  Hyperplane<D> result;
  for (int i = 0; i < D; ++i) result.normal[i] = length > 0 ? normal[i] / length : 0;
  result.offset = length > 0 ? scaled_to_double(world[D], top - grid_exponent_) / length : 0;
  result.error = (3 * D + 12) * roundoff * (D * radius_ + std::fabs(result.offset));
  return result;
}

template <int D>
bool HyperplaneTable<D>::equal(const Source& a, const Source& b, bool opposite) const {
  ExactCovector<D> u, v;
  maps_[a.map].map(covectors_[a.covector], u);
  maps_[b.map].map(covectors_[b.covector], v);
  int pivot = 0;
  for (int i = 1; i < D; ++i)
    if (mp::abs(u[i]) > mp::abs(u[pivot])) pivot = i;
  if (u[pivot].is_zero() || v[pivot].is_zero() || (u[pivot].sign() != v[pivot].sign()) != opposite) return false;
  for (int i = 0; i <= D; ++i)
    if (u[i] * v[pivot] != v[i] * u[pivot]) return false;
  return true;
}

template <int D>
std::vector<OrientedHyperplane> HyperplaneTable<D>::merge(double tolerance) {
  // Each occurrence joins the nearest earlier representative within the tolerance, or becomes one. Candidates are found
  // by a hash of |f|, f a linear form of the coefficients: close hyperplanes have close f, opposite ones opposite f.
  const double half = size_;
  const double window = 8 * (D + 1) * std::max(tolerance, 0x1p-46 * (1 + radius_ / size_)), bucket_width = 32 * window;
  const auto form = [&](const Hyperplane<D>& h) {
    double value = h.at(centre_) / half, f = 0.6180339887498949 * value;
    for (int i = 0; i < D; ++i) f += h.normal[i] * (0.7548776662466927 - 0.2451223337533073 * i * (i % 2 == 0 ? 0.83 : 1.17));
    return f;
  };
  std::vector<OrientedHyperplane> result(sources_.size());
  std::vector<std::uint32_t> next;                           // chains representatives of one bucket
  std::unordered_map<std::int64_t, std::uint32_t> buckets;  // last representative of a bucket, plus one
  buckets.reserve(sources_.size() / 2);
  std::uint32_t count = 0;
  const auto distance = [&](const Hyperplane<D>& a, const Hyperplane<D>& b, double sign) {
    double sum = std::fabs(a.at(centre_) - sign * b.at(centre_));
    for (int i = 0; i < D; ++i) sum += half * std::fabs(a.normal[i] - sign * b.normal[i]);
    return sum;
  };
  for (std::uint32_t i = 0; i < sources_.size(); ++i) {
    const Hyperplane<D> h = hyperplanes_[i];
    const Source source = sources_[i];
    const double key = std::fabs(form(h)) / bucket_width;
    std::uint32_t best = count;
    bool best_flipped = false;
    double best_distance = std::numeric_limits<double>::infinity();
    const auto low = static_cast<std::int64_t>(std::floor(key - 1.0 / 32)), high = static_cast<std::int64_t>(std::floor(key + 1.0 / 32));
    for (std::int64_t bucket = low; bucket <= high; ++bucket) {
      const auto found = buckets.find(bucket);
      for (std::uint32_t r = found == buckets.end() ? 0 : found->second; r != 0; r = next[r - 1]) {
        const Hyperplane<D>& other = hyperplanes_[r - 1];
        double dot = 0;
        for (int k = 0; k < D; ++k) dot += h.normal[k] * other.normal[k];
        const double d = distance(h, other, dot < 0 ? -1 : 1);
        const bool same = tolerance > 0 ? d <= tolerance * size_ : d <= 4 * D * (h.error + other.error) && equal(source, sources_[r - 1], dot < 0);
        if (same && (d < best_distance || (d == best_distance && r - 1 < best))) {
          best = r - 1;
          best_flipped = dot < 0;
          best_distance = d;
        }
      }
    }
    if (best == count) {  // in place: count <= i
      hyperplanes_[count] = h;
      sources_[count] = source;
      std::uint32_t& head = buckets[static_cast<std::int64_t>(std::floor(key))];
      next.push_back(head);
      head = ++count;
    }
    result[i] = oriented(best, best_flipped);
  }
  hyperplanes_.resize(count);
  hyperplanes_.shrink_to_fit();
  sources_.resize(count);
  sources_.shrink_to_fit();
  return result;
}

template <int D>
std::uint32_t HyperplaneTable<D>::axis_position(int axis, double x) const {
  const double position = std::floor((x - origin_[axis]) / step_[axis]);
  return static_cast<std::uint32_t>(std::clamp(position, 0.0, static_cast<double>(axis_steps)));
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::axis_rounded(HyperplaneId id) const {
  const std::uint32_t code = id - first_axis_id;
  const int axis = static_cast<int>(code >> axis_bits);
  Hyperplane<D> result{};
  result.normal[axis] = 1;
  result.offset = -axis_value(axis, code & axis_steps);
  result.error = 2 * roundoff * radius_;  // of the one subtraction; the coefficients are exact
  return result;
}

template <int D>
ExactCovector<D> HyperplaneTable<D>::exact(HyperplaneId id) const {
  ExactCovector<D> world;
  if (id < first_axis_id) {
    maps_[sources_[id].map].map(covectors_[sources_[id].covector], world);
    return world;
  }
  const std::uint32_t code = id - first_axis_id;
  const int axis = static_cast<int>(code >> axis_bits);
  for (auto& coefficient : world) coefficient = 0;
  // value = m 2^e grid units; x - value = 0 times the power of two that makes it an integer.
  int e = 0;
  const double mantissa = std::frexp(axis_value(axis, code & axis_steps), &e);
  const auto m = static_cast<std::int64_t>(std::ldexp(mantissa, 53));
  e -= 53 + grid_exponent_;
  world[axis] = 1;
  world[D] = -m;
  if (e >= 0)
    world[D] <<= e;
  else
    world[axis] <<= -e;
  return world;
}

template class HyperplaneTable<1>;
template class HyperplaneTable<2>;
template class HyperplaneTable<3>;
template class HyperplaneTable<4>;
template class HyperplaneTable<5>;
template class HyperplaneTable<6>;

}  // namespace bsp2::geometry
