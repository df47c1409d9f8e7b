#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/certain_boxes.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/brep.hpp"
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

/// What the faces of a piece are in a complex: connected ones with their loops, and their edges. All is
/// numbered within the piece.
struct BrepPiece {
  struct Face {
    std::uint32_t triangles, loops;  ///< how many
  };
  struct Edge {
    /// Whether the faces about it are in order, as other pieces have none of them: counter-clockwise, seen
    /// from the end of the first one's use (forward) or from its beginning.
    enum class Order : std::uint32_t { open, forward, backward };
    std::uint32_t uses;  ///< how many
    Order order;
  };
  SurfacePiece surface;
  std::vector<std::uint32_t> connected;             ///< how many each of its faces is
  std::vector<Face> faces;                          ///< connected ones
  std::vector<std::uint32_t> triangles;             ///< those of the surface, face by face
  std::vector<std::uint32_t> loops;                 ///< how many uses, face by face; the outline first
  std::vector<std::uint32_t> uses;                  ///< the point where each begins, loop by loop
  std::vector<Edge> edges;                          ///< one for all uses with the same ends
  std::vector<std::uint32_t> uses_of_edges;         ///< edge by edge
  std::vector<double> angles;                       ///< to the next one, of all that are in order
  std::vector<std::array<HyperplaneId, 3>> apexes;  ///< a point of the face beside each of the others
};

/// Puts the pieces of a complex together: array by array what `brep_of` makes of the whole skin.
/// @param surface gets the triangles as `joined` puts them together, interfaces too, if not null.
[[nodiscard]] Brep joined(const HyperplaneTable<3>& table, const std::vector<BrepPiece>& pieces,
                          TriangleSurface* surface = nullptr);

/// Whether parts touch each other in faces of the skin.
[[nodiscard]] bool has_interfaces(const Skin& skin);
[[nodiscard]] Skin without_interfaces(const Skin& skin);

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
/// none. Then `take` has the piece, or `take_faces`. All decisions are exact; where edges are far from each
/// other rounded boxes tell, for certain. Thread rule: one thread at a time, which others help.
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
  [[nodiscard]] std::vector<CertainBox> boxes();
  /// For each share the edges of own faces that come near to its own. @param boxes of each share.
  [[nodiscard]] std::vector<Skin> neighbours(const std::vector<std::vector<CertainBox>>& boxes) const;
  void take_neighbours(const Skin& edges);
  /// Triangulates the own faces. @param crossings that the shares have found before, of all of them.
  /// @return points in which edges of one face cross, at which the edges of all are to be divided.
  [[nodiscard]] std::vector<Name> triangulate(std::span<const Name> crossings, const ToldShare& told = {});
  /// @pre triangulate has found no crossings, on any share.
  [[nodiscard]] SurfacePiece take();
  [[nodiscard]] BrepPiece take_faces();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bsp2::geometry
