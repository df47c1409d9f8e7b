#include <optional>
#include <utility>
#include <vector>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex_share.hpp"
#include "ranks/sharing.hpp"
#include "stages/skin_archive.hpp"
#include "stages/stages.hpp"

// The IN cells become a complex where they are: each rank makes the faces of its own ones, with the cells of
// others around them (meshing::ComplexShare). The master gets faces.

namespace boost::serialization {
template <class Archive>
void serialize(Archive& archive, bsp2::meshing::ComplexShare::Beginning& beginning, unsigned) {
  archive& beginning.cells& beginning.of_families;
}
template <class Archive>
void serialize(Archive& archive, bsp2::meshing::NeighbourCells& cells, unsigned) {
  archive& cells.cells& cells.numbers& cells.boxes;
}
template <class Archive>
void serialize(Archive& archive, bsp2::meshing::ComplexPiece& piece, unsigned) {
  archive& piece.points& piece.shared& piece.names& piece.cells& piece.part& piece.corner_offset& piece
      .corners;
  archive& piece.face_offset& piece.face_points& piece.negative& piece.positive& piece.plane;
}
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using geometry::CertainBox;
using meshing::ComplexShare;
using Batches = std::vector<std::shared_ptr<const geometry::CellBatch>>;

/// The own cells' faces. Collective.
meshing::ComplexPiece piece_of(Ranks& ranks, const geometry::HyperplaneTable<3>& table, Batches cells,
                               unsigned threads) {
  const auto count = static_cast<unsigned>(ranks.count());
  std::optional<ComplexShare> share;
  step(ranks, [&] {
    share.emplace(table, std::move(cells), static_cast<unsigned>(ranks.rank()), count, threads);
    return std::vector<std::string>(count, dataflow::to_bytes(share->beginning()));
  });
  step(ranks, [&] {
    const auto boxes = share->boxes(values_of<ComplexShare::Beginning>(ranks));
    return std::vector<std::string>(count, dataflow::to_bytes(boxes));
  });
  const auto tell_neighbours = [&] {
    step(ranks, [&] { return texts_of(share->neighbours(values_of<std::vector<CertainBox>>(ranks))); });
  };
  const auto take_neighbours = [&] {
    for (auto& some : values_of<meshing::NeighbourCells>(ranks)) share->take_neighbours(std::move(some));
  };
  tell_neighbours();
  step(ranks, [&] {
    take_neighbours();
    return std::vector<std::string>(count, dataflow::to_bytes(share->boxes_of_neighbours()));
  });
  tell_neighbours();
  meshing::ComplexPiece piece;
  ranks.agree([&] {
    take_neighbours();
    piece = share->piece();
  });
  return piece;
}

}  // namespace

std::shared_ptr<meshing::Complex> meshing_cells(Ranks& ranks, const geometry::HyperplaneTable<3>& table,
                                                Batches cells, const RunOptions& options, unsigned threads) {
  std::shared_ptr<meshing::Complex> complex;
  bool is_over = false;
  try {
    const geometry::Interruption by_user(options.interrupted);
    try {
      auto pieces = gather_all(ranks, piece_of(ranks, table, std::move(cells), threads));
      ranks.agree([&] {
        if (ranks.is_master()) complex = std::make_shared<meshing::Complex>(meshing::joined(table, pieces));
      });
    } catch (const AgreedFailure&) {
      is_over = geometry::Interruption::is_over();
      throw;
    }
  } catch (const AgreedFailure&) {
    for (const int said : all_gather(ranks, is_over ? 1 : 0)) is_over = is_over || said != 0;
    if (!is_over) throw;
    throw geometry::Interrupted();
  }
  return complex;
}

}  // namespace bsp2::supersteps
