#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// A model read from a source text, and what the reader wants to say about it.
struct Model {
  Expression expression;
  /// "file:line:column: text". What a file or a font of some name has is told once, with the number of the
  /// other places.
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  ///< likewise, what is right and good to know: no reason for doubt
  /// Occurrences of primitives in the expanded tree of `expression`, in source order: what `%`, `*` and `!`
  /// leave out does not count, nor does what is empty (a cube of size 0, an operand of an empty
  /// intersection).
  std::size_t primitive_count = 0;
  /// Where each of these primitives stands in the text (bytes).
  std::vector<std::size_t> part_offsets;
  /// Where each construct (a Construction in `expression`) stands first.
  std::unordered_map<const Node*, std::size_t> construct_offsets;
  /// A mesh of the text, a `polyhedron` or an `import`, that is a solid by itself and takes part.
  struct Mesh {
    std::size_t offset;          ///< where it stands
    std::filesystem::path file;  ///< of an import
    Expression solid;
    /// What the maps around it multiply its volume by; nothing if there is a construct around it, which makes
    /// something else of it.
    std::optional<double> scale;
  };
  std::vector<Mesh> meshes;  ///< in source order
};

/// A mesh around some points of which the faces wind other than 0 or 1 times, so that they sum up to another
/// volume than that of the solid, which has each point once.
struct OverlappingMesh {
  std::string place;     ///< "name:line:column" of its node
  std::string file;      ///< of an import, else empty
  std::size_t part = 0;  ///< which primitive of the source it is
  std::size_t triangles = 0;
  /// What its faces sum up to where it stands in the model: each point as often as they wind around it. To 14
  /// digits, for it is summed up with 33; nothing under a construct, where it does not stand as it is.
  std::optional<double> volume_by_faces;
};

struct MeshOverlaps {
  std::vector<OverlappingMesh> meshes;  ///< in source order
  /// "name:line:column: ...": where faces cross, and what they sum up to. Equal meshes are told of once, the
  /// first hundred of all.
  std::vector<std::string> warnings;
};

/// The meshes whose faces cross each other for sure, or some of whose shells lie in others that are wound
/// like them.
///
/// Time: n log n for n triangles, more than it takes to read them.
/// @param text the one that the model was read from, under that name.
/// @param threads that look at them.
/// @param sound meshes of the model that are known to be none of these: they are not looked at.
MeshOverlaps overlaps_of(const Model& model, std::string_view text, const std::string& name,
                         unsigned threads = 1, std::span<const TriangleMesh* const> sound = {});

/// "name:line:column" of a byte of the text that was read under that name.
std::string place_in(std::string_view text, const std::string& name, std::size_t offset);

/// What a text is taken to mean beyond what it says.
struct CsgOptions {
  /// `sphere`, `cylinder` and `circle` are truly round (docs/curved.md), but for cylinders and circles of $fn
  /// = 3 to 6, which are prisms and polygons on purpose.
  bool curved = false;
};

/// Reads OpenSCAD's .csg language (all nodes, modifiers % # ! *, comments) with OpenSCAD's meaning;
/// docs/model.md has the details.
///
/// Equal subtrees become one node. Time and memory are linear in the text, and the call stack does not grow
/// with its nesting. Any number of threads may read different texts.
/// @param name the name of the text in messages, usually its path.
/// @throws bsp2::Error "name:line:column: ..." for a syntax error, for an unknown node, and for more sides
/// than the limits of tessellation.hpp; "name: ..." for a text without a node.
Model parse_csg(std::string_view text, const std::string& name, const CsgOptions& options = {});

/// Reads a file. @throws bsp2::Error also if it is no readable file.
Model read_csg(const std::filesystem::path& path, const CsgOptions& options = {});

/// A model as .csg text, and what the program that made it had to say.
struct ModelText {
  std::string text;
  std::vector<std::string> warnings;
};

/// Whether this is OpenSCAD source, which `convert_scad` reads.
bool is_scad(const std::filesystem::path& path);

/// Has the program `openscad` (on the PATH) translate OpenSCAD source. Names of files in the result are
/// relative to the folder of the source, as in a .csg file.
/// @throws bsp2::Error if there is no such program, or if it fails: with what it said.
ModelText convert_scad(const std::filesystem::path& path);

/// The formats of files that a model imports as a table, a line each, of at most 80 columns.
std::string import_format_table();

/// Whether this is, by its name, a file that a model imports: a mesh, faces, or a drawing.
bool is_imported(const std::filesystem::path& path);

/// The whole text of a file. @throws bsp2::Error if it is missing, a directory, not readable or empty.
std::string read_text(const std::filesystem::path& path);
/// The text of a model file. Of what a model imports (is_imported) it is a model that does so, and reads from
/// the same folder.
/// @throws bsp2::Error also if it is a snapshot, or no text at all, by its first bytes, or, by its ending, of
/// a format that is only written.
std::string read_model_text(const std::filesystem::path& path);

}  // namespace bsp2::model
