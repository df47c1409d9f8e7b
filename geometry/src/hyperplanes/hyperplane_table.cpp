#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "hyperplanes/coincidence_index.hpp"

namespace bsp2::geometry {
namespace {

constexpr double roundoff = 0x1p-53;
constexpr double most_turn =
    0x1p-10;  // between the normals of coincident hyperplanes, as a sum over the axes

/// Exponent e with 2^e >= |x|.
int exponent_above(double x) {
  int e = 0;
  std::frexp(x, &e);
  return e;
}

/// The length of a covector's normal, and the largest error of its coefficients.
template <int D, typename Rounded>
std::pair<long double, double> length_of_normal(const Rounded& world) {
  long double square = 0;
  double error = 0;
  for (int i = 0; i < D; ++i) {
    square += world.value[i] * world.value[i];
    error = std::max(error, world.error[i]);
  }
  return {std::sqrt(square), error};
}

}  // namespace

template <int D>
HyperplaneTable<D>::HyperplaneTable(const std::array<double, D>& lower, const std::array<double, D>& upper,
                                    double reach) {
  double largest = 0;
  for (int i = 0; i < D; ++i) {
    size_ = std::max(size_, upper[i] - lower[i]);
    largest = std::max({largest, std::fabs(lower[i]), std::fabs(upper[i])});
  }
  if (size_ <= 0) size_ = largest > 0 ? largest : 1;
  for (int i = 0; i < D; ++i) {
    // Margin on all sides, so that no face of the model nearly coincides with the root cell. The step is a
    // power of two and the origin a multiple of it: all positions are exact doubles.
    const double extent = std::max(upper[i] - lower[i], size_ * 0x1p-20);
    step_[i] = std::max(std::ldexp(1.0, exponent_above(extent * (1 + 0x1p-4)) - static_cast<int>(axis_bits)),
                        std::ldexp(1.0, exponent_above(largest + size_) - 50));
    const double width = step_[i] * axis_steps;
    origin_[i] = std::floor((lower[i] - (width - extent) / 2) / step_[i]) * step_[i];
    centre_[i] = origin_[i] + width / 2;
    radius_ = std::max({radius_, std::fabs(origin_[i]), std::fabs(origin_[i] + width)});
  }
  grid_exponent_ = exponent_above(std::max({largest, size_, reach})) - 100;
  grid_unit_ = std::ldexp(1.0L, grid_exponent_);
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_maps(std::size_t count) {
  const std::size_t first = maps_.size();
  maps_.resize(first + count);
  extents_.resize(first + count);
  return static_cast<std::uint32_t>(first);
}

template <int D>
void HyperplaneTable<D>::set_map(std::uint32_t map, const Matrix<D>& matrix,
                                 const std::array<double, D>& lower, const std::array<double, D>& upper) {
  maps_[map] = AffineMap<D>(matrix, grid_exponent_);
  Extent& extent = extents_[map];
  for (int i = 0; i < D; ++i) {
    extent.centre[i] = (lower[i] + upper[i]) / 2;
    extent.half[i] = (upper[i] - lower[i]) / 2;
  }
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_map(const Matrix<D>& matrix, const std::array<double, D>& lower,
                                          const std::array<double, D>& upper) {
  const std::uint32_t map = add_maps(1);
  set_map(map, matrix, lower, upper);
  return map;
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
std::uint32_t HyperplaneTable<D>::add_covectors(std::vector<Covector<D>>&& covectors) {
  if (!covectors_.empty()) return add_covectors(std::span<const Covector<D>>(covectors));
  covectors_ = std::move(covectors);
  return 0;
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_occurrences(std::uint32_t map, std::uint32_t covector,
                                                  std::uint32_t count) {
  const std::uint32_t number =
      occurrences_.empty() ? 0 : occurrences_.back().first + occurrences_.back().count;
  if (!occurrences_.empty() && occurrences_.back().map == map &&
      occurrences_.back().covector + occurrences_.back().count == covector)
    occurrences_.back().count += count;
  else if (count > 0)
    occurrences_.push_back({map, covector, number, count});
  return number;
}

template <int D>
void HyperplaneTable<D>::reserve(std::size_t maps) {
  maps_.reserve(maps);
  extents_.reserve(maps);
  occurrences_.reserve(maps);
}

/// Some stretches and their hyperplanes, one after the other.
template <int D>
struct HyperplaneTable<D>::Window {
  std::span<Stretch> stretches;
  std::vector<std::size_t> begin;  // of each stretch among the hyperplanes
  std::vector<Hyperplane<D>> hyperplanes;
  std::vector<typename CoincidenceIndex<D>::Key> keys;  // of the hyperplanes
  std::vector<std::uint64_t> marks;                     // of their covectors, where there is no tolerance
  std::vector<std::uint32_t> last_alike;                // the last stretch of a hash
};

// --- rounding ---

/// Rounds the hyperplanes of a window.
template <int D>
void HyperplaneTable<D>::round(Window& window, unsigned threads) const {
  constexpr std::size_t grain = 16;
  window.begin.clear();
  std::size_t count = 0;
  for (const Stretch& stretch : window.stretches) {
    window.begin.push_back(count);
    count += stretch.count;
  }
  window.hyperplanes.resize(count);
  chain_alike(window);
  for_each_range(window.stretches.size(), grain, threads, [&](std::size_t first, std::size_t end) {
    std::vector<std::optional<Direction>> directions;
    for (std::size_t i = first; i < end; ++i) {
      if (i + 2 < end) {  // maps are not in the order of sizes
        const auto* const soon = reinterpret_cast<const char*>(&maps_[window.stretches[i + 2].map]);
        for (std::size_t line = 0; line < sizeof(AffineMap<D>); line += 64) __builtin_prefetch(soon + line);
      }
      if (window.stretches[i].place == 0) round_alike(window, i, directions);
    }
  });
}

/// Stretches of translates with the same covectors, as of one solid at many places, make chains: not longer
/// than a thread should have to round at once, and a new one where two kinds share an entry of the table and
/// take turns in it.
template <int D>
void HyperplaneTable<D>::chain_alike(Window& window) const {
  constexpr std::uint32_t longest_chain = 64;
  const auto are_alike = [&](const Stretch& a, const Stretch& b) {
    return a.hash == b.hash && a.covector == b.covector && a.count == b.count &&
           maps_[a.map].is_translate_of(maps_[b.map]);
  };
  window.last_alike.assign(std::bit_ceil(2 * window.stretches.size()), Stretch::none);
  for (std::uint32_t i = 0; i < window.stretches.size(); ++i) {
    Stretch& stretch = window.stretches[i];
    std::uint32_t& last = window.last_alike[stretch.hash >> 32 & (window.last_alike.size() - 1)];
    if (last != Stretch::none && window.stretches[last].place + 1 < longest_chain &&
        are_alike(window.stretches[last], stretch)) {
      window.stretches[last].next = i;
      stretch.place = window.stretches[last].place + 1;
    }
    last = i;
  }
}

/// Rounds a stretch and those that are chained to it.
/// @param directions room for the normals, which they have in common.
template <int D>
void HyperplaneTable<D>::round_alike(Window& window, std::size_t leader,
                                     std::vector<std::optional<Direction>>& directions) const {
  const Stretch& first = window.stretches[leader];
  const AffineMap<D>& first_map = maps_[first.map];
  const Covector<D>* const covectors = covectors_.data() + first.covector;
  auto rounding = first_map.rounding();
  directions.clear();
  for (std::uint32_t i = 0; i < first.count; ++i)
    directions.push_back(direction_of(first_map.map_normal_rounded(covectors[i].rounded, rounding)));
  for (std::size_t at = leader; at != Stretch::none; at = window.stretches[at].next) {
    const AffineMap<D>& map = maps_[window.stretches[at].map];
    Hyperplane<D>* const hyperplanes = window.hyperplanes.data() + window.begin[at];
    rounding.translation = map.translation();
    for (std::uint32_t i = 0; i < first.count; ++i) {
      const auto& direction = directions[i];
      std::optional<Hyperplane<D>> rounded;
      if (direction)
        rounded = at_distance(*direction,
                              map.map_constant_rounded(covectors[i].rounded, direction->normal, rounding));
      if (rounded) {
        hyperplanes[i] = *rounded;
        continue;
      }
      ExactCovector<D> world;
      map.map(covectors[i], world);
      hyperplanes[i] = round_exactly(world);
    }
  }
}

/// Nothing if the coefficients cancelled too much.
template <int D>
auto HyperplaneTable<D>::direction_of(const typename AffineMap<D>::RoundedNormal& normal) const
    -> std::optional<Direction> {
  const auto [length, normal_error] = length_of_normal<D>(normal);
  const auto rounded_length = static_cast<double>(length);
  if (!(normal_error * D < rounded_length * 0x1p-50)) return std::nullopt;
  Direction result{normal,
                   length,
                   {},
                   2 * normal_error * D / rounded_length + 2 * roundoff,
                   static_cast<double>(grid_unit_) / rounded_length * (1 + 0x1p-50)};
  for (int i = 0; i < D; ++i) result.unit[i] = static_cast<double>(normal.value[i] / length);
  return result;
}

/// Nothing if the constant cancelled too much: a covector of the frame that is far away from its primitive;
/// never seen, but kept exact.
template <int D>
std::optional<Hyperplane<D>> HyperplaneTable<D>::at_distance(
    const Direction& direction, const typename AffineMap<D>::RoundedConstant& constant) const {
  Hyperplane<D> result;
  result.normal = direction.unit;
  result.offset = static_cast<double>(constant.value / direction.length * grid_unit_);
  const double constant_error = constant.error * direction.grid_units;
  // Rounding of the coefficients, then of the D products and sums of `at`, each at most 2^-53 of the sizes
  // involved.
  result.error = D * radius_ * direction.error + constant_error + 2 * roundoff * std::fabs(result.offset) +
                 (D + 2) * roundoff * (D * radius_ + std::fabs(result.offset));
  if (constant_error > 0x1p-48 * (radius_ + std::fabs(result.offset))) return std::nullopt;
  return result;
}

template <int D>
std::optional<typename HyperplaneTable<D>::Refined> HyperplaneTable<D>::refined(HyperplaneId id,
                                                                                LastMap& last) const {
  constexpr long double unit_roundoff = 0x1p-64L;
  Refined result{};
  if (id >= first_axis_id) {
    const Hyperplane<D> h = axis_rounded(id);
    std::copy(h.normal.begin(), h.normal.end(), result.normal.begin());
    result.offset = h.offset;
    result.error = 2 * unit_roundoff * radius_;  // of the one subtraction
    return result;
  }
  if (id >= sources_.size()) return std::nullopt;
  const Source& source = sources_[id];
  const AffineMap<D>& map = maps_[source.map];
  if (last.number != source.map) last = {source.map, map.rounding()};
  const auto world = map.map_rounded(covectors_[source.covector].rounded, last.rounding);
  const auto [length, normal_error] = length_of_normal<D>(world);
  if (!(static_cast<long double>(normal_error) < length * 0x1p-50L)) return std::nullopt;
  for (int i = 0; i < D; ++i) result.normal[i] = world.value[i] / length;
  result.offset = world.value[D] / length * grid_unit_;
  // That the length is rounded makes it another multiple of the same hyperplane. Then as in `round`.
  const long double size = std::fabs(result.offset), reach = D * static_cast<long double>(radius_);
  result.error = reach * (2 * normal_error / length + 2 * unit_roundoff) +
                 2 * world.error[D] / length * grid_unit_ + 4 * unit_roundoff * size +
                 (D + 2) * unit_roundoff * (reach + size);
  return result;
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::round_exactly(const ExactCovector<D>& world) const {
  long top = 0;
  for (int i = 0; i < D; ++i)
    if (!world[i].is_zero())
      top = std::max(top, static_cast<long>(mp::msb(ExactInteger<D>(mp::abs(world[i])))));
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

namespace {

/// @tparam Product holds products of coefficients.
template <typename Product, typename Integer, std::size_t N>
bool are_multiples(const std::array<Integer, N>& u, const std::array<Integer, N>& v, bool opposite) {
  std::size_t pivot = 0;
  for (std::size_t i = 1; i + 1 < N; ++i)
    if (mp::abs(u[i]) > mp::abs(u[pivot])) pivot = i;
  if (u[pivot].is_zero() || v[pivot].is_zero() || (u[pivot].sign() != v[pivot].sign()) != opposite)
    return false;
  // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): of another type, but for some
  const Product of_u(u[pivot]), of_v(v[pivot]);
  for (std::size_t i = 0; i < N; ++i)
    if (Product(u[i]) * of_v != Product(v[i]) * of_u) return false;
  return true;
}

}  // namespace

template <int D>
bool HyperplaneTable<D>::equal(const Source& a, const Source& b, bool opposite) const {
  if (a.map == b.map && maps_[a.map].orientation() != 0)  // what keeps planes apart in the frame, too
    return are_multiples<FixedInteger<512>>(covectors_[a.covector].exact, covectors_[b.covector].exact,
                                            opposite);
  ExactCovector<D> u, v;
  maps_[a.map].map(covectors_[a.covector], u);
  maps_[b.map].map(covectors_[b.covector], v);
  return are_multiples<ExactInteger<D>>(u, v, opposite);
}

/// The occurrences, those of large primitives first, in pieces that threads can share out.
template <int D>
auto HyperplaneTable<D>::by_size(unsigned threads) const -> std::vector<Stretch> {
  constexpr std::uint32_t most = 256;
  std::vector<std::uint64_t> hash(maps_.size());
  for_each_range(maps_.size(), 16384, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) hash[i] = maps_[i].hash_of_linear_part();
  });
  std::vector<double> size(extents_.size());
  for (std::size_t i = 0; i < size.size(); ++i)
    size[i] = *std::max_element(extents_[i].half.begin(), extents_[i].half.end());
  std::vector<std::uint32_t> order(occurrences_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return size[occurrences_[a].map] > size[occurrences_[b].map];
  });
  std::vector<Stretch> stretches;
  stretches.reserve(order.size());
  for (const std::uint32_t i : order) {
    const Stretch& whole = occurrences_[i];
    for (std::uint32_t begin = 0; begin < whole.count; begin += most) {
      const std::uint32_t covector = whole.covector + begin;
      stretches.push_back({.map = whole.map,
                           .covector = covector,
                           .first = whole.first + begin,
                           .count = std::min(most, whole.count - begin),
                           .hash = hash[whole.map] + covector * 0x9e3779b97f4a7c15u});
    }
  }
  return stretches;
}

/// Whether an occurrence coincides with a representative within a tolerance, at which distance and on which
/// side.
template <int D>
bool HyperplaneTable<D>::coincide(const Occurrence& a, const Occurrence& representative, double tolerance,
                                  double& distance, bool& opposite) const {
  const Hyperplane<D>&h = *a.hyperplane, &r = *representative.hyperplane;
  double dot = 0;
  for (int i = 0; i < D; ++i) dot += h.normal[i] * r.normal[i];
  opposite = dot < 0;
  const double sign = opposite ? -1 : 1;
  const Extent& extent = extents_[a.source.map];
  distance = std::fabs(h.at(extent.centre) - sign * r.at(extent.centre));
  if (distance > tolerance * size_) return false;
  double turn = 0;
  for (int i = 0; i < D; ++i) turn += std::fabs(h.normal[i] - sign * r.normal[i]);
  if (turn > most_turn)
    return false;  // within a tiny primitive all faces are close; those that turn are not the same
  for (int i = 0; i < D; ++i) distance += extent.half[i] * std::fabs(h.normal[i] - sign * r.normal[i]);
  return distance <= tolerance * size_;
}

/// What the forms of CoincidenceIndex differ by at most between a hyperplane of this primitive and one that
/// coincides with it: their normals may be turned the more, the smaller it is, and their values at the
/// model's centre differ by what that makes half a model away.
template <int D>
double HyperplaneTable<D>::window(const Extent& extent, double tolerance) const {
  const double rounding = 0x1p-44 * (1 + radius_ / size_);
  const double smallest = *std::min_element(extent.half.begin(), extent.half.end());
  return CoincidenceIndex<D>::sensitivity * std::min(most_turn, tolerance * size_ / smallest) +
         (D + 1) * tolerance + rounding;
}

/// Width of the index's buckets: narrow, so that few hyperplanes share one, but not much narrower than what
/// is looked for.
template <int D>
double HyperplaneTable<D>::bucket(double tolerance) const {
  double sum = 0;
  for (const Extent& extent : extents_) sum += window(extent, tolerance);
  const double mean = sum / static_cast<double>(std::max<std::size_t>(1, extents_.size()));
  return std::max(16 * tolerance, std::clamp(4 * mean, 0x1p-10, 0x1p-8));
}

template <int D>
std::uint32_t HyperplaneTable<D>::add_hyperplane(const Occurrence& occurrence) {
  const auto id = static_cast<std::uint32_t>(hyperplanes_.size());
  if (id == first_axis_id)
    throw Error("the model has more than 1,073,741,824 different half-spaces; divide it");
  hyperplanes_.push_back(*occurrence.hyperplane);
  sources_.push_back(occurrence.source);
  return id;
}

template <int D>
std::uint64_t HyperplaneTable<D>::Marks::operator()(const Source& source) {
  const AffineMap<D>& map = table_.maps_[source.map];
  if (source.map != last_map_) residues_ = map.residues();
  last_map_ = source.map;
  return map.mark(table_.covectors_[source.covector], residues_);
}

/// Hyperplanes by the marks of their covectors: those that are equal have the same one, so that there are
/// many and very near to each other costs nothing.
template <int D>
class HyperplaneTable<D>::Equals {
 public:
  explicit Equals(HyperplaneTable& table) : table_(table) {}

  /// The id of the hyperplane, which gets one if none equals it.
  OrientedHyperplane code(const Occurrence& occurrence, std::uint64_t mark) {
    std::optional<OrientedHyperplane> found;
    if (mark != 0)
      by_mark_.find(tag_of(mark), [&](std::uint32_t id) {
        for (const bool opposite : {false, true})
          if (!found && table_.equal(occurrence.source, table_.sources_[id], opposite))
            found = oriented(id, opposite);
      });
    if (found) return *found;
    const std::uint32_t id = table_.add_hyperplane(occurrence);
    add(id, mark);
    return oriented(id, false);
  }
  void add(std::uint32_t id, std::uint64_t mark) {
    if (mark != 0) by_mark_.add(tag_of(mark), id);
  }
  /// Of a hyperplane that may be in the table under whatever id: a few are held against all that are there,
  /// more are looked up by their marks.
  OrientedHyperplane code_in_table(const Source& source) {
    constexpr std::size_t few = 32;
    const Hyperplane<D> rounded = table_.round_source(source);
    if (asked_ < few) {
      ++asked_;
      const auto found = find_in_table({&rounded, source});
      return found ? *found : oriented(table_.add_hyperplane({&rounded, source}), false);
    }
    if (!has_all_) {
      for (std::uint32_t id = 0; id < table_.sources_.size(); ++id) add(id, mark_of_(table_.sources_[id]));
      has_all_ = true;
    }
    return code({&rounded, source}, mark_of_(source));
  }

 private:
  HyperplaneTable& table_;
  HashIndex by_mark_;
  std::size_t asked_ = 0;
  bool has_all_ = false;
  Marks mark_of_{table_};

  /// Equal hyperplanes have the same value everywhere in space: at a point that hardly any passes through.
  [[nodiscard]] std::optional<OrientedHyperplane> find_in_table(const Occurrence& occurrence) const {
    std::array<double, D> point;
    for (int i = 0; i < D; ++i)
      point[i] = table_.axis_value(i, axis_steps / 16 * static_cast<std::uint32_t>(5 + 2 * i % 7));
    const Hyperplane<D>& own = *occurrence.hyperplane;
    const double value = own.at(point);
    for (std::uint32_t id = 0; id < table_.hyperplanes_.size(); ++id) {
      const Hyperplane<D>& other = table_.hyperplanes_[id];
      const double theirs = other.at(point), error = own.error + other.error;
      for (const bool opposite : {false, true})
        if (std::fabs(value - (opposite ? -theirs : theirs)) <= error &&
            table_.equal(occurrence.source, table_.sources_[id], opposite))
          return oriented(id, opposite);
    }
    return std::nullopt;
  }

  static std::uint32_t tag_of(std::uint64_t mark) {
    return static_cast<std::uint32_t>(mark * 0x9e3779b97f4a7c15u >> 32);
  }
};

/// Gives ids to the hyperplanes of one window after the other.
template <int D>
class HyperplaneTable<D>::Merging {
 public:
  Merging(HyperplaneTable& table, double tolerance, std::size_t occurrences)
      : table_(table),
        tolerance_(tolerance),
        codes_(occurrences),
        index_(table.centre_, table.size_, table.radius_, table.bucket(tolerance)),
        equals_(table) {
    index_.set_reach(tolerance * table.size_);
  }

  /// Any number of threads may do this.
  void find_keys(Window& window) const {
    if (!(tolerance_ > 0)) return find_marks(window);
    window.keys.resize(window.hyperplanes.size());
    for (std::size_t i = 0; i < window.keys.size(); ++i) window.keys[i] = index_.key(window.hyperplanes[i]);
  }

  void add(const Window& window) {
    if (!(tolerance_ > 0)) return add_equal(window);
    for (std::size_t at = 0; at < far_ahead; ++at) look_ahead(window, at);
    std::size_t at = 0;
    for (const Stretch& stretch : window.stretches) {
      if (&stretch != &window.stretches.back()) {
        __builtin_prefetch(&table_.extents_[(&stretch + 1)->map]);
        __builtin_prefetch(&codes_[(&stretch + 1)->first], 1);
      }
      const double own_window = table_.window(table_.extents_[stretch.map], tolerance_);
      for (std::uint32_t i = 0; i < stretch.count; ++i, ++at) {
        look_ahead(window, at + far_ahead);
        codes_[stretch.first + i] =
            code({&window.hyperplanes[at], {stretch.map, stretch.covector + i}}, window.keys[at], own_window);
      }
    }
  }
  [[nodiscard]] std::vector<OrientedHyperplane> take() { return std::move(codes_); }

 private:
  using Key = typename CoincidenceIndex<D>::Key;
  static constexpr std::size_t far_ahead = 16, ahead = 8;

  HyperplaneTable& table_;
  double tolerance_;
  std::vector<OrientedHyperplane> codes_;
  CoincidenceIndex<D> index_;
  Equals equals_;  // used without a tolerance

  void find_marks(Window& window) const {
    window.marks.clear();
    std::uint32_t last = Stretch::none;
    typename AffineMap<D>::Residues residues;
    for (const Stretch& stretch : window.stretches) {
      const AffineMap<D>& map = table_.maps_[stretch.map];
      if (stretch.map != last) residues = map.residues();
      last = stretch.map;
      for (std::uint32_t i = 0; i < stretch.count; ++i)
        window.marks.push_back(map.mark(table_.covectors_[stretch.covector + i], residues));
    }
  }

  /// Without a tolerance those that are equal are one.
  void add_equal(const Window& window) {
    std::size_t at = 0;
    for (const Stretch& stretch : window.stretches)
      for (std::uint32_t i = 0; i < stretch.count; ++i, ++at)
        codes_[stretch.first + i] =
            equals_.code({&window.hyperplanes[at], {stretch.map, stretch.covector + i}}, window.marks[at]);
  }

  /// What is looked up next is fetched from memory meanwhile: the place in the index, then the first
  /// hyperplane that is there.
  void look_ahead(const Window& window, std::size_t at) const {
    if (at < window.keys.size()) index_.prefetch(window.keys[at]);
    const std::size_t near = at + ahead - far_ahead;
    if (at < far_ahead - ahead || near >= window.keys.size()) return;
    if (const auto id = index_.first(window.keys[near])) __builtin_prefetch(&table_.hyperplanes_[*id]);
  }

  OrientedHyperplane code(const Occurrence& occurrence, const Key& key, double own_window) {
    auto& hyperplanes = table_.hyperplanes_;
    auto best = static_cast<std::uint32_t>(hyperplanes.size());
    bool best_opposite = false;
    double best_distance = std::numeric_limits<double>::infinity();
    index_.find(*occurrence.hyperplane, key, table_.extents_[occurrence.source.map].centre, own_window,
                [&](std::uint32_t id) {
                  double distance;
                  bool opposite;
                  if (!table_.coincide(occurrence, {&hyperplanes[id], table_.sources_[id]}, tolerance_,
                                       distance, opposite))
                    return;
                  if (distance > best_distance || (distance == best_distance && id > best)) return;
                  best = id;
                  best_opposite = opposite;
                  best_distance = distance;
                });
    if (best == hyperplanes.size()) {
      table_.add_hyperplane(occurrence);
      index_.add(*occurrence.hyperplane, key, best);
    }
    return oriented(best, best_opposite);
  }
};

template <int D>
std::vector<OrientedHyperplane> HyperplaneTable<D>::merge(double tolerance, unsigned threads) {
  constexpr std::size_t at_once = 4096;  // what is rounded is looked up while it is in the processor's cache
  const std::size_t count =
      occurrences_.empty() ? 0 : std::size_t{occurrences_.back().first} + occurrences_.back().count;
  std::vector<Stretch> stretches = by_size(threads);
  occurrences_ = {};
  hyperplanes_.reserve(count);
  sources_.reserve(count);
  std::vector<std::span<Stretch>> windows;
  for (std::size_t first = 0, end = 0; first < stretches.size(); first = end) {
    for (std::size_t inside = 0; end < stretches.size() && inside < at_once; ++end)
      inside += stretches[end].count;
    windows.push_back(std::span(stretches).subspan(first, end - first));
  }
  Merging merging(*this, tolerance, count);
  const auto round_window = [&](std::size_t i, Window& window) {
    window.stretches = windows[i];
    round(window, windows.size() == 1 ? threads : 1);
    merging.find_keys(window);
  };
  OrderedPipeline<Window>::run(windows.size(), threads, round_window,
                               [&](const Window& window) { merging.add(window); });
  extents_ = {};
  return merging.take();
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::round_source(const Source& source) const {
  const AffineMap<D>& map = maps_[source.map];
  const Covector<D>& covector = covectors_[source.covector];
  const auto rounding = map.rounding();
  if (const auto direction = direction_of(map.map_normal_rounded(covector.rounded, rounding)))
    if (const auto rounded =
            at_distance(*direction, map.map_constant_rounded(covector.rounded, direction->normal, rounding)))
      return *rounded;
  ExactCovector<D> world;
  map.map(covector, world);
  return round_exactly(world);
}

template <int D>
HyperplaneTable<D>::Unmerging::Unmerging(HyperplaneTable& table) : table_(table) {}
template <int D>
HyperplaneTable<D>::Unmerging::~Unmerging() = default;

template <int D>
OrientedHyperplane HyperplaneTable<D>::Unmerging::operator()(const Source& source) {
  if (!equals_) equals_ = std::make_unique<Equals>(table_);
  return equals_->code_in_table(source);
}

template <int D>
HyperplaneId HyperplaneTable<D>::add_apart(std::uint32_t map, std::span<const Covector<D>> covectors) {
  if (!families_.empty()) throw std::logic_error("hyperplanes are added apart before families are");
  const auto first = static_cast<HyperplaneId>(hyperplanes_.size());
  if (covectors.size() > free_ids()) throw Error("the model has too many different half-spaces; divide it");
  const std::uint32_t first_covector = add_covectors(covectors);
  for (std::uint32_t i = 0; i < covectors.size(); ++i) {
    const Source source{map, first_covector + i};
    hyperplanes_.push_back(round_source(source));
    sources_.push_back(source);
  }
  return first;
}

template <int D>
void HyperplaneTable<D>::take_back(HyperplaneId first) {
  if (first >= hyperplanes_.size()) return;
  covectors_.resize(covectors_.size() - (hyperplanes_.size() - first));
  hyperplanes_.resize(first);
  sources_.resize(first);
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
  families_.push_back({end_of_families(), map, count, family, maps_[map].rounding()});
  return families_.back().first;
}

template <int D>
const typename HyperplaneTable<D>::Family& HyperplaneTable<D>::family_of(HyperplaneId id) const {
  return *std::prev(std::upper_bound(families_.begin(), families_.end(), id,
                                     [](HyperplaneId x, const Family& family) { return x < family.first; }));
}

template <int D>
Hyperplane<D> HyperplaneTable<D>::family_rounded(HyperplaneId id) const {
  const Family& family = family_of(id);
  const auto local = std::visit(
      [&](const auto& hyperplanes) { return hyperplanes.rounded(id - family.first); }, family.hyperplanes);
  const AffineMap<D>& map = maps_[family.map];
  if (const auto direction = direction_of(map.map_normal_rounded(local, family.rounding)))
    if (const auto rounded =
            at_distance(*direction, map.map_constant_rounded(local, direction->normal, family.rounding)))
      return *rounded;
  return round_exactly(exact(id));
}

template <int D>
ExactCovector<D> HyperplaneTable<D>::exact(HyperplaneId id) const {
  ExactCovector<D> world;
  if (id >= hyperplanes_.size() && id < first_axis_id) {
    const Family& family = family_of(id);
    const auto local = std::visit(
        [&](const auto& hyperplanes) { return hyperplanes.exact(id - family.first); }, family.hyperplanes);
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
  const double value = h.at(point),
               bound = h.error * (1 + reach / radius_);  // `error` holds within the radius
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
    if (mantissa[i] != 0)
      sum += (Integer(covector[i]) * mantissa[i]) << static_cast<unsigned>(exponent[i] - least);
  return sum.sign();
}

#define BSP2_INSTANTIATE(D) template class HyperplaneTable<D>;

BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
