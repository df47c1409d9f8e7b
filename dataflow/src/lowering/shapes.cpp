#include "lowering/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "producers/lathe_producer.hpp"
#include "shapes/spline_shape.hpp"

namespace bsp2::dataflow {

using geometry::Polytope;

namespace {

/// Scale and origin of a polytope's normalized frame, in which coordinates are of the order of 1. The origin
/// stays where it is if it is near, so that simple numbers stay simple.
template <int D>
std::pair<std::array<double, D>, std::array<double, D>> frame_of(const model::Polytope& polytope) {
  double far = 0, extent = 0;
  for (std::size_t i = 0; i < polytope.corners.size(); ++i) {
    far = std::max(far, std::fabs(polytope.corners[i]));
    extent = std::max(extent, std::fabs(polytope.corners[i] - polytope.corners[i % D]));
  }
  std::pair<std::array<double, D>, std::array<double, D>> frame{};
  const bool moves = far > 256 * extent;
  if (moves) std::copy_n(polytope.corners.begin(), D, frame.second.begin());
  const double size = moves ? extent : far;
  frame.first.fill(size > 0 ? std::ldexp(1.0, std::ilogb(size) + 1) : 1.0);  // of one point there is no size
  return frame;
}

}  // namespace

template <int D>
Framed<D> Shapes<D>::of(const model::Primitive& primitive) const {
  const auto* const cuboid = std::get_if<model::Cuboid>(&primitive);
  if (cuboid == nullptr) return by_node_.at(&primitive);
  std::array<double, D> size;
  std::copy_n(cuboid->size.begin(), D, size.begin());
  return {box_.value(), Transformer<D>::scaling(size)};
}

template <int D>
void Shapes<D>::prepare(std::span<const model::Primitive* const> primitives, unsigned threads) {
  prepare_meshes(primitives, threads);
  const auto make_new = [&]<typename Kind>(const model::Primitive* primitive, const Kind& kind) {
    if constexpr (std::is_same_v<Kind, model::Cuboid>)
      make_box();
    else if (!by_node_.contains(primitive))
      by_node_.emplace(primitive, make(kind));
  };
  for (const model::Primitive* primitive : primitives)
    std::visit([&](const auto& kind) { make_new(primitive, kind); }, *primitive);
}

template <int D>
void Shapes<D>::prepare_meshes(std::span<const model::Primitive* const> primitives, unsigned threads) {
  meshes_.clear();
  std::vector<std::pair<const model::TriangleMesh*, std::shared_ptr<MeshShape>*>>
      meshes;  // elements of a map keep their place
  for (const model::Primitive* primitive : primitives) {
    const auto* mesh = std::get_if<model::TriangleMesh>(primitive);
    if (mesh == nullptr || by_node_.contains(primitive)) continue;
    const auto [place, is_new] = meshes_.try_emplace(mesh);
    if (is_new) meshes.emplace_back(mesh, &place->second);
  }
  constexpr std::size_t grain = 8;
  geometry::for_each_range(meshes.size(), grain, threads, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      *meshes[i].second = std::make_shared<MeshShape>(*meshes[i].first);
  });
  std::size_t count = covectors_.size();
  for (const auto& mesh : meshes) count += (*mesh.second)->covectors.size();
  if (count > covectors_.capacity()) covectors_.reserve(std::max(count, 2 * covectors_.capacity()));
}

template <int D>
std::uint32_t Shapes<D>::add(Shape<D> shape) {
  shapes_.push_back(std::move(shape));
  return static_cast<std::uint32_t>(shapes_.size() - 1);
}

template <int D>
void Shapes<D>::add_covectors(Shape<D>& shape, const std::vector<geometry::Covector<D>>& covectors) {
  shape.first_covector = static_cast<std::uint32_t>(covectors_.size());
  shape.covector_count = static_cast<std::uint32_t>(covectors.size());
  covectors_.insert(covectors_.end(), covectors.begin(), covectors.end());
}

template <int D>
void Shapes<D>::make_box() {
  if (box_) return;
  Shape<D> shape;
  const Polytope<D> box = geometry::unit_box<D>();
  add_covectors(shape, box.covectors);
  shape.bounds = {box.lower, box.upper};
  box_ = add(std::move(shape));
}

template <int D>
Framed<D> Shapes<D>::make(const model::Lathe& lathe) {
  if constexpr (D != 3) {
    throw std::logic_error("a lathe is three-dimensional");
  } else {
    double widest = 0;
    for (const auto& ring : lathe.rings) widest = std::max(widest, ring.radius);
    const double bottom = lathe.rings.front().z, height = lathe.rings.back().z - bottom;
    std::vector<double> radius, z, key{static_cast<double>(lathe.sides)};
    for (const auto& ring : lathe.rings) {
      radius.push_back(ring.radius / widest);
      z.push_back((ring.z - bottom) / height);
      key.insert(key.end(), {radius.back(), z.back()});
    }
    const auto [entry, is_new] =
        known_.try_emplace(std::move(key), static_cast<std::uint32_t>(shapes_.size()));
    if (is_new) {
      Shape<D> shape;
      Polytope<3> polytope = geometry::lathe(lathe.sides, radius, z);
      if (polytope.covectors.size() >= LatheProducer::least_facets)
        shape.lathe = std::make_shared<LatheShape>(lathe.sides, radius, z, polytope.covectors);
      add_covectors(shape, polytope.covectors);
      shape.bounds = {polytope.lower, polytope.upper};
      for (std::size_t i = 0; i < radius.size(); ++i) shape.rings.emplace_back(radius[i], z[i]);
      shape.turned =
          std::make_shared<const TurnedShape>(TurnedShape{shape.first_covector, lathe.sides, shape.rings});
      add(std::move(shape));
    }
    return {entry->second, Transformer<3>::scaling({widest, widest, height}, {0, 0, bottom})};
  }
}

template <int D>
Framed<D> Shapes<D>::make(const model::TriangleMesh& mesh) {
  if constexpr (D != 3) {
    throw std::logic_error("a triangle mesh is three-dimensional");
  } else {
    Shape<D> shape;
    std::shared_ptr<MeshShape> normalized = std::move(meshes_.at(&mesh));
    add_covectors(shape, normalized->covectors);
    normalized->covectors.clear();
    normalized->covectors.shrink_to_fit();
    const Transformer<3> frame = Transformer<3>::scaling(
        {normalized->scale, normalized->scale, normalized->scale}, normalized->origin);
    shape.bounds = {normalized->lower, normalized->upper};
    shape.mesh = std::move(normalized);
    return {add(std::move(shape)), frame};
  }
}

template <int D>
Framed<D> Shapes<D>::make(const model::RegularPolygon& polygon) {
  if constexpr (D != 2) {
    throw std::logic_error("a regular polygon is two-dimensional");
  } else {
    const auto [entry, is_new] =
        known_.try_emplace({static_cast<double>(polygon.sides)}, static_cast<std::uint32_t>(shapes_.size()));
    if (is_new) {
      Shape<D> shape;
      const Polytope<2> polytope = geometry::regular_polygon(polygon.sides);
      add_covectors(shape, polytope.covectors);
      shape.bounds = {polytope.lower, polytope.upper};
      add(std::move(shape));
    }
    return {entry->second, Transformer<2>::scaling({polygon.radius, polygon.radius})};
  }
}

template <int D>
Framed<D> Shapes<D>::make(const model::ConvexPolygon& polygon) {
  if constexpr (D != 2 && D != 3) {
    throw std::logic_error("a convex polygon is two- or three-dimensional");
  } else {
    std::vector<std::array<std::int64_t, 2>> points;
    for (const auto& point : polygon.points) {
      auto& on_grid = points.emplace_back();
      for (int i = 0; i < 2; ++i) on_grid[i] = std::llround(std::ldexp(point[i] / polygon.scale, 53));
    }
    const Polytope<D> polytope = geometry::convex_polygon<D>(points);
    Shape<D> shape;
    add_covectors(shape, polytope.covectors);
    shape.bounds = {polytope.lower, polytope.upper};
    std::array<double, D> factors;
    factors.fill(1);
    factors[0] = factors[1] = polygon.scale;
    return {add(std::move(shape)), Transformer<D>::scaling(factors)};
  }
}

template <int D>
template <typename Primitive>
Framed<D> Shapes<D>::make(const Primitive& primitive) {
  using Solid = Placed<D, Primitive>;
  if constexpr (std::is_void_v<Solid>) {
    throw std::logic_error("a round solid of another dimension than there is");
  } else {
    const RoundFrame<D> frame = Solid::frame(primitive);
    Shape<D> shape;
    shape.bounds = frame.bounds;
    shape.ball_axes = frame.ball_axes;
    shape.place_round = [&primitive](geometry::HyperplaneTable<D>& table, std::uint32_t map,
                                     std::uint32_t limit) {
      return RoundSolid<D>(Solid::place(primitive, table, map, limit));
    };
    add_covectors(shape, frame.half_spaces);
    return {add(std::move(shape)), Transformer<D>::scaling(frame.factors)};
  }
}

/// Coefficients of 60 bits: the half-spaces are within 2^-60 of what they were.
template <int D>
Framed<D> Shapes<D>::make(const model::Polytope& polytope) {
  Shape<D> shape;
  const auto frame = frame_of<D>(polytope);
  shape.undecided = polytope.undecided;
  std::vector<geometry::Covector<D>> covectors;
  for (std::size_t at = 0; at < polytope.half_spaces.size(); at += D + 1) {
    std::array<long double, D + 1> row{};
    row[D] = static_cast<long double>(polytope.half_spaces[at + D]);
    long double largest = 0;
    for (int i = 0; i < D; ++i) {
      const auto normal = static_cast<long double>(polytope.half_spaces[at + static_cast<std::size_t>(i)]);
      row[i] = normal * frame.first[i];
      row[D] += normal * frame.second[i];
    }
    for (const long double x : row) largest = std::max(largest, std::fabs(x));
    const int exponent = 60 - std::ilogb(largest) - 1;
    std::array<geometry::LocalInteger, D + 1> exact;
    for (int i = 0; i <= D; ++i)
      exact[i] = static_cast<std::int64_t>(std::llround(std::ldexp(row[i], exponent)));
    covectors.push_back(geometry::make_covector<D>(exact));
  }
  add_covectors(shape, covectors);
  shape.bounds.lower.fill(std::numeric_limits<double>::infinity());
  shape.bounds.upper.fill(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < polytope.corners.size(); ++i) {
    const std::size_t axis = i % D;
    const double x = (polytope.corners[i] - frame.second[axis]) / frame.first[axis];
    const double slack = 0x1p-30;  // the corners of the half-spaces are not quite those that are given
    shape.bounds.lower[axis] = std::min(shape.bounds.lower[axis], x - slack);
    shape.bounds.upper[axis] = std::max(shape.bounds.upper[axis], x + slack);
  }
  return {add(std::move(shape)), Transformer<D>::scaling(frame.first, frame.second)};
}

template <int D>
template <typename Surface>
Framed<D> Shapes<D>::make_patches(const Surface& surface, const Surface* Shape<D>::*of) {
  Shape<D> shape;
  shape.*of = &surface;
  shape.bounds = bounds_of<D>(surface);
  return {add(std::move(shape)), {}};
}

template <int D>
Framed<D> Shapes<D>::make(const model::Preimage& preimage) {
  Shape<D> shape;
  shape.preimage = &preimage;
  std::copy_n(preimage.lower.begin(), D, shape.bounds.lower.begin());
  std::copy_n(preimage.upper.begin(), D, shape.bounds.upper.begin());
  return {add(std::move(shape)), {}};
}

#define BSP2_INSTANTIATE(D) template class Shapes<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
