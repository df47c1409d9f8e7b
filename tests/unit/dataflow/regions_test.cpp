// The cells do not depend on the regions, on who evaluates them, and on where an evaluation was interrupted:
// random expressions with and without round solids, in two to four dimensions.
#include <gtest/gtest.h>

#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dataflow/in_regions.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

std::vector<double> lengths(Random& random, int count) {
  std::vector<double> lengths;
  for (int i = 0; i < count; ++i) lengths.push_back(uniform(random, 0.3, 2));
  return lengths;
}

/// A closed curve of the plane through corners of a star, by parabolas.
model::Expression spline_star(Random& random) {
  model::Spline::Piece piece{{2}, {{}}, {}};
  const int corners = pick(random, 3, 6);
  for (int i = 0; i < corners + 2; ++i) {
    const double angle = 2 * std::numbers::pi * (i % corners) / corners, radius = i % 2 == 0 ? 1.5 : 0.9;
    piece.points.insert(piece.points.end(), {radius * std::cos(angle), radius * std::sin(angle), 1.0});
  }
  for (int i = 0; i < corners + 5; ++i) piece.knots[0].push_back(i);
  return model::spline(2, {piece});
}

/// A thin curve or surface with its control points anywhere.
model::Expression thin_spline(Random& random, int d) {
  const std::uint32_t parameters = d == 3 && chance(random, 0.3) ? 2 : 1;
  std::vector<double> points;
  for (int i = 0; i < (parameters == 2 ? 9 : 4) * (d + 1); ++i)
    points.push_back(i % (d + 1) == d ? 1 : uniform(random, -2, 2));
  return model::bezier(d, std::vector<std::uint32_t>(parameters, parameters == 2 ? 2 : 3), points);
}

/// What has no facets: balls, cylinders, cones, tori, splines, and prisms and sections of those.
model::Expression random_curved(Random& random, int d) {
  const double r = uniform(random, 0.5, 2);
  if (chance(random, 0.35)) return model::ball(d, r);
  if (d == 2) {
    switch (pick(random, 0, 4)) {
      case 0:
        return model::section(model::torus(uniform(random, 0.5, 1.5), 0.5), pick(random, 0, 2),
                              uniform(random, -0.4, 0.4));
      case 1:
        return model::section(model::cone(2, r, 0), pick(random, 0, 2), uniform(random, 0, 0.4));
      case 2:
        return spline_star(random);
      case 3:
        return thin_spline(random, d);
      default:
        return model::round_cylinder(1, r, lengths(random, 1));
    }
  }
  if (d == 3) {
    switch (pick(random, 0, 5)) {
      case 0:
        return model::torus(uniform(random, 1, 2), uniform(random, 0.2, 1));
      case 1:
        return model::cone(uniform(random, 0.5, 3), r, chance(random, 0.5) ? 0 : uniform(random, 0.2, 2));
      case 2:
        return chance(random, 0.3) ? thin_spline(random, d)
                                   : model::extrude(random_curved(random, 2), {uniform(random, 0.5, 2)});
      case 3:
        return model::round_cylinder(1, r, lengths(random, 2));
      default:
        return model::round_cylinder(2, r, lengths(random, 1));
    }
  }
  switch (pick(random, 0, 3)) {
    case 0:
      return model::extrude(random_curved(random, d - 1), {uniform(random, 0.5, 2)});
    case 1:
      return model::round_cylinder(2, r, lengths(random, d - 2));
    default:
      return model::round_cylinder(d - 1, r, lengths(random, 1));
  }
}

/// @param curved the share of primitives without facets.
model::Expression random_solid(Random& random, int d, int depth, double curved) {
  if (depth == 0) {
    if (!chance(random, curved))
      return random_expression(random, d, chance(random, 0.5) ? Kind::solids : Kind::grid_boxes, 0);
    const auto solid = random_curved(random, d);
    return model::transform(chance(random, 0.4) ? grid_matrix(random, d, 2) : free_matrix(random, d, 1.5),
                            solid);
  }
  std::vector<model::Expression> operands;
  for (int i = pick(random, 2, 3); i > 0; --i)
    operands.push_back(random_solid(random, d, chance(random, 0.3) ? 0 : depth - 1, curved));
  switch (pick(random, 0, 5)) {
    case 0:
    case 1:
      return model::unite(operands);
    case 2:
      return model::intersect(operands);
    case 3:
      return model::symmetric_difference(operands);
    default:
      return model::subtract(operands);
  }
}

/// How far: a tolerance, a level, or what is seen small. @param finer by this factor, or so many levels
/// deeper.
template <int D>
struct Limits {
  std::optional<double> tolerance, angle;
  std::optional<unsigned> level;
  std::vector<double> eye;

  Limits(Random& random, double width) {
    const int kind = pick(random, 0, 9);
    const double thick = width / (D == 2   ? uniform(random, 4, 60)
                                  : D == 3 ? uniform(random, 3, 8)
                                           : uniform(random, 1.5, 3));
    if (kind < 3) {
      level = static_cast<unsigned>(pick(random, 1, D == 2 ? 20 : D == 3 ? 12 : 9));
      return;
    }
    tolerance = thick;
    if (kind > 4) return;
    for (int i = 0; i < D; ++i) eye.push_back(uniform(random, -1, 1) * width);
    angle = uniform(random, 0.02, 0.3);
  }
  void refine() {
    if (level) *level += 3;
    if (tolerance) *tolerance /= D == 2 ? 4 : 1.7;
    if (angle) *angle /= 1.7;
  }
  [[nodiscard]] EvaluateOptions options(bool keep_out) const {
    EvaluateOptions options;
    options.tolerance = tolerance;
    options.level = level;
    options.angle = angle;
    options.eye = eye;
    options.keep_out = keep_out;
    return options;
  }
};

template <int D>
void expect_same_totals(const Totals<D>& a, const Totals<D>& b) {
  EXPECT_EQ(a.digest.hex(), b.digest.hex());
  EXPECT_EQ(a.in_cells, b.in_cells);
  EXPECT_EQ(a.fuzzy_cells, b.fuzzy_cells);
  EXPECT_EQ(a.out_cells, b.out_cells);
  EXPECT_EQ(a.in.state(), b.in.state());
  EXPECT_EQ(a.fuzzy.state(), b.fuzzy.state());
  EXPECT_EQ(a.fuzzy_below.state(), b.fuzzy_below.state());
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.upper, b.upper);
  EXPECT_EQ(a.level, b.level);
}

/// What a test has gone through.
struct Seen {
  std::size_t fuzzy_cells = 0, most_regions = 0, interruptions = 0;
};

/// After so many cells at most an evaluation is interrupted: several times in all.
template <int D>
std::uint64_t interruption(const Totals<D>& whole) {
  return 3 + (whole.in_cells + whole.fuzzy_cells + whole.out_cells) / 4;
}

/// So large that a test would take long: there are others.
template <int D>
bool is_large(const Totals<D>& whole) {
  return whole.in_cells + whole.fuzzy_cells + whole.out_cells > 1500;
}

/// On one thread in one region, against any number of regions, threads and interruptions, and in both orders.
template <int D>
void expect_one_digest(const model::Expression& e, Random& random, Seen& seen) {
  const Network<D> network = compile<D>(e, {.coincidence = chance(random, 0.2) ? 0 : 1e-9});
  Limits<D> limits(random, network.table.width());
  const bool keep_out = chance(random, 0.3);
  const EvaluateOptions options = limits.options(keep_out);
  const auto whole = evaluate(network, partition(network, 0).regions, options, {}).totals;
  if (is_large(whole)) return;
  seen.fuzzy_cells += whole.fuzzy_cells;
  const std::uint64_t some = interruption(whole);
  for (const unsigned depth : {0U, 1U, 5U, 10U}) {
    SCOPED_TRACE("depth " + std::to_string(depth));
    InRegions<D> regions(network, depth, options, random);
    regions.run(depth == 0 || chance(random, 0.5) ? some : 0);
    expect_same_totals(regions.totals(), whole);
    seen.most_regions = std::max(seen.most_regions, regions.regions());
    seen.interruptions += regions.interruptions();
  }
}

/// Coarse first, then finer: from regions as from one.
template <int D>
void expect_one_digest_further(const model::Expression& e, Random& random) {
  const Network<D> network = compile<D>(e, {});
  Limits<D> limits(random, network.table.width());
  const bool keep_out = chance(random, 0.3);
  std::optional<Totals<D>> first;
  Limits<D> finer = limits;
  finer.refine();
  for (const unsigned depth : {0U, 4U, 9U}) {
    SCOPED_TRACE("depth " + std::to_string(depth));
    InRegions<D> regions(network, depth, limits.options(keep_out), random);
    regions.run(first && chance(random, 0.5) ? interruption(*first) : 0);
    regions.go_on_to(finer.options(keep_out));
    regions.run(first && chance(random, 0.5) ? interruption(*first) : 0);
    if (!first) first.emplace(regions.totals());
    if (is_large(*first)) return;
    expect_same_totals(regions.totals(), *first);
  }
}

/// Which cells are kept changes none: IN and FUZZY cells are the same with OUT cells and without.
template <int D>
void expect_same_cells_beside_out_ones(const model::Expression& e, Random& random) {
  const Network<D> network = compile<D>(e, {});
  const Limits<D> limits(random, network.table.width());
  const auto of = [&](bool keep_out) {
    return evaluate(network, partition(network, 0).regions, limits.options(keep_out), {}).totals;
  };
  const auto with = of(true), without = of(false);
  EXPECT_EQ(with.in_cells, without.in_cells);
  EXPECT_EQ(with.fuzzy_cells, without.fuzzy_cells);
  EXPECT_EQ(with.in.state(), without.in.state());
  EXPECT_EQ(with.fuzzy.state(), without.fuzzy.state());
}

class Regions : public testing::Test {
 protected:
  /// @param count of rounds; BSP2_ROUNDS times as many where it is set.
  template <typename Body>
  static void rounds(int count, const Body& body) {
    for (int round = 0; round < samples::all_rounds(count) && !HasFailure(); ++round) {
      const std::uint64_t seed = new_seed();
      SCOPED_TRACE(testing::Message() << "round " << round << ", BSP2_SEED=" << seed);
      Random random(seed);
      body(random, round);
    }
  }
};

TEST_F(Regions, OfRoundSolidsChangeNoCell) {
  Seen seen;
  rounds(12, [&](Random& random, int round) {
    expect_one_digest<2>(random_solid(random, 2, 2, 0.6), random, seen);
    if (round % 4 == 0) expect_one_digest<3>(random_solid(random, 3, 1, 0.6), random, seen);
    if (round % 8 == 0) expect_one_digest<4>(random_solid(random, 4, 1, 0.5), random, seen);
  });
  if (std::getenv("BSP2_SEED") != nullptr) return;  // the same model again and again
  EXPECT_GT(seen.fuzzy_cells, 50U);
  EXPECT_GT(seen.most_regions, 16U);
  EXPECT_GT(seen.interruptions, 0U);
}

TEST_F(Regions, OfPolyhedraChangeNoCell) {
  Seen seen;
  rounds(16, [&](Random& random, int round) {
    expect_one_digest<2>(random_solid(random, 2, 2, 0), random, seen);
    if (round % 4 == 0) expect_one_digest<3>(random_solid(random, 3, 2, 0), random, seen);
    if (round % 8 == 0) expect_one_digest<4>(random_solid(random, 4, 1, 0), random, seen);
  });
}

TEST_F(Regions, ChangeNoCellWhenAnEvaluationGoesOnFurther) {
  rounds(6, [&](Random& random, int round) {
    expect_one_digest_further<2>(random_solid(random, 2, 2, 0.6), random);
    if (round % 3 == 0) expect_one_digest_further<3>(random_solid(random, 3, 1, 0.6), random);
    if (round % 6 == 0) expect_one_digest_further<4>(random_solid(random, 4, 1, 0.5), random);
  });
}

TEST_F(Regions, DoNotDependOnWhatIsKept) {
  rounds(40, [&](Random& random, int round) {
    expect_same_cells_beside_out_ones<2>(random_solid(random, 2, 2, 0.6), random);
    if (round % 4 == 0) expect_same_cells_beside_out_ones<3>(random_solid(random, 3, 1, 0.6), random);
    if (round % 8 == 0) expect_same_cells_beside_out_ones<4>(random_solid(random, 4, 1, 0.5), random);
  });
}

}  // namespace
}  // namespace bsp2::dataflow
