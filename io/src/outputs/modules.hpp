#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bsp2/geometry/support/module.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "outputs/piece.hpp"

// VTK, HDF5 and Open CASCADE are a hundred shared libraries with what they need, and most runs need none of
// them. So what needs them lives in modules.

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

/// What bsp2-hdf5 does: see write_snapshot and read_snapshot.
struct Hdf5Module {
  static constexpr const char* name = "bsp2-hdf5";
  void (*write_snapshot)(const std::filesystem::path& path, const Snapshot& snapshot,
                         const SnapshotWriters& writers);
  /// @param path a file that can be opened.
  Snapshot (*read_snapshot)(const std::filesystem::path& path, SnapshotPart part,
                            const std::function<bool(std::uint32_t region)>& wanted);
};

enum class CadFormat { step, iges, brep };

/// What bsp2-occt does: see write_cad.
struct OcctModule {
  static constexpr const char* name = "bsp2-occt";
  /// @return whether the file could be written. @throws Error if the shapes cannot be made.
  bool (*write)(const std::filesystem::path& path, CadFormat format, const geometry::Brep& brep,
                const SurfaceParts& parts);
};

/// Loaded by the first call, from any thread, and never unloaded. @throws Error if that fails.
const VtkModule& vtk_module();
const Hdf5Module& hdf5_module();
const OcctModule& occt_module();

/// What the room and its modules must have in common.
extern const char* const module_layout;

}  // namespace bsp2::io
