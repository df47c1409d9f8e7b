#include "bsp2/io/outputs/cad.hpp"

#include <fstream>
#include <iterator>
#include <sstream>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "outputs/modules.hpp"
#include "surfaces/labels.hpp"

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
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  if (!file || bytes.size() != fs::file_size(path))
    throw Error("what was written to '" + path.string() + "' cannot be read");
  return bytes;
}

CadParts cad_parts(const geometry::Brep& brep, std::span<const geometry::RoundSolid> rounds,
                   const PartLabels& labels) {
  CadParts parts;
  const auto add = [&](std::int32_t part) { parts[part] = {labels.name(part), labels.colour(part)}; };
  for (const geometry::Brep::Solid& solid : brep.solids) add(solid.part);
  for (const geometry::RoundSolid& solid : rounds) add(solid.part);
  return parts;
}

/// What becomes points and nothing, in sentences.
std::vector<std::string> notes_of(const fs::path& path, const CadRemarks& remarks) {
  std::vector<std::string> notes;
  if (const auto count = remarks.short_edges; count > 0)
    notes.push_back(path.string() +
                    counted(count,
                            ": # edge[s] [is|are] shorter than 1e-7, which CAD programs take "
                            "for [a point; it is a point|points; they are points] in the file"));
  if (const auto count = remarks.thin_solids; count > 0)
    notes.push_back(path.string() + counted(count, ": # solid[s] [is|are] thinner than 1e-7, and left out"));
  if (const auto count = remarks.true_surfaces; count > 0)
    notes.push_back(path.string() +
                    counted(count,
                            ": # round solid[s] that [touches|touch] nothing else [has its|have "
                            "their] true surface[s], not that of [its|their] cells"));
  return notes;
}

}  // namespace

std::vector<std::string> write_cad(const fs::path& path, const geometry::Brep& brep,
                                   const SurfaceParts& parts, std::span<const geometry::RoundSolid> rounds) {
  check_surface_file(path);
  if (brep.solids.empty() && rounds.empty())
    throw Error("cannot write '" + path.string() +
                "': the solid is empty, which files for CAD programs cannot hold");
  // Open CASCADE writes to a path; whole or not at all is ours.
  const TemporaryDirectory folder(folder_of(path));
  const fs::path part = folder.path() / path.filename();
  const CadRemarks remarks = occt_module().write(
      part, format_of(path), brep, rounds, cad_parts(brep, rounds, PartLabels(parts, path.stem().string())),
      geometry::Interruption::is_wanted);
  if (geometry::Interruption::is_over()) throw geometry::Interrupted();
  if (rounds.empty() && remarks.thin_solids == brep.solids.size())
    throw Error("cannot write '" + path.string() +
                "': all of it is thinner than 1e-7, which CAD programs take for nothing; scale the model up");
  if (!remarks.is_written)
    throw Error("cannot write '" + path.string() + "': the disk is full, or Open CASCADE cannot write it");
  write_file(path, bytes_of(part));
  return notes_of(path, remarks);
}

}  // namespace bsp2::io
