#include "bsp2/dataflow/surface/surface.hpp"

#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <future>
#include <iterator>
#include <utility>

#include "evaluate/large_stack.hpp"
#include "process/combiner.hpp"
#include "surface/skin_of_cells.hpp"
#include "surface/surface_tracer.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;
using geometry::Label;

namespace {

/// Convex solids of more facets are not cut out of space by all of their half-spaces.
constexpr std::uint32_t most_facets = 4096;
/// What a region's pieces need stays in the processor's cache.
constexpr std::size_t facets_of_region = 4096, least_regions = 16;

/// Parts a share of space into about `count` regions, always the one with the most facets.
std::vector<SurfaceBox> regions_of(SurfaceTracer& tracer, std::size_t count, const std::atomic<bool>& stop) {
  const auto has_less = [](const SurfaceBox& a, const SurfaceBox& b) {
    return a.facets.size() < b.facets.size();
  };
  std::vector<SurfaceBox> done, open;  // a heap
  open.push_back(tracer.whole());
  while (!open.empty() && done.size() + open.size() < count && !stop) {
    std::pop_heap(open.begin(), open.end(), has_less);
    SurfaceBox box = std::move(open.back());
    open.pop_back();
    if (box.program.empty()) continue;
    const auto cut = tracer.choose_cut(box);
    if (!cut) {
      done.push_back(std::move(box));
      continue;
    }
    for (SurfaceBox& half : tracer.halve(box, *cut)) {
      open.push_back(std::move(half));
      std::push_heap(open.begin(), open.end(), has_less);
    }
  }
  std::move(open.begin(), open.end(), std::back_inserter(done));
  std::erase_if(done, [](const SurfaceBox& box) { return box.program.empty(); });
  return done;
}

/// Whether a point that is in no operand is in the solid: then that ends where space does.
Label label_outside(const Word*& at) {
  const Word* const begin = at;
  const Word* const end = at + at[1];
  if ((begin[0] & Program::kind_mask) == Program::kind_leaf) {
    at = end;
    return (begin[0] & Program::negated) != 0 ? Label::in : Label::out;
  }
  Combiner combiner(begin[0] & Program::kind_mask, begin[2]);
  at += Program::header;
  while (at != end) {
    const Label operand = label_outside(at);
    if (!combiner.fold({operand})) continue;
    at = end;
    return operand;
  }
  return combiner.answer().label;
}
bool is_unbounded(const std::vector<Word>& program) {
  if (program.empty()) return false;
  bool is_in = false;
  call_on_large_stack([&] {
    const Word* at = program.data();
    is_in = label_outside(at) == Label::in;
  });
  return is_in;
}

/// What is done by several threads.
class Tracing {
 public:
  Tracing(Network<3>& network, const SurfaceOptions& options)
      : network_(network), options_(options), first_added_(static_cast<HyperplaneId>(network.table.size())) {}

  void run() {
    const std::size_t threads = std::max(1U, options_.threads);
    across_.resize(threads + 1);
    const OperandFacets facets(network_, options_.threads, options_.share, options_.shares, stop_);
    result_.has_given_up = !facets.are_sound();
    if (stop_ || result_.has_given_up || facets.space().is_empty()) return;
    call_on_large_stack([&] {
      SurfaceTracer tracer(network_, facets, stop_);
      regions_ =
          regions_of(tracer, std::max(least_regions * threads, facets.size() / facets_of_region), stop_);
      result_.regions = regions_.size();
      result_.has_given_up = tracer.has_given_up();
      across_[threads] = tracer.take_across();
    });
    if (result_.has_given_up) return;
    std::vector<geometry::Skin> skins(regions_.size());
    hot_.resize(regions_.size());
    count_ = regions_.size();
    call_on_large_stacks(threads, [&](std::size_t thread) { across_[thread] = trace(facets, skins); });
    for (geometry::Skin& skin : skins) result_.skin.append(std::exchange(skin, {}));
    result_.boxes = boxes_;
    for (const auto& some : hot_) result_.boxes_of_cells += some.size();
    result_.has_given_up = has_given_up_;
    if (!stop_) add_facets_across(facets);
    if (!stop_) add_skin_of_cells(network_, std::exchange(hot_, {}), options_.threads, stop_, result_.skin);
  }
  void stop() { stop_ = true; }
  [[nodiscard]] double share_done() const {
    return count_ == 0 ? 0 : static_cast<double>(done_) / static_cast<double>(count_);
  }
  [[nodiscard]] TracedSurface take() { return std::move(result_); }
  /// Of the network, for those who make cells after all.
  void take_back_planes() { network_.table.take_back(first_added_); }

 private:
  Network<3>& network_;
  const SurfaceOptions& options_;
  HyperplaneId first_added_;
  std::vector<SurfaceBox> regions_;
  std::vector<std::vector<HotBox>> hot_;     // of each region
  std::vector<FacetsAcrossRegions> across_;  // of each thread, and of what made the regions
  TracedSurface result_;
  std::atomic<std::size_t> next_{0}, done_{0}, count_{0};
  std::atomic<bool> stop_{false}, has_given_up_{false};
  std::atomic<std::uint64_t> boxes_{0};

  /// By several threads at the same time.
  FacetsAcrossRegions trace(const OperandFacets& facets, std::vector<geometry::Skin>& skins) {
    try {
      SurfaceTracer tracer(network_, facets, stop_);
      for (std::size_t i = next_++; i < skins.size() && !stop_; i = next_++) {
        tracer.trace(std::move(regions_[i]), skins[i]);
        hot_[i] = tracer.take_hot();
        if (tracer.has_given_up()) has_given_up_ = stop_ = true;
        ++done_;
      }
      boxes_ += tracer.boxes();
      return tracer.take_across();
    } catch (...) {
      stop_ = true;
      throw;
    }
  }

  /// A facet is whole if it meets no other operand in any region.
  void add_facets_across(const OperandFacets& facets) {
    std::vector<std::uint8_t> is_touched(facets.size());
    std::vector<WholeFacet> whole;
    std::vector<FacetsAcrossRegions::Part> parts;
    for (const auto& some : across_) {
      for (const std::uint32_t facet : some.touched) is_touched[facet] = 1;
      whole.insert(whole.end(), some.whole.begin(), some.whole.end());
    }
    for (const auto& some : across_)
      for (const auto& part : some.parts) {
        std::uint8_t& state = is_touched[part.facet.facet];
        if (state == 1) parts.push_back(part);
        if (state == 0) whole.push_back(part.facet);
        if (state == 0) state = 2;  // once
      }
    across_.clear();
    add_whole_facets(facets, whole, options_.threads, result_.skin);
    call_on_large_stack([&] { SurfaceTracer(network_, facets, stop_).add_parts(parts, result_.skin); });
  }
};

}  // namespace

bool has_plain_facets(const Network<3>& network) {
  return !network.is_divided() && !is_unbounded(network.program) &&
         std::all_of(network.producers.begin(), network.producers.end(), [](const Producer<3>& producer) {
           return !producer.undecided && producer.plane_count <= most_facets && !is_curved(producer.kind);
         });
}

TracedSurface trace_surface(Network<3>& network, const SurfaceOptions& options) {
  constexpr std::chrono::milliseconds period(20);
  constexpr unsigned periods_a_report = 5;
  Tracing tracing(network, options);
  auto work = std::async(std::launch::async, [&] { tracing.run(); });
  bool interrupted = false;
  try {
    for (unsigned i = 1; work.wait_for(period) != std::future_status::ready; ++i) {
      if (options.interrupted && options.interrupted()) interrupted = true;
      if (interrupted) tracing.stop();
      if (options.on_progress && i % periods_a_report == 0) options.on_progress(tracing.share_done());
    }
  } catch (...) {
    tracing.stop();
    throw;
  }
  TracedSurface result;
  try {
    work.get();
    result = tracing.take();
  } catch (...) {
    result.failure = std::current_exception();
  }
  result.interrupted = interrupted;
  if (result.interrupted || result.has_given_up || result.failure) tracing.take_back_planes();
  return result;
}

std::string digest_of(const geometry::TriangleSurface& surface) {
  XXH3_state_t* const state = XXH3_createState();
  XXH3_128bits_reset(state);
  const auto add = [&](const auto& values) {
    XXH3_128bits_update(state, values.data(), values.size() * sizeof(values[0]));
  };
  add(surface.points);
  add(surface.triangles);
  add(surface.owner);
  const XXH128_hash_t hash = XXH3_128bits_digest(state);
  XXH3_freeState(state);
  std::array<char, 33> text;
  std::snprintf(text.data(), text.size(), "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                static_cast<unsigned long long>(hash.low64));
  return text.data();
}

}  // namespace bsp2::dataflow
