#include "bsp2/supersteps/render/rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/supersteps/render/hidden_facets.hpp"
#include "ranks/exchange.hpp"
#include "render/camera.hpp"
#include "render/canvas.hpp"
#include "render/inner_sides.hpp"
#include "render/shading.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::BspTree;
using geometry::CellBatch;

constexpr Colour background{0.965, 0.97, 0.975};

/// The point of a cell in model space; of a plane cell at z = 0.
Vector point_of(const CellBatch& batch, std::size_t cell, std::size_t vertex) {
  const auto d = static_cast<std::size_t>(batch.dimension);
  Vector p{};
  std::copy_n(batch.cell_points(cell).data() + vertex * d, d, p.begin());
  return p;
}

bool is_drawn(const CellBatch& batch, std::size_t cell) { return batch.label[cell] != geometry::Label::out; }

Box3 bounds_of(const SolidMesh& mesh) {
  Box3 box;
  for (const auto& batch : mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      for (std::size_t v = 0; is_drawn(*batch, cell) && v < batch->point_count(cell); ++v)
        box.add(point_of(*batch, cell, v));
  return box;
}

/// The space of the picture: its regions, how far each is moved, and in which order they hide each other.
///
/// A region moves by `explode` times the way from the middle to a point within it, the middle of its box if
/// that is. So it stays within what it would be if all space were scaled about the middle: the regions are
/// still parted by a BSP tree, the same one, scaled; it is walked with the eye scaled back instead.
class Space {
 public:
  Space(const RunResult& result, const Camera& camera, const Box3& bounds, double explode)
      : result_(result), camera_(camera), middle_(bounds.middle()), explode_(explode) {
    // Without a partition all is one region.
    const BspTree& partition = result.partition;
    const bool is_divided = !partition.nodes.empty();
    struct Place {
      std::int32_t region,
          tree;  // nodes or leaves of the partition, and of the tree that begins with the same nodes
      Box3 box;
      std::vector<Bound> bounds;
    };
    std::vector<Place> stack;
    stack.push_back({is_divided ? partition.root : ~1, result.tree.root, bounds, {}});
    while (!stack.empty()) {
      Place at = std::move(stack.back());
      stack.pop_back();
      if (at.region < 0) {
        enter(static_cast<std::size_t>(~at.region) - 1, at.tree, point_within(at.box, at.bounds));
        continue;
      }
      const BspTree::Node& node = partition.nodes[at.region];
      auto [negative, positive] = halves(node.hyperplane, at.box);
      const bool shared = at.tree >= 0;  // else: this rank has no cells here
      at.bounds.push_back({node.hyperplane, 1});
      stack.push_back({node.negative, shared ? result.tree.nodes[at.tree].negative : BspTree::empty_leaf,
                       negative, at.bounds});
      at.bounds.back().sign = -1;
      stack.push_back({node.positive, shared ? result.tree.nodes[at.tree].positive : BspTree::empty_leaf,
                       positive, std::move(at.bounds)});
    }
  }

  [[nodiscard]] const Vector& shift(std::size_t region) const { return shifts_[region]; }
  [[nodiscard]] RegionsInSpace regions() const { return {shifts_, roots_, explode_ > 0}; }

  /// Calls visit(region) for all regions, from the farthest to the nearest.
  template <typename Visit>
  void visit_regions(Visit visit) const {
    if (result_.partition.nodes.empty()) return visit(0);
    Vector eye{};
    if (camera_.is_perspective())
      for (int i = 0; i < 3; ++i) eye[i] = middle_[i] + (camera_.eye()[i] - middle_[i]) / (1 + explode_);
    walk(result_.partition, result_.partition.root, eye,
         [&](std::int32_t leaf) { visit(static_cast<std::size_t>(leaf) - 1); });
  }

  /// Calls visit(number) for the cells of a region that this rank has, from the farthest to the nearest.
  template <typename Visit>
  void visit_cells(std::size_t region, Visit visit) const {
    const Vector eye = camera_.is_perspective() ? difference(camera_.eye(), shifts_[region]) : Vector{};
    walk(result_.tree, roots_[region], eye,
         [&](std::int32_t leaf) { visit(static_cast<std::size_t>(leaf) - 1); });
  }

 private:
  const RunResult& result_;
  const Camera& camera_;
  Vector middle_;
  double explode_;
  std::vector<Vector> shifts_;
  std::vector<std::int32_t> roots_;  // in the tree

  /// A half-space of the partition: where sign times the hyperplane is negative.
  struct Bound {
    std::uint32_t hyperplane;
    double sign;
  };

  void enter(std::size_t region, std::int32_t root, const Vector& point) {
    if (region >= roots_.size()) {
      roots_.resize(region + 1, BspTree::empty_leaf);
      shifts_.resize(region + 1);
    }
    roots_[region] = root;
    const Vector way = difference(point, middle_);
    for (int i = 0; i < 3; ++i) shifts_[region][i] = explode_ * way[i];
  }

  /// The middle of a region's box; where hyperplanes that are not parallel to axes leave that outside, a
  /// point found from there by stepping across the one that it is farthest beyond, again and again (Agmon's
  /// relaxation).
  [[nodiscard]] Vector point_within(const Box3& box, const std::vector<Bound>& bounds) const {
    constexpr int most_steps = 200;
    constexpr double overshoot = 1.5;
    const auto d = static_cast<std::size_t>(result_.partition.dimension);
    Vector point = box.middle();
    for (int step = 0; step < most_steps; ++step) {
      double worst = 0;
      const Bound* crossed = nullptr;
      for (const Bound& bound : bounds) {
        const double* h = result_.partition.hyperplanes.data() + bound.hyperplane * (d + 1);
        double value = h[0];
        for (std::size_t axis = 0; axis < d; ++axis) value += h[axis + 1] * point[axis];
        if (bound.sign * value <= worst) continue;
        worst = bound.sign * value;
        crossed = &bound;
      }
      if (crossed == nullptr) break;
      const double* h = result_.partition.hyperplanes.data() + crossed->hyperplane * (d + 1);
      for (std::size_t axis = 0; axis < d; ++axis)
        point[axis] = std::clamp(point[axis] - overshoot * worst * crossed->sign * h[axis + 1], box.low[axis],
                                 std::max(box.low[axis], box.high[axis]));
    }
    return point;
  }

  /// A box on both sides of a hyperplane of the partition; one that is not parallel to an axis leaves it as
  /// it is.
  [[nodiscard]] std::array<Box3, 2> halves(std::uint32_t hyperplane, const Box3& box) const {
    std::array<Box3, 2> result{box, box};
    const auto d = static_cast<std::size_t>(result_.partition.dimension);
    const double* h = result_.partition.hyperplanes.data() + hyperplane * (d + 1);
    for (std::size_t axis = 0; axis < d; ++axis) {
      if (std::fabs(h[axis + 1]) < 1 - 1e-9) continue;
      const double x =
          std::clamp(-h[0] / h[axis + 1], box.low[axis], std::max(box.low[axis], box.high[axis]));
      const bool ascends = h[axis + 1] > 0;
      result[ascends ? 0 : 1].high[axis] = x;
      result[ascends ? 1 : 0].low[axis] = x;
    }
    return result;
  }

  /// In the plane nothing hides anything: any order will do, but it must not depend on who draws.
  template <typename Visit>
  void walk(const BspTree& tree, std::int32_t from, const Vector& eye, Visit visit) const {
    const bool parallel = !camera_.is_perspective();
    const Vector seen_from = parallel ? camera_.direction() : eye;
    tree.visit_back_to_front(from, {seen_from.data(), static_cast<std::size_t>(tree.dimension)}, parallel,
                             visit);
  }
};

/// Draws cells on a canvas or a drawing.
template <typename Target>
class Painter {
 public:
  /// @param inner if the eye is in an IN cell: then the solid is seen from within. May be null.
  Painter(const RunResult& result, const PictureOptions& options, const Camera& camera, const Frame& frame,
          const InnerSides* inner, Target& target)
      : result_(result), options_(options), camera_(camera), frame_(frame), inner_(inner), target_(target) {
    const auto is_opaque = [](const auto& colour) { return !colour || (*colour)[3] == 255; };
    if (options.format != PictureFormat::png &&
        std::all_of(result.colour_of_primitive.begin(), result.colour_of_primitive.end(), is_opaque))
      hidden_.emplace(result.mesh);
  }

  /// @param number of the cell, counted through the batches.
  void paint(const CellBatch& batch, std::size_t cell, std::size_t number, const Vector& shift) {
    if (!is_drawn(batch, cell) || (options_.most_level && batch.level[cell] > *options_.most_level)) return;
    Ink ink = ink_of(result_, batch, cell, options_.shade);
    ink.edges = options_.edges;
    if (batch.dimension == 2)
      paint_polygon(batch, cell, shift, ink);
    else if (inner_ != nullptr && batch.label[cell] == geometry::Label::in)
      paint_inner_sides(number, shift, ink);
    else if (!options_.section)
      paint_cell(batch, cell, shift, ink);
    else
      paint_cut_cell(batch, cell, *options_.section, shift, ink);
  }

 private:
  /// The facets of a cell that face the viewer; they do not hide each other.
  void paint_cell(const CellBatch& batch, std::size_t cell, const Vector& shift, const Ink& ink) {
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      if (hidden_ && hidden_->contains(batch, cell, f)) continue;
      seen_.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f))
        seen_.push_back(camera_.see(sum(point_of(batch, cell, v), shift)));
      const Vector normal = normal_of(seen_);
      if (camera_.shows_front(normal, seen_[0])) fill(lit(ink, normalized(normal)));
    }
  }

  /// What of a cell is on the near side of a section, and its cut.
  void paint_cut_cell(const CellBatch& batch, std::size_t cell, const PictureSection& section,
                      const Vector& shift, const Ink& ink) {
    bool is_kept = false, is_cut_off = false;  // one that touches the section is on one side of it
    for (std::size_t v = 0; v < batch.point_count(cell); ++v) {
      const double x = point_of(batch, cell, v)[static_cast<std::size_t>(section.axis)];
      is_kept = is_kept || (section.keeps_upper ? x > section.at : x < section.at);
      is_cut_off = is_cut_off || (section.keeps_upper ? x < section.at : x > section.at);
    }
    if (!is_kept) return;
    if (!is_cut_off) return paint_cell(batch, cell, shift, ink);
    std::vector<Vector> polygon, cut;
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      polygon.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f)) polygon.push_back(point_of(batch, cell, v));
      paint_polygon_in_space(part_of(polygon, section, cut), shift, ink);
    }
    paint_polygon_in_space(around(cut, section), shift, ink);
  }

  static bool is_left(const Vector& p, const PictureSection& section) {
    const double x = p[static_cast<std::size_t>(section.axis)];
    return section.keeps_upper ? x >= section.at : x <= section.at;
  }

  /// @param cut gets the points in which the polygon's edges cross the section.
  static std::vector<Vector> part_of(const std::vector<Vector>& polygon, const PictureSection& section,
                                     std::vector<Vector>& cut) {
    const auto axis = static_cast<std::size_t>(section.axis);
    std::vector<Vector> part;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      if (is_left(p, section)) part.push_back(p);
      if (is_left(p, section) == is_left(q, section)) continue;
      // The same from both ends, since the edge is one of two facets.
      const auto& [a, b] = std::minmax(p, q);
      const double t = (section.at - a[axis]) / (b[axis] - a[axis]);
      Vector at;
      for (std::size_t k = 0; k < 3; ++k) at[k] = a[k] + t * (b[k] - a[k]);
      at[axis] = section.at;
      part.push_back(at);
      cut.push_back(at);
    }
    return part;
  }

  /// Corners of a convex polygon in a section, each at least once: counter-clockwise, seen from where nothing
  /// is left.
  static std::vector<Vector> around(std::vector<Vector> points, const PictureSection& section) {
    auto u = static_cast<std::size_t>((section.axis + 1) % 3),
         v = static_cast<std::size_t>((section.axis + 2) % 3);
    if (section.keeps_upper) std::swap(u, v);
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    Vector middle{};
    for (const Vector& p : points)
      for (std::size_t k = 0; k < 3; ++k) middle[k] += p[k] / static_cast<double>(points.size());
    const auto angle = [&](const Vector& p) { return std::atan2(p[v] - middle[v], p[u] - middle[u]); };
    std::sort(points.begin(), points.end(),
              [&](const Vector& a, const Vector& b) { return angle(a) < angle(b); });
    return points;
  }

  /// If it faces the viewer.
  void paint_polygon_in_space(const std::vector<Vector>& polygon, const Vector& shift, const Ink& ink) {
    if (polygon.size() < 3) return;
    seen_.clear();
    for (const Vector& p : polygon) seen_.push_back(camera_.see(sum(p, shift)));
    const Vector normal = normal_of(seen_);
    if (camera_.shows_front(normal, seen_[0])) fill(lit(ink, normalized(normal)));
  }

  /// Where the solid ends behind a cell: lit as if it were looked at from there.
  void paint_inner_sides(std::size_t number, const Vector& shift, const Ink& ink) {
    for (const InnerSides::Piece& piece : inner_->of(number)) {
      seen_.clear();
      for (auto p = piece.rbegin(); p != piece.rend(); ++p) seen_.push_back(camera_.see(sum(*p, shift)));
      const Vector normal = normal_of(seen_);
      if (dot(normal, normal) > 0) fill(lit(ink, normalized(normal)));
    }
  }

  /// A cell of the plane: its points around its middle.
  void paint_polygon(const CellBatch& batch, std::size_t cell, const Vector& shift, const Ink& ink) {
    const auto count = batch.point_count(cell);
    std::vector<Vector> points;
    Vector middle{};
    for (std::size_t v = 0; v < count; ++v) {
      points.push_back(sum(point_of(batch, cell, v), shift));
      for (const int axis : {0, 1}) middle[axis] += points.back()[axis] / static_cast<double>(count);
    }
    const auto angle = [&](const Vector& p) { return std::atan2(p[1] - middle[1], p[0] - middle[0]); };
    std::sort(points.begin(), points.end(),
              [&](const Vector& a, const Vector& b) { return angle(a) < angle(b); });
    seen_.clear();
    for (const Vector& p : points) seen_.push_back(camera_.see(p));
    fill(ink);
  }

  void fill(const Ink& ink) {
    camera_.clip(seen_);
    if (seen_.size() < 3) return;
    placed_.clear();
    for (const Vector& p : seen_) placed_.push_back(frame_.place(camera_.project(p)));
    target_.fill(placed_, ink);
  }

  const RunResult& result_;
  const PictureOptions& options_;
  const Camera& camera_;
  const Frame& frame_;
  const InnerSides* inner_;
  Target& target_;
  std::optional<HiddenFacets> hidden_;  // of vector pictures
  std::vector<Vector> seen_;
  std::vector<Point2> placed_;
};

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

/// Draws what this rank holds of a strip. Regions of one rank that follow each other, seen from the back,
/// share a layer; each layer is handed over when it is complete.
template <typename Target, typename HandOver>
void draw_layers(const RunResult& result, const Space& space, const CellStrips<Target>& strips, int strip,
                 Painter<Target>& painter, Target& target, std::int32_t rank,
                 const std::function<void(double)>& told, HandOver hand_over) {
  constexpr std::size_t seldom = 4096;
  const Cells cells(result.mesh);
  std::size_t visited = 0;
  std::size_t place = 0;
  std::int32_t before = -1;
  const auto complete = [&] {
    if (before == rank) hand_over(PlacedLayer<typename Target::Layer>{strip, place, target.take()});
  };
  space.visit_regions([&](std::size_t region) {
    const int drawer = drawer_of(result, region);
    if (drawer != before) {
      complete();
      ++place;
      before = drawer;
    }
    if (drawer != rank) return;
    space.visit_cells(region, [&](std::size_t number) {
      if (told && ++visited % seldom == 0)
        told((strip + static_cast<double>(visited) / static_cast<double>(cells.count())) / target.strips());
      if (!strips.touches(number, strip)) return;
      const auto [batch, cell] = cells.at(number);
      painter.paint(batch, cell, number, space.shift(region));
    });
  });
  complete();
}

/// The layers of all ranks, one over the other.
template <typename Target>
std::string compose(const Ranks& ranks, Target& target) {
  std::vector<PlacedLayer<typename Target::Layer>> layers;
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, layers.emplace_back());
  std::sort(layers.begin(), layers.end(), [](const auto& a, const auto& b) {
    return std::tie(a.strip, a.place) < std::tie(b.strip, b.place);
  });
  auto next = layers.begin();
  for (int strip = 0; strip < target.strips(); ++strip) {
    target.begin_strip(strip);
    for (; next != layers.end() && next->strip == strip; ++next) target.put(next->layer);
    target.end_strip(background);
  }
  return target.file();
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
  std::vector<std::string> layers;
  ranks.agree([&] {
    Painter<Target> painter(result, options, camera, frame, inner ? &*inner : nullptr, target);
    const CellStrips<Target> strips(result, space, camera, frame, target);
    for (int strip = 0; strip < target.strips(); ++strip) {
      target.begin_strip(strip);
      const auto hand_over = [&](const auto& layer) {
        if (ranks.count() == 1)  // the only layer of each strip stays where it is
          target.put(layer.layer);
        else
          layers.push_back(dataflow::to_bytes(layer));
      };
      draw_layers(result, space, strips, strip, painter, target, ranks.rank(), options.on_progress,
                  hand_over);
      if (ranks.count() == 1) target.end_strip(background);
    }
  });
  if (ranks.count() == 1) return target.file();
  for (std::string& layer : layers) ranks.send(0, std::exchange(layer, {}));
  ranks.sync();
  std::string file;
  ranks.agree([&] {
    if (ranks.is_master()) file = compose(ranks, target);
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
    std::unique_ptr<Canvas> canvas;
    ranks.agree([&] { canvas = make_canvas(options.width, options.height); });
    return draw(ranks, result, options, *canvas, *at_eye);
  }
  Drawing drawing(options.width, options.height, options.format);
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
