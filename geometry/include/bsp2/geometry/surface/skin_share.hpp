#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/contact.hpp"

namespace bsp2::geometry {

/// The triangles of some faces of a surface.
struct SurfacePiece {
  struct Face {
    Skin::Face face;
    std::uint32_t triangles;  ///< how many
  };
  struct SharedPoint {
    std::uint32_t point;
    std::array<HyperplaneId, 3> name;
  };
  std::vector<Face> faces;                              ///< in their order
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< face by face; of the piece's points
  std::vector<std::array<double, 3>> points;            ///< in the order in which the triangles name them
  std::vector<SharedPoint> shared;                      ///< points that other pieces may have, too
};

/// Puts the pieces of a surface together: byte for byte what `triangulate` makes of the whole skin, however
/// the faces are dealt out.
TriangleSurface joined(const std::vector<SurfacePiece>& pieces);

/// What one of several who share a skin has of it, and what is made of that.
///
/// Each face becomes the own one of one share, which triangulates it. What happens in a point, whether it is
/// a corner and what its name is, depends on the edges through that point alone. So a share needs, of the
/// faces of others, the edges that come near to its own ones; nobody needs the whole. The calls come in this
/// order, on all shares alike; what is given out for each share is handed over between two of them:
///
///     claims -> decide -> hand_over -> take_over -> boxes -> neighbours -> take_neighbours -> triangulate
///
/// `triangulate` is called again, on all shares, with the crossings that all have found, until there are
/// none. Then `take` has the piece. All decisions are exact; where edges are far from each other rounded
/// boxes tell, for certain. Thread rule: one thread at a time, which others help.
class SkinShare {
 public:
  /// @param skin what has been found here. @param threads that work on it.
  SkinShare(const HyperplaneTable<3>& table, Skin skin, unsigned share, unsigned shares, unsigned threads);
  ~SkinShare();
  SkinShare(const SkinShare&) = delete;
  SkinShare& operator=(const SkinShare&) = delete;

  /// A face of which a share has so many edges.
  struct Claim {
    Skin::Face face;
    std::uint32_t edges;
  };
  /// Whose own a face is that several have claimed.
  struct Decision {
    Skin::Face face;
    std::uint32_t owner;
  };
  /// Bounds of some edges, for certain.
  struct Box {
    std::array<double, 3> low, high;
  };
  using Name = std::array<HyperplaneId, 3>;

  /// For each share those faces of which it decides whose own they are: by what they are alone.
  [[nodiscard]] std::vector<std::vector<Claim>> claims() const;
  /// Whoever has most of a face gets it. @param claims those of each share, in their order.
  /// @return for each share those of its faces that others have claimed, too.
  [[nodiscard]] static std::vector<std::vector<Decision>> decide(
      const std::vector<std::vector<Claim>>& claims);
  /// For each share what is here of faces that are its own now; here it is gone.
  [[nodiscard]] std::vector<Skin> hand_over(std::span<const Decision> decisions);
  void take_over(const Skin& faces);
  /// Where the edges of the own faces are; all of these have come now.
  [[nodiscard]] std::vector<Box> boxes();
  /// For each share the edges of own faces that come near to its own. @param boxes of each share.
  [[nodiscard]] std::vector<Skin> neighbours(const std::vector<std::vector<Box>>& boxes) const;
  void take_neighbours(const Skin& edges);
  /// Triangulates the own faces. @param crossings that the shares have found before, of all of them.
  /// @return points in which edges of one face cross, at which the edges of all are to be divided.
  [[nodiscard]] std::vector<Name> triangulate(std::span<const Name> crossings, const ToldShare& told = {});
  /// @pre triangulate has found no crossings, on any share.
  [[nodiscard]] SurfacePiece take();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bsp2::geometry
