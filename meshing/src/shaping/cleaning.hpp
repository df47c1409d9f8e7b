#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "editing/editor.hpp"
#include "shaping/improving.hpp"
#include "shaping/moves.hpp"
#include "shaping/sizing.hpp"

namespace bsp2::meshing {

/// Absorbs what of a mesh is smaller than is wanted, and what rounding has made flat or turned over, and
/// counts how far that moves the surface.
///
/// Thread rule: one thread at a time.
class Cleaner {
 public:
  /// What it works with; all must outlive it. @param report gets what is done.
  Cleaner(Editor& editor, const Sizing& sizing, Improver& improver, const ShapeOptions& options,
          ShapeReport& report)
      : editor_(editor), sizing_(sizing), improver_(improver), options_(options), report_(report) {}

  /// From now on nothing is moved by more than that in all; at first that is `clean`.
  void allow(double most) { most_ = most; }
  /// Absorbs what is shorter or thinner than that.
  void clean();
  /// Mends what is flat or turned over.
  void absorb();
  /// Makes what is around those that are left better, which gives them room.
  void loosen();
  /// How many are flat or turned over.
  [[nodiscard]] std::uint64_t turned() const;
  /// See Moves.
  void remember_moves() { moves_.remember(std::max(most_, options_.clean)); }
  [[nodiscard]] const Moves& moves() const { return moves_; }
  void take_back(Moves moves) { moves_ = std::move(moves); }

 private:
  using Pair = std::array<std::uint32_t, 2>;
  Editor& editor_;
  const Sizing& sizing_;
  Improver& improver_;
  const ShapeOptions& options_;
  ShapeReport& report_;
  Moves moves_{editor_};
  double most_ = options_.clean;

  [[nodiscard]] double most_at(const Point& place) const;
  [[nodiscard]] double most_between(std::uint32_t u, std::uint32_t v) const;
  void tell_move(const Displacement& moved);
  bool absorb(std::uint32_t t);
  bool mend(std::uint32_t t);
  bool attach(std::uint32_t t, double share, Editor::Gain gain);
  bool attach_around(std::uint32_t t);
  bool cross_edges(std::uint32_t t);
  bool peel(std::uint32_t t);
  bool dissolve(std::uint32_t t);
  bool pull_apart(std::uint32_t t);
  [[nodiscard]] Point normal_of_face(const std::array<std::uint32_t, 4>& points, int k) const;
  bool merge_either(std::uint32_t u, std::uint32_t v, bool may_leave_more);
  bool merge_half_way(std::uint32_t from, std::uint32_t to);
  std::uint64_t lead_edges_through_points();
  std::uint64_t peel_flakes();
  bool lead_through(const Pair& edge, std::uint32_t m, double most, Editor::Gain gain);
  bool lead_to(const Pair& edge, std::uint32_t m, const Point& step, Editor::Gain gain);
  bool lead_half_way(const Pair& edge, std::uint32_t m, const Point& foot, Editor::Gain gain);
};

}  // namespace bsp2::meshing
