#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/io/files/file.hpp"

namespace bsp2::io {

struct VtuOptions {
  bool tets = false;  ///< cut the cells into simplices, none of which is flat or inverted: larger files, but
                      ///< faster filters in ParaView
  int rank = 0;       ///< who computed the cells, for the cell array `rank`
  std::vector<std::int32_t>
      rank_of_region;  ///< who computed the cells of each region, if they are of several
  /// Red, green, blue, opacity of the IN cells of each primitive, for the cell array `color`; empty: there is
  /// none.
  std::vector<std::array<std::uint8_t, 4>> colour_of_primitive;
  std::array<std::uint8_t, 4> other_colour{255, 255, 255, 255};  ///< of all other cells
  std::vector<std::string>
      part_names;  ///< in the field array `part_names` of each piece; none: the whole is part 0
  std::size_t piece_cells =
      8000;  ///< at most so many cells of the mesh in a piece; bounds the memory for writing
};

/// What became of the cells of a mesh that is written as simplices.
struct SimplexCount {
  std::uint64_t simplices = 0;
  double smallest_angle =
      180;  ///< degrees: between two faces of a tetrahedron (dihedral), or two sides of a triangle
  std::uint64_t incomplete_cells =
      0;  ///< of which something is left out, since rounded to doubles it would be flat or inverted
  double left_out_volume = 0;  ///< of all these together

  void add(const SimplexCount& other) {  // here, since the module that counts sees no sources of this room
    simplices += other.simplices;
    smallest_angle = other.smallest_angle < smallest_angle ? other.smallest_angle : smallest_angle;
    incomplete_cells += other.incomplete_cells;
    left_out_volume += other.left_out_volume;
  }
};

/// Writes a solid mesh as a VTK unstructured grid: `NAME.pvtu` and its pieces `NAME_0.vtu`, `NAME_1.vtu`, ...
///
/// Cells are tetrahedra, wedges and hexahedra where they are exactly that, else polyhedra; polygons in 2D,
/// lines in 1D. Points with the same coordinates are one within a piece. Cell data: label, primitive, part,
/// region, rank, level, volume. All files are complete before the first of them appears under its name, the
/// `.pvtu` last.
/// @param pvtu a path that ends in `.pvtu`, in a folder that exists.
/// @param batches all of the same dimension.
/// @throws bsp2::Error if a file cannot be written, and if the dimension is above 3.
void write_vtu(const std::filesystem::path& pvtu, int dimension,
               std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
               const VtuOptions& options = {});

/// Removes a mesh and its pieces, if there are any.
void remove_vtu(const std::filesystem::path& pvtu);

/// Could `write_vtu` succeed, as far as that is known without a path? Asked before a long run. @throws
/// bsp2::Error if VTK cannot be loaded, which otherwise is tried when the first mesh is written.
void check_vtu();

/// One process's share of a mesh that several processes write as one `NAME.pvtu`, each its own pieces.
///
/// All make a share and tell each other its size; then all `write`; when all have written, all `publish`;
/// when all have published, the first one calls `finish`. A share that is not published leaves nothing
/// behind.
class VtuShare {
 public:
  /// What the others must know about a share.
  struct Size {
    std::uint64_t pieces = 0;  ///< files; none if it has no cells
    bool has_polyhedra = false;
  };

  /// @param batches must live as long as the share.
  /// @throws bsp2::Error as write_vtu.
  VtuShare(const std::filesystem::path& pvtu, int dimension,
           std::span<const std::shared_ptr<const geometry::CellBatch>> batches, VtuOptions options);
  ~VtuShare();
  VtuShare(const VtuShare&) = delete;
  VtuShare& operator=(const VtuShare&) = delete;

  [[nodiscard]] Size size() const;
  /// Writes the pieces out of sight, the first share also the `.pvtu`.
  /// @param before pieces of the shares before this one. @param all sizes of all shares together.
  void write(std::uint64_t before, const Size& all);
  /// Of the pieces of this share, once they are written.
  [[nodiscard]] const SimplexCount& simplices() const { return simplices_; }
  /// Moves the pieces to their names.
  void publish();
  /// Moves the `.pvtu` to its name, and removes pieces that an earlier, larger mesh left there. Of the first
  /// share.
  void finish();

 private:
  struct Content;
  std::filesystem::path pvtu_;
  VtuOptions options_;
  std::unique_ptr<Content> content_;
  std::optional<TemporaryDirectory> scratch_;
  std::uint64_t before_ = 0, all_pieces_ = 0;
  SimplexCount simplices_;
  void publish(const std::filesystem::path& name) const;
};

}  // namespace bsp2::io
