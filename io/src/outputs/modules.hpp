#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/support/module.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/geometry/surface/round_solid.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "outputs/piece.hpp"

// VTK, HDF5, Open CASCADE and cairo are a hundred shared libraries with what they need, and most runs need
// none of them. So what needs them lives in modules.

namespace bsp2::io {

/// A file of a mesh: where it is written for now, and the mesh's path, for messages.
struct PieceFile {
  std::filesystem::path path, shown;
};

/// What bsp2-vtk does.
struct VtkModule {
  static constexpr const char* name = "bsp2-vtk";
  /// Does a piece hold a cell that is only a polyhedron?
  bool (*has_polyhedra)(const Piece& piece);
  /// @param with_polyhedron write one cell as a polyhedron even if it is simpler. @throws Error if the disk
  /// is full.
  /// @return of the simplices in it, if the cells are to be cut.
  SimplexCount (*write_piece)(const PieceFile& file, const Piece& piece, bool with_polyhedron,
                              const VtuOptions& options);
  /// The bytes of a file.
  std::string (*to_vtp)(const geometry::TriangleSurface& surface, const SurfaceParts& parts);
};

/// An array for a file: of doubles or of whole numbers, the other pointer null; rows by columns.
struct Hdf5Array {
  const char* name;
  const double* reals;
  const std::int64_t* integers;
  std::uint64_t rows, columns;
};

/// What bsp2-hdf5 does: see write_snapshot and what follows it.
struct Hdf5Module {
  static constexpr const char* name = "bsp2-hdf5";
  void (*write_snapshot)(const std::filesystem::path& path, const Snapshot& snapshot,
                         const SnapshotWriters& writers);
  /// @param path a file that can be opened.
  Snapshot (*read_snapshot)(const std::filesystem::path& path, SnapshotPart part,
                            const std::function<bool(std::uint32_t region)>& wanted);
  /// Whether it can be opened and has not the mark of a snapshot, of whatever version.
  bool (*is_of_others)(const std::filesystem::path& path);
  void (*add_surface)(const std::filesystem::path& path, const geometry::TriangleSurface& surface,
                      const geometry::Brep* faces);
  std::optional<SnapshotSurface> (*read_surface)(const std::filesystem::path& path, std::int32_t parts,
                                                 bool with_faces);
  /// A file of arrays, and a text about them as its attribute `names`; it appears when it is complete.
  /// @throws Error if it cannot be written.
  void (*write_arrays)(const std::filesystem::path& path, const std::vector<Hdf5Array>& arrays,
                       const std::string& names);
};

enum class CadFormat { step, iges, brep };

/// What a part is called in a file.
struct CadPart {
  std::string name;  ///< UTF-8
  std::optional<SurfaceParts::Colour> colour;
};
using CadParts = std::map<std::int32_t, CadPart>;  ///< by number

/// What became of a complex in a file.
struct CadRemarks {
  bool is_written = false;
  std::uint64_t short_edges = 0, thin_solids = 0;  ///< that have become points, and nothing
  std::uint64_t true_surfaces = 0;                 ///< solids that have them
};

/// What bsp2-occt does: see write_cad.
struct OcctModule {
  static constexpr const char* name = "bsp2-occt";
  /// @param is_over whether somebody wants it to end; then the file is not written.
  /// @throws Error if the shapes cannot be made.
  CadRemarks (*write)(const std::filesystem::path& path, CadFormat format, const geometry::Brep& brep,
                      std::span<const geometry::RoundSolid> rounds, const CadParts& parts, bool (*is_over)());
};

/// What bsp2-pdf does.
struct PdfModule {
  static constexpr const char* name = "bsp2-pdf";
  /// The bytes of a file.
  std::string (*to_pdf)(const Sheet& sheet);
};

/// Loaded by the first call, from any thread, and never unloaded. @throws Error if that fails.
const VtkModule& vtk_module();
const Hdf5Module& hdf5_module();
const OcctModule& occt_module();
const PdfModule& pdf_module();

/// What the room and its modules must have in common.
extern const char* const module_layout;

}  // namespace bsp2::io
