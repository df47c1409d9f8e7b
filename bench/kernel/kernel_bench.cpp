// What the kernel's steps cost, one at a time, on one thread: kernel_bench --benchmark_filter=Split

#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/dataflow/regions/partition.hpp"
#include "bsp2/geometry/cells/clipper.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/model/builder/builder.hpp"

namespace bsp2 {
namespace {

using dataflow::Network;
using geometry::Cell;
using geometry::HyperplaneId;
using geometry::Splitter;

constexpr int D = 3;

/// A cylinder of `facets` sides in general position; its planes, and a root cell around it that they cross.
Network<D> cylinder_network(std::int64_t facets) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const std::array<double, 16> turned{1, 0, 0, 0.1, 0, c, -s, 0.2, 0, s, c, 0.3, 0, 0, 0, 1};
  return dataflow::compile<D>(
      model::transform(turned, model::cylinder(2, 1, 0.9, static_cast<std::uint32_t>(facets))), {});
}

/// The cell inside all half-spaces of a network's first producer.
Cell<D> inside_of(const Network<D>& network, Splitter<D>& splitter) {
  geometry::Clipper<D> clipper(splitter);
  clipper.load(geometry::root_cell(network.table));
  for (const auto plane : network.planes_of(network.producers[0])) clipper.cut(plane, nullptr);
  return clipper.cell();
}

/// Evaluates on one thread and keeps the cells.
class Cells : public dataflow::Consumer {
 public:
  std::vector<std::shared_ptr<const dataflow::Refinement>> batches;
  void consume(const std::shared_ptr<const dataflow::Refinement>& batch) override {
    batches.push_back(batch);
  }
};

/// Balls on a grid that overlap: a solid of many cells.
model::Expression balls(int side) {
  std::vector<model::Expression> all;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) {
        const std::array<double, 16> moved{1, 0, 0, x * 0.9, 0, 1, 0, y * 0.9, 0, 0, 1, z * 0.9, 0, 0, 0, 1};
        all.push_back(model::transform(moved, model::sphere(0.6, 12)));
      }
  return model::unite(std::move(all));
}

std::vector<std::shared_ptr<const dataflow::Refinement>> cells_of(int side) {
  const auto network = dataflow::compile<D>(balls(side), {});
  auto parts = dataflow::partition(network, 0);
  Cells cells;
  std::array<dataflow::Consumer*, 1> consumers{&cells};
  dataflow::evaluate<D>(network, std::move(parts.regions), {}, consumers);
  return cells.batches;
}

/// How long does one answer of the predicate take, when the filter answers it?
void predicate_filtered(benchmark::State& state) {
  const auto network = cylinder_network(32);
  Splitter<D> splitter(network.table);
  const auto cell = geometry::root_cell(network.table);
  const HyperplaneId id = network.planes_of(network.producers[0])[0].id();
  const auto h = network.table.rounded(id);
  for ([[maybe_unused]] const auto round : state)
    for (const auto& vertex : cell.vertices()) benchmark::DoNotOptimize(splitter.side(vertex, id, h));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cell.vertices().size()));
}
BENCHMARK(predicate_filtered);

/// And when exact integers have to? Four planes through one corner of a cone; a new splitter remembers no
/// answer.
void predicate_exact(benchmark::State& state) {
  const auto network = dataflow::compile<D>(model::cylinder(2, 1, 0, 32), {});
  const auto planes = network.planes_of(network.producers[0]);
  std::uint64_t exact = 0;
  std::array<HyperplaneId, 3> ids{};
  std::size_t found = 0;
  for (const auto plane : planes)  // the sides of the cone all meet in its apex
    if (std::fabs(network.table.rounded(plane.id()).normal[2]) < 0.99 && found < 3) ids[found++] = plane.id();
  const auto vertex = geometry::make_vertex<D>(network.table, ids, exact);
  std::uint64_t asked = 0;
  for ([[maybe_unused]] const auto round : state) {
    state.PauseTiming();
    Splitter<D> splitter(network.table);
    state.ResumeTiming();
    for (const auto plane : planes)
      benchmark::DoNotOptimize(splitter.side(vertex, plane.id(), network.table.rounded(plane.id())));
    asked += splitter.counts().exact_predicates;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(asked));
}
BENCHMARK(predicate_exact);

/// What does one split of a prism with so many sides cost, both halves built?
void split(benchmark::State& state) {
  const auto network = cylinder_network(state.range(0));
  Splitter<D> splitter(network.table);
  const auto cell = inside_of(network, splitter);
  const auto& table = network.table;
  double middle = 0;
  for (const auto& vertex : cell.vertices())
    middle += vertex.x[0] / static_cast<double>(cell.vertices().size());
  const HyperplaneId id = table.axis_hyperplane(0, table.axis_position(0, middle));
  std::array<Cell<D>, 2> halves;
  for ([[maybe_unused]] const auto round : state) {
    splitter.classify(cell, id);
    splitter.split(cell, id, &halves[0], &halves[1]);
    benchmark::DoNotOptimize(halves);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(split)->ArgName("facets")->Arg(4)->Arg(16)->Arg(64);

/// What does one plane cost when a cube is cut down to a prism with so many sides?
void clip_by_facets(benchmark::State& state) {
  const auto network = cylinder_network(state.range(0));
  Splitter<D> splitter(network.table);
  const auto root = geometry::root_cell(network.table);
  const auto planes = network.planes_of(network.producers[0]);
  geometry::Clipper<D> clipper(splitter);
  for ([[maybe_unused]] const auto round : state) {
    clipper.load(root);
    for (const auto plane : planes) clipper.cut(plane, nullptr);
    benchmark::DoNotOptimize(clipper.cell());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(planes.size()));
}
BENCHMARK(clip_by_facets)->ArgName("facets")->Arg(4)->Arg(16)->Arg(64);

/// What does it cost to ask a cylinder with so many sides about a cell that all of them cross?
void classification(benchmark::State& state) {
  const auto network = cylinder_network(state.range(0));
  Splitter<D> splitter(network.table);
  dataflow::Localizer<D> localizer(network, splitter);
  const auto root = geometry::root_cell(network.table);
  dataflow::Words out;
  for ([[maybe_unused]] const auto round : state)
    benchmark::DoNotOptimize(localizer.decide(network.program, root, out));
  state.SetItemsProcessed(state.iterations() * network.producers[0].plane_count);
}
BENCHMARK(classification)->ArgName("facets")->Arg(4)->Arg(16)->Arg(64);

/// A whole evaluation: splits a second.
void evaluation(benchmark::State& state) {
  const auto network = dataflow::compile<D>(balls(static_cast<int>(state.range(0))), {});
  std::uint64_t splits = 0;
  for ([[maybe_unused]] const auto round : state) {
    auto parts = dataflow::partition(network, 0);
    splits += dataflow::evaluate<D>(network, std::move(parts.regions), {}, {}).totals.counts.splits;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(splits));
}
BENCHMARK(evaluation)->ArgName("side")->Arg(4)->UseRealTime();

/// Cells to bytes and back, as they travel between ranks.
void archive(benchmark::State& state) {
  const auto batches = cells_of(4);
  std::int64_t bytes = 0;
  for ([[maybe_unused]] const auto round : state)
    for (const auto& batch : batches) {
      const std::string text = dataflow::to_bytes(batch->cells);
      geometry::CellBatch back;
      dataflow::from_bytes(text, back);
      bytes += static_cast<std::int64_t>(text.size());
    }
  state.SetBytesProcessed(bytes);
}
BENCHMARK(archive);

/// A snapshot of these cells, to the disk.
void snapshot_write(benchmark::State& state) {
  const auto batches = cells_of(4);
  io::Snapshot snapshot;
  std::int64_t bytes = 0;
  for (const auto& batch : batches) snapshot.cells.push_back({batch, &batch->cells});
  const auto path = std::filesystem::temp_directory_path() / "bsp2_kernel_bench.h5";
  for ([[maybe_unused]] const auto round : state) {
    io::write_snapshot(path, snapshot);
    bytes += static_cast<std::int64_t>(std::filesystem::file_size(path));
  }
  std::filesystem::remove(path);
  state.SetBytesProcessed(bytes);
}
BENCHMARK(snapshot_write)->UseRealTime();

}  // namespace
}  // namespace bsp2
