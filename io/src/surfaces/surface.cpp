#include "bsp2/io/outputs/surface.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <sstream>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "outputs/modules.hpp"
#include "outputs/single_precision.hpp"
#include "surfaces/writers.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::TriangleSurface;

constexpr bool single = true, all_digits = false, named = true, nameless = false, coloured = true,
               plain = false, faces = true, no_faces = false, plane = true, solid = false, by_part = true;

/// By ending.
constexpr SurfaceFormat formats[] = {
    {".3mf", "for printers: an object a part, units, a picture", single, named, coloured, no_faces, solid,
     by_part},
    {".amf", "for printers, as OpenSCAD: an object a part", single, named, coloured, no_faces, solid,
     by_part},
    {".brep", "faces, as Open CASCADE keeps them", all_digits, nameless, plain, faces},
    {".dxf", "outlines of plane models: a layer a part", all_digits, named, coloured, no_faces, plane},
    {".glb", "glTF for viewers, binary: sharp edges as lines", single, named, coloured},
    {".gltf", "the same as text", single, named, coloured},
    {".iges", "faces, for CAD programs: solids by part", all_digits, named, coloured, faces},
    {".igs", "the same", all_digits, named, coloured, faces},
    {".obj", "text, a group a part; colours in a file .mtl", all_digits, named, coloured},
    {".off", "text, as OpenSCAD writes it", all_digits, nameless, coloured},
    {".pdf", "outlines of plane models, for print", single, nameless, coloured, no_faces, plane},
    {".ply", "binary, the part of each triangle", all_digits, named, coloured},
    {".step", "faces, for CAD programs: solids by part", all_digits, named, coloured, faces},
    {".stl", "binary, for printers: triangles and nothing else", single, nameless, plain},
    {".stp", "the same as .step", all_digits, named, coloured, faces},
    {".svg", "outlines of plane models: a path a part", all_digits, named, coloured, no_faces, plane},
    {".vtp", "for ParaView, the part of each triangle", all_digits, named, coloured},
    {".wrl", "VRML97, a face set a part", single, named, coloured},
    {".x3d", "X3D, a face set a part", single, named, coloured},
};

/// Words as they are spoken, for example ".a, .b or .c".
std::string listed(const std::vector<std::string_view>& words, const std::string& last_word) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    (text += i == 0 ? "" : i + 1 == words.size() ? " " + last_word + " " : ", ") += words[i];
  return text;
}

std::string exact_endings() {
  std::vector<std::string_view> endings;
  for (const SurfaceFormat& format : formats)
    if (!format.is_single && !format.has_faces && !format.is_plane) endings.push_back(format.ending);
  return listed(endings, "and");
}

/// Whether single precision has numbers as large as the coordinates.
bool fits_single(const TriangleSurface& surface) {
  return std::all_of(surface.points.begin(), surface.points.end(), [](const auto& point) {
    return std::all_of(point.begin(), point.end(),
                       [](double x) { return std::fabs(x) <= std::numeric_limits<float>::max(); });
  });
}

/// What single precision costs, for who gets the file; empty if that is nothing to tell of.
std::string warning_of(const fs::path& path, const SurfaceFormat& format, const SingleLoss& loss) {
  if (loss.changed == 0) return "";
  const auto point = [](const std::array<double, 3>& p) {
    std::ostringstream text;
    text << '(' << p[0] << ", " << p[1] << ", " << p[2] << ')';
    return text.str();
  };
  std::ostringstream text;
  text.precision(6);
  text << path.string() << ": the single precision of " << format.ending << " changes ";
  if (loss.parts == 1)
    text << "the solid";
  else
    text << loss.changed << " of the " << loss.parts << " connected parts of the surface";
  text << " by more than a hundred-thousandth of the volume or the size";
  text << (loss.changed > 1 ? "; most of all that between "
           : loss.parts > 1 ? ", that between "
                            : ", between ")
       << point(loss.lower) << " and " << point(loss.upper) << ": corners move by up to " << loss.moved
       << ", and its volume of ";
  text.precision(9);
  text << std::fabs(loss.volume) << " becomes " << std::fabs(loss.rounded_volume) << "; " << exact_endings()
       << " keep all digits";
  return text.str();
}

/// The bytes of a file for pictures.
std::string scene_bytes(const SurfaceFormat& format, const SingleSurface& surface, const PartLabels& labels) {
  if (format.ending == ".glb") return to_gltf(surface, labels, GltfForm::binary);
  if (format.ending == ".gltf") return to_gltf(surface, labels, GltfForm::text);
  if (format.ending == ".wrl") return to_vrml(surface, labels);
  if (format.ending == ".x3d") return to_x3d(surface, labels);
  throw std::logic_error("no writer for " + std::string(format.ending));
}

/// Files in single precision.
void write_single(const fs::path& path, const SurfaceFormat& format, const TriangleSurface& surface,
                  const SurfaceParts& parts, std::vector<std::string>& notes) {
  const PartLabels labels(parts, path.stem().string());
  if (format.ending == ".3mf") return write_file(path, to_3mf(surface, labels, notes));
  if (format.ending == ".amf") return write_file(path, to_amf(surface, labels, notes));
  const SingleSurface rounded = rounded_to_single(surface);
  if (format.ending == ".stl") return write_file(path, to_stl(rounded));
  write_file(path, scene_bytes(format, rounded, labels));
}

void write_obj(const fs::path& path, const TriangleSurface& surface, const SurfaceParts& parts) {
  const PartLabels labels(parts, "part_0");
  std::string material_file;
  if (labels.are_coloured()) {
    const fs::path materials = fs::path(path).replace_extension(".mtl");
    write_file(materials, to_mtl(surface, labels));
    material_file = one_line(materials.filename().string());
  }
  write_file(path, to_obj(surface, labels, material_file));
}

/// Files without a limit of precision.
void write_exactly(const fs::path& path, const SurfaceFormat& format, const TriangleSurface& surface,
                   const SurfaceParts& parts, std::vector<std::string>& notes) {
  if (format.ending == ".obj") return write_obj(path, surface, parts);
  const PartLabels labels(parts, path.stem().string());
  if (format.ending == ".ply") return write_file(path, to_ply(surface, labels));
  if (format.ending == ".off") return write_file(path, to_off(surface, labels, notes));
  if (format.ending == ".vtp") return write_file(path, vtk_module().to_vtp(surface, parts));
  throw std::logic_error("no writer for " + std::string(format.ending));
}

}  // namespace

std::span<const SurfaceFormat> surface_formats() { return formats; }

const SurfaceFormat* surface_format(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const auto* found = std::find_if(std::begin(formats), std::end(formats),
                                   [&](const SurfaceFormat& format) { return format.ending == ending; });
  return found == std::end(formats) ? nullptr : found;
}

double least_step(const fs::path& path) {
  const SurfaceFormat* format = surface_format(path);
  // Of .off, which holds all digits, some readers keep no more.
  const bool is_single = format != nullptr && (format->is_single || format->ending == ".off");
  return is_single && !format->is_plane ? std::numeric_limits<float>::epsilon() / 16 : 0;
}

std::string surface_endings() {
  std::vector<std::string_view> endings;
  for (const SurfaceFormat& format : formats) endings.push_back(format.ending);
  return listed(endings, "or");
}

std::string plane_endings() {
  std::vector<std::string_view> endings;
  for (const SurfaceFormat& format : formats)
    if (format.is_plane) endings.push_back(format.ending);
  return listed(endings, "or");
}

std::string surface_format_table() {
  std::ostringstream table;
  const auto line = [&](std::string_view ending, std::string_view precision, std::string_view has_parts,
                        std::string_view has_colours, std::string_view description) {
    const auto cell = [&](std::string_view text, std::size_t width) {
      table << text << std::string(width - std::min(width, text.size()), ' ');
    };
    cell(ending, 7);
    cell(precision, 8);
    cell(has_parts, 7);
    cell(has_colours, 9);
    table << description << '\n';
  };
  line("ending", "digits", "parts", "colours", "holds closed triangles, if it says no other");
  for (const SurfaceFormat& format : formats)
    line(format.ending, format.is_single ? "single" : "all", format.holds_parts ? "yes" : "-",
         format.holds_colours ? "yes" : "-", format.description);
  return table.str();
}

void check_surface_file(const fs::path& path) {
  const SurfaceFormat* format = surface_format(path);
  if (format == nullptr)
    throw Error("cannot write '" + path.string() + "': a boundary is written as " + surface_endings());
  if (format->ending == ".vtp") vtk_module();
  if (format->has_faces) occt_module();
  if (format->is_plane) check_sheet(*sheet_format(path));
}

bool changes_in_single(const TriangleSurface& surface) { return loss_in_single(surface).changed > 0; }

SurfaceRemarks write_surface(const fs::path& path, const TriangleSurface& surface, const SurfaceParts& parts,
                             const TriangleSurface* found) {
  check_surface_file(path);
  const SurfaceFormat& format = *surface_format(path);
  if (format.has_faces)
    throw Error("cannot write '" + path.string() + "': " + std::string(format.ending) +
                " holds faces, not triangles");
  if (format.is_plane)
    throw Error(
        "cannot write '" + path.string() + "': " + std::string(format.ending) +
        " holds the outlines of plane models, and this one is solid; 'bsp2 draw' makes drawings of it");
  SurfaceRemarks remarks;
  if (!format.is_single) {
    write_exactly(path, format, surface, parts, remarks.notes);
  } else {
    if (!fits_single(surface))
      throw Error("cannot write '" + path.string() +
                  "': coordinates above 3.4e38 are too large for the single precision of " +
                  std::string(format.ending) + "; " + exact_endings() + " keep them");
    write_single(path, format, surface, parts, remarks.notes);
    remarks.warning = warning_of(path, format, loss_in_single(found != nullptr ? *found : surface));
  }
  for (std::string& note : remarks.notes) note = path.string() + ": " + note;
  return remarks;
}

}  // namespace bsp2::io
