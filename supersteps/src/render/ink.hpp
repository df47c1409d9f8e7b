#pragma once

#include <array>
#include <cstdint>

#include "pixels/colour.hpp"
#include "render/camera.hpp"

namespace bsp2::supersteps {

/// What a facet is a piece of: a body of RoundFaces, and which segment of its profile; none: of nothing
/// round.
struct RoundPlace {
  std::int32_t body = -1;
  std::uint32_t segment = 0;
  std::int32_t side =
      0;  ///< whether what is seen is the outside of the body (1) or the inside (-1); 0: as the facet lies
};

/// How a polygon is drawn.
struct Ink {
  Colour colour{};  ///< under full light
  double opacity = 1;
  bool edges = false;             ///< its outline as a dark line
  std::array<double, 4> plane{};  ///< as seen: the normal of unit length, its front to the viewer, and the
                                  ///< offset; 0: it is as bright as its colour, whatever the light
  RoundPlace round;
  std::uint32_t region = 0;
};

/// What a sample knows of what is seen there.
struct SeenFacet {
  std::array<double, 4> plane{};  ///< as of an Ink
  std::uint32_t colour = 0;       ///< under full light, 0xrrggbb
  RoundPlace round;
  std::uint32_t region = 0;

  [[nodiscard]] bool is_lit() const { return plane[0] != 0 || plane[1] != 0 || plane[2] != 0; }
  [[nodiscard]] Vector normal() const { return {plane[0], plane[1], plane[2]}; }

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& plane[0] & plane[1] & plane[2] & plane[3] &
        colour& round.body& round.segment& round.side& region;
  }
};

}  // namespace bsp2::supersteps
