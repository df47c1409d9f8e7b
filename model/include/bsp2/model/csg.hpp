#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "bsp2/model/expression.hpp"

namespace bsp2::model {

/// A model read from a source text, and what the reader wants to say about it.
struct Model {
  Expression expression;
  std::vector<std::string> warnings;  ///< "file:line:column: text"
  /// Occurrences of primitives in the expanded tree of `expression`, in source order: what `%`, `*` and `!` leave out
  /// does not count, nor does what is empty (a cube of size 0, an operand of an empty intersection).
  std::size_t primitive_count = 0;
  /// Where each of these primitives stands in the text (bytes).
  std::vector<std::size_t> part_offsets;
  /// Where each construct (a Construction in `expression`) stands first.
  std::unordered_map<const Node*, std::size_t> construct_offsets;
  /// A `polyhedron` of the text that is a solid by itself, and where it stands.
  struct Polyhedron {
    std::size_t offset;
    Expression solid;
  };
  std::vector<Polyhedron> polyhedra;  ///< in source order
};

/// A warning, "name:line:column: ...", for each `polyhedron` whose faces cross each other: where, and what they sum up to, which
/// is not the volume of the solid. Equal ones are told of once, the first hundred of all.
///
/// Time: n log n for n triangles, more than it takes to read them.
/// @param text the one that the model was read from, under that name.
std::vector<std::string> crossing_warnings(const Model& model, std::string_view text, const std::string& name);

/// "name:line:column" of a byte of the text that was read under that name.
std::string place_in(std::string_view text, const std::string& name, std::size_t offset);

/// What a text is taken to mean beyond what it says.
struct CsgOptions {
  /// `sphere`, `cylinder` and `circle` are truly round (docs/curved.md), but for cylinders and circles of $fn = 3 to 6, which
  /// are prisms and polygons on purpose.
  bool curved = false;
};

/// Reads OpenSCAD's .csg language (all nodes, modifiers % # ! *, comments) with OpenSCAD's meaning; docs/model.md has the details.
///
/// Equal subtrees become one node. Time and memory are linear in the text, and the call stack does not grow with its
/// nesting. Any number of threads may read different texts.
/// @param name the name of the text in messages, usually its path.
/// @throws bsp2::Error "name:line:column: ..." for a syntax error, for an unknown node, and for more sides than the limits of tessellation.hpp; "name: ..." for a text without a node.
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

/// Has the program `openscad` (on the PATH) translate OpenSCAD source. Names of files in the result are relative to the
/// folder of the source, as in a .csg file.
/// @throws bsp2::Error if there is no such program, or if it fails: with what it said.
ModelText convert_scad(const std::filesystem::path& path);

/// The whole text of a model file. @throws bsp2::Error if it is missing, a directory, not readable or empty.
std::string read_text(const std::filesystem::path& path);
/// The same. @throws bsp2::Error also if it is a mesh or a drawing, by its name: those are imported; or a snapshot, by its first bytes.
std::string read_model_text(const std::filesystem::path& path);

}  // namespace bsp2::model
