#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "builder/node_making.hpp"

namespace bsp2::model {
namespace {

constexpr std::uint32_t most_degree = 15;
constexpr double most_weight_ratio = 0x1p20;

/// @return how many control points go with the knots.
std::size_t check_knots(const std::vector<double>& knots, std::uint32_t degree) {
  if (degree < 1 || degree > most_degree)
    throw Error("spline: a degree of " + std::to_string(degree) + "; it takes 1 to " +
                std::to_string(most_degree));
  require_finite(knots, "spline");
  if (knots.size() < 2 * std::size_t{degree} + 2)
    throw Error("spline: " + counted(knots.size(), "# knot[s]; degree ") + std::to_string(degree) +
                " takes at least " + std::to_string(2 * degree + 2));
  if (!std::is_sorted(knots.begin(), knots.end())) throw Error("spline: the knots do not ascend");
  const std::size_t count = knots.size() - degree - 1;
  if (!(knots[degree] < knots[count])) throw Error("spline: all knots of the domain are equal");
  for (std::size_t i = 1; i + degree + 1 < knots.size(); ++i)
    if (knots[i] == knots[i + degree] && knots[i] > knots[degree] && knots[i] < knots[count])
      throw Error("spline: the knot " + std::to_string(knots[i]) + " comes more than " +
                  counted(degree, "# time[s]: the map is torn there"));
  return count;
}

void check_piece(int dimension, const Spline::Piece& piece) {
  const std::size_t parameters = piece.degrees.size();
  if (parameters < 1 || parameters > static_cast<std::size_t>(dimension))
    throw Error("spline: " + counted(parameters, "# parameter[s] in ") +
                counted(dimension, "# dimension[s]"));
  if (piece.knots.size() != parameters)
    throw Error("spline: " + counted(piece.knots.size(), "# list[s] of knots for ") +
                counted(parameters, "# parameter[s]"));
  std::size_t count = 1;
  std::string shape;
  for (std::size_t j = 0; j < parameters; ++j) {
    const std::size_t along = check_knots(piece.knots[j], piece.degrees[j]);
    count *= along;
    shape += (j == 0 ? "" : " x ") + std::to_string(along);
  }
  const std::size_t stride = static_cast<std::size_t>(dimension) + 1;
  if (piece.points.size() != count * stride)
    throw Error("spline: " + std::to_string(piece.points.size() / stride) +
                " control points; degrees and knots ask for " + shape);
  require_finite(piece.points, "spline");
}

void check_weights(int dimension, const std::vector<Spline::Piece>& pieces) {
  const std::size_t stride = static_cast<std::size_t>(dimension) + 1;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const auto& piece : pieces)
    for (std::size_t at = stride - 1; at < piece.points.size(); at += stride) {
      least = std::min(least, piece.points[at]);
      most = std::max(most, piece.points[at]);
    }
  if (!(least > 0)) throw Error("spline: weights have to be positive");
  if (most > most_weight_ratio * least) throw Error("spline: one weight is more than 2^20 times another");
}

std::string edge_text(std::uint32_t a, std::uint32_t b) {
  return "from point " + std::to_string(a) + " to point " + std::to_string(b);
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// From each edge to the next one around its first point, on its left.
std::map<Edge, Edge> fans_of(const std::vector<std::vector<std::uint32_t>>& faces) {
  std::map<Edge, Edge> next;
  for (const auto& face : faces)
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % face.size()],
                          before = face[(i + face.size() - 1) % face.size()];
      if (!next.emplace(Edge{a, b}, Edge{a, before}).second)
        throw Error("subdivision: two faces go along the edge " + edge_text(a, b) +
                    "; it takes one in either direction");
    }
  for (const auto& [edge, other] : next)
    if (!next.contains({edge.second, edge.first}))
      throw Error("subdivision: the mesh is open at the edge " + edge_text(edge.first, edge.second) +
                  "; it takes meshes without a border, all faces turned the same way");
  return next;
}

/// Around a point there is one fan of faces.
void check_fans(const std::map<Edge, Edge>& next) {
  for (auto first = next.begin(); first != next.end();) {
    const auto end = next.lower_bound({first->first.first + 1, 0});
    const auto count = std::distance(first, end);
    std::ptrdiff_t met = 0;
    Edge edge = first->first;
    do {
      edge = next.at(edge);
      ++met;
    } while (edge != first->first);
    if (met != count)
      throw Error("subdivision: parts of the mesh touch only in point " + std::to_string(first->first.first));
    if (count < 3)
      throw Error("subdivision: point " + std::to_string(first->first.first) + " has " +
                  counted(count, "# edge[s]; it takes 3 or more"));
    first = end;
  }
}

/// What has no size is empty. @param points the coordinates of one each `stride` numbers.
bool is_one_point(const std::vector<double>& points, std::size_t stride, std::span<const double> point) {
  for (std::size_t at = 0; at < points.size(); at += stride)
    if (!std::equal(point.begin(), point.end(), points.begin() + static_cast<std::ptrdiff_t>(at)))
      return false;
  return true;
}

}  // namespace

std::vector<double> clamped_knots(std::uint32_t degree, std::size_t count) {
  std::vector<double> knots(degree, 0.0);
  for (std::size_t i = 0; i + degree <= count; ++i) knots.push_back(static_cast<double>(i));
  knots.insert(knots.end(), degree, knots.back());
  return knots;
}

Expression spline(int dimension, std::vector<Spline::Piece> pieces) {
  if (dimension < 2 || dimension > geometry::most_dimensions)
    throw Error("spline: " + counted(dimension, "# dimension[s]; it takes 2 to ") +
                std::to_string(geometry::most_dimensions));
  if (pieces.empty()) return Expression(dimension);
  for (const auto& piece : pieces) {
    check_piece(dimension, piece);
    const auto solid = [&](const Spline::Piece& p) {
      return p.degrees.size() == static_cast<std::size_t>(dimension);
    };
    if (piece.degrees.size() != pieces.front().degrees.size() || solid(piece) != solid(pieces.front()))
      throw Error("spline: pieces of " + std::to_string(pieces.front().degrees.size()) + " and of " +
                  counted(piece.degrees.size(), "# parameter[s]"));
  }
  check_weights(dimension, pieces);
  const auto stride = static_cast<std::size_t>(dimension) + 1;
  const double* first = pieces.front().points.data();
  if (std::all_of(pieces.begin(), pieces.end(), [&](const Spline::Piece& piece) {
        return is_one_point(piece.points, stride, {first, stride - 1});
      }))
    return Expression(dimension);
  return make_node(dimension, Spline{std::move(pieces)});
}

Expression bezier(int dimension, std::vector<std::uint32_t> degrees, std::vector<double> points) {
  Spline::Piece piece{std::move(degrees), {}, std::move(points)};
  for (const std::uint32_t degree : piece.degrees)
    piece.knots.push_back(clamped_knots(degree, std::size_t{degree} + 1));
  return spline(dimension, {std::move(piece)});
}

Expression subdivision_surface(int dimension, SubdivisionSurface surface) {
  if (dimension < 3 || dimension > geometry::most_dimensions)
    throw Error("subdivision: " + counted(dimension, "# dimension[s]; it takes 3 to ") +
                std::to_string(geometry::most_dimensions));
  require_finite(surface.points, "subdivision");
  const auto stride = static_cast<std::size_t>(dimension);
  if (surface.points.size() % stride != 0)
    throw Error("subdivision: a point has other than " + counted(dimension, "# coordinate[s]"));
  if (surface.faces.empty()) return Expression(dimension);
  for (const auto& face : surface.faces) {
    if (face.size() < 3) throw Error("subdivision: a face has " + counted(face.size(), "# corner[s]"));
    if (surface.scheme == SubdivisionSurface::Scheme::loop && face.size() != 3)
      throw Error("subdivision: a face has " +
                  counted(face.size(), "# corner[s]; Loop's scheme takes triangles"));
    for (const std::uint32_t corner : face)
      if (corner >= surface.points.size() / stride)
        throw Error("subdivision: there is no point " + std::to_string(corner));
  }
  check_fans(fans_of(surface.faces));
  if (is_one_point(surface.points, stride, {surface.points.data(), stride})) return Expression(dimension);
  return make_node(dimension, std::move(surface));
}

}  // namespace bsp2::model
