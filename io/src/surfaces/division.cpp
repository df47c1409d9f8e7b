#include "surfaces/division.hpp"

#include <algorithm>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::io {
namespace {

/// Parts are numbered from -1; here from 0.
std::size_t place_of(std::int32_t owner) { return static_cast<std::size_t>(owner + 1); }

/// The triangles of one part.
geometry::TriangleSurface surface_of(const PartPiece& piece, const geometry::TriangleSurface& whole) {
  geometry::TriangleSurface surface;
  surface.points.reserve(piece.points.size());
  for (const std::uint32_t point : piece.points) surface.points.push_back(whole.points[point]);
  surface.triangles = piece.triangles;
  surface.owner.assign(piece.triangles.size(), piece.owner);
  return surface;
}

}  // namespace

std::vector<PartPiece> pieces_by_part(std::size_t points, const std::vector<CornerIndices>& triangles,
                                      const std::vector<std::int32_t>& owner) {
  std::vector<std::size_t> count;
  for (const std::int32_t part : owner) {
    if (place_of(part) >= count.size()) count.resize(place_of(part) + 1);
    ++count[place_of(part)];
  }
  std::vector<PartPiece> pieces;
  std::vector<std::size_t> piece_of(count.size());
  for (std::size_t place = 0; place < count.size(); ++place) {
    if (count[place] == 0) continue;
    piece_of[place] = pieces.size();
    PartPiece& piece = pieces.emplace_back();
    piece.owner = static_cast<std::int32_t>(place) - 1;
    piece.of_whole.reserve(count[place]);
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    pieces[piece_of[place_of(owner[t])]].of_whole.push_back(t);
  std::vector<std::uint32_t> number(points, no_half_edge);
  for (PartPiece& piece : pieces) {
    piece.triangles.reserve(piece.of_whole.size());
    for (const std::uint32_t t : piece.of_whole) {
      CornerIndices& corners = piece.triangles.emplace_back(triangles[t]);
      for (std::uint32_t& corner : corners) {
        if (number[corner] == no_half_edge) {
          number[corner] = static_cast<std::uint32_t>(piece.points.size());
          piece.points.push_back(corner);
        }
        corner = number[corner];
      }
    }
    for (const std::uint32_t point : piece.points) number[point] = no_half_edge;
  }
  return pieces;
}

std::vector<PrintedObject> printed_objects(const geometry::TriangleSurface& surface, const PartLabels& labels,
                                           std::vector<std::string>& notes) {
  std::vector<PrintedObject> objects;
  Touching touching;
  std::vector<std::string> vanished;
  for (const PartPiece& piece : pieces_by_part(surface.points.size(), surface.triangles, surface.owner)) {
    SingleSurface rounded = rounded_to_single(surface_of(piece, surface));
    if (rounded.triangles.empty()) {
      vanished.push_back(labels.name(piece.owner));
      continue;
    }
    PrintedObject& object = objects.emplace_back();
    object.owner = piece.owner;
    object.name = labels.name(piece.owner);
    object.mesh = {std::move(rounded.points), std::move(rounded.triangles), std::move(rounded.owner)};
    make_manifold(object.mesh, touching);
  }
  if (const std::string told = touching.told(); !told.empty()) notes.push_back(told);
  if (!vanished.empty()) notes.push_back("single precision leaves nothing of " + parts_named(vanished));
  return objects;
}

}  // namespace bsp2::io
