#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "shapes/spline_shape.hpp"

namespace bsp2::dataflow {
namespace {

using Face = std::vector<std::uint32_t>;

/// A closed mesh that can be subdivided, and asked for the corners around a face.
template <int D>
class ControlMesh {
 public:
  using Point = std::array<double, D>;
  ControlMesh(std::vector<Point> points, std::vector<Face> faces)
      : points_(std::move(points)), faces_(std::move(faces)) {
    connect();
  }

  [[nodiscard]] std::size_t faces() const { return faces_.size(); }
  [[nodiscard]] std::size_t largest_valence() const {
    return *std::max_element(valence_.begin(), valence_.end());
  }

  /// Catmull and Clark's first step makes quadrangles of all faces.
  [[nodiscard]] ControlMesh quadrangulated() const {
    std::vector<Point> points;
    std::vector<Face> faces;
    const auto edge_numbers = number_edges();
    const auto first_edge = static_cast<std::uint32_t>(points_.size()),
               first_face = first_edge + static_cast<std::uint32_t>(edge_numbers.size());
    std::vector<Point> centres, middles(edge_numbers.size());
    for (const Face& face : faces_) centres.push_back(mean(face));
    std::vector<Point> of_faces(points_.size()), of_edges(points_.size());
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t i = 0; i < faces_[f].size(); ++i) {
        const std::uint32_t a = faces_[f][i], b = next(f, i);
        const double n = static_cast<double>(valence_[a]);
        add(of_faces[a], centres[f], 1 / n);
        add(of_edges[a], points_[b], 1 / n);
        Point& middle = middles[edge_numbers.at(std::minmax(a, b))];
        add(middle, centres[f], 0.25);
        add(middle, points_[a], 0.25);  // b comes from the other side
      }
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const double n = std::max(1.0, static_cast<double>(valence_[v]));  // points may be of no face
      Point point{};
      add(point, of_faces[v], 1 / n);
      add(point, of_edges[v], 1 / n);
      add(point, points_[v], (n - 2) / n);
      points.push_back(point);
    }
    points.insert(points.end(), middles.begin(), middles.end());
    points.insert(points.end(), centres.begin(), centres.end());
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t i = 0; i < faces_[f].size(); ++i) {
        const std::uint32_t a = faces_[f][i],
                            before = faces_[f][(i + faces_[f].size() - 1) % faces_[f].size()];
        faces.push_back({a, first_edge + edge_numbers.at(std::minmax(a, next(f, i))),
                         first_face + static_cast<std::uint32_t>(f),
                         first_edge + edge_numbers.at(std::minmax(before, a))});
      }
    return {std::move(points), std::move(faces)};
  }

  /// Loop's step: each triangle becomes four.
  [[nodiscard]] ControlMesh quartered() const {
    std::vector<Point> points;
    std::vector<Face> faces;
    const auto edge_numbers = number_edges();
    const auto first_edge = static_cast<std::uint32_t>(points_.size());
    std::vector<Point> around(points_.size()), middles(edge_numbers.size());
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = faces_[f][i], b = next(f, i), c = faces_[f][(i + 2) % 3];
        add(around[a], points_[b], 1);
        Point& middle = middles[edge_numbers.at(std::minmax(a, b))];
        add(middle, points_[a], 0.375);  // b comes from the other side
        add(middle, points_[c], 0.125);
      }
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const double n = std::max(1.0, static_cast<double>(valence_[v])),
                   c = 3.0 / 8 + std::cos(2 * std::numbers::pi / n) / 4, beta = (5.0 / 8 - c * c) / n;
      Point point{};
      add(point, points_[v], 1 - n * beta);
      add(point, around[v], beta);
      points.push_back(point);
    }
    points.insert(points.end(), middles.begin(), middles.end());
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      std::array<std::uint32_t, 3> middle{};
      for (std::size_t i = 0; i < 3; ++i)
        middle[i] = first_edge + edge_numbers.at(std::minmax(faces_[f][i], next(f, i)));
      for (std::size_t i = 0; i < 3; ++i) faces.push_back({faces_[f][i], middle[i], middle[(i + 2) % 3]});
      faces.push_back({middle[0], middle[1], middle[2]});
    }
    return {std::move(points), std::move(faces)};
  }

  /// The patch of a face of which one corner at most is irregular.
  [[nodiscard]] Patch<D> patch(std::size_t face, bool triangles) const {
    const Face& corners = faces_[face];
    const std::size_t regular = triangles ? 6 : 4;
    std::size_t first = 0;
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (valence_[corners[i]] != regular) first = i;
    Patch<D> patch;
    patch.kind = triangles ? Patch<D>::Kind::loop : Patch<D>::Kind::catmull_clark;
    patch.valence = static_cast<std::uint16_t>(valence_[corners[first]]);
    const auto around = triangles ? around_triangle(corners[first], corners[(first + 1) % 3])
                                  : around_quadrangle(corners[first], corners[(first + 1) % 4]);
    for (const std::uint32_t v : around)
      patch.coordinates.insert(patch.coordinates.end(), points_[v].begin(), points_[v].end());
    if (triangles || patch.valence != 4) return patch;
    // v, e_0, f_0, e_1, f_1 ... go around the 4 x 4 points' inner ones.
    constexpr std::size_t places[4][4] = {{6, 5, 4, 15}, {7, 0, 3, 14}, {8, 1, 2, 13}, {9, 10, 11, 12}};
    std::array<std::array<Point, 4>, 4> net;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j) net[i][j] = points_[around[places[i][j]]];
    return bezier_of_bspline<D>(net);
  }

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Point> points_;
  std::vector<Face> faces_;
  std::vector<std::size_t> valence_;  // of each point
  std::map<Edge, std::pair<std::uint32_t, std::uint32_t>>
      left_;  // from a to b: the face on the left, and a's place in it

  static void add(Point& sum, const Point& point, double weight) {
    for (std::size_t i = 0; i < D; ++i) sum[i] += weight * point[i];
  }
  [[nodiscard]] std::uint32_t next(std::size_t face, std::size_t corner) const {
    return faces_[face][(corner + 1) % faces_[face].size()];
  }
  [[nodiscard]] Point mean(const Face& face) const {
    Point sum{};
    for (const std::uint32_t corner : face) add(sum, points_[corner], 1.0 / static_cast<double>(face.size()));
    return sum;
  }

  void connect() {
    valence_.assign(points_.size(), 0);
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t i = 0; i < faces_[f].size(); ++i) {
        ++valence_[faces_[f][i]];
        left_[{faces_[f][i], next(f, i)}] = {static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(i)};
      }
  }

  [[nodiscard]] std::map<Edge, std::uint32_t> number_edges() const {
    std::map<Edge, std::uint32_t> numbers;
    for (const auto& [edge, place] : left_)
      if (edge.first < edge.second) numbers.emplace(edge, static_cast<std::uint32_t>(numbers.size()));
    return numbers;
  }

  /// In the face on the left of the edge from a to b, the corner that follows b by so many steps.
  [[nodiscard]] std::uint32_t beyond(std::uint32_t a, std::uint32_t b, std::size_t steps) const {
    const auto [face, corner] = left_.at({a, b});
    return faces_[face][(corner + 1 + steps) % faces_[face].size()];
  }

  /// The corners around the quadrangle on the left of the edge from v to e_0, in a patch's order.
  [[nodiscard]] Face around_quadrangle(std::uint32_t v, std::uint32_t e0) const {
    Face around{v};
    std::uint32_t spoke = e0;
    for (std::size_t i = 0; i < valence_[v]; ++i) {
      around.push_back(spoke);
      around.push_back(beyond(v, spoke, 1));
      spoke = beyond(v, spoke, 2);
    }
    const std::uint32_t f0 = around[2], e1 = around[3];
    const std::uint32_t right = beyond(f0, e0, 1), right_above = beyond(f0, e0, 2),
                        above_right = beyond(e1, f0, 1), above = beyond(e1, f0, 2);
    around.insert(around.end(), {beyond(right, e0, 2), right, right_above, beyond(f0, right_above, 1),
                                 above_right, above, beyond(e1, above, 1)});
    return around;
  }

  [[nodiscard]] Face around_triangle(std::uint32_t v, std::uint32_t e0) const {
    Face around{v};
    std::uint32_t spoke = e0;
    for (std::size_t i = 0; i < valence_[v]; ++i) {
      around.push_back(spoke);
      spoke = beyond(v, spoke, 1);
    }
    const std::uint32_t e1 = around[2], last = around[valence_[v]];
    const std::uint32_t p = beyond(e0, last, 1), r = beyond(e1, e0, 1), q = beyond(e0, p, 1),
                        s = beyond(e1, r, 1), t = beyond(e1, s, 1);
    around.insert(around.end(), {p, q, r, s, t});
    return around;
  }
};

}  // namespace

template <int D>
PlacedPatches<D> place(const model::SubdivisionSurface& surface, const Transformer<D>& placement) {
  const bool triangles = surface.scheme == model::SubdivisionSurface::Scheme::loop;
  PlacedPoints<D> placed(surface.points, D, placement);
  placed.choose_frame();
  std::vector<std::array<double, D>> points;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    auto& point = points.emplace_back();
    for (std::size_t j = 0; j < D; ++j) point[j] = static_cast<double>(placed[i][j]);
  }
  ControlMesh<D> mesh(std::move(points), surface.faces);
  const std::size_t valence = mesh.largest_valence();
  mesh = triangles ? mesh.quartered() : mesh.quadrangulated().quadrangulated();
  PlacedPatches<D> result;
  for (std::size_t face = 0; face < mesh.faces(); ++face) result.roots.push_back(mesh.patch(face, triangles));
  result.placement = placed.frame();
  std::size_t corners = valence;  // of the largest face, too
  for (const auto& face : surface.faces) corners = std::max(corners, face.size());
  result.error = placed.error() + 32 * static_cast<double>(corners + 8) * 0x1p-53;
  result.closed = D == 3;
  return result;
}

template <int D>
Box<D> bounds_of(const model::SubdivisionSurface& surface) {
  Box<D> box = Box<D>::empty();
  for (std::size_t at = 0; at < surface.points.size(); at += D) {
    std::array<double, D> point;
    std::copy_n(surface.points.begin() + static_cast<std::ptrdiff_t>(at), D, point.begin());
    box.unite({point, point});
  }
  return box;
}

#define BSP2_INSTANTIATE(D)                                                                    \
  template PlacedPatches<D> place<D>(const model::SubdivisionSurface&, const Transformer<D>&); \
  template Box<D> bounds_of<D>(const model::SubdivisionSurface&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
