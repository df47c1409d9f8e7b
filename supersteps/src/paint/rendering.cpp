#include "bsp2/supersteps/render/rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "paint/painter.hpp"
#include "ranks/exchange.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;

/// Where the cells of a mesh are, by number.
class Cells {
 public:
  explicit Cells(const SolidMesh& mesh) : mesh_(mesh) {
    for (const auto& batch : mesh.batches) {
      first_.push_back(count_);
      count_ += batch->size();
    }
  }
  struct Place {
    const CellBatch& batch;
    std::size_t cell;
  };
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] Place at(std::size_t number) const {
    const auto batch =
        static_cast<std::size_t>(std::upper_bound(first_.begin(), first_.end(), number) - first_.begin()) - 1;
    return {*mesh_.batches[batch], number - first_[batch]};
  }

 private:
  const SolidMesh& mesh_;
  std::vector<std::size_t> first_;  // cell of the mesh with which each batch begins
  std::size_t count_ = 0;
};

/// Which strips of a picture each cell touches.
template <typename Target>
class CellStrips {
 public:
  CellStrips(const RunResult& result, const Space& space, const Camera& camera, const Frame& frame,
             const Target& target) {
    if (target.strips() == 1) return;
    for (const auto& batch : result.mesh.batches)
      for (std::size_t cell = 0; cell < batch->size(); ++cell) {
        const Vector& shift = space.shift(result.partition.nodes.empty() ? 0 : batch->region[cell]);
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t v = 0; v < batch->point_count(cell); ++v) {
          const Vector seen = camera.see(sum(point_of(*batch, cell, v), shift));
          const double y = camera.is_before_eye(seen) ? frame.place(camera.project(seen))[1]
                                                      : std::numeric_limits<double>::quiet_NaN();
          low = y >= low ? low : std::isnan(y) ? -std::numeric_limits<double>::infinity() : y;
          high = y <= high ? high : std::isnan(y) ? std::numeric_limits<double>::infinity() : y;
        }
        strips_.push_back(target.strips_between(low, high));
      }
  }
  [[nodiscard]] bool touches(std::size_t cell, int strip) const {
    return strips_.empty() || (strips_[cell][0] <= strip && strip <= strips_[cell][1]);
  }

 private:
  std::vector<std::array<std::uint8_t, 2>>
      strips_;  // the first and the last of each cell; empty: there is one
};

/// A layer and its place in the picture.
template <typename Layer>
struct PlacedLayer {
  int strip = 0;
  std::size_t place = 0;
  Layer layer;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& strip& place& layer;
  }
};

/// Cells that this rank draws, and that are not parted by those of another rank: in the order in which they
/// are drawn.
struct Run {
  std::size_t place = 0;  ///< among the layers of all ranks
  std::vector<std::uint32_t> cells;
};

/// What this rank draws, in the order of the BSP trees, which are walked once for all strips.
std::vector<Run> runs_of(const RunResult& result, const Space& space, std::int32_t rank,
                         bool is_front_first) {
  std::vector<Run> runs;
  std::size_t place = 0;
  std::int32_t before = -1;
  space.visit_regions([&](std::size_t region) {
    const int drawer = drawer_of(result, region);
    if (drawer != before) ++place;
    if (drawer == rank) {
      if (before != rank) runs.push_back({place, {}});
      space.visit_cells(region, [&](std::size_t number) {
        runs.back().cells.push_back(static_cast<std::uint32_t>(number));
      });
    }
    before = drawer;
  });
  if (is_front_first)
    for (Run& run : runs) std::reverse(run.cells.begin(), run.cells.end());
  return runs;
}

/// The layers of all ranks, one over the other.
template <typename Target>
void compose(const Ranks& ranks, Target& target, const Lighting& lighting) {
  std::vector<PlacedLayer<typename Target::Layer>> layers;
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, layers.emplace_back());
  std::sort(layers.begin(), layers.end(), [](const auto& a, const auto& b) {
    return std::tie(a.strip, a.place) < std::tie(b.strip, b.place);
  });
  auto next = layers.begin();
  for (int strip = 0; strip < target.strips(); ++strip) {
    target.begin_strip(strip);
    for (; next != layers.end() && next->strip == strip; ++next) target.put(next->layer);
    target.end_strip(lighting);
  }
}

/// All that is to be seen, on all ranks.
Extent extent_of(Ranks& ranks, const RunResult& result, const PictureOptions& options, const Space& space,
                 const Camera& camera, const Box3& shown) {
  Extent extent;
  if (!options.bounds.lower.empty()) {
    Box3 box;
    for (const Vector& corner : shown.corners()) {
      const Vector way = difference(corner, shown.middle());
      box.add(sum(corner, {options.explode * way[0], options.explode * way[1], options.explode * way[2]}));
    }
    for (const Vector& corner : box.corners()) extent.add(camera, corner);
    return extent;
  }
  if (options.ball > 0 && !shown.is_empty()) {
    const Vector across = difference(shown.high, shown.low);
    extent.add_ball(camera, shown.middle(), options.ball * std::sqrt(dot(across, across)) / 2);
    return extent;
  }
  for (const auto& batch : result.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (!is_drawn(*batch, cell)) continue;
      const Vector& shift = space.shift(result.partition.nodes.empty() ? 0 : batch->region[cell]);
      for (std::size_t v = 0; v < batch->point_count(cell); ++v)
        extent.add(camera, sum(point_of(*batch, cell, v), shift));
    }
  Extent all;
  for (const Extent& part : all_gather(ranks, extent)) all.add(part);
  return all;
}

/// What the camera is made for, on all ranks.
Box3 shown_by(Ranks& ranks, const RunResult& result, const PictureOptions& options) {
  Box3 shown;
  if (!options.bounds.lower.empty()) {
    Vector lower{}, upper{};
    std::copy(options.bounds.lower.begin(), options.bounds.lower.end(), lower.begin());
    std::copy(options.bounds.upper.begin(), options.bounds.upper.end(), upper.begin());
    shown.add(lower);
    shown.add(upper);
    return shown;
  }
  for (const Box3& part : all_gather(ranks, bounds_of(result.mesh))) shown.add(part);
  return shown;
}

/// All that a picture is drawn of, the same on all ranks but for the cells.
class Scene {
 public:
  /// Collective.
  Scene(Ranks& ranks, const RunResult& result, const PictureOptions& options)
      : shown(shown_by(ranks, result, options)) {
    ranks.agree([&] {
      camera.emplace(options, result.mesh.dimension, shown);
      space.emplace(result, *camera, shown, options.explode);
    });
  }
  /// Of the cell at the eye; OUT where there is none, and without an eye. Collective.
  [[nodiscard]] geometry::Label label_at_eye(Ranks& ranks, const RunResult& result) const {
    if (!camera->is_perspective() || result.mesh.dimension != 3) return geometry::Label::out;
    std::optional<geometry::Label> mine;
    ranks.agree([&] { mine = label_here(result, space->regions(), camera->eye(), ranks.rank()); });
    auto label = geometry::Label::out;
    for (const int found : all_gather(ranks, static_cast<int>(mine.value_or(geometry::Label::out))))
      if (static_cast<geometry::Label>(found) != geometry::Label::out)
        label = static_cast<geometry::Label>(found);
    return label;
  }

  Box3 shown;
  std::optional<Camera> camera;
  std::optional<Space> space;
};

/// Corners are darker within so much of the solid's size.
double reach_of_shade(const RunResult& result, const Box3& shown) {
  if (result.mesh.dimension != 3 || shown.is_empty()) return 0;
  const Vector across = difference(shown.high, shown.low);
  return 0.03 * std::sqrt(dot(across, across));
}

/// Draws what this rank holds. @return its layers, if there are other ranks.
template <typename Target>
std::vector<std::string> draw_strips(const Ranks& ranks, const RunResult& result,
                                     const PictureOptions& options, const Space& space,
                                     const CellStrips<Target>& strips, const Lighting& lighting,
                                     Painter<Target>& painter, Target& target) {
  constexpr std::size_t seldom = 4096, often = 64;
  const Cells cells(result.mesh);
  const std::vector<Run> runs = runs_of(result, space, ranks.rank(), Target::is_front_first);
  std::vector<std::string> layers;
  std::size_t painted = 0;
  for (int strip = 0; strip < target.strips(); ++strip) {
    target.begin_strip(strip);
    for (const Run& run : runs) {
      for (const std::uint32_t number : run.cells) {
        if (!strips.touches(number, strip)) continue;
        const auto [batch, cell] = cells.at(number);
        painter.paint(batch, cell, number,
                      space.shift(result.partition.nodes.empty() ? 0 : batch.region[cell]));
        if (++painted % often == 0) geometry::Interruption::check();
        if (options.on_progress && painted % seldom == 0)
          options.on_progress(static_cast<double>(strip) / target.strips());
      }
      if (ranks.count() > 1)
        layers.push_back(
            dataflow::to_bytes(PlacedLayer<typename Target::Layer>{strip, run.place, target.take()}));
    }
    if (ranks.count() == 1) target.end_strip(lighting);  // the only layer of each strip stays where it is
  }
  return layers;
}

template <typename Target>
std::string draw(Ranks& ranks, const RunResult& result, const PictureOptions& options, Target& target,
                 geometry::Label& at_eye) {
  const Scene scene(ranks, result, options);
  const auto& [shown, camera, space] = std::tie(scene.shown, *scene.camera, *scene.space);
  std::optional<InnerSides> inner;
  at_eye = scene.label_at_eye(ranks, result);
  if (at_eye == geometry::Label::in && !options.section)
    inner.emplace(ranks, result, space.regions(), camera);
  const Frame frame(camera, extent_of(ranks, result, options, space, camera, shown), options.look,
                    options.width, options.height);
  const Numbers numbers = Numbers::of(ranks, result, options);
  const Lighting lighting(camera, frame, result.round_faces.get(), space.regions().shifts,
                          reach_of_shade(result, shown), skin_thickness(result));
  std::vector<std::string> layers;
  ranks.agree([&] {
    Painter<Target> painter(result, options, camera, frame, inner ? &*inner : nullptr,
                            Inks(result, options, numbers), target);
    const CellStrips<Target> strips(result, space, camera, frame, target);
    layers = draw_strips(ranks, result, options, space, strips, lighting, painter, target);
  });
  for (std::string& layer : layers) ranks.send(0, std::exchange(layer, {}));
  if (ranks.count() > 1) ranks.sync();
  std::string file;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    if (ranks.count() > 1) compose(ranks, target, lighting);
    Overlay overlay;
    add_legend(overlay, result, options, numbers);
    add_axes(overlay, options, camera, frame, result.mesh.dimension);
    file = target.file(lighting, overlay);
  });
  return file;
}

}  // namespace

std::optional<PictureFormat> picture_format(const std::filesystem::path& path) {
  const auto ending = path.extension();
  if (ending == ".png") return PictureFormat::png;
  if (ending == ".svg") return PictureFormat::svg;
  if (ending == ".pdf") return PictureFormat::pdf;
  return std::nullopt;
}

std::string render(Ranks& ranks, const RunResult& result, const PictureOptions& options,
                   geometry::Label* at_eye) {
  ranks.agree([&] {
    const int dimension = result.mesh.dimension;
    if (dimension != 2 && dimension != 3)
      throw Error("solids of dimension 2 and 3 can be drawn, not " + std::to_string(dimension) +
                  (dimension > 3 ? "; section() or project() in the model give what can be shown" : ""));
  });
  auto label = geometry::Label::out;
  if (at_eye == nullptr) at_eye = &label;
  if (options.format == PictureFormat::png) {
    std::optional<Canvas> canvas;
    ranks.agree([&] { canvas.emplace(options); });
    return draw(ranks, result, options, *canvas, *at_eye);
  }
  Drawing drawing(options);
  return draw(ranks, result, options, drawing, *at_eye);
}

std::string render(SolidMesh mesh, geometry::BspTree tree, const PictureOptions& options) {
  Ranks alone;
  RunResult result;
  result.mesh = std::move(mesh);
  result.tree = std::move(tree);
  return render(alone, result, options);
}

}  // namespace bsp2::supersteps
