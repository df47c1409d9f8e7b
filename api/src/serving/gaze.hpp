#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "serving/detail.hpp"

namespace bsp2::api {

/// Where a page looks, and how large it is: what decides how finely it must have what it shows.
struct Gaze {
  using Point = std::array<double, 3>;
  /// Of a section.
  struct Plane {
    std::size_t axis;  ///< it is across
    double at;
    bool keeps_above;  ///< else what is below
    friend bool operator==(const Plane&, const Plane&) = default;
  };
  std::uint64_t number = 0;         ///< the page's own
  std::array<double, 16> matrix{};  ///< from the model to what is seen, [-w, w] along each axis; by columns
  double height = 0;                ///< pixels
  /// Things are moved, by whoever draws them: by so many times the way from `middle` to theirs, see Shifts.
  double explode = 0;
  Point middle{};
  std::vector<Plane> planes;      ///< what they take away is not seen; of each axis one at most
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
  /// coarsest, so that there are no more in any case. What is not in the picture, or taken away by a plane,
  /// gets its coarsest one, or of voxels likewise, and what is not drawn none.
  /// @param run_of_surface the run whose surface there is. @param shift by which it is moved.
  [[nodiscard]] Wanted wanted(const Detail& detail, std::uint64_t run_of_surface,
                              const Point& shift = {}) const;
  /// Of a thing's kind and run, whatever its part.
  [[nodiscard]] bool shows(const Detail& detail, std::uint64_t run_of_surface) const {
    const bool shows_surface = wants_surface && detail.run == run_of_surface;
    return (detail.kind == Detail::Kind::surface) == shows_surface;
  }
  /// Half a pixel where a box is nearest, in units of the model; nothing where that is at the eye or behind
  /// it. @param pixels of its rectangle in the picture.
  [[nodiscard]] std::optional<double> half_pixel(const Point& lower, const Point& upper,
                                                 double& pixels) const;
};

}  // namespace bsp2::api
