#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/api/products/drawings.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "evaluation/patience.hpp"
#include "evaluation/result.hpp"
#include "evaluation/told.hpp"
#include "outputs/outputs.hpp"

namespace bsp2 {
namespace {

/// What one rank alone does ends wherever it is, as long as this lives; several agree on it where they meet.
/// What is asked once to end is so to the end.
class InterruptedAlone {
 public:
  InterruptedAlone(const supersteps::Ranks& ranks, const Options& options, supersteps::RunOptions& run) {
    if (ranks.count() > 1 || options.stop_gently) return;
    if (run.interrupted) interruption_.emplace(run.interrupted);
    run.interrupted = geometry::Interruption::is_wanted;  // by this, or by a Stoppable around it
  }

 private:
  std::optional<geometry::Interruption> interruption_;
};

/// What each rank sees of the files by itself. @throws Error if they cannot be used.
void check_files(const supersteps::RunOptions& run) {
  if (run.resume) io::check_snapshot_is_readable(*run.resume);
  if (run.snapshot) io::check_snapshot_path(*run.snapshot);
}

/// The contacts that the ranks found, by cells: all on the master, none elsewhere. Collective.
void gather_contacts(supersteps::Ranks& ranks, supersteps::RunResult& result) {
  using geometry::Contact;
  static_assert(std::is_trivially_copyable_v<Contact>);
  if (ranks.count() == 1) return;
  auto& contacts = result.contacts;
  if (!ranks.is_master()) {
    ranks.send(0, {reinterpret_cast<const char*>(contacts.data()), contacts.size() * sizeof(Contact)});
    contacts = {};
  }
  ranks.sync();
  for (const auto& message : ranks.received()) {
    const std::size_t before = contacts.size();
    contacts.resize(before + message.bytes.size() / sizeof(Contact));
    if (!message.bytes.empty()) std::memcpy(&contacts[before], message.bytes.data(), message.bytes.size());
  }
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& a, const Contact& b) { return a.cell < b.cell; });
}

/// Evaluates and writes. Collective, within Ranks::together.
supersteps::RunResult work(const supersteps::RunOptions& run, const Options& options,
                           Ranks::Implementation& ranks, Told& told, api::Written& written) {
  const api::Writing writing{.files = options.outputs,
                             .run = run,
                             .stops_gently = options.stop_gently,
                             .cells_go = options.outputs_only,
                             .dashes = options.dashes,
                             .on_writing =
                                 [&](const auto& file) {
                                   const bool is_made =
                                       options.outputs.solver_mesh &&
                                       io::solver_file(options.outputs.solver_mesh->file) == file;
                                   told.begin((is_made ? "meshing " : "writing ") + file.filename().string());
                                 },
                             .on_picture = [&told](double done) { told.show(done, 0); }};
  return api::write_run(writing, ranks.ranks, ranks.engine, written);
}

Result found(supersteps::RunOptions run, const Options& options, const Ranks& ranks,
             std::optional<Expression> expression, const std::vector<std::string>& warnings) {
  auto made = std::make_shared<Result::Implementation>();
  made->ranks = ranks.implementation();
  made->expression = std::move(expression);
  made->holds_cells = !options.measures_only && !options.outputs_only;
  supersteps::Ranks& all = made->ranks->ranks;
  // Cells may stay on the ranks then, where files that are written later cannot find it (see run_options).
  if (all.count() > 1 && options.collect == Collect::automatic && !options.outputs_only)
    run.closes_parts = true;
  const Patience patience(all, options.timeout);
  Told told(all, options.progress);
  if (options.progress)
    run.on_progress = [&told](double done, std::uint64_t cells) { told.show(done, cells); };
  all.restart();
  const InterruptedAlone interruption(all, options, run);
  try {
    all.together([&] {
      all.agree([&] { check_files(run); });
      made->result = work(run, options, *made->ranks, told, made->written);
      if (options.contacts) gather_contacts(all, made->result);
    });
  } catch (const Error&) {  // places in the model may have been put before it
    if (!geometry::Interruption::is_over()) throw;
    made->result = {};  // before there was anything to show
    made->result.report.interrupted = true;
  }
  made->has_contacts = options.contacts && made->holds_cells && !made->result.report.interrupted &&
                       made->result.report.failed.empty() && all.is_master();
  auto& report = made->result.report;
  report.warnings.insert(report.warnings.begin(), warnings.begin(), warnings.end());
  made->model = run.model;
  made->snapshot = run.snapshot ? run.snapshot : run.resume;
  return Result(std::move(made));
}

void write_sheet(const std::filesystem::path& file, const io::Sheet& sheet) {
  io::make_folder(io::folder_of(file));
  io::write_file(file, io::sheet_bytes(sheet, io::sheet_format(file).value()));
}

}  // namespace

Result evaluate(const Expression& expression, const Options& options, const Ranks& ranks) {
  return guarded([&] {
    std::vector<std::string> warnings;
    supersteps::RunOptions run = run_options(expression, options, warnings);
    return found(std::move(run), options, ranks, expression, warnings);
  });
}

Result evaluate(const std::filesystem::path& model, const Options& options, const Ranks& ranks) {
  return guarded([&] {
    supersteps::RunOptions run = run_options(options);
    run.model = model;
    return found(std::move(run), options, ranks, std::nullopt, {});
  });
}

std::vector<std::string> draw(const Expression& expression, const std::vector<std::filesystem::path>& files,
                              const DrawingOptions& words, const Options& options, const Ranks& ranks) {
  return guarded([&] {
    const drawing::DrawingOptions how = api::drawing_options(words);
    for (const auto& file : files) {
      const auto format = io::sheet_format(file);
      if (!format) throw Error("cannot draw '" + file.string() + "': a drawing is .svg, .pdf or .dxf");
      io::check_sheet(*format);
    }
    Options of_surface = options;
    of_surface.surface_only = of_surface.faces = true;
    std::vector<std::string> told;
    supersteps::RunOptions run = run_options(expression, of_surface, told);
    supersteps::Ranks& all = ranks.implementation()->ranks;
    const Patience patience(all, options.timeout);
    Told told_of(all, options.progress);
    run.on_progress = [&](double done, std::uint64_t cells) { told_of.show(done, cells); };
    const InterruptedAlone interruption(all, options, run);
    all.restart();
    all.together([&] {
      const supersteps::RunResult result = ranks.implementation()->engine(run, all);
      all.agree([&] {
        if (result.report.interrupted) throw Error("interrupted; nothing is drawn");
        if (!result.report.failed.empty()) throw Error(result.report.failed.front().text);
      });
      const drawing::Drawing drawn = api::draw(run, how, result, all, ranks.implementation()->engine);
      all.agree([&] {
        if (!all.is_master()) return;
        for (const auto& file : files) write_sheet(file, drawn.sheet);
      });
      for (const auto& sentences :
           {result.report.warnings, api::warnings_of_drawing(result), result.report.notes, drawn.notes})
        told.insert(told.end(), sentences.begin(), sentences.end());
    });
    return told;
  });
}

Result resume(const std::filesystem::path& snapshot, const Options& options, const Ranks& ranks) {
  return guarded([&] {
    if (options.curved || options.parts_by_colour || options.coincidence != Options().coincidence ||
        !options.size_field.empty())
      throw Error(
          "curved, parts_by_colour, coincidence and size_field are those of the snapshot: leave them out");
    supersteps::RunOptions run = run_options(options);
    run.resume = snapshot;
    return found(std::move(run), options, ranks, std::nullopt, {});
  });
}

}  // namespace bsp2
