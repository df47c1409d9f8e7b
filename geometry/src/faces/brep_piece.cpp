#include "faces/brep_piece.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "faces/edge_order.hpp"
#include "faces/face_maker.hpp"
#include "support/counted_order.hpp"
#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

/// The edges of a piece's faces, and the faces about each where no other piece may have some of them.
class EdgeMaker {
 public:
  EdgeMaker(ExactPoints& exact, const TriangulatedSkin& skin, std::span<const BoundOfFace> bounds,
            const IsShared& is_shared, BrepPiece& piece)
      : order_(exact), skin_(skin), bounds_(bounds), is_shared_(is_shared), piece_(piece) {}

  void run() {
    const auto ends = [&](std::uint32_t use) {
      const BoundOfFace& bound = bounds_[use];
      return std::tuple(std::min(bound.from, bound.to), std::max(bound.from, bound.to));
    };
    const auto by_ends = counted_order(
        bounds_.size(), [&](std::size_t i) { return std::min(bounds_[i].from, bounds_[i].to); },
        [&](std::uint32_t a, std::uint32_t b) {
          return std::tuple_cat(ends(a), std::tuple(a)) < std::tuple_cat(ends(b), std::tuple(b));
        });
    piece_.uses_of_edges.reserve(bounds_.size());
    for (std::size_t begin = 0, end = 0; begin < by_ends.size(); begin = end) {
      while (end < by_ends.size() && ends(by_ends[end]) == ends(by_ends[begin])) ++end;
      add_edge(std::span(by_ends).subspan(begin, end - begin));
    }
  }

 private:
  EdgeOrder order_;
  const TriangulatedSkin& skin_;
  std::span<const BoundOfFace> bounds_;
  const IsShared& is_shared_;
  BrepPiece& piece_;
  std::vector<FaceAtEdge> faces_;  // at the edge at hand

  void add_edge(std::span<const std::uint32_t> uses) {
    faces_.clear();
    for (const std::uint32_t use : uses) {
      const auto& [from, to, apex, face] = bounds_[use];
      faces_.push_back({use, from < to, &skin_.faces[face], &skin_.points.vertices[apex]});
    }
    const BoundOfFace& bound = bounds_[uses.front()];
    const auto count = static_cast<std::uint32_t>(uses.size());
    if (!(is_shared_(bound.from) && is_shared_(bound.to))) {
      order_.sort(faces_);
      if (EdgeOrder::are_about_one_edge(faces_)) {
        add_decided();
        return;
      }
    }
    piece_.edges.push_back({count, BrepPiece::Edge::Order::open});
    for (const std::uint32_t use : uses) {
      piece_.uses_of_edges.push_back(use);
      piece_.apexes.push_back(skin_.points.vertices[bounds_[use].apex].hyperplanes);
    }
  }

  void add_decided() {
    piece_.edges.push_back(
        {static_cast<std::uint32_t>(faces_.size()),
         faces_.front().forward ? BrepPiece::Edge::Order::forward : BrepPiece::Edge::Order::backward});
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      piece_.uses_of_edges.push_back(faces_[i].use);
      piece_.angles.push_back(order_.angle(faces_[i], faces_[(i + 1) % faces_.size()]));
    }
  }
};

}  // namespace

SurfacePiece surface_piece_of(TriangulatedSkin&& skin, const IsShared& is_shared) {
  SurfacePiece piece;
  for (std::uint32_t i = 0; i < skin.point_of_surface.size(); ++i)
    if (const std::uint32_t point = skin.point_of_surface[i]; is_shared(point))
      piece.shared.push_back({i, skin.points.vertices[point].hyperplanes});
  const auto& face_of = skin.face_of_triangle;
  for (std::size_t begin = 0, end = 0; begin < face_of.size(); begin = end) {
    while (end < face_of.size() && face_of[end] == face_of[begin]) ++end;
    piece.faces.push_back({skin.faces[face_of[begin]], static_cast<std::uint32_t>(end - begin)});
  }
  piece.points = std::move(skin.surface.points);
  piece.triangles = std::move(skin.surface.triangles);
  return piece;
}

BrepPiece brep_piece_of(ExactPoints& exact, TriangulatedSkin&& skin, const IsShared& is_shared) {
  BrepPiece piece;
  const std::vector<BoundOfFace> bounds = make_faces(exact, skin, piece);
  std::vector<std::uint32_t> number(skin.points.size(), none);
  for (std::uint32_t i = 0; i < skin.point_of_surface.size(); ++i) number[skin.point_of_surface[i]] = i;
  piece.uses.reserve(bounds.size());
  for (const BoundOfFace& bound : bounds) piece.uses.push_back(number[bound.from]);
  EdgeMaker(exact, skin, bounds, is_shared, piece).run();
  piece.surface = surface_piece_of(std::move(skin), is_shared);
  return piece;
}

}  // namespace bsp2::geometry
