#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/model/expression/line_finder.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {

Source compilation(const Ranks& ranks, const RunOptions& options) {
  Source source;
  if (!ranks.is_master()) return source;
  if (options.resume) {
    source.text = io::read_snapshot(*options.resume, io::SnapshotPart::head).head.source;
  } else if (options.text) {
    source.text = *options.text;
  } else if (model::is_scad(options.model)) {
    model::ModelText translated = model::convert_scad(options.model);
    source.text = std::move(translated.text);
    source.warnings = std::move(translated.warnings);
  } else {
    source.text = model::read_model_text(options.model);
  }
  return source;
}

Source parsed(Source source, const RunOptions& options) {
  try {
    source.model = options.text && options.read && !options.curved && !options.resume
                       ? *options.read
                       : model::parse_csg(source.text, source_name(options), {.curved = options.curved});
  } catch (const Error& error) {
    if (source.warnings.empty()) throw;
    // What the translator was in doubt of may be why.
    std::string text = error.what();
    for (const std::string& warning : source.warnings) text += "; before that, " + warning;
    throw Error(text);
  }
  return source;
}

model::MeshOverlaps overlaps_in(const Source& source, const RunOptions& options, unsigned threads,
                                std::span<const model::TriangleMesh* const> sound) {
  return model::overlaps_of(source.model, source.text, source_name(options), threads, sound);
}

std::string source_name(const RunOptions& options) {
  return options.model.string() + (!options.text && model::is_scad(options.model) ? ".csg" : "");
}

template <int D>
dataflow::Network<D> translation(const Source& source, const RunOptions& options, unsigned threads) {
  const std::string name = source_name(options);
  const auto located = [&](const std::string& text) {
    return text.starts_with(name + ":") ? text : name + ": " + text;
  };
  const auto place = [&](std::size_t offset) { return model::place_in(source.text, name, offset) + ": "; };
  dataflow::CompileOptions compile_options{
      .coincidence = options.coincidence,
      .parts = options.parts_by_colour ? dataflow::Parts::colours : dataflow::Parts::named,
      .threads = threads};
  // There may be as many warnings as constructs, which are made one after the other.
  compile_options.place_of = [&, lines = model::LineFinder(source.text)](const model::Node& node) mutable {
    const auto found = source.model.construct_offsets.find(&node);
    return found == source.model.construct_offsets.end() ? "" : name + ":" + lines.at(found->second) + ": ";
  };
  compile_options.place_of_primitive = [&](std::int32_t primitive) {
    const auto& offsets = source.model.part_offsets;
    return static_cast<std::size_t>(primitive) < offsets.size()
               ? place(offsets[static_cast<std::size_t>(primitive)])
               : "";
  };
  try {
    dataflow::Network<D> network = dataflow::compile<D>(source.model.expression, compile_options);
    for (std::string& warning : network.warnings) warning = located(warning);
    return network;
  } catch (const Error& error) {
    throw Error(located(error.what()));
  }
}

std::string lost_by_merging(const Source& source, const RunOptions& options, std::uint64_t hyperplanes,
                            unsigned threads) {
  if (!(options.coincidence > 0)) return "";
  RunOptions exact = options;
  exact.coincidence = 0;
  std::uint64_t different = 0;
  try {
    geometry::in_dimension(source.model.expression.dimension(), [&](auto dimension) {
      different = translation<dimension()>(source, exact, threads).table.size();
    });
  } catch (const std::exception&) {
    return "";  // without merging it cannot be made at all, or not in this memory
  }
  if (different <= hyperplanes) return "";
  const std::uint64_t merged = different - hyperplanes;
  std::ostringstream text;
  text << counted(merged, "; # hyperplane[s] [lies|lie] closer to another one than ") << options.coincidence
       << counted(merged, " of the model and [counts|count] as the same")
       << ", so what is as thin as that is lost; --coincidence 0 keeps all that the numbers of "
          "the model express";
  return text.str();
}

void refuse_warnings(const std::vector<std::string>& warnings) {
  if (warnings.empty()) return;
  std::string text = warnings.front();
  if (warnings.size() > 1) text += counted(warnings.size() - 1, " (and # more warning[s])");
  throw Error(text + "; --strict turns warnings into errors");
}

template <int D>
void limit_refinement(const dataflow::Network<D>& network, RunOptions& options) {
  if (!network.is_round()) return;
  // Above three dimensions the number of cells grows too fast with the tolerance for more than a first look.
  constexpr double share = D > 5 ? 4 : D > 4 ? 8 : D > 3 ? 16 : 1000;
  if (!options.tolerance && !options.level)
    options.tolerance = std::ldexp(1.0, std::ilogb(network.table.width() / share));
}

#define BSP2_STAGE(D)                                                                       \
  template dataflow::Network<D> translation<D>(const Source&, const RunOptions&, unsigned); \
  template void limit_refinement<D>(const dataflow::Network<D>&, RunOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
