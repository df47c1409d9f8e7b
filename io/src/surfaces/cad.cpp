#include "bsp2/io/outputs/cad.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "outputs/modules.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

CadFormat format_of(const fs::path& path) {
  const std::string_view ending = surface_format(path)->ending;
  if (ending == ".brep") return CadFormat::brep;
  return ending == ".iges" || ending == ".igs" ? CadFormat::iges : CadFormat::step;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What CAD programs take for a point: a ten-millionth of a millimetre.
std::size_t short_edges(const geometry::Brep& brep) {
  constexpr double point = 1e-7;
  return static_cast<std::size_t>(
      std::count_if(brep.edges.begin(), brep.edges.end(), [&](const geometry::Brep::Edge& edge) {
        const auto &a = brep.points[edge.ends[0]], &b = brep.points[edge.ends[1]];
        return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) <= point;
      }));
}

}  // namespace

std::vector<std::string> write_cad(const fs::path& path, const geometry::Brep& brep,
                                   const SurfaceParts& parts) {
  check_surface_file(path);
  // Open CASCADE writes to a path; whole or not at all is ours.
  const TemporaryDirectory folder(folder_of(path));
  const fs::path part = folder.path() / path.filename();
  if (!occt_module().write(part, format_of(path), brep, parts))
    throw Error("cannot write '" + path.string() + "': the disk is full, or Open CASCADE cannot write it");
  write_file(path, bytes_of(part));
  std::vector<std::string> notes;
  if (const std::size_t count = short_edges(brep); count > 0) {
    std::ostringstream note;
    note << path.string() << ": " << count << (count == 1 ? " edge is" : " edges are")
         << " shorter than 1e-7, which CAD programs take for " << (count == 1 ? "a point" : "points")
         << " and may refuse";
    notes.push_back(note.str());
  }
  return notes;
}

}  // namespace bsp2::io
