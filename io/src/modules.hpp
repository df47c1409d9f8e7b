#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "bsp2/geometry/boundary.hpp"
#include "bsp2/io/snapshot.hpp"
#include "bsp2/io/vtu.hpp"
#include "piece.hpp"

// VTK and HDF5 are 46 shared libraries with what they need, and most runs need neither. So what needs them lives in two shared libraries of our
// own, the modules, and each is loaded when it is first asked for.

namespace bsp2::io {

/// A file of a mesh: where it is written for now, and the mesh's path, for messages.
struct PieceFile {
  std::filesystem::path path, shown;
};

/// What bsp2-vtk does.
struct VtkModule {
  /// Does a piece hold a cell that is only a polyhedron?
  bool (*has_polyhedra)(const Piece& piece);
  /// @param with_polyhedron write one cell as a polyhedron even if it is simpler. @throws Error if the disk is full.
  void (*write_piece)(const PieceFile& file, const Piece& piece, bool with_polyhedron, const VtuOptions& options);
  /// The bytes of a file.
  std::string (*to_vtp)(const geometry::TriangleSurface& surface);
};

/// What bsp2-hdf5 does: see write_snapshot and read_snapshot.
struct Hdf5Module {
  void (*write_snapshot)(const std::filesystem::path& path, const Snapshot& snapshot, const SnapshotWriters& writers);
  /// @param path a file that can be opened.
  Snapshot (*read_snapshot)(const std::filesystem::path& path, SnapshotPart part, const std::function<bool(std::uint32_t region)>& wanted);
};

/// Loaded by the first call, from any thread, and never unloaded. @throws Error if that fails.
const VtkModule& vtk_module();
const Hdf5Module& hdf5_module();

/// What the program and a module must have in common to understand each other: a digest of the headers whose types pass between
/// them, and of the compiler. Each has it as BSP2_IO_LAYOUT; this is the program's.
extern const char* const module_layout;

/// Loads `NAME.so` from a folder.
/// @return what its `bsp2_module` returns.
/// @throws Error if it is not there, if it cannot be loaded, or if it was built with another layout.
const void* load_module(const std::string& name, const std::filesystem::path& folder, const char* layout = module_layout);

/// Where the modules are: beside the program's folder, in builds as in installations, however they were moved. Nowhere else: what was
/// built from other sources, or is somebody else's, is not the program's. @throws Error if the program's own place is not known.
std::filesystem::path module_folder();

}  // namespace bsp2::io

/// Each module has one of these, its only symbol: a VtkModule or Hdf5Module, null if the program has another layout.
extern "C" [[gnu::visibility("default")]] const void* bsp2_module(const char* layout);
