#include <algorithm>
#include <ctime>
#include <functional>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"
#include "bsp2/supersteps/loop/tables.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::Skin;
using geometry::SkinShare;
using Network = dataflow::Network<3>;

/// Processor time of all threads of this process.
double seconds_of_processor() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What so many nodes do, step by step, one node after the other.
class Nodes {
 public:
  Nodes(unsigned count, unsigned threads) : count_(count), threads_(threads) {}

  /// All nodes wait for each other at the end of a step.
  template <typename Work>
  void step(const Work& work) {
    auto& seconds = steps_.emplace_back();
    for (unsigned node = 0; node < count_; ++node) {
      const double start = seconds_of_processor();
      work(node);
      seconds.push_back((seconds_of_processor() - start) / threads_);
    }
  }
  /// Seconds: of each step of each node.
  [[nodiscard]] const std::vector<std::vector<double>>& steps() const { return steps_; }

 private:
  unsigned count_, threads_;
  std::vector<std::vector<double>> steps_;
};

/// What has come from all, for one of them.
template <typename T>
std::vector<T> column(std::vector<std::vector<T>>& rows, unsigned to) {
  std::vector<T> values;
  for (auto& row : rows) values.push_back(std::move(row[to]));
  return values;
}

/// As the ranks do it (stages/boundary.cpp), without messages.
std::vector<geometry::SurfacePiece> pieces_of(const geometry::HyperplaneTable<3>& table,
                                              std::vector<Skin> skins, unsigned threads, Nodes& nodes) {
  const auto count = static_cast<unsigned>(skins.size());
  std::vector<std::unique_ptr<SkinShare>> shares(count);
  std::vector<std::vector<std::vector<SkinShare::Claim>>> claims(count);
  nodes.step([&](unsigned node) {
    shares[node] = std::make_unique<SkinShare>(table, std::exchange(skins[node], {}), node, count, threads);
    claims[node] = shares[node]->claims();
  });
  std::vector<std::vector<std::vector<SkinShare::Decision>>> decisions(count);
  nodes.step([&](unsigned node) { decisions[node] = SkinShare::decide(column(claims, node)); });
  std::vector<std::vector<Skin>> faces(count), edges(count);
  nodes.step([&](unsigned node) {
    std::vector<SkinShare::Decision> mine;
    for (const auto& some : column(decisions, node)) mine.insert(mine.end(), some.begin(), some.end());
    faces[node] = shares[node]->hand_over(mine);
  });
  std::vector<std::vector<geometry::CertainBox>> boxes(count);
  nodes.step([&](unsigned node) {
    for (const Skin& some : column(faces, node)) shares[node]->take_over(some);
    boxes[node] = shares[node]->boxes();
  });
  nodes.step([&](unsigned node) { edges[node] = shares[node]->neighbours(boxes); });
  std::vector<SkinShare::Name> crossings;
  for (bool is_first = true; is_first || !crossings.empty(); is_first = false) {
    std::vector<SkinShare::Name> found;
    nodes.step([&](unsigned node) {
      if (is_first)
        for (const Skin& some : column(edges, node)) shares[node]->take_neighbours(some);
      const auto some = shares[node]->triangulate(crossings);
      found.insert(found.end(), some.begin(), some.end());
    });
    crossings = std::move(found);
  }
  std::vector<geometry::SurfacePiece> pieces(count);
  nodes.step([&](unsigned node) {
    pieces[node] = shares[node]->take();
    shares[node].reset();
  });
  return pieces;
}

/// The skins of all, as ranks find them.
std::vector<Skin> traced(Network& network, unsigned count, unsigned threads, Nodes& nodes) {
  std::vector<Skin> skins(count);
  const auto planes = static_cast<geometry::HyperplaneId>(network.table.size());
  nodes.step([&](unsigned node) {
    network.table.take_back(planes);  // each has a table of its own
    dataflow::SurfaceOptions options;
    options.threads = threads;
    options.share = node;
    options.shares = count;
    auto traced = dataflow::trace_surface(network, options);
    if (traced.failure) std::rethrow_exception(traced.failure);
    if (traced.has_given_up)
      throw Error(
          "too many operands meet in one place for a surface without cells, which is what is measured");
    skins[node] = std::move(traced.skin);
  });
  return skins;
}

/// One time.
SurfaceFigures measure_once(Network& network, unsigned count, unsigned threads) {
  const auto planes = static_cast<geometry::HyperplaneId>(network.table.size());
  SurfaceFigures figures;
  Nodes tracing(count, threads), resolving(count, threads);
  auto skins = traced(network, count, threads, tracing);
  geometry::TriangleSurface surface;
  if (count == 1) {
    resolving.step(
        [&](unsigned) { surface = geometry::triangulate(network.table, std::move(skins[0]), {}, threads); });
  } else {
    auto pieces = pieces_of(network.table, std::move(skins), threads, resolving);
    const double start = seconds_of_processor();
    surface = geometry::joined(pieces);
    figures.joining = seconds_of_processor() - start;
  }
  figures.tracing = tracing.steps();
  figures.resolution = resolving.steps();
  figures.triangles = surface.triangles.size();
  figures.digest = dataflow::digest_of(surface);
  network.table.take_back(planes);
  return figures;
}

/// Of two times that did the same the least of each step: what else the machine does only makes them longer.
void take_least(const SurfaceFigures& other, SurfaceFigures& figures) {
  const auto take = [](const auto& from, auto& to) {
    for (std::size_t i = 0; i < to.size(); ++i)
      for (std::size_t node = 0; node < to[i].size(); ++node)
        to[i][node] = std::min(to[i][node], from[i][node]);
  };
  take(other.tracing, figures.tracing);
  take(other.resolution, figures.resolution);
  figures.joining = std::min(figures.joining, other.joining);
}

}  // namespace

double SurfaceFigures::most(const std::vector<std::vector<double>>& steps) {
  double sum = 0;
  for (const auto& step : steps) sum += *std::max_element(step.begin(), step.end());
  return sum;
}
double SurfaceFigures::mean(const std::vector<std::vector<double>>& steps) {
  double sum = 0;
  for (const auto& step : steps)
    sum += std::accumulate(step.begin(), step.end(), 0.0) / static_cast<double>(step.size());
  return sum;
}

std::vector<SurfaceFigures> measure_surface(const RunOptions& options,
                                            const std::vector<unsigned>& node_counts) {
  constexpr int times = 3;
  Ranks alone;
  const unsigned threads = threads_of(options, alone);
  const Source source = parsed(compilation(alone, options), options);
  if (source.model.expression.dimension() != 3)
    throw Error("the surface is measured of solids, in three dimensions");
  Network network = translation<3>(source, options, threads);
  if (!dataflow::has_plain_facets(network))
    throw Error(
        "the model's surface is found from cells, and only one that is found without them is measured");
  std::vector<SurfaceFigures> result;
  for (const unsigned count : node_counts) {
    SurfaceFigures figures = measure_once(network, count, threads);
    for (int time = 1; time < times; ++time) take_least(measure_once(network, count, threads), figures);
    if (!result.empty() && result.front().digest != figures.digest)
      throw std::logic_error("the surface is another one where the nodes are " + std::to_string(count));
    figures.nodes = count;
    result.push_back(std::move(figures));
  }
  return result;
}

}  // namespace bsp2::supersteps
