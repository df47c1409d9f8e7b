#pragma once

// A surface that several put together, in one process.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/skin_share.hpp"

namespace bsp2::geometry {

/// What each gives to each of the others: [from][to] becomes [to][from].
template <typename T>
std::vector<std::vector<T>> exchanged(std::vector<std::vector<T>> given) {
  std::vector<std::vector<T>> taken(given.size());
  for (auto& row : given)
    for (std::size_t to = 0; to < row.size(); ++to) taken[to].push_back(std::move(row[to]));
  return taken;
}

/// What each of several has made of the sum of their skins, as ranks do it that have one each.
/// @param crossings counts those that were found.
inline std::vector<std::unique_ptr<SkinShare>> shares_of(const HyperplaneTable<3>& table,
                                                         std::vector<Skin> skins, unsigned threads = 1,
                                                         std::size_t* crossings_found = nullptr) {
  const auto count = static_cast<unsigned>(skins.size());
  std::vector<std::unique_ptr<SkinShare>> shares;
  for (unsigned i = 0; i < count; ++i)
    shares.push_back(std::make_unique<SkinShare>(table, std::move(skins[i]), i, count, threads));
  std::vector<std::vector<std::vector<SkinShare::Claim>>> claims;
  for (const auto& share : shares) claims.push_back(share->claims());
  std::vector<std::vector<std::vector<SkinShare::Decision>>> decisions;
  for (const auto& some : exchanged(std::move(claims))) decisions.push_back(SkinShare::decide(some));
  decisions = exchanged(std::move(decisions));
  std::vector<std::vector<Skin>> given;
  for (unsigned i = 0; i < count; ++i) {
    std::vector<SkinShare::Decision> mine;
    for (const auto& some : decisions[i]) mine.insert(mine.end(), some.begin(), some.end());
    given.push_back(shares[i]->hand_over(mine));
  }
  given = exchanged(std::move(given));
  std::vector<std::vector<CertainBox>> boxes;
  for (unsigned i = 0; i < count; ++i) {
    for (const Skin& faces : given[i]) shares[i]->take_over(faces);
    boxes.push_back(shares[i]->boxes());
  }
  given.clear();
  for (const auto& share : shares) given.push_back(share->neighbours(boxes));
  given = exchanged(std::move(given));
  for (unsigned i = 0; i < count; ++i)
    for (const Skin& edges : given[i]) shares[i]->take_neighbours(edges);
  std::vector<SkinShare::Name> crossings;
  do {
    std::vector<SkinShare::Name> found;
    for (const auto& share : shares) {
      const auto some = share->triangulate(crossings);
      found.insert(found.end(), some.begin(), some.end());
    }
    crossings = std::move(found);
    if (crossings_found != nullptr) *crossings_found += crossings.size();
  } while (!crossings.empty());
  return shares;
}

/// The surface of the sum of some skins. @param crossings counts those that were found.
inline TriangleSurface triangulated_by_all(const HyperplaneTable<3>& table, std::vector<Skin> skins,
                                           unsigned threads = 1, std::size_t* crossings_found = nullptr) {
  std::vector<SurfacePiece> pieces;
  for (const auto& share : shares_of(table, std::move(skins), threads, crossings_found))
    pieces.push_back(share->take());
  return joined(pieces);
}

/// The complex of the sum of some skins, and the surface with its interfaces.
/// @param open counts edges that none of the shares could decide alone, decided the others.
inline Brep brep_by_all(const HyperplaneTable<3>& table, std::vector<Skin> skins, TriangleSurface& surface,
                        std::size_t& open, std::size_t& decided, unsigned threads = 1) {
  std::vector<BrepPiece> pieces;
  for (const auto& share : shares_of(table, std::move(skins), threads)) {
    pieces.push_back(share->take_faces());
    for (const auto& edge : pieces.back().edges)
      ++(edge.order == BrepPiece::Edge::Order::open ? open : decided);
  }
  return joined(table, pieces, &surface);
}

/// Deals the faces of a skin out, and those of some to several, edge by edge. @param choose who of so many
/// gets something.
template <typename Choose>
std::vector<Skin> dealt_out(const Skin& skin, unsigned count, const Choose& choose) {
  std::vector<Skin> parts(count, skin);  // vertices and faces without edges do no harm
  for (Skin& part : parts) part.edges.clear();
  for (const Skin::Edge& edge : skin.edges) parts[choose(edge)].edges.push_back(edge);
  return parts;
}

}  // namespace bsp2::geometry
