#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "editing/editor.hpp"
#include "shaping/wanted_lengths.hpp"

namespace bsp2::meshing {

/// Makes the worst tetrahedra of a mesh better, one by one.
///
/// Thread rule: one thread at a time.
class Improver {
 public:
  // Shapes (`shape_of`): up to where the points that there are are arranged anew, below what new ones are
  // worth it, and what a collapse may leave at first.
  static constexpr double very_good = 0.6, good = 0.35, fair = 0.2;

  /// @param editor the mesh. @param wanted lengths, known of all points that there are. Both must outlive it.
  Improver(Editor& editor, const WantedLengths& wanted) : editor_(editor), wanted_(wanted) {}

  /// Those that are worse than `below`. @return how often one was made better.
  std::uint64_t improve(double below, bool with_new_points);
  bool improve_one(std::uint32_t t, bool with_new_points);
  /// By tetrahedron: when it was tried in vain, and whether with new points.
  using Tried = std::vector<std::pair<std::uint64_t, bool>>;
  [[nodiscard]] const Tried& tried() const { return tried_; }
  void take_back(Tried tried) { tried_ = std::move(tried); }
  /// What has been tried in vain is tried once more.
  void forget() { tried_.clear(); }
  /// Tetrahedra none of whose points is one of these were tried in vain.
  void settle_all_but(const std::vector<bool>& points);

 private:
  Editor& editor_;
  const WantedLengths& wanted_;
  Tried tried_;

  bool is_settled(std::uint32_t t, bool with_new_points);
  bool insert_near(std::uint32_t t);
  bool collapse_to_better(std::uint32_t u, std::uint32_t v, double better);
};

}  // namespace bsp2::meshing
