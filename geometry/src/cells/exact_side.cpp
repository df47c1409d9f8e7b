// The exact part of Splitter's predicate: what the filter leaves open.
#include <algorithm>
#include <limits>

#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::geometry {

namespace {

/// The place of a key in a cache with one entry a place. A cache has no memory before it is needed: many
/// splitters never ask exactly.
template <typename Entry, std::size_t N>
Entry& place_of(std::vector<Entry>& cache, std::size_t size, const std::array<std::uint32_t, N>& key) {
  if (cache.empty()) cache.resize(size);
  std::uint64_t hash = 0;
  for (const std::uint32_t word : key) hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
  return cache[(hash >> 32) % size];
}

/// Without a call, which these few words are not worth.
template <std::size_t N>
bool is_same(const std::array<std::uint32_t, N>& a, const std::array<std::uint32_t, N>& b) {
  std::uint32_t difference = 0;
  for (std::size_t i = 0; i < N; ++i) difference |= a[i] ^ b[i];
  return difference == 0;
}

constexpr int large_entries_above = 3;  // dimensions
template <int D>
constexpr std::size_t cached_covectors = D <= large_entries_above ? 256 : 16;
constexpr std::size_t cached_fractions = 1024;
constexpr int certain = Fraction::bits - 20;  // minors of fractions have a sign from 2^-certain on
constexpr std::size_t cached_pencils = 8192;
constexpr std::size_t cached_sides = 16384;

}  // namespace

/// Valid until the next call.
template <int D>
const ExactCovector<D>& Splitter<D>::exact(HyperplaneId id) {
  auto& entry = place_of(exact_cache_, cached_covectors<D>, std::array{id});
  if (entry.id != id) {
    entry.covector = table_->exact(id);
    divide_by_common_power_of_two(entry.covector);
    entry.id = id;
  }
  return entry.covector;
}

template <int D>
int Splitter<D>::exact_side(const Vertex<D>& vertex, HyperplaneId id) {
  std::array<HyperplaneId, D> ids = vertex.hyperplanes;  // cells name one vertex in several orders
  std::sort(ids.begin(), ids.end());
  std::array<HyperplaneId, D + 1> key;
  std::copy(ids.begin(), ids.end(), key.begin());
  key[D] = id;
  CachedSide& known = place_of(side_cache_, cached_sides, key);
  if (!is_same(known.key, key)) known = {key, static_cast<std::int8_t>(compute_exact_side(ids, id))};
  return known.side;
}

/// The sign of a hyperplane at a point in homogeneous coordinates.
template <int D, typename Integer>
int side_of_point(const std::array<Integer, D + 1>& point, const std::array<Integer, D + 1>& hyperplane) {
  Integer value = hyperplane[D] * point[D];
  for (int i = 0; i < D; ++i)
    if (!hyperplane[i].is_zero() && !point[i].is_zero()) value += hyperplane[i] * point[i];
  return value.sign() * point[D].sign();
}

/// The point in which hyperplanes meet, valid until the next call.
template <int D>
const ExactCovector<D>& Splitter<D>::exact_point(const std::array<HyperplaneId, D>& ids) {
  auto& known = place_of(point_cache_, cached_covectors<D>, ids);
  if (!is_same(known.ids, ids)) {
    std::array<ExactCovector<D>, D> rows;
    for (int i = 0; i < D; ++i) rows[i] = exact(ids[i]);
    known.point = meeting_point<D>(rows);
    divide_by_common_power_of_two(known.point);
    known.ids = ids;
  }
  return known.point;
}

/// Whether covectors of one frame are known to have a point in common, as all planes around a corner of a
/// mesh have.
template <int D>
bool have_common_point(const HyperplaneTable<D>& table, const std::array<std::uint32_t, D + 1>& covectors) {
  return std::ranges::any_of(table.covector(covectors[0]).points, [&](std::uint32_t point) {
    return point != 0 && std::all_of(covectors.begin() + 1, covectors.end(), [&](std::uint32_t other) {
             return std::ranges::find(table.covector(other).points, point) !=
                    table.covector(other).points.end();
           });
  });
}

/// Where all hyperplanes are of one primitive, as around the corners of a sphere: the same in its own frame,
/// where the coefficients are a third as long, and the answer is that of all primitives of its shape.
template <int D>
std::optional<int> Splitter<D>::side_in_frame(const std::array<HyperplaneId, D>& vertex, HyperplaneId id) {
  const auto* asked = table_->source(id);
  if (asked == nullptr) return std::nullopt;
  std::array<std::uint32_t, D + 1> covectors;
  covectors[D] = asked->covector;
  for (int i = 0; i < D; ++i) {
    const auto* own = table_->source(vertex[i]);
    if (own == nullptr || own->map != asked->map) return std::nullopt;
    covectors[i] = own->covector;
  }
  std::sort(covectors.begin(), covectors.begin() + D);
  CachedSide& known = place_of(frame_cache_, cached_sides, covectors);
  if (!is_same(known.key, covectors))
    known = {covectors, static_cast<std::int8_t>(compute_side_in_frame(covectors))};
  return known.side;
}

/// Columns may be divided by a power of two: that only scales the frame's axes.
template <int D>
int Splitter<D>::compute_side_in_frame(const std::array<std::uint32_t, D + 1>& covectors) const {
  if (have_common_point<D>(*table_, covectors)) return 0;
  using Integer = FixedInteger<D <= 3 ? 896 : 512>;  // D + 1 coefficients of 216 bits; above D = 3, of 64
  std::array<std::array<Integer, D + 1>, D> rows;
  std::array<Integer, D + 1> last;
  for (int column = 0; column <= D; ++column) {
    unsigned shift = std::numeric_limits<unsigned>::max();
    for (const std::uint32_t covector : covectors) {
      const LocalInteger& entry = table_->covector(covector).exact[column];
      if (!entry.is_zero())
        shift = std::min(shift, static_cast<unsigned>(mp::lsb(LocalInteger(mp::abs(entry)))));
    }
    if (shift == std::numeric_limits<unsigned>::max()) shift = 0;
    for (int row = 0; row <= D; ++row) {
      const LocalInteger& entry = table_->covector(covectors[row]).exact[column];
      const LocalInteger size = LocalInteger(mp::abs(entry)) >> shift;
      (row < D ? rows[row][column] : last[column]) = Integer(entry.sign() < 0 ? LocalInteger(-size) : size);
    }
  }
  return side_of_point<D>(meeting_point<D>(rows), last);
}

/// A hyperplane with no coefficient above 1/8, in coordinates of the model that are not above 1; valid until
/// the next call.
template <int D>
auto Splitter<D>::in_fractions(HyperplaneId id) -> const FractionCovector& {
  auto& known = place_of(fraction_cache_, cached_fractions, std::array{id});
  if (known.id != id) {
    const ExactCovector<D> covector = table_->exact(id);
    const auto scale = [&](int i) { return i < D ? reach_bits_ : 0; };
    long bits =
        0;  // of the largest coefficient; all may be zero, as covectors of preimages are where nothing is
    for (int i = 0; i <= D; ++i)
      if (!covector[i].is_zero())
        bits =
            std::max(bits, scale(i) + 1 + static_cast<long>(mp::msb(ExactInteger<D>(mp::abs(covector[i])))));
    for (int i = 0; i <= D; ++i) known.covector[i] = Fraction::scaled(covector[i], scale(i) - bits - 3);
    known.id = id;
  }
  return known.covector;
}

/// The point in which hyperplanes meet, valid until the next call.
template <int D>
auto Splitter<D>::point_in_fractions(const std::array<HyperplaneId, D>& ids) -> const FractionCovector& {
  auto& known = place_of(fraction_point_cache_, cached_fractions, ids);
  if (!is_same(known.ids, ids)) {
    std::array<FractionCovector, D> rows;
    for (int i = 0; i < D; ++i) rows[i] = in_fractions(ids[i]);
    known.point = meeting_point<D>(rows);
    known.ids = ids;
  }
  return known.point;
}

/// The side, if it can be told from the first 192 bits of the hyperplanes' coefficients.
///
/// No coefficient is above 1/8, so no minor of n rows is above n! / 8^n, and all are below 1/2. With e =
/// 2^-192 for what is cut off a coefficient and 6 e for what is cut off a product, the error of a minor of n
/// rows is E(n) <= n (E(n - 1) + (n - 1)! e + 6 e), even if coefficients were up to 1, with terms in e^2 left
/// out: E(4) <= 336 e, and E(7) < 2^17 e. The weight is a minor of D rows, the value one of D + 1.
template <int D>
std::optional<int> Splitter<D>::side_in_fractions(const std::array<HyperplaneId, D>& vertex,
                                                  HyperplaneId id) {
  const FractionCovector& point = point_in_fractions(vertex);  // before the hyperplane: it asks for others
  if (!point[D].is_at_least(certain)) return std::nullopt;
  const FractionCovector& hyperplane = in_fractions(id);
  Fraction value;
  for (int i = 0; i <= D; ++i) value += hyperplane[i] * point[i];
  if (!value.is_at_least(certain)) return std::nullopt;
  return value.is_negative() == point[D].is_negative() ? 1 : -1;
}

/// Do these hyperplanes meet in more than a point, as planes through one line do? If so, that is known from
/// now on.
template <int D>
bool Splitter<D>::is_pencil(const std::array<HyperplaneId, D>& ids) {
  const FractionCovector& point = point_in_fractions(ids);
  if (std::any_of(point.begin(), point.end(), [](const Fraction& x) { return x.is_at_least(certain); }))
    return false;
  const ExactCovector<D>& proof = exact_point(ids);
  if (std::any_of(proof.begin(), proof.end(), [](const ExactInteger<D>& x) { return !x.is_zero(); }))
    return false;
  place_of(pencil_cache_, cached_pencils, ids).ids = ids;
  return true;
}

template <int D>
bool Splitter<D>::is_known_pencil(const std::array<HyperplaneId, D>& ids) {
  return is_same(place_of(pencil_cache_, cached_pencils, ids).ids, ids);
}

namespace {

/// If a hyperplane contains all that D - 1 of a vertex's meet in, it contains the vertex, and all others
/// along that edge: so do nearly all that contain a vertex at all. The D sets of hyperplanes of which one
/// would be a pencil.
template <int D>
std::array<std::array<HyperplaneId, D>, D> edge_pencils(const std::array<HyperplaneId, D>& vertex,
                                                        HyperplaneId id) {
  std::array<std::array<HyperplaneId, D>, D> sets;
  for (int left_out = 0; left_out < D; ++left_out) {
    sets[left_out] = vertex;
    sets[left_out][left_out] = id;
    std::sort(sets[left_out].begin(), sets[left_out].end());
  }
  return sets;
}

}  // namespace

template <int D>
int Splitter<D>::compute_exact_side(const std::array<HyperplaneId, D>& vertex, HyperplaneId id) {
  ++counts_.exact_predicates;
  if (const auto side = side_in_frame(vertex, id)) return *side;
  const auto edges = edge_pencils<D>(vertex, id);
  if (std::any_of(edges.begin(), edges.end(), [&](const auto& edge) { return is_known_pencil(edge); }))
    return 0;
  if (const auto side = side_in_fractions(vertex, id)) return *side;
  if (std::any_of(edges.begin(), edges.end(), [&](const auto& edge) { return is_pencil(edge); })) return 0;
  const ExactCovector<D>& point = exact_point(vertex);  // before the covector: it asks for others
  return side_of_point<D>(point, exact(id));
}

#define BSP2_INSTANTIATE(D) template int Splitter<D>::exact_side(const Vertex<D>&, HyperplaneId);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
