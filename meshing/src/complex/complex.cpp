#include "bsp2/meshing/complex/complex.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "complex/plane_overlay.hpp"

// 1. Corners of cells are named by three hyperplanes, as resolution has them (docs/resolution.md), and those
//    that are one point are made one.
// 2. Hyperplane by hyperplane the facets of the cells on its two sides are laid over each other.
// 3. Each edge of what comes of that is divided at every point that lies on it.

namespace bsp2::meshing {
namespace {

using geometry::ExactPoints;
using geometry::FacetIndex;
using geometry::FacetSet;
using geometry::HyperplaneId;
using geometry::OrientedHyperplane;

class ComplexMaker {
 public:
  ComplexMaker(const geometry::HyperplaneTable<3>& table,
               std::span<const std::shared_ptr<const geometry::CellBatch>> batches)
      : table_(table), index_(table, batches), exact_(table), points_(exact_) {
    for (const auto& batch : batches)
      for (std::size_t cell = 0; cell < batch->size(); ++cell) {
        const bool is_in = batch->label[cell] == geometry::Label::in;
        number_.push_back(is_in ? static_cast<std::int32_t>(complex_.part.size()) : Complex::outside);
        if (is_in) complex_.part.push_back(batch->part[cell]);
      }
  }

  Complex run() {
    name_points();
    order_cells();
    lay_over();
    const std::vector<std::uint32_t> map = points_.unify();
    for (Face& face : faces_) {
      Polygon& polygon = face.piece.polygon;
      for (PolygonCorner& corner : polygon) corner.point = map[corner.point];
      // Where a cycle begins depends on who wrote the cell.
      const auto by_point = [](const PolygonCorner& x, const PolygonCorner& y) { return x.point < y.point; };
      std::rotate(polygon.begin(), std::min_element(polygon.begin(), polygon.end(), by_point), polygon.end());
    }
    std::sort(faces_.begin(), faces_.end());
    write_faces();
    drop_unused_points();
    return std::move(complex_);
  }

 private:
  struct Face {
    HyperplaneId plane;
    PlanePiece piece;
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> order() const {
      // The outside is the last of all.
      return std::minmax(static_cast<std::uint32_t>(piece.negative),
                         static_cast<std::uint32_t>(piece.positive));
    }
    /// A total one: several faces may be between a cell and the outside.
    friend bool operator<(const Face& a, const Face& b) {
      const auto key = [](const Face& face) {
        const Polygon& polygon = face.piece.polygon;
        return std::tuple(face.order(), face.plane, polygon[0].point, polygon[1].point, polygon[2].point);
      };
      return key(a) < key(b);
    }
  };
  /// An edge of faces: from the lower point to the higher one.
  struct Side {
    std::uint32_t low, high;
    HyperplaneId plane, across;
  };

  const geometry::HyperplaneTable<3>& table_;
  FacetIndex index_;
  ExactPoints exact_;
  PointRegister points_;
  std::vector<std::int32_t> number_;    // of each cell of the batches among those of the complex
  std::vector<PolygonCorner> corners_;  // of all facets, plane by plane
  std::vector<Face> faces_;
  std::vector<Side> sides_;                         // by their ends, each once
  std::vector<std::uint32_t> first_inner_, inner_;  // by side: points on it, from the lower end on
  Complex complex_;

  void name_points() {
    FacetSet set;
    for (std::size_t i = 0; i < index_.size(); ++i) {
      geometry::Interruption::check();
      set.clear(index_.hyperplane(i));
      index_.append(i, set);
      for (std::size_t facet = 0; facet < set.facets.size(); ++facet) {
        const auto corners = set.corners_of(facet);
        for (std::size_t k = 0; k < corners.size(); ++k) {
          const OrientedHyperplane before = corners[(k + corners.size() - 1) % corners.size()].across;
          corners_.push_back(
              {points_.find(set.hyperplane, before.id(), corners[k].across.id()), corners[k].across});
        }
      }
    }
    const std::vector<std::uint32_t> map = points_.unify();
    for (PolygonCorner& corner : corners_) corner.point = map[corner.point];
  }

  /// Cells by their points: batches come in an order that depends on who computed what.
  void order_cells() {
    std::vector<std::vector<std::uint32_t>> points(complex_.part.size());
    FacetSet set;
    for (std::size_t i = 0, at = 0; i < index_.size(); ++i) {
      geometry::Interruption::check();
      set.clear(index_.hyperplane(i));
      index_.append(i, set);
      for (std::size_t facet = 0; facet < set.facets.size(); ++facet)
        for (std::size_t k = set.corners_of(facet).size(); k > 0; --k)
          points[static_cast<std::size_t>(number_.at(set.facets[facet].cell))].push_back(
              corners_[at++].point);
    }
    std::vector<std::uint32_t> order(points.size());
    for (std::uint32_t cell = 0; cell < points.size(); ++cell) {
      order[cell] = cell;
      std::sort(points[cell].begin(), points[cell].end());
      points[cell].erase(std::unique(points[cell].begin(), points[cell].end()), points[cell].end());
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return points[a] < points[b]; });
    std::vector<std::int32_t> place(points.size()), part;
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      place[order[i]] = static_cast<std::int32_t>(i);
      part.push_back(complex_.part[order[i]]);
    }
    complex_.part = std::move(part);
    for (std::int32_t& number : number_)
      if (number != Complex::outside) number = place[static_cast<std::size_t>(number)];
  }

  void lay_over() {
    FacetSet set;
    std::vector<PlaneFacet> facets;
    std::vector<PlanePiece> pieces;
    PlaneOverlay overlay(exact_, points_);
    std::size_t at = 0;
    for (std::size_t i = 0; i < index_.size(); ++i) {
      geometry::Interruption::check();
      set.clear(index_.hyperplane(i));
      index_.append(i, set);
      facets.clear();
      pieces.clear();
      for (std::size_t facet = 0; facet < set.facets.size(); ++facet) {
        const std::size_t count = set.corners_of(facet).size();
        const FacetSet::Facet& source = set.facets[facet];
        facets.push_back({number_.at(source.cell), source.positive,
                          upright(set.hyperplane, std::span(corners_).subspan(at, count))});
        at += count;
      }
      overlay.run(set.hyperplane, facets, pieces);
      for (PlanePiece& piece : pieces) faces_.push_back({set.hyperplane, std::move(piece)});
    }
    corners_ = {};
  }

  /// Counter-clockwise seen from the plane's positive side. A cell that is as thin as its corners are rounded
  /// may have been written inside out, so the order is asked for exactly.
  Polygon upright(HyperplaneId plane, std::span<const PolygonCorner> corners) {
    Polygon polygon(corners.begin(), corners.end());
    const auto& vertices = points_.points().vertices;
    const geometry::PlaneFrame frame(exact_, geometry::oriented(plane));
    if (frame.orientation(vertices[polygon[0].point], vertices[polygon[1].point],
                          vertices[polygon[2].point]) > 0)
      return polygon;
    std::reverse(polygon.begin(), polygon.end());
    // The edge that began at a corner now ends there.
    const OrientedHyperplane first = polygon.front().across;
    for (std::size_t k = 0; k + 1 < polygon.size(); ++k) polygon[k].across = polygon[k + 1].across;
    polygon.back().across = first;
    return polygon;
  }

  void write_faces() {
    const std::vector<std::uint32_t> side_of = find_sides();
    divide_sides();
    std::vector<std::uint32_t> cycle;
    auto next = side_of.begin();
    for (const Face& face : faces_) {
      geometry::Interruption::check();
      cycle.clear();
      for (const PolygonCorner& corner : face.piece.polygon) {
        const std::uint32_t side = *next++;
        cycle.push_back(corner.point);
        const auto inner =
            std::span(inner_).subspan(first_inner_[side], first_inner_[side + 1] - first_inner_[side]);
        if (corner.point == sides_[side].low)
          cycle.insert(cycle.end(), inner.begin(), inner.end());
        else
          cycle.insert(cycle.end(), inner.rbegin(), inner.rend());
      }
      add_face(face, cycle);
    }
  }

  /// Each edge of the faces once, by its ends. @return which of them the edges of each face are, one face
  /// after the other.
  std::vector<std::uint32_t> find_sides() {
    std::vector<Side> edges;
    std::vector<std::uint32_t> begin(points_.points().size() + 1, 0);  // of those with each lower end
    for (const Face& face : faces_) {
      const Polygon& polygon = face.piece.polygon;
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const auto [low, high] = std::minmax(polygon[k].point, polygon[(k + 1) % polygon.size()].point);
        if (low == high) throw std::logic_error("an edge of a face has one end only");
        edges.push_back({low, high, face.plane, polygon[k].across.id()});
        ++begin[low + 1];
      }
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted(edges.size());  // higher end, edge
    for (std::uint32_t i = 0; i < edges.size(); ++i) sorted[begin[edges[i].low]++] = {edges[i].high, i};
    std::vector<std::uint32_t> side_of(edges.size());
    std::size_t first = 0;
    for (const std::uint32_t end : begin) {
      if (end == first) continue;
      std::sort(&sorted[first], sorted.data() + end);
      for (std::size_t i = first; i < end; ++i) {
        if (i == first || sorted[i].first != sorted[i - 1].first) sides_.push_back(edges[sorted[i].second]);
        side_of[sorted[i].second] = static_cast<std::uint32_t>(sides_.size() - 1);
      }
      first = end;
    }
    return side_of;
  }

  /// Finds all points that lie on sides, from the lower end of each on.
  void divide_sides() {
    std::vector<geometry::Skin::Face> carriers;
    geometry::EdgeChain chain;
    for (std::uint32_t i = 0; i < sides_.size(); ++i) {
      carriers.push_back({geometry::oriented(sides_[i].plane), 0});
      chain.push_back({sides_[i].low, sides_[i].high, i, sides_[i].across});
    }
    geometry::EdgeSplitter(exact_).split(points_.points(), carriers, chain);
    first_inner_.assign(sides_.size() + 1, 0);
    for (const geometry::Skin::Edge& edge : chain) {
      if (edge.from == sides_[edge.face].low) continue;
      inner_.push_back(edge.from);
      ++first_inner_[edge.face + 1];
    }
    std::partial_sum(first_inner_.begin(), first_inner_.end(), first_inner_.begin());
  }

  void add_face(const Face& face, std::vector<std::uint32_t>& cycle) {
    const auto [owner, neighbour] = face.order();
    const bool is_reversed = static_cast<std::uint32_t>(face.piece.negative) != owner;
    if (is_reversed) std::reverse(cycle.begin(), cycle.end());
    complex_.face_points.insert(complex_.face_points.end(), cycle.begin(), cycle.end());
    complex_.face_offset.push_back(static_cast<std::uint32_t>(complex_.face_points.size()));
    complex_.owner.push_back(static_cast<std::int32_t>(owner));
    complex_.neighbour.push_back(static_cast<std::int32_t>(neighbour));
    complex_.plane.push_back(face.plane);
    Point normal = table_.rounded(face.plane).normal;
    if (is_reversed)
      for (double& x : normal) x = -x;
    complex_.outward.push_back(normal);
  }

  void drop_unused_points() {
    const auto& vertices = points_.points().vertices;
    std::vector<std::uint32_t> map(vertices.size(), ~0U);
    for (std::uint32_t& point : complex_.face_points) {
      if (map[point] == ~0U) {
        map[point] = static_cast<std::uint32_t>(complex_.points.size());
        complex_.points.push_back(vertices[point].x);
        for (double& x : complex_.points.back()) x += 0.0;  // no -0
      }
      point = map[point];
    }
  }
};

}  // namespace

Complex conforming_complex(const geometry::HyperplaneTable<3>& table,
                           std::span<const std::shared_ptr<const geometry::CellBatch>> batches) {
  return ComplexMaker(table, batches).run();
}

}  // namespace bsp2::meshing
