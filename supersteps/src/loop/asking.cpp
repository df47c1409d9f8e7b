#include "loop/asking.hpp"

#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "loop/querying.hpp"
#include "render/round_faces.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace {

template <int D>
class AskedRun : public Asked {
 public:
  AskedRun(std::shared_ptr<const dataflow::Network<D>> network, const dataflow::Partition<D>& partition,
           unsigned threads)
      : network_(std::move(network)), threads_(threads) {
    partition_.root = partition.root;
    partition_.nodes = partition.nodes;
  }

  [[nodiscard]] std::vector<Answer> locate(const RunResult& result,
                                           std::span<const double> points) const override {
    return querying<D>(network_->table, result, points, threads_);
  }
  void find_boundary(RunResult& result, bool with_faces) const override {
    RunOptions options;
    options.boundary = true;
    options.faces = with_faces;
    options.outlines = true;
    Resolution found = resolved(result, options);
    result.faces = std::move(found.faces);
    result.outlines = std::move(found.outlines);
    if (result.boundary) return;  // the same triangles: who looks at them shall go on doing so
    result.boundary = std::move(found.boundary);
    describe_boundary(result);
  }
  [[nodiscard]] std::vector<geometry::Contact> contacts(const RunResult& result) const override {
    RunOptions options;
    options.contacts = true;
    return resolved(result, options).contacts;
  }
  [[nodiscard]] meshing::Complex complex(const RunResult& result) const override {
    if constexpr (D == 3)
      return result.complex ? std::exchange(*result.complex, {})
                            : meshing::conforming_complex(network_->table, result.mesh.batches, threads_);
    else
      throw Error("meshes for solvers are made of solids of dimension 3, not " + std::to_string(D) +
                  (D < 3 ? "; linear_extrude() or extrude() in the model makes a solid of a plane shape"
                         : "; section() or project() in the model gives one of dimension 3"));
  }

  [[nodiscard]] std::optional<std::array<double, 3>> on_true_surface(
      const RunResult& result, std::span<const std::uint32_t> planes,
      const std::array<double, 3>& point) const override {
    if constexpr (D == 3)
      if (result.round_faces != nullptr && result.round_faces->has_curved())
        return result.round_faces->place_on(planes, point, [this](geometry::HyperplaneId plane) {
          return network_->table.rounded(plane).normal;
        });
    return std::nullopt;
  }

 private:
  std::shared_ptr<const dataflow::Network<D>> network_;
  dataflow::Partition<D> partition_;
  unsigned threads_;

  /// As the run resolves, by this process alone.
  [[nodiscard]] Resolution resolved(const RunResult& result, const RunOptions& options) const {
    CellShare share;
    std::uint64_t cells = 0;
    for (const auto& batch : result.mesh.batches) {
      share.batches.push_back(batch);
      share.first_cell.push_back(std::exchange(cells, cells + batch->size()));
    }
    Ranks alone;
    return resolution<D>(alone, *network_, partition_, std::move(share), options, threads_);
  }
};

}  // namespace

void describe_boundary(RunResult& result) {
  if (result.boundary)
    result.report.boundary = {result.boundary->triangles.size(), result.boundary->area(),
                              result.boundary->is_closed(), dataflow::digest_of(*result.boundary)};
}

template <int D>
std::shared_ptr<const Asked> asked(std::shared_ptr<const dataflow::Network<D>> network,
                                   const dataflow::Partition<D>& partition, unsigned threads) {
  return std::make_shared<AskedRun<D>>(std::move(network), partition, threads);
}

#define BSP2_STAGE(D)                                                                         \
  template std::shared_ptr<const Asked> asked<D>(std::shared_ptr<const dataflow::Network<D>>, \
                                                 const dataflow::Partition<D>&, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
