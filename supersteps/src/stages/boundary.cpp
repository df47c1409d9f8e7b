#include <algorithm>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/skin_share.hpp"
#include "ranks/sharing.hpp"
#include "stages/skin_archive.hpp"
#include "stages/stages.hpp"

// The surface is put together by all ranks, each of which triangulates some of its faces
// (geometry::SkinShare): faces go to those who have most of them, edges to all that have others near by. The
// master gets triangles, or, where faces are wanted, faces with their edges.

namespace bsp2::supersteps {
namespace {

using geometry::SkinShare;
using Table = geometry::HyperplaneTable<3>;

/// What of the surface this rank makes: of its own faces the triangles, or all that a complex needs.
/// Collective.
template <typename Piece>
Piece piece_of(Ranks& ranks, const Table& table, geometry::Skin mine, unsigned threads,
               const geometry::ToldShare& told) {
  const auto count = static_cast<unsigned>(ranks.count());
  std::optional<SkinShare> share;
  step(ranks, [&] {
    share.emplace(table, std::exchange(mine, {}), static_cast<unsigned>(ranks.rank()), count, threads);
    return texts_of(share->claims());
  });
  step(ranks, [&] { return texts_of(SkinShare::decide(values_of<std::vector<SkinShare::Claim>>(ranks))); });
  step(ranks, [&] {
    std::vector<SkinShare::Decision> decisions;
    for (const auto& some : values_of<std::vector<SkinShare::Decision>>(ranks))
      decisions.insert(decisions.end(), some.begin(), some.end());
    return texts_of(share->hand_over(decisions));
  });
  step(ranks, [&] {
    for (const auto& faces : values_of<geometry::Skin>(ranks)) share->take_over(faces);
    return std::vector<std::string>(count, dataflow::to_bytes(share->boxes()));
  });
  step(ranks,
       [&] { return texts_of(share->neighbours(values_of<std::vector<geometry::CertainBox>>(ranks))); });
  std::vector<SkinShare::Name> crossings;
  for (bool is_first = true; is_first || !crossings.empty(); is_first = false) {
    step(ranks, [&] {
      if (is_first)
        for (const auto& edges : values_of<geometry::Skin>(ranks)) share->take_neighbours(edges);
      return std::vector<std::string>(count, dataflow::to_bytes(share->triangulate(crossings, told)));
    });
    crossings.clear();
    ranks.agree([&] {
      for (const auto& some : values_of<std::vector<SkinShare::Name>>(ranks))
        crossings.insert(crossings.end(), some.begin(), some.end());
    });
  }
  Piece piece;
  ranks.agree([&] {
    if constexpr (std::is_same_v<Piece, geometry::BrepPiece>)
      piece = share->take_faces();
    else
      piece = share->take();
  });
  return piece;
}

/// The triangles alone. Collective.
void find_surface(Ranks& ranks, const Table& table, geometry::Skin mine, unsigned threads,
                  std::optional<geometry::TriangleSurface>& boundary, const geometry::ToldShare& told) {
  const auto pieces =
      gather_all(ranks, piece_of<geometry::SurfacePiece>(ranks, table, std::move(mine), threads, told));
  ranks.agree([&] {
    if (ranks.is_master()) boundary = geometry::joined(pieces);
  });
}

/// What this rank's share of the work is told as a part of the whole.
geometry::ToldShare part_of(const geometry::ToldShare& told, double from, double to) {
  if (!told) return {};
  return [&told, from, to](double done) { told(from + done * (to - from)); };
}

/// The master alone has all.
void find_alone(const Table& table, geometry::Skin all, bool with_faces, unsigned threads,
                std::optional<geometry::TriangleSurface>& boundary, std::optional<geometry::Brep>& faces,
                const geometry::ToldShare& told) {
  if (with_faces)
    faces = geometry::brep_of(table, std::move(all), &boundary.emplace(), told, threads);
  else
    boundary = geometry::triangulate(table, std::move(all), told, threads);
}

/// Faces, too. Where parts touch, the surface has other triangles than the faces: there is nothing between
/// parts. Collective.
void find_faces(Ranks& ranks, const Table& table, geometry::Skin mine, unsigned threads,
                std::optional<geometry::TriangleSurface>& boundary, std::optional<geometry::Brep>& faces,
                const geometry::ToldShare& told) {
  const auto touching = all_gather(ranks, static_cast<std::uint64_t>(geometry::has_interfaces(mine)));
  const bool is_divided = std::ranges::find(touching, 1U) != touching.end();
  double done = 0;
  if (is_divided) {
    done = 0.4;
    geometry::Skin outer;
    ranks.agree([&] { outer = geometry::without_interfaces(mine); });
    find_surface(ranks, table, std::move(outer), threads, boundary, part_of(told, 0, done));
  }
  const auto pieces = gather_all(
      ranks, piece_of<geometry::BrepPiece>(ranks, table, std::move(mine), threads, part_of(told, done, 0.9)));
  ranks.agree([&] {
    if (ranks.is_master())
      faces = geometry::joined(table, pieces, is_divided ? nullptr : &boundary.emplace());
  });
}

}  // namespace

void find_boundary(Ranks& ranks, const Table& table, geometry::Skin mine, bool with_faces, unsigned threads,
                   std::optional<geometry::TriangleSurface>& boundary, std::optional<geometry::Brep>& faces,
                   const geometry::ToldShare& told) {
  if (ranks.count() == 1)
    ranks.agree([&] { find_alone(table, std::move(mine), with_faces, threads, boundary, faces, told); });
  else if (with_faces)
    find_faces(ranks, table, std::move(mine), threads, boundary, faces, told);
  else
    find_surface(ranks, table, std::move(mine), threads, boundary, part_of(told, 0, 0.9));
}

}  // namespace bsp2::supersteps
