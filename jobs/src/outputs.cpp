#include "bsp2/jobs/outputs.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "bsp2/geometry/error.hpp"
#include "bsp2/io/file.hpp"
#include "bsp2/io/snapshot.hpp"
#include "bsp2/io/vtu.hpp"
#include "bsp2/jobs/report_json.hpp"
#include "bsp2/supersteps/rendering.hpp"

namespace bsp2::jobs {
namespace fs = std::filesystem;
namespace {

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

void write_picture(const fs::path& path, supersteps::RunResult& result) {
  const auto start = std::chrono::steady_clock::now();
  io::write_file(path, supersteps::render_png(result.mesh, result.tree));
  supersteps::SuperstepRecord record;
  record.name = "rendering";
  record.seconds = {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  record.bytes_sent = record.bytes_received = record.cells = {0};
  record.work_seconds = record.seconds;
  record.predicted_seconds = record.seconds.front();
  result.report.supersteps.push_back(record);
}

/// With -o, what this dimension does not allow is left out; asked for by name, it is a mistake.
bool is_possible(bool possible, const char* what, const std::optional<fs::path>& folder, const fs::path& path,
                 supersteps::RunReport& report) {
  if (possible || !folder || path != *folder / path.filename()) return true;
  report.warnings.push_back(std::string("no ") + what + " is written: the model's dimension is " +
                            std::to_string(report.dimension));
  return false;
}

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

void check_outputs(const RunCommand& command) {
  if (command.folder) io::check_folder(*command.folder);
  if (command.options.snapshot) io::check_snapshot_path(*command.options.snapshot);
  for (const auto& file : {command.mesh, command.picture, command.report}) {
    if (!file) continue;
    io::check_folder(folder_of(*file));
    std::error_code error;
    if (!file->has_filename() || fs::is_directory(*file, error)) throw Error("cannot write '" + file->string() + "': it is a directory");
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
      throw Error("cannot write '" + file->string() + "': " + error.message());
    if (fs::equivalent(*file, command.options.resume.value_or(command.options.model), error)) throw Error("cannot write '" + file->string() + "': it is the input itself");
  }
}

void write_outputs(const RunCommand& command, supersteps::RunResult& result) {
  if (command.folder) io::make_folder(*command.folder);
  for (const auto& file : {command.mesh, command.picture, command.report}) {
    if (file) io::make_folder(folder_of(*file));
  }
  const int d = result.report.dimension;
  if (command.mesh && is_possible(d <= 3, "mesh", command.folder, *command.mesh, result.report)) {
    io::write_vtu(*command.mesh, d, result.mesh.batches, {.tets = command.tets});
  }
  if (command.picture &&
      is_possible(d == 2 || d == 3, "picture", command.folder, *command.picture, result.report)) {
    write_picture(*command.picture, result);
  }
  result.report.peak_rss_bytes = std::max(result.report.peak_rss_bytes, peak_rss_bytes());
  if (command.report) io::write_file(*command.report, to_json(result.report));
}

}  // namespace bsp2::jobs
