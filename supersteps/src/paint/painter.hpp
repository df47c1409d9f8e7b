#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include "bsp2/supersteps/render/hidden_facets.hpp"
#include "paint/canvas.hpp"
#include "render/inner_sides.hpp"
#include "render/round_faces.hpp"
#include "render/section.hpp"
#include "render/shading.hpp"
#include "render/space.hpp"

namespace bsp2::supersteps {

/// Draws cells on a canvas or a drawing.
template <typename Target>
class Painter {
 public:
  /// @param inner if the eye is in an IN cell: then the solid is seen from within. May be null.
  Painter(const RunResult& result, const PictureOptions& options, const Camera& camera, const Frame& frame,
          const InnerSides* inner, Inks inks, Target& target)
      : result_(result),
        options_(options),
        camera_(camera),
        frame_(frame),
        inner_(inner),
        target_(target),
        round_(result.round_faces.get()),
        inks_(std::move(inks)) {
    const auto is_opaque = [](const auto& colour) { return !colour || (*colour)[3] == 255; };
    if (options.format != PictureFormat::png &&
        std::all_of(result.colour_of_primitive.begin(), result.colour_of_primitive.end(), is_opaque))
      hidden_.emplace(result.mesh);
  }

  /// @param number of the cell, counted through the batches.
  void paint(const geometry::CellBatch& batch, std::size_t cell, std::size_t number, const Vector& shift) {
    if (!is_drawn(batch, cell) || (options_.most_level && batch.level[cell] > *options_.most_level)) return;
    Ink ink = inks_.of(batch, cell);
    ink.edges = options_.edges == Edges::cells;
    ink.region = batch.region[cell];
    if (batch.dimension == 2)
      paint_plane_cell(batch, cell, shift, ink);
    else if (inner_ != nullptr && batch.label[cell] == geometry::Label::in)
      paint_inner_sides(number, shift, ink);
    else if (!options_.section)
      paint_cell(batch, cell, shift, ink);
    else
      paint_cut_cell(batch, cell, *options_.section, shift, ink);
  }

 private:
  /// The facets of a cell that face the viewer; they do not hide each other.
  void paint_cell(const geometry::CellBatch& batch, std::size_t cell, const Vector& shift, const Ink& ink) {
    points_.clear();
    bool is_before_eye = true;
    for (std::size_t v = 0; v < batch.point_count(cell); ++v) {
      points_.push_back(camera_.see(sum(point_of(batch, cell, v), shift)));
      is_before_eye = is_before_eye && camera_.is_before_eye(points_.back());
    }
    if (is_before_eye && is_covered()) return;  // else all corners have their places now
    Ink of_cell = ink;
    if (ink.round.body >= 0) of_cell.round.side = side_of_skin(batch, cell, ink.round);
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      if (hidden_ && hidden_->contains(batch, cell, f)) continue;
      seen_.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f)) seen_.push_back(points_[v]);
      const Vector normal = normal_of(seen_);
      if (!camera_.shows_front(normal, seen_[0])) continue;
      const Ink of_this = in_plane(of_facet(of_cell, batch, f), normal);
      if (!is_before_eye) {
        fill(of_this);
        continue;
      }
      placed_.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f)) placed_.push_back(places_[v]);
      target_.fill(placed_, of_this);
    }
  }

  /// Which side of a curved surface is seen in a cell of its skin, by that facet of the cell which faces the
  /// viewer and of all runs best along the surface: its front is towards the outside if the cell is on its
  /// negative side.
  [[nodiscard]] std::int32_t side_of_skin(const geometry::CellBatch& batch, std::size_t cell,
                                          const RoundPlace& skin) {
    double along = 0.7;  // the others part the skin
    std::int32_t side = round_->owner(skin).owns ? 1 : -1;
    std::vector<Vector> polygon;
    for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
      const std::int32_t plane = batch.facet_hyperplane[f];
      if (round_->of(static_cast<geometry::HyperplaneId>(plane < 0 ? ~plane : plane)).body != skin.body)
        continue;
      seen_.clear();
      polygon.clear();
      for (const std::uint16_t v : batch.vertices_of_facet(f)) {
        seen_.push_back(points_[v]);
        polygon.push_back(point_of(batch, cell, v));
      }
      if (!camera_.shows_front(normal_of(seen_), seen_[0])) continue;
      const Vector normal = normalized(normal_of(polygon));
      const double runs_along = dot(round_->normal(skin, polygon[0], normal), normal);
      if (!(runs_along > along)) continue;
      along = runs_along;
      side = plane < 0 ? -1 : 1;
    }
    return side;
  }

  /// Finds the places of the corners of a cell that is before the eye. @return whether all of it is behind
  /// what has been drawn.
  [[nodiscard]] bool is_covered() {
    Point2 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()},
        high{-low[0], -low[1]};
    places_.clear();
    for (const Vector& point : points_) {
      const Point2 at = frame_.place(camera_.project(point));
      places_.push_back(at);
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], at[k]);
        high[k] = std::max(high[k], at[k]);
      }
    }
    return target_.is_covered(low, high);
  }

  /// What of a cell is on the near side of a section, and its cut.
  void paint_cut_cell(const geometry::CellBatch& batch, std::size_t cell, const PictureSection& section,
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
      paint_polygon(part_of(polygon, section, cut), shift, of_facet(ink, batch, f));
    }
    paint_polygon(around(cut, section), shift, ink);
  }

  void paint_polygon(const std::vector<Vector>& polygon, const Vector& shift, const Ink& ink) {
    if (polygon.size() < 3) return;
    seen_.clear();
    for (const Vector& p : polygon) seen_.push_back(camera_.see(sum(p, shift)));
    fill_if_front(ink);
  }

  /// Where the solid ends behind a cell: lit as if it were looked at from there.
  void paint_inner_sides(std::size_t number, const Vector& shift, const Ink& ink) {
    for (const InnerSides::Piece& piece : inner_->of(number)) {
      seen_.clear();
      for (auto p = piece.rbegin(); p != piece.rend(); ++p) seen_.push_back(camera_.see(sum(*p, shift)));
      const Vector normal = normal_of(seen_);
      if (dot(normal, normal) > 0) fill(in_plane(ink, normal));
    }
  }

  /// A cell of the plane: its points around its middle.
  void paint_plane_cell(const geometry::CellBatch& batch, std::size_t cell, const Vector& shift,
                        const Ink& ink) {
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

  /// The skin of something curved is bent where a facet of it is not, but for where it ends in a face of the
  /// model.
  [[nodiscard]] Ink of_facet(const Ink& ink, const geometry::CellBatch& batch, std::size_t facet) const {
    Ink result = ink;
    if (round_ == nullptr) return result;
    const std::int32_t plane = batch.facet_hyperplane[facet];
    const auto id = static_cast<geometry::HyperplaneId>(plane < 0 ? ~plane : plane);
    if (ink.round.body < 0 || round_->is_of_model(id)) result.round = round_->of(id);
    return result;
  }

  [[nodiscard]] Ink in_plane(const Ink& ink, const Vector& normal) const {
    const Vector n = normalized(normal);
    Ink result = ink;
    result.plane = {n[0], n[1], n[2], -dot(n, seen_[0])};
    return result;
  }

  void fill_if_front(const Ink& ink) {
    const Vector normal = normal_of(seen_);
    if (camera_.shows_front(normal, seen_[0])) fill(in_plane(ink, normal));
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
  const RoundFaces* round_;
  Inks inks_;
  std::optional<HiddenFacets> hidden_;  // of vector pictures
  std::vector<Vector> points_, seen_;
  std::vector<Point2> places_, placed_;
};

}  // namespace bsp2::supersteps
