#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "outputs/outputs.hpp"

namespace bsp2 {

/// Numbers of points, or indices, without the lists they stand in.
template <typename Number, std::size_t N>
std::span<const Number> flat(const std::vector<std::array<Number, N>>& rows) {
  return {rows.empty() ? nullptr : rows.front().data(), N * rows.size()};
}

class Result::Implementation {
 public:
  supersteps::RunResult result;
  api::Written written;
  std::shared_ptr<Ranks::Implementation> ranks;
  std::optional<Expression> expression;           ///< none: of a file, or of a snapshot
  std::filesystem::path model;                    ///< the file
  std::optional<std::filesystem::path> snapshot;  ///< that was written, or else resumed
  bool holds_cells = true;                        ///< on some rank
  bool has_contacts = false;                      ///< all are in the result

  /// @throws Error that says why, if there are no cells to be shown as `what`.
  void check_cells(const std::string& what) const;

  const Cells& cells();
  const Measures& measures();
  void find_surface(bool with_faces = false);
  void find_outlines();
  const supersteps::Asked& asked() const;
  std::vector<std::string> write(const std::filesystem::path& path, const WriteOptions& options);
  std::string picture(const std::string& format, const View& view);
  void animate(const std::filesystem::path& path, const Film& film, const View& view);
  [[nodiscard]] Figures figures() const;

 private:
  std::shared_ptr<const geometry::CellBatch> whole_;  // all cells
  std::optional<Cells> cells_;
  std::optional<Measures> measures_;

  void write_on_master(const std::filesystem::path& path, const WriteOptions& options,
                       std::vector<std::string>& warnings);
  [[nodiscard]] std::string source() const;
};

}  // namespace bsp2
