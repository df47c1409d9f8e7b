#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "bsp2/api/products/drawings.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "evaluation/result.hpp"
#include "evaluation/run_options.hpp"

namespace bsp2 {
namespace {

/// Tells somebody of the supersteps as they begin, as long as this lives.
class Told {
 public:
  Told(supersteps::Ranks& ranks, supersteps::RunOptions& run,
       const std::function<void(const Progress&)>& tell)
      : ranks_(ranks) {
    if (!tell || !ranks.is_master()) return;
    const auto now = std::make_shared<Progress>();
    ranks.on_superstep = [now, tell](const std::string& name, unsigned) {
      now->superstep = name;
      now->done = 0;
      tell(*now);
    };
    run.on_progress = [now, tell](double done, std::uint64_t cells) {
      now->done = done;
      if (cells > 0) now->cells = cells;
      tell(*now);
    };
  }
  ~Told() { ranks_.on_superstep = nullptr; }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;

 private:
  supersteps::Ranks& ranks_;
};

/// What one rank alone does ends wherever it is, as long as this lives; several agree on it where they meet.
/// What is asked once to end is so to the end.
class InterruptedAlone {
 public:
  InterruptedAlone(const supersteps::Ranks& ranks, supersteps::RunOptions& run) {
    if (ranks.count() > 1) return;
    if (run.interrupted) interruption_.emplace(run.interrupted);
    run.interrupted = geometry::Interruption::is_wanted;  // by this, or by a Stoppable around it
  }

 private:
  std::optional<geometry::Interruption> interruption_;
};

/// How long ranks wait for each other, as long as this lives.
class Patience {
 public:
  Patience(supersteps::Ranks& ranks, const std::optional<double>& seconds)
      : ranks_(ranks), before_(ranks.timeout()) {
    if (seconds) ranks.set_timeout(*seconds);
  }
  ~Patience() { ranks_.set_timeout(before_); }
  Patience(const Patience&) = delete;
  Patience& operator=(const Patience&) = delete;

 private:
  supersteps::Ranks& ranks_;
  double before_;
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

Result found(supersteps::RunOptions run, const Options& options, const Ranks& ranks,
             std::optional<Expression> expression, const std::vector<std::string>& warnings) {
  auto made = std::make_shared<Result::Implementation>();
  made->ranks = ranks.implementation();
  made->expression = std::move(expression);
  made->holds_cells = !options.measures_only;
  supersteps::Ranks& all = made->ranks->ranks;
  const Patience patience(all, options.timeout);
  const Told told(all, run, options.progress);
  all.restart();
  const InterruptedAlone interruption(all, run);
  try {
    all.together([&] {
      all.agree([&] { check_files(run); });
      made->result = supersteps::run(run, all);
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
    const Told progress(all, run, options.progress);
    const InterruptedAlone interruption(all, run);
    all.restart();
    all.together([&] {
      const supersteps::RunResult result = supersteps::run(run, all);
      all.agree([&] {
        if (result.report.interrupted) throw Error("interrupted; nothing is drawn");
        if (!result.report.failed.empty()) throw Error(result.report.failed.front().text);
      });
      const drawing::Drawing drawn = api::draw(
          run, how, result, all, [](const auto& again, auto& same) { return supersteps::run(again, same); });
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
    supersteps::RunOptions run = run_options(options);
    run.resume = snapshot;
    return found(std::move(run), options, ranks, std::nullopt, {});
  });
}

}  // namespace bsp2
