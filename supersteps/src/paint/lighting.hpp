#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/camera.hpp"
#include "render/ink.hpp"
#include "render/round_faces.hpp"

/// Light on what is seen.
namespace bsp2::supersteps {

/// How bright a face is: two lights, from the upper left before the solid and from the right, and a sky.
/// @param normal of unit length, in the picture's axes.
double brightness(const Vector& normal);

/// Knows where facets are, how they bend, and how bright that makes them. Any number of threads may ask.
class Lighting {
 public:
  /// @param round of the model, or null. @param shifts of the regions. @param radius within which corners are
  /// darker; 0: none is. @param skin how thick that of curved solids is. Camera, frame and round bodies are
  /// kept as references.
  Lighting(const Camera& camera, const Frame& frame, const RoundFaces* round, std::span<const Vector> shifts,
           double radius, double skin);

  /// The point of a facet's plane that is seen in a place of the picture.
  [[nodiscard]] Vector point(const SeenFacet& facet, const Point2& place) const;
  /// Its normal there: bent, if it is of something round.
  [[nodiscard]] Vector normal(const SeenFacet& facet, const Vector& point) const;
  /// Whether a line is drawn between two facets that are seen side by side: they meet in more than 30
  /// degrees, or one is behind the other. Either may be null: nothing.
  [[nodiscard]] bool is_edge(const SeenFacet* a, const Point2& at_a, const SeenFacet* b,
                             const Point2& at_b) const;
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const Frame& frame() const { return frame_; }
  [[nodiscard]] double radius() const { return radius_; }

 private:
  const Camera& camera_;
  const Frame& frame_;
  const RoundFaces* round_;
  std::vector<Vector> shifts_;                     // as seen
  std::vector<RoundFaces::Placement> placements_;  // likewise
  double radius_, skin_;
};

}  // namespace bsp2::supersteps
