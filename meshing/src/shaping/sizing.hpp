#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "editing/editor.hpp"
#include "shaping/wanted_lengths.hpp"

namespace bsp2::meshing {

/// Brings the edges of a mesh to the lengths that are wanted: those too short collapse, those too long are
/// split.
///
/// Thread rule: one thread at a time.
class Sizing {
 public:
  using Pair = std::array<std::uint32_t, 2>;

  /// @param editor the mesh. @param wanted lengths, known of all points that there are. Both must outlive it.
  Sizing(Editor& editor, WantedLengths& wanted) : editor_(editor), wanted_(wanted) {}

  /// All edges of which `is_wanted` (of the length, and of the wanted one) and both of whose ends have
  /// changed since then, as those of edges do around which something has; the shortest first, those of nearly
  /// one length as they are in memory. Points of edges may be gone when their turn comes: then nothing is
  /// around them.
  [[nodiscard]] std::vector<Pair> edges_where(const std::function<bool(double, double)>& is_wanted,
                                              std::uint64_t since = 0) const;
  /// @param share edges shorter than this share of what is wanted go, where what is left has at least this
  /// shape. @param since as for `edges_where`. @return how many did.
  std::uint64_t coarsen(double share, double least, std::uint64_t since = 0);
  /// Collapses what is shorter than new edges should be. @return how many times.
  std::uint64_t coarsen(std::uint64_t since = 0);
  /// Splits what is too long. @param since as for `edges_where`. @return how many times.
  std::uint64_t refine(std::uint64_t since = 0);
  /// Moves each point to where that is better.
  void smooth_all();

 private:
  Editor& editor_;
  WantedLengths& wanted_;

  [[nodiscard]] double ratio(const Pair& edge) const {
    return editor_.length(edge[0], edge[1]) / wanted_.between(edge[0], edge[1]);
  }
  std::uint64_t split_longest(const std::vector<Pair>& edges);
  std::uint32_t split(const Pair& edge);
  bool take_back(std::uint32_t m);
  void flip_around(std::uint32_t p);
  void smooth_changed(std::uint64_t since);
};

/// Rises with a number from 0 on, by steps of an eighth of its octave.
std::uint32_t rank_of(double x);

}  // namespace bsp2::meshing
