#include "answers/drawings.hpp"

#include <spdlog/fmt/fmt.h>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"

namespace bsp2::jobs {
namespace fs = std::filesystem;

void check_drawings(const RunCommand& command) {
  for (const fs::path& file : command.drawing->files) io::check_sheet(io::sheet_format(file).value());
}

void write_drawings(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
                    const Run& run, std::ostream& out) {
  if (!result.report.failed.empty()) return;  // the boundary could not be found, which is told
  const drawing::DrawingOptions& options = command.drawing->options;
  const drawing::Drawing drawn = api::draw(command.options, options, result, ranks, run, "--");
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    for (const fs::path& file : command.drawing->files) {
      if (command.on_writing) command.on_writing(file);
      io::make_folder(io::folder_of(file));
      io::write_file(file, io::sheet_bytes(drawn.sheet, io::sheet_format(file).value()));
    }
    for (const std::string& warning : api::warnings_of_drawing(result))
      result.report.warnings.push_back(warning);
    auto& notes = result.report.notes;
    notes.insert(notes.end(), drawn.notes.begin(), drawn.notes.end());
    if (!command.quiet)
      out << fmt::format(
          "{} on {}, scale {}\n", counted(drawn.sheet.paths.size(), "# line[s]"), options.size.name,
          drawn.scale >= 1 ? fmt::format("{:g}:1", drawn.scale) : fmt::format("1:{:g}", 1 / drawn.scale));
  });
}

}  // namespace bsp2::jobs
