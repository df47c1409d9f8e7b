#include "bsp2/meshing/complex/complex_share.hpp"

#include <optional>
#include <stdexcept>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/plane_names.hpp"
#include "complex/complex_maker.hpp"

namespace bsp2::meshing {

using geometry::BoxGroups;
using geometry::CellBatch;
using geometry::CertainBox;

struct ComplexShare::Implementation {
  using Batch = std::shared_ptr<const CellBatch>;
  struct Place {
    std::uint32_t batch, cell;
  };
  const geometry::HyperplaneTable<3>& table;
  std::vector<Batch> batches;
  std::uint32_t share, shares;
  unsigned threads;
  std::vector<Place> own;   // IN cells
  std::uint32_t first = 0;  // number of the first of them
  std::optional<ComplexMaker> maker;
  std::vector<CertainBox> own_boxes;
  BoxGroups own_groups;
  std::vector<std::vector<bool>> is_sent;  // by share
  // Of others: all that have come, and of these those that touch own cells.
  std::vector<Batch> other_batches;
  std::vector<Place> others;
  std::vector<std::uint32_t> other_numbers;
  std::vector<CertainBox> other_boxes;
  std::vector<std::uint32_t> nearest;

  [[nodiscard]] BoxGroups::BoxOf box_of_own() const {
    return [this](std::uint32_t cell) { return own_boxes[cell]; };
  }
  [[nodiscard]] std::vector<std::uint32_t> others_touching(std::span<const CertainBox> boxes) const {
    const auto box_of = [this](std::uint32_t cell) { return other_boxes[cell]; };
    BoxGroups groups;
    groups.make(others.size(), box_of);
    return groups.touching(boxes, box_of);
  }
  [[nodiscard]] std::vector<CertainBox> nearest_boxes() const {
    std::vector<CertainBox> boxes;
    for (const std::uint32_t cell : nearest) boxes.push_back(other_boxes[cell]);
    return boxes;
  }
};

ComplexShare::ComplexShare(const geometry::HyperplaneTable<3>& table,
                           std::vector<std::shared_ptr<const CellBatch>> batches, unsigned share,
                           unsigned shares, unsigned threads)
    : implementation_(new Implementation{table, std::move(batches), share, shares, threads, {}}) {
  Implementation& mine = *implementation_;
  for (std::uint32_t batch = 0; batch < mine.batches.size(); ++batch)
    for (std::uint32_t cell = 0; cell < mine.batches[batch]->size(); ++cell)
      if (mine.batches[batch]->label[cell] == geometry::Label::in) mine.own.push_back({batch, cell});
}
ComplexShare::~ComplexShare() = default;

ComplexShare::Beginning ComplexShare::beginning() const {
  const Implementation& mine = *implementation_;
  return {static_cast<std::uint32_t>(mine.own.size()), geometry::family_planes(mine.table, mine.batches)};
}

std::vector<CertainBox> ComplexShare::boxes(std::span<const Beginning> all) {
  Implementation& mine = *implementation_;
  std::vector<geometry::HyperplaneId> families;
  std::uint64_t cells = 0;
  for (std::size_t share = 0; share < all.size(); ++share) {
    if (share == mine.share) mine.first = static_cast<std::uint32_t>(cells);
    cells += all[share].cells;
    families.insert(families.end(), all[share].of_families.begin(), all[share].of_families.end());
  }
  if (cells > 0x7fffffff) throw std::length_error("a mesh has more cells than can be numbered with 31 bits");
  mine.maker.emplace(mine.table, std::move(families), mine.threads);
  mine.maker->load(mine.batches);
  for (std::uint32_t cell = 0; cell < mine.own.size(); ++cell)
    mine.own_boxes.push_back(mine.maker->box_of(cell));
  mine.own_groups.make(mine.own.size(), mine.box_of_own());
  mine.is_sent.assign(mine.shares, std::vector<bool>(mine.own.size()));
  return mine.own_groups.boxes();
}

std::vector<NeighbourCells> ComplexShare::neighbours(const std::vector<std::vector<CertainBox>>& boxes) {
  Implementation& mine = *implementation_;
  std::vector<NeighbourCells> result(mine.shares);
  for (std::size_t to = 0; to < result.size(); ++to) {
    geometry::Interruption::check();
    if (to == mine.share) continue;
    for (const std::uint32_t cell : mine.own_groups.touching(boxes[to], mine.box_of_own())) {
      if (mine.is_sent[to][cell]) continue;
      mine.is_sent[to][cell] = true;
      const auto [batch, index] = mine.own[cell];
      result[to].cells.append(*mine.batches[batch], index, 1);
      result[to].numbers.push_back(mine.first + cell);
      result[to].boxes.push_back(mine.own_boxes[cell]);
    }
  }
  return result;
}

void ComplexShare::take_neighbours(NeighbourCells cells) {
  Implementation& mine = *implementation_;
  const auto batch = static_cast<std::uint32_t>(mine.other_batches.size());
  for (std::uint32_t cell = 0; cell < cells.cells.size(); ++cell) mine.others.push_back({batch, cell});
  mine.other_numbers.insert(mine.other_numbers.end(), cells.numbers.begin(), cells.numbers.end());
  mine.other_boxes.insert(mine.other_boxes.end(), cells.boxes.begin(), cells.boxes.end());
  mine.other_batches.push_back(std::make_shared<const CellBatch>(std::move(cells.cells)));
}

std::vector<CertainBox> ComplexShare::boxes_of_neighbours() {
  Implementation& mine = *implementation_;
  mine.nearest = mine.others_touching(mine.own_boxes);
  const std::vector<CertainBox> boxes = mine.nearest_boxes();
  BoxGroups groups;
  groups.make(boxes.size(), [&](std::uint32_t i) { return boxes[i]; });
  return groups.boxes();
}

ComplexPiece ComplexShare::piece() {
  Implementation& mine = *implementation_;
  const std::vector<CertainBox> boxes = mine.nearest_boxes();
  std::vector<bool> is_shared(mine.own.size());
  for (const std::uint32_t cell : mine.own_groups.touching(boxes, mine.box_of_own())) is_shared[cell] = true;
  const auto around = std::make_shared<CellBatch>();
  std::vector<std::uint32_t> numbers;
  std::vector<bool> is_taken(mine.others.size());
  const auto take = [&](std::uint32_t cell) {
    if (is_taken[cell]) return;
    is_taken[cell] = true;
    const auto [batch, index] = mine.others[cell];
    around->append(*mine.other_batches[batch], index, 1);
    numbers.push_back(mine.other_numbers[cell]);
  };
  for (const std::uint32_t cell : mine.nearest) take(cell);
  const auto near = static_cast<std::uint32_t>(numbers.size());
  for (const std::uint32_t cell : mine.others_touching(boxes)) take(cell);
  const std::vector<std::shared_ptr<const CellBatch>> loaded{around};
  mine.maker->load(loaded);
  return mine.maker->run({mine.first, static_cast<std::uint32_t>(mine.own.size()), near, numbers, is_shared});
}

}  // namespace bsp2::meshing
