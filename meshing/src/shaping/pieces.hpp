#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "editing/editor.hpp"

namespace bsp2::meshing {

/// A mesh with what is known of its points beyond their places; all of it, or that of one part.
struct Piece {
  Tetrahedra mesh;
  std::vector<Editor::Kind> kind;  ///< of each point
  /// A point that other pieces have, too.
  struct Shared {
    std::uint32_t point, of_whole;
    double wanted;  ///< length of edges there
  };
  std::vector<Shared> shared;
  double too_many = 0;  ///< see WantedLengths
};

/// One piece for each part, in ascending order. Points in tetrahedra of several are of the kind `shared` in
/// each of them. @param wanted of each point of the whole.
std::vector<Piece> divided(const Piece& whole, const std::vector<double>& wanted);

/// Puts pieces together again, in which all has changed but what is between shared points on sides.
/// @param whole as it was divided. @param pieces are used up. @return has no shared points any more.
/// @param seam gets the points that were.
Piece joined(const Piece& whole, std::vector<Piece> pieces, std::vector<std::uint32_t>& seam);

/// Replaces each piece by what `work` makes of it, in this order and as many at a time as there are threads.
/// @throws what `work` throws; Interrupted.
void replace_all(std::vector<Piece>& pieces, unsigned threads,
                 const std::function<Piece(const Piece&)>& work);

}  // namespace bsp2::meshing
