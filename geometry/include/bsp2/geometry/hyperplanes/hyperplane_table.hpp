#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/families/computed_family.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/geometry/families/torus_family.hpp"
#include "bsp2/geometry/support/buffer.hpp"

namespace bsp2::geometry {

/// All hyperplanes of a model, each under one id.
///
/// Three kinds: the hyperplanes of primitives (a covector of the primitive's frame and the affine map that
/// places it: the exact coefficients are their product, computed when asked for), axis-parallel cuts x_axis =
/// position on a regular grid of 2^27 steps over the model's bounds, and the families of curved solids; the
/// latter two need no storage here.
///
/// Life: bounds, then maps and covectors and occurrences are added, then `merge` decides coincidence once,
/// then families are added, then any number of threads may read.
template <int D>
class HyperplaneTable {
 public:
  /// @param lower, upper bounds of the model, finite: the root cell holds them.
  /// @param reach a bound of |x_i| over all primitives that will be added.
  HyperplaneTable(const std::array<double, D>& lower, const std::array<double, D>& upper, double reach);

  /// Makes room for so many maps and their occurrences; more may come.
  void reserve(std::size_t maps);
  /// Numbers for maps, each of which `set_map` has to make before anything else is asked of it, and before
  /// `merge`; different threads may make different ones. @return the first number.
  [[nodiscard]] std::uint32_t add_maps(std::size_t count);
  /// The map that places a primitive, and bounds of the placed primitive.
  void set_map(std::uint32_t map, const Matrix<D>& matrix, const std::array<double, D>& lower,
               const std::array<double, D>& upper);
  /// `add_maps(1)` and `set_map`.
  std::uint32_t add_map(const Matrix<D>& matrix, const std::array<double, D>& lower,
                        const std::array<double, D>& upper);
  /// Adds the map of a primitive that may be anywhere in the model.
  std::uint32_t add_map(const Matrix<D>& matrix);
  /// @return index of the first one.
  std::uint32_t add_covectors(std::span<const Covector<D>> covectors);
  /// Adds covectors, of which the table's first ones are taken without a copy. @return index of the first
  /// one.
  std::uint32_t add_covectors(std::vector<Covector<D>>&& covectors);
  [[nodiscard]] int orientation(std::uint32_t map) const { return maps_[map].orientation(); }
  /// Adds the hyperplanes of `count` covectors from `covector` on, placed by `map`. @return the number of the
  /// first of these occurrences.
  std::uint32_t add_occurrences(std::uint32_t map, std::uint32_t covector, std::uint32_t count);
  std::uint32_t add_occurrence(std::uint32_t map, std::uint32_t covector) {
    return add_occurrences(map, covector, 1);
  }

  /// Decides which occurrences are the same hyperplane and gives ids. An occurrence is represented by another
  /// one that equals it, or (tolerance > 0) that differs from it by at most `tolerance` times the size of the
  /// model anywhere within the bounds of its own primitive: so no primitive's face moves by more. Large
  /// primitives represent small ones.
  /// @param threads that round hyperplanes; the result is the same for any number.
  /// @return the oriented hyperplane of each occurrence. @throws Error if there are more hyperplanes than
  /// ids.
  std::vector<OrientedHyperplane> merge(double tolerance, unsigned threads = 1);

  /// Gives ids of their own to hyperplanes that `merge` lets others represent; those that are equal share
  /// one. Between `merge` and `add_family`, in one thread.
  class Unmerging;
  /// Adds more hyperplanes after `merge`, each under an id of its own, whatever it equals, while no other
  /// thread reads. @pre there are no families. @return the first id.
  HyperplaneId add_apart(std::uint32_t map, std::span<const Covector<D>> covectors);
  /// Takes back all that have been added apart: those from this id on.
  void take_back(HyperplaneId first);

  /// Gives ids to the hyperplanes of a family, placed by `map`. After `merge`. @return the first id: add the
  /// number.
  using AnyFamily = std::conditional_t<D == 3, std::variant<RoundFamily<D>, SharedFamily<D>, TorusFamily>,
                                       std::variant<RoundFamily<D>, SharedFamily<D>>>;
  HyperplaneId add_family(std::uint32_t map, const AnyFamily& family);
  /// How many ids are left for families.
  [[nodiscard]] std::uint32_t free_ids() const { return first_axis_id - end_of_families(); }
  [[nodiscard]] const AffineMap<D>& map(std::uint32_t index) const { return maps_[index]; }

  /// Hyperplanes of primitives; their ids are 0 ... size() - 1.
  [[nodiscard]] std::size_t size() const { return hyperplanes_.size(); }
  /// The rounded hyperplane; with the sign of the id's canonical orientation.
  [[nodiscard]] Hyperplane<D> rounded(HyperplaneId id) const {
    if (id < hyperplanes_.size()) return hyperplanes_[id];
    return id < first_axis_id ? family_rounded(id) : axis_rounded(id);
  }
  /// The rounded hyperplanes of primitives, by id.
  [[nodiscard]] std::span<const Hyperplane<D>> rounded() const { return hyperplanes_; }
  /// A hyperplane of a primitive or across an axis with up to eleven bits more, for where it meets others
  /// that are nearly parallel.
  struct Refined {
    std::array<long double, D> normal;
    long double offset, error;  ///< error: as that of Hyperplane, where values are computed in long double
  };
  /// The map of the hyperplane that was refined last: those that meet are mostly of one primitive.
  struct LastMap {
    std::uint32_t number = ~std::uint32_t{0};
    typename AffineMap<D>::Rounding rounding;
  };
  /// Nothing for hyperplanes of families, and where coefficients cancelled too much.
  [[nodiscard]] std::optional<Refined> refined(HyperplaneId id, LastMap& last) const;
  [[nodiscard]] ExactCovector<D> exact(HyperplaneId id) const;
  /// Where a hyperplane comes from: the covector in a primitive's frame, which primitives of one shape share,
  /// and the map that places it. Hyperplanes of one map lie in the model as their covectors do in the frame:
  /// maps keep sides and meeting points.
  struct Source {
    std::uint32_t map, covector;
  };
  /// Numbers that are the same for hyperplanes that are equal, or opposite, and hardly ever for others; 0 of
  /// what is none.
  class Marks;
  /// Null for hyperplanes of families and axis-parallel cuts.
  [[nodiscard]] const Source* source(HyperplaneId id) const {
    return id < sources_.size() ? &sources_[id] : nullptr;
  }
  [[nodiscard]] const Covector<D>& covector(std::uint32_t index) const { return covectors_[index]; }
  /// -1, 0, +1: the side of the hyperplane on which a point given in doubles is, anywhere in space. Exact.
  [[nodiscard]] int side(const std::array<double, D>& point, HyperplaneId id) const;

  /// The hyperplane x_axis = value, negative below; `position` in [0, axis_steps].
  [[nodiscard]] static HyperplaneId axis_hyperplane(int axis, std::uint32_t position) {
    return first_axis_id + (static_cast<std::uint32_t>(axis) << axis_bits) + position;
  }
  [[nodiscard]] double axis_value(int axis, std::uint32_t position) const {
    return origin_[axis] + position * step_[axis];
  }
  /// The last position whose value is <= x.
  [[nodiscard]] std::uint32_t axis_position(int axis, double x) const;
  static constexpr std::uint32_t axis_steps = (1u << 27) - 1;

  /// Corners of the root cell, which holds the model's bounds with a margin.
  [[nodiscard]] std::uint32_t root_lower() const { return 0; }
  [[nodiscard]] std::uint32_t root_upper() const { return axis_steps; }
  /// The root cell's extent along its longest axis.
  [[nodiscard]] double width() const { return *std::max_element(step_.begin(), step_.end()) * axis_steps; }
  /// A bound of |x_i| within the root cell.
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] int grid_exponent() const { return grid_exponent_; }

 private:
  static constexpr unsigned axis_bits = 27;
  static constexpr HyperplaneId first_axis_id = 1u
                                                << 30;  // leaves a bit for the orientation: 7 axes would fit

  std::array<double, D> origin_, step_;
  double radius_ = 0, size_ = 0;
  std::array<double, D> centre_;
  int grid_exponent_ = 0;
  long double grid_unit_ = 1;  // 2^grid_exponent_
  struct Extent {
    std::array<double, D> centre, half;
  };
  Buffer<AffineMap<D>> maps_;
  Buffer<Extent> extents_;  // of the primitives that the maps place, until merge
  std::vector<Covector<D>> covectors_;
  /// Occurrences with numbers that follow each other: of one map, and of covectors that follow each other.
  struct Stretch {
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    std::uint32_t map, covector, first, count;
    std::uint32_t next = none;  ///< the next one in this window that is alike: of the same covectors, placed
                                ///< by a translate of the map
    std::uint32_t place = 0;    ///< in the chain that these make; the first one leads
    std::uint64_t hash = 0;     ///< the same for all that are alike
  };
  std::vector<Stretch> occurrences_;        // until merge
  std::vector<Hyperplane<D>> hyperplanes_;  // from merge on, by id, and where they come from
  std::vector<Source> sources_;
  struct Family {
    HyperplaneId first;
    std::uint32_t map, count;
    AnyFamily hyperplanes;
    typename AffineMap<D>::Rounding rounding;  // of the map
  };
  std::vector<Family> families_;  // by id

  [[nodiscard]] HyperplaneId end_of_families() const {
    return families_.empty() ? static_cast<HyperplaneId>(hyperplanes_.size())
                             : families_.back().first + families_.back().count;
  }
  [[nodiscard]] const Family& family_of(HyperplaneId id) const;
  Hyperplane<D> family_rounded(HyperplaneId id) const;
  Hyperplane<D> axis_rounded(HyperplaneId id) const;
  struct Window;
  class Equals;
  class Merging;
  /// What translates of one map give a covector in common.
  struct Direction {
    typename AffineMap<D>::RoundedNormal normal;
    long double length;  // of the normal
    std::array<double, D> unit;
    double error;       // of its coefficients
    double grid_units;  // not less than the grid's unit by the length
  };
  [[nodiscard]] std::vector<Stretch> by_size(unsigned threads) const;
  void round(Window& window, unsigned threads) const;
  void chain_alike(Window& window) const;
  void round_alike(Window& window, std::size_t leader,
                   std::vector<std::optional<Direction>>& directions) const;
  [[nodiscard]] std::optional<Direction> direction_of(
      const typename AffineMap<D>::RoundedNormal& normal) const;
  [[nodiscard]] std::optional<Hyperplane<D>> at_distance(
      const Direction& direction, const typename AffineMap<D>::RoundedConstant& constant) const;
  Hyperplane<D> round_exactly(const ExactCovector<D>& world) const;
  [[nodiscard]] Hyperplane<D> round_source(const Source& source) const;
  [[nodiscard]] bool equal(const Source& a, const Source& b, bool opposite) const;
  struct Occurrence {
    const Hyperplane<D>* hyperplane;
    Source source;
  };
  [[nodiscard]] bool coincide(const Occurrence& a, const Occurrence& representative, double tolerance,
                              double& distance, bool& opposite) const;
  [[nodiscard]] double window(const Extent& extent, double tolerance) const;
  [[nodiscard]] double bucket(double tolerance) const;
  std::uint32_t add_hyperplane(const Occurrence& occurrence);
};

/// Thread rule: one thread at a time; several that each have their own.
template <int D>
class HyperplaneTable<D>::Marks {
 public:
  explicit Marks(const HyperplaneTable& table) : table_(table) {}
  /// Takes longer where the source's map is not that of the one before.
  std::uint64_t operator()(const Source& source);

 private:
  const HyperplaneTable& table_;
  std::uint32_t last_map_ = ~std::uint32_t{0};  // whose residues are known
  typename AffineMap<D>::Residues residues_;
};

template <int D>
class HyperplaneTable<D>::Unmerging {
 public:
  explicit Unmerging(HyperplaneTable& table);
  Unmerging(const Unmerging&) = delete;
  Unmerging& operator=(const Unmerging&) = delete;
  ~Unmerging();
  /// The hyperplane that equals that of the source, exactly. @throws Error if there are more hyperplanes than
  /// ids.
  OrientedHyperplane operator()(const Source& source);

 private:
  HyperplaneTable& table_;
  std::unique_ptr<Equals> equals_;  // made when first needed: it holds all that the table has
};

}  // namespace bsp2::geometry
