#pragma once

#include <cstdint>
#include <memory>

#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::dataflow {

/// Decided cells on their way to the consumers, and where they come from.
struct Refinement {
  geometry::CellBatch cells;
  std::uint32_t worker = 0;
  std::uint64_t first = 0;  ///< number of the first cell among all cells of its worker
};

/// A process with one input stream and no output stream; any number of them may listen to one result.
///
/// Thread rule: all calls come from the thread that called `evaluate`, one at a time. A consumer may keep the
/// batch: it is shared by all consumers and never changes. An exception ends the evaluation and leaves
/// `evaluate`. Source: the paper, section 4.1, "Consumers".
class Consumer {
 public:
  Consumer() = default;
  Consumer(const Consumer&) = delete;
  Consumer& operator=(const Consumer&) = delete;
  virtual ~Consumer() = default;
  virtual void consume(const std::shared_ptr<const Refinement>& refinement) = 0;
  /// Whether it is there for cells, and not only to see the progress. Cells that nobody takes are measured
  /// and not written. Does not change.
  [[nodiscard]] virtual bool takes_cells() const { return true; }
  /// Called about ten times a second. @param done share of the space that is decided, 0 to 1. @param cells
  /// that are decided.
  /// @param grown with a limit of cells: by so many the cells, decided or not, have become more.
  virtual void progress(double done, std::uint64_t cells, std::int64_t grown) {
    static_cast<void>(done);
    static_cast<void>(cells);
    static_cast<void>(grown);
  }
};

}  // namespace bsp2::dataflow
