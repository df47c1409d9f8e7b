#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bsp2/dataflow/shapes/lathe.hpp"
#include "bsp2/dataflow/shapes/round_solids.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "process/transformer.hpp"
#include "producers/lathe_shape.hpp"
#include "shapes/mesh_shape.hpp"

namespace bsp2::dataflow {

/// A primitive's shape in a normalized frame, shared by all that have it: all boxes, say.
template <int D>
struct Shape {
  std::uint32_t first_covector = 0, covector_count = 0;
  std::vector<std::pair<double, double>>
      rings;                                // lathe: radius and z, in the normalized frame; otherwise empty
  Box<D> bounds;                            // in the normalized frame
  std::shared_ptr<const LatheShape> lathe;  // of one with very many facets; shared: by all occurrences of it
  std::shared_ptr<const TurnedShape> turned;  // likewise, of any lathe
  std::shared_ptr<const MeshShape> mesh;      // shared: by all occurrences of one mesh
  std::optional<int> ball_axes;               // of a unit ball of so many axes times a box
  /// Of a round solid: places it, with at most so many hyperplanes of the table, by the map of this number.
  std::function<RoundSolid<D>(geometry::HyperplaneTable<D>&, std::uint32_t map, std::uint32_t limit)>
      place_round;
  const model::Spline* spline = nullptr;  // its patches are placed, not its shape
  const model::SubdivisionSurface* subdivision = nullptr;
  const model::Preimage* preimage = nullptr;
  bool undecided = false;
  [[nodiscard]] bool is_spline() const { return spline != nullptr || subdivision != nullptr; }
  /// Whether it is where all of its half-spaces are; of a lathe there are more hyperplanes, which bound
  /// nothing.
  [[nodiscard]] bool is_convex() const { return !is_round() && !(mesh && !mesh->convex); }
  [[nodiscard]] bool is_round() const { return place_round || is_spline() || preimage != nullptr; }
};

/// What a primitive is made of.
template <int D>
struct Framed {
  std::uint32_t shape;
  Transformer<D> frame;  // from the shape's normalized frame to the primitive's own
};

/// The shapes of a model's primitives, and their covectors, each once.
template <int D>
class Shapes {
 public:
  /// Works out what primitives are made of; meshes on several threads, as they take longest.
  void prepare(std::span<const model::Primitive* const> primitives, unsigned threads);
  /// What a primitive is made of that was prepared. Any number of threads may ask.
  [[nodiscard]] Framed<D> of(const model::Primitive& primitive) const;
  [[nodiscard]] const Shape<D>& operator[](std::uint32_t shape) const { return shapes_[shape]; }
  /// Gives those of all shapes away: nothing may be prepared after that.
  [[nodiscard]] std::vector<geometry::Covector<D>> take_covectors() { return std::move(covectors_); }

 private:
  std::vector<geometry::Covector<D>> covectors_;
  std::vector<Shape<D>> shapes_;
  std::unordered_map<const model::Primitive*, Framed<D>> by_node_;
  std::unordered_map<const model::TriangleMesh*, std::shared_ptr<MeshShape>>
      meshes_;  // whose shapes are still to be made
  std::map<std::vector<double>, std::uint32_t>
      known_;                         // lathes by sides and normalized rings, regular polygons by sides
  std::optional<std::uint32_t> box_;  // the shape of all cuboids

  void prepare_meshes(std::span<const model::Primitive* const> primitives, unsigned threads);
  std::uint32_t add(Shape<D> shape);
  void add_covectors(Shape<D>& shape, const std::vector<geometry::Covector<D>>& covectors);
  void make_box();
  Framed<D> make(const model::Lathe& lathe);
  Framed<D> make(const model::TriangleMesh& mesh);
  Framed<D> make(const model::RegularPolygon& polygon);
  Framed<D> make(const model::ConvexPolygon& polygon);
  /// Of a round solid.
  template <typename Primitive>
  Framed<D> make(const Primitive& primitive);
  Framed<D> make(const model::Polytope& polytope);
  Framed<D> make(const model::Spline& spline) { return make_patches(spline, &Shape<D>::spline); }
  Framed<D> make(const model::SubdivisionSurface& surface) {
    return make_patches(surface, &Shape<D>::subdivision);
  }
  Framed<D> make(const model::Preimage& preimage);
  /// @param of the field of a shape that holds the surface.
  template <typename Surface>
  Framed<D> make_patches(const Surface& surface, const Surface* Shape<D>::*of);
};

}  // namespace bsp2::dataflow
