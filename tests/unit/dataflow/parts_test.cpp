// A cell's primitive: one of the source that contains the whole cell, the same one in every run.

#include <gtest/gtest.h>

#include <map>

#include "dataflow/oracle.hpp"
#include "geometry/cell_samples.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::CellBatch;
using geometry::Label;

constexpr Real margin = 1e-9L;
using Polygon = std::vector<std::array<Real, 3>>;

/// A primitive with all maps above it, as `occurrences` gives it: its own description, and the maps from the
/// outermost on.
struct Placed {
  explicit Placed(const model::Expression& e) : at(&e) {
    for (; const auto* transform = std::get_if<model::Transform>(&at->node().value); at = &transform->child)
      maps.push_back(&transform->matrix);
  }
  [[nodiscard]] const model::TriangleMesh* mesh() const {
    return std::get_if<model::TriangleMesh>(&std::get<model::Primitive>(at->node().value));
  }
  /// A point of the primitive's own frame in the world.
  [[nodiscard]] std::array<Real, 3> image(std::array<Real, 3> x) const {
    for (std::size_t k = maps.size(); k-- > 0;) {
      const auto& m = *maps[k];
      std::array<Real, 3> y{};
      for (std::size_t i = 0; i < 3; ++i)
        y[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
      x = y;
    }
    return x;
  }
  const model::Expression* at;
  std::vector<const std::vector<double>*> maps;
};

/// What of a polygon is deeper than `margin` inside the cell's half-space.
Polygon clipped(const Polygon& polygon, const geometry::Hyperplane<3>& h, Real sign) {
  const auto value = [&](const std::array<Real, 3>& x) {
    return sign * (h.offset + h.normal[0] * x[0] + h.normal[1] * x[1] + h.normal[2] * x[2]) + margin;
  };
  Polygon left;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Real va = value(a), vb = value(b);
    if (va < 0) left.push_back(a);
    if ((va < 0) == (vb < 0)) continue;
    std::array<Real, 3> between;
    for (std::size_t k = 0; k < 3; ++k) between[k] = a[k] + (b[k] - a[k]) * va / (va - vb);
    left.push_back(between);
  }
  return left;
}

/// Whether a triangle of the mesh goes through the inside of the cell.
bool crosses(const Placed& placed, const Network<3>& network, const CellBatch& batch, std::size_t cell) {
  for (const auto& triangle : placed.mesh()->triangles) {
    Polygon left;
    for (const std::uint32_t corner : triangle) {
      const auto& p = placed.mesh()->points[corner];
      left.push_back(placed.image({p[0], p[1], p[2]}));
    }
    for (std::uint32_t facet = batch.facet_offset[cell];
         facet < batch.facet_offset[cell + 1] && !left.empty(); ++facet) {
      const std::int32_t code = batch.facet_hyperplane[facet];
      left =
          clipped(left, network.table.rounded(static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code)),
                  code < 0 ? -1 : 1);
    }
    if (!left.empty()) return true;
  }
  return false;
}

/// The whole cell is in a convex primitive if its corners are, and in a mesh if a point of it is and no facet
/// goes through it.
template <int D>
void expect_contained(const model::Expression& primitive, const Network<D>& network, const CellBatch& batch,
                      std::size_t cell, Random& random) {
  const Placed placed(primitive);
  const Where inner = where(primitive, point_in(batch, cell, random), margin);
  EXPECT_TRUE(inner.inside || inner.doubtful);
  if constexpr (D == 3)
    if (placed.mesh() != nullptr) {
      EXPECT_FALSE(crosses(placed, network, batch, cell)) << "a facet of the primitive goes through the cell";
      return;
    }
  const auto corners = batch.cell_points(cell);
  for (std::size_t at = 0; at < corners.size(); at += D) {
    const Where there = where(primitive,
                              Point(corners.begin() + static_cast<std::ptrdiff_t>(at),
                                    corners.begin() + static_cast<std::ptrdiff_t>(at + D)),
                              1e-8L);
    EXPECT_TRUE(there.inside || there.doubtful) << "a corner is outside of the primitive";
  }
}

bool is_union(const model::Expression& e) {
  if (const auto* transform = std::get_if<model::Transform>(&e.node().value))
    return is_union(transform->child);
  const auto* boolean = std::get_if<model::Boolean>(&e.node().value);
  if (boolean == nullptr) return true;
  return boolean->operation == model::Operation::unite &&
         std::all_of(boolean->children.begin(), boolean->children.end(), is_union);
}

/// The primitive of each IN cell, by the coordinates of its corners.
template <int D>
std::map<std::vector<double>, std::int32_t> primitives_of(const Evaluated<D>& result) {
  std::map<std::vector<double>, std::int32_t> primitives;
  for (const auto& refinement : result.refinements)
    for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
      const auto corners = refinement->cells.cell_points(cell);
      primitives.emplace(std::vector<double>(corners.begin(), corners.end()),
                         refinement->cells.primitive[cell]);
    }
  return primitives;
}

template <int D>
void check_primitives(const model::Expression& e, Random& random) {
  const Network<D> network = compile<D>(e, {});
  const auto primitives = occurrences(e);
  const bool only_unites = is_union(e);  // else an operand may have no cell as a whole
  EvaluateOptions options;
  const Evaluated<D> one = evaluate_all(network, 0, options);
  for (const auto& refinement : one.refinements) {
    const CellBatch& batch = refinement->cells;
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      ASSERT_EQ(batch.label[cell], Label::in);
      const std::int32_t primitive = batch.primitive[cell];
      ASSERT_EQ(batch.part[cell], 0) << "nothing has a name";
      ASSERT_TRUE(primitive != geometry::no_primitive || !only_unites);
      if (primitive == geometry::no_primitive) continue;
      ASSERT_LT(static_cast<std::size_t>(primitive), primitives.size());
      expect_contained<D>(primitives[static_cast<std::size_t>(primitive)], network, batch, cell, random);
      if (testing::Test::HasFailure()) return;
    }
  }
  const auto all = primitives_of(one);
  for (const unsigned threads : {1U, 2U, 4U})
    for (const Order order : {Order::depth, Order::priority}) {
      options.threads = threads;
      options.order = order;
      ASSERT_EQ(primitives_of(evaluate_all(network, 0, options)), all) << threads << " threads";
    }
}

template <int D>
void check_random_primitives(int rounds, int depth) {
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    check_primitives<D>(random_expression(random, D, round % 3 == 0 ? Kind::grid_boxes : Kind::solids, depth),
                        random);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Primitives, ContainTheirWholeCells) { check_random_primitives<3>(50, 2); }

TEST(Primitives, ContainTheirWholeCellsInOtherDimensions) {
  check_random_primitives<1>(20, 2);
  check_random_primitives<2>(30, 2);
  check_random_primitives<4>(2, 1);
}

}  // namespace
}  // namespace bsp2::dataflow
