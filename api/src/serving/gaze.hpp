#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "serving/detail.hpp"

namespace bsp2::api {

/// Where a page looks, and how large it is: what decides how finely it must have what it shows.
struct Gaze {
  std::uint64_t number = 0;         ///< the page's own
  std::array<double, 16> matrix{};  ///< from the model to what is seen, [-w, w] along each axis; by columns
  double height = 0;                ///< pixels
  /// Of all that is seen, as a camera has it; 0: of each thing its own. So all get one level, and no two
  /// levels meet.
  double depth = 0;
  bool sees_all = false;          ///< things are moved, by whoever draws them: each may be in the picture
  bool wants_surface = false;     ///< in the place of cells, where there is one
  std::set<std::int32_t> hidden;  ///< parts
  std::set<std::pair<Detail::Kind, std::uint32_t>> exactly;  ///< what is wanted as it is

  /// @return nothing if that is no gaze.
  static std::optional<Gaze> heard(const std::string& text);

  /// What is wanted of something.
  struct Wanted {
    int level;
    double depth;  ///< how far away it is
    bool is_seen;  ///< else it can wait
  };
  /// The coarsest level whose step is at most half a pixel where the thing is nearest. Where something in it
  /// would be lost, a finer one; where that has more than two triangles for each pixel of its box (or than
  /// two boxes have), one with a step of at most a pixel, or, if that does not help, of voxels, above its
  /// coarsest, so that there are no more in any case. Not so where all are to have one level, or parts of a
  /// region are hidden. What is not in the picture gets its coarsest one, and what is not drawn none.
  /// @param run_of_surface the run whose surface there is.
  [[nodiscard]] Wanted wanted(const Detail& detail, std::uint64_t run_of_surface) const;
};

}  // namespace bsp2::api
