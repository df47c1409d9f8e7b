#include "bsp2/geometry/hyperplane_table.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/dimensions.hpp"

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
  double largest = 0;
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
  grid_exponent_ = exponent_above(std::max({largest, size_, reach})) - 100;
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_map(const Matrix<D>& matrix, const std::array<double, D>& lower, const std::array<double, D>& upper) {
  maps_.emplace_back(matrix, grid_exponent_);
  Extent extent;
  for (int i = 0; i < D; ++i) {
    extent.centre[i] = (lower[i] + upper[i]) / 2;
    extent.half[i] = (upper[i] - lower[i]) / 2;
  }
  extents_.push_back(extent);
  return static_cast<std::uint32_t>(maps_.size() - 1);
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_map(const Matrix<D>& matrix) {
  std::array<double, D> lower, upper;
  for (int i = 0; i < D; ++i) {
    lower[i] = centre_[i] - size_ / 2;
    upper[i] = centre_[i] + size_ / 2;
  }
  return add_map(matrix, lower, upper);
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
  if (const auto rounded = round(maps_[source.map].map_rounded(covectors_[source.covector].rounded))) return *rounded;
  ExactCovector<D> world;
  maps_[source.map].map(covectors_[source.covector], world);
  return round_exactly(world);
}

/// Nothing if the coefficients cancelled too much.
template <int D>
std::optional<Hyperplane<D>> HyperplaneTable<D>::round(const typename AffineMap<D>::Rounded& world) const {
  long double square = 0, normal_error = 0;
  for (int i = 0; i < D; ++i) {
    square += world.value[i] * world.value[i];
    normal_error = std::max(normal_error, world.error[i]);
  }
  const long double length = std::sqrt(square);
  if (!(normal_error * D < length * 0x1p-50L)) return std::nullopt;
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
  if (constant_error > 0x1p-48 * (radius_ + std::fabs(result.offset))) return std::nullopt;
  return result;
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::round_exactly(const ExactCovector<D>& world) const {
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

namespace {

/// Finds hyperplanes whose coefficients are close: three linear forms of them, each cut into buckets.
template <int D>
class CoefficientHash {
 public:
  CoefficientHash(const std::array<double, D>& centre, double half, double tolerance, std::size_t expected)
      : width_(std::max(0x1p-10, 16 * tolerance)), centre_(centre), half_(half) {
    std::size_t size = 64;
    while (size < 2 * expected) size *= 2;
    heads_.assign(size, none);
  }

  /// Calls `visit` with each entry that may be within `window` of h or of its opposite.
  template <typename Visit>
  void find(const Hyperplane<D>& h, double window, Visit&& visit) const {
    const auto f = forms(h);
    for (const double sign : {1.0, -1.0}) {
      if (sign * f[0] < -2 * window) continue;  // entries have the sign that makes the first form positive
      std::array<std::int64_t, 3> low, high;
      for (int i = 0; i < 3; ++i) {
        low[i] = bucket(sign * f[i] - window);
        high[i] = bucket(sign * f[i] + window);
      }
      std::array<std::int64_t, 3> at;
      for (at[0] = low[0]; at[0] <= high[0]; ++at[0])
        for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
          for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
            for (std::uint32_t entry = heads_[slot(at)]; entry != none; entry = next_[entry]) visit(entry);
    }
  }

  /// Entries are numbered 0, 1, 2 ...
  void add(const Hyperplane<D>& h) {
    auto f = forms(h);
    std::array<std::int64_t, 3> at;
    for (int i = 0; i < 3; ++i) at[i] = bucket(f[0] < 0 ? -f[i] : f[i]);
    std::uint32_t& head = heads_[slot(at)];
    next_.push_back(head);
    head = static_cast<std::uint32_t>(next_.size() - 1);
  }

 private:
  static constexpr std::uint32_t none = ~0u;
  double width_;  // of a bucket
  std::array<double, D> centre_;
  double half_;
  std::vector<std::uint32_t> heads_, next_;

  std::array<double, 3> forms(const Hyperplane<D>& h) const {
    const double value = h.at(centre_) / half_;
    std::array<double, 3> f{0.618033988749895 * value, 0.414213562373095 * value, -0.302775637731995 * value};
    constexpr std::array<std::array<double, 6>, 3> weights{{{0.754877666, -0.569840291, 0.324717957, 0.219149, -0.8192, 0.4656},
                                                            {-0.465571232, 0.682327804, 0.867653, -0.3473, 0.2956, 0.7321},
                                                            {0.5436890127, 0.295597743, -0.8392867, 0.6180, 0.1323, -0.3813}}};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < D; ++i) f[k] += weights[k][i] * h.normal[i];
    return f;
  }
  [[nodiscard]] std::int64_t bucket(double f) const { return static_cast<std::int64_t>(std::floor(f / width_)); }
  [[nodiscard]] std::size_t slot(const std::array<std::int64_t, 3>& at) const {
    std::uint64_t hash = 0;
    for (const std::int64_t x : at) hash = (hash ^ static_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u, hash ^= hash >> 29;
    return hash & (heads_.size() - 1);
  }
};

}  // namespace

/// Occurrences, those of large primitives first.
template <int D>
std::vector<std::uint32_t> HyperplaneTable<D>::by_size() const {
  std::vector<std::uint32_t> order(sources_.size());
  std::vector<double> size(extents_.size());
  for (std::size_t i = 0; i < extents_.size(); ++i) size[i] = *std::max_element(extents_[i].half.begin(), extents_[i].half.end());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return size[sources_[a].map] > size[sources_[b].map]; });
  return order;
}

template <int D>
bool HyperplaneTable<D>::coincide(std::uint32_t occurrence, std::uint32_t representative, double tolerance, double& distance, bool& opposite) const {
  const Hyperplane<D>&h = hyperplanes_[occurrence], &r = hyperplanes_[representative];
  double dot = 0;
  for (int i = 0; i < D; ++i) dot += h.normal[i] * r.normal[i];
  opposite = dot < 0;
  const double sign = opposite ? -1 : 1;
  const Extent& extent = extents_[sources_[occurrence].map];
  double turn = 0;
  for (int i = 0; i < D; ++i) turn += std::fabs(h.normal[i] - sign * r.normal[i]);
  if (turn > 0x1p-10) return false;  // within a tiny primitive all faces are close; those that turn are not the same
  distance = std::fabs(h.at(extent.centre) - sign * r.at(extent.centre));
  for (int i = 0; i < D; ++i) distance += extent.half[i] * std::fabs(h.normal[i] - sign * r.normal[i]);
  if (tolerance > 0) return distance <= tolerance * size_;
  return distance <= 4 * D * (h.error + r.error) && equal(sources_[occurrence], sources_[representative], opposite);
}

template <int D>
std::vector<OrientedHyperplane> HyperplaneTable<D>::merge(double tolerance) {
  CoefficientHash<D> hash(centre_, size_, tolerance, sources_.size());
  std::vector<OrientedHyperplane> result(sources_.size());
  std::vector<std::uint32_t> representatives;  // by id
  for (const std::uint32_t i : by_size()) {
    // Coefficients of coincident hyperplanes differ the more, the smaller the primitive is.
    const auto& half = extents_[sources_[i].map].half;
    const double smallest = std::max(*std::min_element(half.begin(), half.end()), size_ * 0x1p-30);
    const double window = std::max(std::min(8 * tolerance * size_ / smallest, std::max(0x1p-12, 4 * tolerance)), 0x1p-44 * (1 + radius_ / size_));
    auto best = static_cast<std::uint32_t>(representatives.size());
    bool best_opposite = false;
    double best_distance = std::numeric_limits<double>::infinity();
    hash.find(hyperplanes_[i], window, [&](std::uint32_t id) {
      double distance;
      bool opposite;
      if (!coincide(i, representatives[id], tolerance, distance, opposite)) return;
      if (distance > best_distance || (distance == best_distance && id > best)) return;
      best = id;
      best_opposite = opposite;
      best_distance = distance;
    });
    if (best == representatives.size()) {
      representatives.push_back(i);
      hash.add(hyperplanes_[i]);
    }
    result[i] = oriented(best, best_opposite);
  }
  std::vector<Hyperplane<D>> hyperplanes;
  std::vector<Source> sources;
  for (const std::uint32_t i : representatives) {
    hyperplanes.push_back(hyperplanes_[i]);
    sources.push_back(sources_[i]);
  }
  hyperplanes_ = std::move(hyperplanes);
  sources_ = std::move(sources);
  extents_ = {};
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
HyperplaneId HyperplaneTable<D>::add_family(std::uint32_t map, const AnyFamily& family) {
  const std::uint32_t count = std::visit([](const auto& hyperplanes) { return hyperplanes.count(); }, family);
  if (count > free_ids()) throw std::logic_error("a family has more hyperplanes than there are ids left");
  families_.push_back({end_of_families(), map, count, family});
  return families_.back().first;
}

template <int D>
const typename HyperplaneTable<D>::Family& HyperplaneTable<D>::family_of(HyperplaneId id) const {
  return *std::prev(std::upper_bound(families_.begin(), families_.end(), id, [](HyperplaneId x, const Family& family) { return x < family.first; }));
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::family_rounded(HyperplaneId id) const {
  const Family& family = family_of(id);
  const auto local = std::visit([&](const auto& hyperplanes) { return hyperplanes.rounded(id - family.first); }, family.hyperplanes);
  if (const auto rounded = round(maps_[family.map].map_rounded(local))) return *rounded;
  return round_exactly(exact(id));
}

template <int D>
ExactCovector<D> HyperplaneTable<D>::exact(HyperplaneId id) const {
  ExactCovector<D> world;
  if (id >= hyperplanes_.size() && id < first_axis_id) {
    const Family& family = family_of(id);
    const auto local = std::visit([&](const auto& hyperplanes) { return hyperplanes.exact(id - family.first); }, family.hyperplanes);
    maps_[family.map].map(Covector<D>{local, {}}, world);
    return world;
  }
  if (id < first_axis_id) {
    maps_[sources_[id].map].map(covectors_[sources_[id].covector], world);
    return world;
  }
  const std::uint32_t code = id - first_axis_id;
  const int axis = static_cast<int>(code >> axis_bits);
  for (auto& coefficient : world) coefficient = 0;
  // value = m 2^e grid units; x - value = 0 times the power of two that makes it an integer.
  const double value = axis_value(axis, code & axis_steps);
  if (value == 0) {
    world[axis] = 1;
    return world;
  }
  int e = 0;
  const double mantissa = std::frexp(value, &e);
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

template <int D>
int HyperplaneTable<D>::side(const std::array<double, D>& point, HyperplaneId id) const {
  const Hyperplane<D> h = rounded(id);
  double reach = 0;
  for (const double x : point) reach = std::max(reach, std::fabs(x));
  const double value = h.at(point), bound = h.error * (1 + reach / radius_);  // `error` holds within the radius
  if (value > bound) return 1;
  if (value < -bound) return -1;
  // A coordinate is m 2^e grid units. All terms are brought to the smallest power of two.
  using Integer = mp::cpp_int;
  std::array<std::int64_t, D> mantissa{};
  std::array<int, D> exponent{};
  int least = 0;
  for (int i = 0; i < D; ++i) {
    mantissa[i] = static_cast<std::int64_t>(std::ldexp(std::frexp(point[i], &exponent[i]), 53));
    exponent[i] -= 53 + grid_exponent_;
    if (mantissa[i] != 0) least = std::min(least, exponent[i]);
  }
  const ExactCovector<D> covector = exact(id);
  Integer sum = Integer(covector[D]) << static_cast<unsigned>(-least);
  for (int i = 0; i < D; ++i)
    if (mantissa[i] != 0) sum += (Integer(covector[i]) * mantissa[i]) << static_cast<unsigned>(exponent[i] - least);
  return sum.sign();
}

#define BSP2_INSTANTIATE(D) template class HyperplaneTable<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
