#include "faces/joined_pieces.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "support/counted_order.hpp"
#include "surface/no_index.hpp"
#include "surface/skin_steps.hpp"

namespace bsp2::geometry {
namespace {

/// Numbers names in the order in which they come.
class Names {
 public:
  explicit Names(std::size_t most) {
    std::size_t size = 16;
    while (size < 2 * most) size *= 2;
    table_.assign(size, none);
  }
  std::uint32_t number(const std::array<HyperplaneId, 3>& name) {
    std::uint64_t hash = name[0];
    for (const std::size_t k : {1U, 2U}) hash = hash * 0x9e3779b97f4a7c15u + name[k];
    std::size_t at = hash * 0x9e3779b97f4a7c15u >> 20;
    for (;; ++at) {
      std::uint32_t& entry = table_[at & (table_.size() - 1)];
      if (entry == none) {
        entry = static_cast<std::uint32_t>(names_.size());
        names_.push_back(name);
        return entry;
      }
      if (names_[entry] == name) return entry;
    }
  }
  [[nodiscard]] std::size_t size() const { return names_.size(); }

 private:
  std::vector<std::uint32_t> table_;
  std::vector<std::array<HyperplaneId, 3>> names_;
};

/// A piece that is read from its beginning to its end.
struct Reading {
  const SurfacePiece* piece;
  std::size_t face = 0, triangle = 0;  ///< the next ones
};

/// Faces of all pieces in their order: the piece of each.
std::vector<std::uint32_t> order_of_faces(std::span<const SurfacePiece* const> pieces) {
  std::vector<Skin::Face> faces;
  std::vector<std::uint32_t> piece_of;
  for (std::uint32_t i = 0; i < pieces.size(); ++i)
    for (const SurfacePiece::Face& face : pieces[i]->faces) {
      faces.push_back(face.face);
      piece_of.push_back(i);
    }
  auto order = counted_order(
      faces.size(), [&](std::size_t i) { return faces[i].outward.code; },
      [&](std::uint32_t a, std::uint32_t b) { return is_before(faces[a], faces[b]); });
  for (std::uint32_t& face : order) face = piece_of[face];
  return order;
}

}  // namespace

JoinedPieces join(std::span<const SurfacePiece* const> pieces) {
  std::size_t all_triangles = 0, all_points = 0, all_shared = 0;
  for (const SurfacePiece* piece : pieces) {
    all_triangles += piece->triangles.size();
    all_points += piece->points.size();
    all_shared += piece->shared.size();
  }
  if (all_points + all_shared >= none) throw Error("the surface has more points than 2^32");
  const auto first_name = static_cast<std::uint32_t>(none - all_shared);
  Names names(all_shared);
  std::vector<Reading> readings;
  JoinedPieces result;  // a number is `none` yet, or, from `first_name` on, that of a name
  for (const SurfacePiece* piece : pieces) {
    readings.push_back({piece});
    auto& number = result.numbers.emplace_back(piece->points.size(), none);
    for (const auto& [point, name] : piece->shared) number[point] = first_name + names.number(name);
  }
  std::vector<std::uint32_t> number_of_name(names.size(), none);
  TriangleSurface& surface = result.surface;
  surface.points.reserve(all_points);
  surface.triangles.reserve(all_triangles);
  surface.owner.reserve(all_triangles);
  result.piece_of_face = order_of_faces(pieces);
  for (const std::uint32_t i : result.piece_of_face) {
    Reading& reading = readings[i];
    const SurfacePiece& piece = *reading.piece;
    const auto& [face, triangles] = piece.faces[reading.face++];
    for (std::uint32_t k = 0; k < triangles; ++k) {
      auto triangle = piece.triangles[reading.triangle++];
      for (std::uint32_t& point : triangle) {
        std::uint32_t* number = &result.numbers[i][point];
        if (*number >= first_name && *number != none) number = &number_of_name[*number - first_name];
        if (*number == none) {
          *number = static_cast<std::uint32_t>(surface.points.size());
          surface.points.push_back(piece.points[point]);
        }
        point = *number;
      }
      surface.triangles.push_back(triangle);
      surface.owner.push_back(face.owner);
    }
  }
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (const auto& [point, name] : pieces[i]->shared)
      result.numbers[i][point] = number_of_name[result.numbers[i][point] - first_name];
  return result;
}

TriangleSurface joined(const std::vector<SurfacePiece>& pieces) {
  std::vector<const SurfacePiece*> all;
  for (const SurfacePiece& piece : pieces) all.push_back(&piece);
  return join(all).surface;
}

}  // namespace bsp2::geometry
