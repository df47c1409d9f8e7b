#include "outputs/drawings.hpp"

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "outputs/outputs.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;

void check_drawing(const DrawingOutput& output, std::string_view dashes) {
  drawing_options(output.drawing, dashes);
  for (const fs::path& file : output.files) io::check_sheet(io::sheet_format(file).value());
}

void write_drawing(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks,
                   const Run& run, Written& written) {
  // Why there are none is told already.
  const bool has_no_faces = result.report.dimension == 3 && !result.faces;
  if (told_by_master(has_no_faces, ranks)) return;
  const DrawingOutput& output = *writing.files.drawing;
  const drawing::DrawingOptions options = drawing_options(output.drawing, writing.dashes);
  const drawing::Drawing drawn = draw(writing.run, options, result, ranks, run, writing.dashes);
  if (writing.cells_go) geometry::Interruption::check();
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    for (const fs::path& file : output.files) {
      if (writing.on_writing) writing.on_writing(file);
      io::make_folder(io::folder_of(file));
      io::write_file(file, io::sheet_bytes(drawn.sheet, io::sheet_format(file).value()));
    }
    for (const std::string& warning : warnings_of_drawing(result)) result.report.warnings.push_back(warning);
    auto& notes = result.report.notes;
    notes.insert(notes.end(), drawn.notes.begin(), drawn.notes.end());
    written.drawing = Figures::Drawing{
        .lines = drawn.sheet.paths.size(), .sheet = std::string(options.size.name), .scale = drawn.scale};
  });
}

}  // namespace bsp2::api
