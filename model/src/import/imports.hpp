#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/model/expression/expression.hpp"
#include "bsp2/model/expression/tessellation.hpp"
#include "mesh/mesh_closing.hpp"

/// Files that a model names. All ranks read them, so all must be able to.
namespace bsp2::model {

struct ImportedMesh {
  std::vector<Point3> points;
  FaceCycles faces;                     ///< clockwise seen from outside, as in a polyhedron
  std::vector<std::string> warnings{};  ///< what is odd about the file, which was read all the same

  /// @return its index.
  std::uint32_t add_point(const Point3& point);
  /// @param corners counter-clockwise seen from outside, as in files.
  void add_face(std::span<const std::uint32_t> corners);
};

/// Who is told what there is to say about a file; each may be empty.
struct Remarks {
  std::function<void(const std::string&)> warn;  ///< what is not read, and others
  std::function<void(const std::string&)> note;  ///< what is right as it is, and good to know
};

/// What of a file is a part by itself.
struct ImportedPart {
  std::string name;              ///< empty: it has none
  std::optional<Colour> colour;  ///< of all of it
  ImportedMesh mesh;
};

/// All parts of a file, in its order: one without a name of what only has triangles.
struct ImportedParts {
  std::vector<ImportedPart> parts;
  std::vector<std::string> warnings{};         ///< what is odd about the file, or not as exact in it
  std::vector<std::string> notes{};            ///< what is right as it is, and good to know
  std::vector<std::array<double, 4>> sizes{};  ///< of a size field, see read_size_field
};

/// What is said of a file in another unit than millimetres, as 3MF and AMF have them; nothing of these.
std::vector<std::string> notes_of_unit(std::string_view unit);

/// All parts as one mesh.
ImportedMesh joined(const std::vector<ImportedPart>& parts);

/// How finely the curved faces of a file become triangles.
struct Fineness {
  Resolution resolution;
  double deflection = 0;  ///< how far triangles may be from the face, > 0; 0: as the resolution says
};

/// The ending of a file's name (with its dot) in small letters.
std::string lower_ending(const std::filesystem::path& path);

/// Whether import_parts reads files with this ending (with its dot, in small letters).
bool is_mesh_ending(std::string_view ending);

/// Whether files with this ending are written, and not read.
bool is_written_alone(std::string_view ending);
/// What is said of an ending that is not read.
std::string why_not_read(std::string_view ending);

/// The endings that import_parts reads, for messages: ".3mf, .amf, ... and .vtp".
std::string mesh_endings();

/// The parts of a file of solids: meshes, or faces that become meshes.
///
/// Strict: what is damaged or cut off is an error with its line or byte, never half a mesh; only of the
/// number of facets that a binary STL file tells its length knows better, which gets a warning. Coordinates
/// are finite and at most largest_coordinate.
/// @throws bsp2::Error if the file cannot be read.
ImportedParts import_parts(const std::filesystem::path& path, const Fineness& fineness = {});

/// All parts of a file of solids as one mesh.
ImportedMesh import_mesh(const std::filesystem::path& path);

/// A part of a file that is a solid.
struct SolidPart {
  std::string name;  ///< empty: none
  std::optional<Colour> colour;
  TriangleMesh mesh;
};

/// The solids that the parts of a file bound, each repaired where it does not close; what encloses nothing is
/// left out.
/// @param remarks is told what was repaired, and what is odd but for faces that cross (overlaps_of in csg.hpp
/// looks for those).
/// @throws bsp2::Error also for what cannot be repaired.
std::vector<SolidPart> solids_of_file(const std::filesystem::path& path, const Fineness& fineness,
                                      const Remarks& remarks);

/// The mesh in the bytes of a file, for each format. @param path its name in messages.
ImportedMesh import_stl(std::string_view bytes, const std::filesystem::path& path);  ///< text and binary
ImportedMesh import_off(std::string_view bytes, const std::filesystem::path& path);  ///< text
ImportedMesh import_obj(std::string_view bytes, const std::filesystem::path& path);
ImportedMesh import_ply(std::string_view bytes,
                        const std::filesystem::path& path);  ///< text and binary, both byte orders
ImportedParts import_3mf(
    std::string_view bytes,
    const std::filesystem::path& path);  ///< the build, with its transforms; units make no difference
ImportedParts import_gltf(std::string_view bytes,
                          const std::filesystem::path& path);  ///< text and binary, in millimetres, z up
ImportedParts import_msh(std::string_view bytes,
                         const std::filesystem::path& path);  ///< of gmsh, 2.2 and 4.1, text and binary
ImportedParts import_amf(
    std::string_view bytes,
    const std::filesystem::path& path);  ///< plain or zipped; no constellations, no units, as in OpenSCAD

struct Landscape {
  ImportedMesh mesh;
  double unit = 1;  ///< heights are the mesh's z times this: so z is exact, which heights are not
};

/// A landscape: the heights of a text (.dat; rows are y, columns x) or the grey values of a picture (.png, 0
/// to 100) over a grid of unit squares, four triangles each, down to 0 or to 1 below the lowest height,
/// whichever is lower. Without two rows and columns it has no faces. @throws bsp2::Error if the file cannot
/// be read.
Landscape import_surface(const std::filesystem::path& path, bool center, bool invert);

struct PlaneDrawing {
  std::vector<std::array<double, 2>> points;
  FaceCycles paths;
};

/// Where the drawing lies: its point `origin` becomes 0, lengths are multiplied by `scale`.
struct DrawingFrame {
  std::array<double, 2> origin{};
  double scale = 1;
};

/// The paths of a DXF drawing's lines, arcs, circles, ellipses, splines, polylines, solids and inserted
/// blocks. As in OpenSCAD their points lie on a grid of 2^-10, ends next to each other on it meet, and open
/// paths are closed by a straight line.
///
/// Bounded, whatever the numbers in the file say: a million lines, and blocks that are inserted some hundred
/// thousand times.
/// @param layer only what is on this layer (of an INSERT: its own, whatever is in the block); empty:
/// everything.
/// @param remarks is warned once of all that is not read, by its kinds, and told the units of the file.
/// @throws bsp2::Error if the file cannot be read or is cut off, if a number in it is none, if a block
/// inserts itself.
PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer,
                        const DrawingFrame& frame, const Resolution& resolution, const Remarks& remarks = {});

/// What is wanted of an SVG drawing, with what is in it; empty names: everything.
struct SvgSelection {
  std::string id;  ///< of an element
  std::string
      layer;  ///< the label of a layer of Inkscape; where there is none of that label, the id of a group

  /// "element with the id '...'", "layer '...'"
  [[nodiscard]] std::string text() const;
};

/// The areas of an SVG drawing's paths, rectangles, circles, ellipses, polygons and lines, one drawing a
/// shape, in millimetres with y upwards. As in OpenSCAD 2021.01 a line (a path whose ends are apart, a
/// polyline) has the width of its stroke, areas have no strokes. What is hidden (`display`, `visibility`, by
/// attributes, styles or a simple style sheet) is left out, `<use>` is followed.
/// @param dpi units of a length without unit in an inch; 72 if it is no positive number.
/// @param center whether the middle of what is drawn (of the selection) is moved to the origin.
/// @param remarks is warned once of all that is not read, by its kinds.
/// @return nothing if there is nothing of that name.
/// @throws bsp2::Error if the file cannot be read, if a <use> uses itself, or if they multiply to more than a
/// million elements.
std::optional<std::vector<PlaneDrawing>> import_svg(const std::filesystem::path& path, double dpi,
                                                    bool center, const SvgSelection& selection = {},
                                                    const Remarks& remarks = {});

}  // namespace bsp2::model
