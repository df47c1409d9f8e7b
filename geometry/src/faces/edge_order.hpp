#pragma once

#include <cstdint>
#include <span>

#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// A face at one of its edges.
struct FaceAtEdge {
  std::uint32_t use;  ///< its number
  bool forward;       ///< whether the face is on the left from the edge's lower end to its higher one
  const Skin::Face* face;
  const Vertex<3>* apex;  ///< a point of the face beside the edge: a corner of the triangle there
};

/// Puts the faces about an edge in order: counter-clockwise, seen from its higher end. Which end is the
/// higher one the caller says; seen from the other end the same faces follow each other the other way round.
/// Thread rule: one thread at a time.
class EdgeOrder {
 public:
  explicit EdgeOrder(ExactPoints& exact) : exact_(exact) {}

  /// From the first one on, which stays.
  void sort(std::span<FaceAtEdge> faces);
  /// From one face to the next one, in [0, 2 pi]. How far it is to the nearer side, their normals tell; on
  /// which side that is, the predicate.
  [[nodiscard]] double angle(const FaceAtEdge& face, const FaceAtEdge& next);
  /// Whether all faces that follow each other have the same part between them. If not, these are several
  /// edges whose ends have become the same by rounding.
  [[nodiscard]] static bool are_about_one_edge(std::span<const FaceAtEdge> faces);
  /// Puts the faces of several edges in pairs that have a part between them, like brackets. @return whether
  /// that can be done; if not, they stay as they are.
  [[nodiscard]] static bool make_pairs(std::span<FaceAtEdge> faces);

 private:
  ExactPoints& exact_;

  [[nodiscard]] int side(const FaceAtEdge& of, const FaceAtEdge& other);
  [[nodiscard]] int quarter(const FaceAtEdge& of, const FaceAtEdge& other);
};

}  // namespace bsp2::geometry
