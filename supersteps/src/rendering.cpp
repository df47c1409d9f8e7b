#include "bsp2/supersteps/rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "bsp2/geometry/error.hpp"
#include "canvas.hpp"
#include "exchange.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;
using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vector normalized(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

/// Axes of the picture in model space: to the right, up, and to the viewer.
struct Camera {
  Vector right{1, 0, 0}, up{0, 1, 0}, toward{0, 0, 1};

  [[nodiscard]] Vector see(const Vector& p) const { return {dot(right, p), dot(up, p), dot(toward, p)}; }
};

/// From the front (-y), `azimuth` degrees to the right and `elevation` degrees above; z is up.
Camera camera_at(double azimuth, double elevation) {
  const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
  return {{std::cos(a), std::sin(a), 0},
          {-std::sin(a) * std::sin(e), std::cos(a) * std::sin(e), std::cos(e)},
          {std::sin(a) * std::cos(e), -std::cos(a) * std::cos(e), std::sin(e)}};
}

/// The point of a cell in the picture's axes.
Vector seen_point(const Camera& camera, const CellBatch& batch, std::size_t cell, std::size_t vertex) {
  const auto d = static_cast<std::size_t>(batch.dimension);
  Vector p{};
  std::copy_n(batch.cell_points(cell).data() + vertex * d, d, p.begin());
  return camera.see(p);
}

/// What the picture shows: a rectangle of its axes.
struct Extent {
  std::array<double, 2> low, high;
  Extent() {
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
  }
  void add(const std::array<double, 2>& below, const std::array<double, 2>& above) {
    for (const int axis : {0, 1}) {
      low[axis] = std::min(low[axis], below[axis]);
      high[axis] = std::max(high[axis], above[axis]);
    }
  }
  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & low[0] & low[1] & high[0] & high[1];
  }
};

Extent extent_of(const SolidMesh& mesh, const Camera& camera) {
  Extent extent;
  for (const auto& batch : mesh.batches) {
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (batch->label[cell] != geometry::Label::in) continue;
      for (std::size_t v = 0; v < batch->point_count(cell); ++v) {
        const Vector p = seen_point(camera, *batch, cell, v);
        extent.add({p[0], p[1]}, {p[0], p[1]});
      }
    }
  }
  return extent;
}

/// Maps what is seen into the image, with a margin.
struct Frame {
  double scale = 1;
  std::array<double, 2> center{};
  double half = 0;

  [[nodiscard]] std::array<double, 2> place(const Vector& seen) const {
    return {half + scale * (seen[0] - center[0]), half - scale * (seen[1] - center[1])};
  }
};

Frame frame_of(const Extent& extent, int size) {
  constexpr double margin = 0.05;
  const auto& [low, high] = extent;
  const double width = std::max(high[0] - low[0], high[1] - low[1]);
  if (!(width > 0)) return {};
  return {size * (1 - 2 * margin) / width, {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2}, size / 2.0};
}

/// A warm stone, a little different from part to part so that neighbours can be told apart.
Colour stone(std::int32_t part) {
  std::uint32_t h = static_cast<std::uint32_t>(part) * 0x9e3779b9U;
  h = (h ^ (h >> 15)) * 0x85ebca6bU;
  h ^= h >> 13;
  const double light = 1 + 0.07 * ((h & 0xff) / 127.5 - 1), warmth = 0.03 * (((h >> 8) & 0xff) / 127.5 - 1);
  return {0.93 * light + warmth, 0.86 * light, 0.74 * light - warmth};
}

/// Light from the upper left, before the solid, and a dim sky so that nothing is black.
Colour shaded(const Colour& colour, const Vector& normal) {
  static const Vector light = normalized({-0.5, 0.6, 0.7});
  const double brightness = 0.4 + 0.08 * normal[1] + 0.6 * std::max(0.0, dot(normal, light));
  Colour result;
  for (int i = 0; i < 3; ++i) result[i] = std::clamp(colour[i] * brightness, 0.0, 1.0);
  return result;
}

/// Normal of a polygon, not normalized: twice its area long.
Vector normal_of(const std::vector<Vector>& polygon) {
  Vector n{};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    for (int k = 0; k < 3; ++k) n[k] += (p[(k + 1) % 3] - q[(k + 1) % 3]) * (p[(k + 2) % 3] + q[(k + 2) % 3]);
  }
  return n;
}

class Painter {
 public:
  Painter(const Extent& extent, const Camera& camera, int size) : camera_(camera), frame_(frame_of(extent, size)), canvas_(size) {}

  void paint(const CellBatch& batch, std::size_t cell) {
    if (batch.dimension == 2)
      paint_polygon(batch, cell);
    else
      paint_cell(batch, cell);
  }

  [[nodiscard]] Canvas& canvas() { return canvas_; }
  [[nodiscard]] std::string png() { return canvas_.png({0.965, 0.97, 0.975}); }

 private:

  /// The facets of a cell that face the viewer; they do not hide each other.
  void paint_cell(const CellBatch& batch, std::size_t cell) {
    if (batch.label[cell] != geometry::Label::in) return;
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      seen_.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f))
        seen_.push_back(seen_point(camera_, batch, cell, v));
      const Vector normal = normal_of(seen_);
      if (normal[2] > 0) fill(shaded(stone(batch.part[cell]), normalized(normal)));
    }
  }

  /// A cell of the plane: its points around its middle.
  void paint_polygon(const CellBatch& batch, std::size_t cell) {
    if (batch.label[cell] != geometry::Label::in) return;
    seen_.clear();
    Vector middle{};
    const auto count = batch.point_count(cell);
    for (std::size_t v = 0; v < count; ++v) {
      seen_.push_back(seen_point(camera_, batch, cell, v));
      for (const int axis : {0, 1}) middle[axis] += seen_.back()[axis] / static_cast<double>(count);
    }
    const auto angle = [&](const Vector& p) { return std::atan2(p[1] - middle[1], p[0] - middle[0]); };
    std::sort(seen_.begin(), seen_.end(),
              [&](const Vector& a, const Vector& b) { return angle(a) < angle(b); });
    fill(stone(batch.part[cell]));
  }

  void fill(const Colour& colour) {
    placed_.clear();
    for (const Vector& p : seen_) placed_.push_back(frame_.place(p));
    canvas_.fill(placed_, colour);
  }

  Camera camera_;
  Frame frame_;
  Canvas canvas_;
  std::vector<Vector> seen_;
  std::vector<std::array<double, 2>> placed_;
};

Camera camera_for(int dimension) {
  if (dimension == 2) return {};
  if (dimension == 3) return camera_at(30, 22);
  throw Error("solids of dimension 2 and 3 can be drawn, not " + std::to_string(dimension));
}

/// In the plane nothing hides anything: any order will do, but it must not depend on who draws.
std::vector<double> looking_direction(const Camera& camera, int dimension) {
  if (dimension == 2) return {1, 0};
  return {-camera.toward[0], -camera.toward[1], -camera.toward[2]};
}

/// Calls visit(batch, cell) for all cells of the mesh, from the farthest to the nearest.
template <typename Visit>
void visit_back_to_front(const SolidMesh& mesh, const geometry::BspTree& tree, const Camera& camera, Visit visit) {
  std::vector<std::size_t> first;  // cell of the mesh with which each batch begins
  std::size_t cells = 0;
  for (const auto& batch : mesh.batches) {
    first.push_back(cells);
    cells += batch->size();
  }
  tree.visit_back_to_front(looking_direction(camera, mesh.dimension), true, [&](std::int32_t leaf) {
    const auto cell = static_cast<std::size_t>(leaf) - 1;
    const auto batch =
        static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), cell) - first.begin()) - 1;
    visit(*mesh.batches[batch], cell - first[batch]);
  });
}

/// The place of each region's layer in the picture. Regions of one rank that follow each other, seen from the back, share a
/// layer.
std::vector<std::size_t> layers_of_regions(const RunResult& result, const Camera& camera) {
  std::vector<std::size_t> layers(result.rank_of_region.size());
  std::size_t layer = 0;
  std::int32_t before = -1;
  result.partition.visit_back_to_front(looking_direction(camera, result.report.dimension), true, [&](std::int32_t leaf) {
    const auto region = static_cast<std::size_t>(leaf) - 1;
    if (before >= 0 && result.rank_of_region[region] != before) ++layer;
    before = result.rank_of_region[region];
    layers[region] = layer;
  });
  return layers;
}

struct PlacedLayer {
  std::size_t place = 0;
  Layer layer;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & place & layer;
  }
};

/// Draws what this rank holds; each layer is handed over when it is complete.
template <typename HandOver>
void draw_layers(const RunResult& result, const Camera& camera, Painter& painter, HandOver hand_over) {
  const auto layers = layers_of_regions(result, camera);
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::size_t at_hand = none;
  visit_back_to_front(result.mesh, result.tree, camera, [&](const CellBatch& batch, std::size_t cell) {
    const std::size_t layer = layers.at(batch.region[cell]);
    if (at_hand != none && layer != at_hand) hand_over(PlacedLayer{at_hand, painter.canvas().take()});
    at_hand = layer;
    painter.paint(batch, cell);
  });
  if (at_hand != none) hand_over(PlacedLayer{at_hand, painter.canvas().take()});
}

std::string compose(const Ranks& ranks, Painter& painter) {
  std::vector<PlacedLayer> layers;
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, layers.emplace_back());
  std::sort(layers.begin(), layers.end(), [](const PlacedLayer& a, const PlacedLayer& b) { return a.place < b.place; });
  for (const PlacedLayer& layer : layers) painter.canvas().put(layer.layer);
  return painter.png();
}

}  // namespace

std::string render_png(const SolidMesh& mesh, const geometry::BspTree& tree, int size) {
  const Camera camera = camera_for(mesh.dimension);
  Painter painter(extent_of(mesh, camera), camera, size);
  visit_back_to_front(mesh, tree, camera, [&](const CellBatch& batch, std::size_t cell) { painter.paint(batch, cell); });
  return painter.png();
}

std::string render_png(Ranks& ranks, const RunResult& result, int size) {
  ranks.begin("rendering");
  if (result.is_collected) return ranks.is_master() ? render_png(result.mesh, result.tree, size) : std::string();
  const Camera camera = camera_for(result.report.dimension);
  Extent extent;
  for (const Extent& part : all_gather(ranks, extent_of(result.mesh, camera))) extent.add(part.low, part.high);
  Painter painter(extent, camera, size);
  draw_layers(result, camera, painter, [&](const PlacedLayer& layer) { ranks.send(0, dataflow::to_bytes(layer)); });
  ranks.sync();
  return ranks.is_master() ? compose(ranks, painter) : std::string();
}

}  // namespace bsp2::supersteps
