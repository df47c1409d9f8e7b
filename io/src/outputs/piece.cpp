#include "outputs/piece.hpp"

#include <algorithm>

namespace bsp2::io {

std::vector<Piece> divide(std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
                          std::size_t piece_cells) {
  std::vector<Piece> pieces(1);
  std::size_t room = piece_cells;
  for (const auto& batch : batches) {
    for (std::size_t first = 0; first < batch->size();) {
      if (room == 0) {
        pieces.emplace_back();
        room = piece_cells;
      }
      const std::size_t last = first + std::min(room, batch->size() - first);
      pieces.back().push_back({batch.get(), first, last});
      room -= last - first;
      first = last;
    }
  }
  return pieces;
}

}  // namespace bsp2::io
