#include "bsp2/supersteps/rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "bsp2/geometry/error.hpp"
#include "canvas.hpp"

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

/// Maps what is seen into the image, with a margin.
struct Frame {
  double scale = 1;
  std::array<double, 2> center{};
  double half = 0;

  [[nodiscard]] std::array<double, 2> place(const Vector& seen) const {
    return {half + scale * (seen[0] - center[0]), half - scale * (seen[1] - center[1])};
  }
};

Frame frame_of(const SolidMesh& mesh, const Camera& camera, int size) {
  constexpr double infinity = std::numeric_limits<double>::infinity(), margin = 0.05;
  std::array<double, 2> low{infinity, infinity}, high{-infinity, -infinity};
  for (const auto& batch : mesh.batches) {
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (batch->label[cell] != geometry::Label::in) continue;
      for (std::size_t v = 0; v < batch->point_count(cell); ++v) {
        const Vector p = seen_point(camera, *batch, cell, v);
        for (const int axis : {0, 1}) {
          low[axis] = std::min(low[axis], p[axis]);
          high[axis] = std::max(high[axis], p[axis]);
        }
      }
    }
  }
  const double extent = std::max(high[0] - low[0], high[1] - low[1]);
  if (!(extent > 0)) return {};
  return {size * (1 - 2 * margin) / extent, {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2}, size / 2.0};
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
  Painter(const SolidMesh& mesh, const Camera& camera, int size)
      : camera_(camera), frame_(frame_of(mesh, camera, size)), canvas_(size, {0.965, 0.97, 0.975}) {}

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

  [[nodiscard]] std::string png() { return canvas_.png(); }

 private:
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

void paint_plane(const SolidMesh& mesh, Painter& painter) {
  for (const auto& batch : mesh.batches) {
    for (std::size_t cell = 0; cell < batch->size(); ++cell) painter.paint_polygon(*batch, cell);
  }
}

void paint_space(const SolidMesh& mesh, const geometry::BspTree& tree, const Camera& camera,
                 Painter& painter) {
  std::vector<std::size_t> first;  // cell of the mesh with which each batch begins
  std::size_t cells = 0;
  for (const auto& batch : mesh.batches) {
    first.push_back(cells);
    cells += batch->size();
  }
  const Vector looking{-camera.toward[0], -camera.toward[1], -camera.toward[2]};
  tree.visit_back_to_front(looking, true, [&](std::int32_t leaf) {
    const auto cell = static_cast<std::size_t>(leaf) - 1;
    const auto batch =
        static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), cell) - first.begin()) - 1;
    painter.paint_cell(*mesh.batches[batch], cell - first[batch]);
  });
}

}  // namespace

std::string render_png(const SolidMesh& mesh, const geometry::BspTree& tree, int size) {
  if (mesh.dimension == 2) {
    Painter painter(mesh, Camera{}, size);
    paint_plane(mesh, painter);
    return painter.png();
  }
  if (mesh.dimension != 3) {
    throw Error("solids of dimension 2 and 3 can be drawn, not " + std::to_string(mesh.dimension));
  }
  const Camera camera = camera_at(30, 22);
  Painter painter(mesh, camera, size);
  paint_space(mesh, tree, camera, painter);
  return painter.png();
}

}  // namespace bsp2::supersteps
