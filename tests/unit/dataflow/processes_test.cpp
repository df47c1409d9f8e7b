// The process kinds one by one: what each makes of a stream of refinements.

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "dataflow/oracle.hpp"
#include "geometry/cell_samples.hpp"
#include "process/combiner.hpp"
#include "process/transformer.hpp"
#include "producers/convex_producer.hpp"
#include "producers/lathe_producer.hpp"
#include "producers/mesh_producer.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Cell;
using geometry::Label;
using geometry::Position;

/// One refinement: the cell `path` (one character a split) is IN, OUT, or was split by a hyperplane.
struct Refinement {
  std::string path;
  Label label = Label::fuzzy;
  geometry::OrientedHyperplane cut;
  double volume = 0;
  Point inside;  // a point of the cell
};

/// Drives a producer alone over the root cell and returns the stream that it emits.
template <int D, ProducerProcess<D> P>
std::vector<Refinement> stream_of(const Network<D>& network, const P& producer, Random& random) {
  geometry::Splitter<D> splitter(network.table);
  geometry::CellWriter<D> writer(network.table);
  CellView<D> view(splitter);
  struct Undecided {
    std::string path;
    Cell<D> cell;
    Words state;
  };
  std::vector<Undecided> stack;
  stack.push_back(
      {"", geometry::root_cell(network.table), {Program::kind_leaf | Program::whole, Program::header, 0}});
  std::vector<Refinement> stream;
  while (!stack.empty() && stream.size() < 100000) {
    const Undecided at = std::move(stack.back());
    stack.pop_back();
    view.look_at(at.cell);
    Words left;
    Refinement refinement{at.path,
                          producer.ask(at.state.data(), view, left),
                          {},
                          writer.measure(at.cell).volume(),
                          point_in(at.cell, random)};
    if (refinement.label == Label::fuzzy) {
      left[1] = static_cast<Word>(left.size());
      const std::size_t before = producer.undecided(at.state.data());
      EXPECT_LE(producer.undecided(left.data()), before) << "a state must shrink";
      EXPECT_GT(producer.undecided(left.data()), 0U);
      const Advice advice = producer.advise(left.data(), view);
      refinement.cut = advice.plane;
      if (splitter.classify(at.cell, advice.plane.id()) != Position::crossing) {
        ADD_FAILURE() << "advice misses the cell";
        return stream;
      }
      Undecided negative{at.path + '-', {}, left}, positive{at.path + '+', {}, left};
      splitter.split(at.cell, advice.plane.id(), &negative.cell, &positive.cell);
      // What the advice promises.
      Words unused;
      const Undecided &beyond = advice.plane.flipped() ? negative : positive,
                      &behind = advice.plane.flipped() ? positive : negative;
      if (advice.beyond_is_out) {
        view.look_at(beyond.cell);
        EXPECT_EQ(producer.ask(left.data(), view, unused), Label::out);
      }
      unused.clear();
      if (advice.behind_is_in) {
        view.look_at(behind.cell);
        EXPECT_EQ(producer.ask(left.data(), view, unused), Label::in);
      }
      stack.push_back(std::move(negative));
      stack.push_back(std::move(positive));
    }
    stream.push_back(std::move(refinement));
  }
  return stream;
}

/// Each refinement replaces a cell that the stream has split before, nothing comes twice, and what is final
/// fills the root.
void expect_stream_of_refinements(const std::vector<Refinement>& stream) {
  std::map<std::string, const Refinement*> seen;
  double final_volume = 0;
  for (const Refinement& refinement : stream) {
    ASSERT_TRUE(seen.emplace(refinement.path, &refinement).second)
        << "cell " << refinement.path << " is emitted twice";
    if (!refinement.path.empty()) {
      const auto parent = seen.find(refinement.path.substr(0, refinement.path.size() - 1));
      ASSERT_TRUE(parent != seen.end())
          << "cell " << refinement.path << " comes before the one that it refines";
      ASSERT_EQ(parent->second->label, Label::fuzzy)
          << "cell " << refinement.path << " refines a decided one";
      ASSERT_LE(refinement.volume, parent->second->volume * (1 + 1e-12));
    }
    if (refinement.label != Label::fuzzy) final_volume += refinement.volume;
  }
  for (const Refinement& refinement : stream)
    if (refinement.label == Label::fuzzy) {
      ASSERT_TRUE(seen.contains(refinement.path + '-') && seen.contains(refinement.path + '+'));
    }
  EXPECT_NEAR(final_volume, stream.front().volume, 1e-12 * stream.front().volume);
}

template <int D>
std::vector<Refinement> stream_of(const model::Expression& primitive, Random& random) {
  const Network<D> network = compile<D>(primitive, {});
  EXPECT_EQ(network.producers.size(), 1U);
  const Producer<D>& producer = network.producers[0];
  if constexpr (D == 3)
    if (producer.kind == ProducerKind::mesh)
      return stream_of<3>(network, MeshProducer(network, producer), random);
  if constexpr (D == 3)
    if (producer.kind == ProducerKind::lathe)
      return stream_of<3>(network, LatheProducer(network, producer), random);
  return stream_of<D>(network, ConvexProducer<D>(network, producer), random);
}

template <int D>
double check_producer(const model::Expression& primitive, Random& random) {
  const auto stream = stream_of<D>(primitive, random);
  expect_stream_of_refinements(stream);
  double in = 0;
  for (const Refinement& refinement : stream) {
    if (refinement.label == Label::fuzzy) continue;
    const Where truth = where(primitive, refinement.inside, 1e-7L);
    EXPECT_TRUE(truth.doubtful || truth.inside == (refinement.label == Label::in)) << refinement.path;
    if (refinement.label == Label::in) in += refinement.volume;
  }
  return in;
}

TEST(ConvexProducer, EmitsAStreamOfRefinementsInAnyDimension) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  EXPECT_NEAR(check_producer<1>(model::cuboid({2}), random), 2, 1e-13);
  EXPECT_NEAR(check_producer<2>(model::cuboid({2, 3}), random), 6, 1e-13);
  EXPECT_NEAR(check_producer<3>(model::cuboid({2, 3, 4}), random), 24, 1e-12);
  EXPECT_NEAR(check_producer<4>(model::cuboid({2, 1, 1, 3}), random), 6, 1e-12);
#if BSP2_DIMENSIONS > 4
  EXPECT_NEAR(check_producer<6>(model::cuboid({1, 1, 1, 1, 1, 2}), random), 2, 1e-12);
#endif
  for (const std::uint32_t sides : {3U, 16U, 64U}) {
    const double area = sides * std::sin(2 * std::numbers::pi / sides) / 2;
    EXPECT_NEAR(check_producer<3>(model::cylinder(2, 1, 1, sides), random), 2 * area, 1e-12);
    EXPECT_NEAR(check_producer<3>(model::cylinder(3, 1, 0, sides), random), area, 1e-12);
  }
  check_producer<3>(model::sphere(1, 24), random);
}

TEST(LatheProducer, EmitsAStreamOfRefinements) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (const std::uint32_t sides : {600U, 1001U}) {
    const double area = sides * std::sin(2 * std::numbers::pi / sides) / 2;
    EXPECT_NEAR(check_producer<3>(model::cylinder(2, 1, 1, sides), random), 2 * area, 1e-11);
    EXPECT_NEAR(check_producer<3>(model::cylinder(3, 1, 0, sides), random), area, 1e-11);
    EXPECT_NEAR(check_producer<3>(model::cylinder(3, 1, 2, sides), random), 7 * area, 1e-11);
  }
  for (const std::uint32_t sides : {33U, 60U}) check_producer<3>(model::sphere(1, sides), random);
}

/// Whatever cuts its cells, a lathe answers as its half-spaces do one by one.
TEST(LatheProducer, AnswersAsAllItsHalfSpacesDo) {
  for (int round = 0; round < samples::rounds(60); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = model::transform(
        free_matrix(random, 3, 3), chance(random, 0.5)
                                       ? model::sphere(1, static_cast<std::uint32_t>(pick(random, 33, 60)))
                                       : model::cylinder(1, 1, uniform(random, 0, 2),
                                                         static_cast<std::uint32_t>(pick(random, 512, 900))));
    const Network<3> network = compile<3>(e, {});
    if (network.producers.empty() || network.producers[0].kind != ProducerKind::lathe) continue;
    const LatheProducer lathe(network, network.producers[0]);
    const ConvexProducer<3> convex(network, network.producers[0]);
    geometry::Splitter<3> splitter(network.table);
    CellView<3> view(splitter);
    const Words whole{Program::kind_leaf | Program::whole, Program::header, 0};
    for (int descent = 0; descent < 20; ++descent) {
      Cell<3> cell = geometry::root_cell(network.table);
      Words state = whole, plain = whole;
      for (int depth = 0; depth < 40; ++depth) {
        view.look_at(cell);
        Words left, plain_left;
        const Label label = lathe.ask(state.data(), view, left),
                    truth = convex.ask(plain.data(), view, plain_left);
        // A cell may be outside although no half-space alone keeps it there.
        const bool sharper = label == Label::out && truth == Label::fuzzy;
        ASSERT_TRUE(label == truth || label == Label::fuzzy || sharper) << "a wrong label at depth " << depth;
        for (int sample = 0; sharper && sample < 10; ++sample) {
          const Where there = where(e, point_in(cell, random), 1e-9L);
          ASSERT_TRUE(there.doubtful || !there.inside);
        }
        if (label != Label::fuzzy) break;
        left[1] = static_cast<Word>(left.size());
        state = left;
        if (truth == Label::fuzzy) {
          plain_left[1] = static_cast<Word>(plain_left.size());
          plain = plain_left;
        } else {
          plain = whole;
        }
        geometry::HyperplaneId id = lathe.advise(state.data(), view).plane.id();
        if (chance(random, 0.5)) {  // a cut that the lathe did not ask for
          const int axis = pick(random, 0, 2);
          const double x = uniform(random, view.extent().lower[static_cast<std::size_t>(axis)],
                                   view.extent().upper[static_cast<std::size_t>(axis)]);
          const auto other = network.table.axis_hyperplane(axis, network.table.axis_position(axis, x));
          if (view.crosses(other)) id = other;
        }
        ASSERT_EQ(splitter.classify(cell, id), Position::crossing);
        Cell<3> half;
        const bool negative = chance(random, 0.5);
        splitter.split(cell, id, negative ? &half : nullptr, negative ? nullptr : &half);
        cell = std::move(half);
      }
    }
  }
}

TEST(MeshProducer, EmitsAStreamOfRefinements) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  EXPECT_NEAR(check_producer<3>(l_shape(1, 1, 2), random), 6, 1e-12);
  EXPECT_NEAR(check_producer<3>(star(7, 2, 1, 1), random), 14 * std::sin(std::numbers::pi / 7), 1e-12);
  EXPECT_NEAR(check_producer<3>(polycube({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}), random), 4, 1e-12);
}

/// Slabs far thinner than doubles resolve, cut through a mesh: no double lies in their cells.
TEST(MeshProducer, IsExactInCellsThinnerThanDoublesResolve) {
  int in = 0, out = 0;
  for (int round = 0; round < samples::all_rounds(12); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto mesh =
        model::transform(free_matrix(random, 3, 0.3),
                         round % 2 == 0 ? star(pick(random, 5, 9), 2, 0.6, 1) : random_polycube(random, 5));
    const auto slab_at = [&](double x) {
      auto m = identity_matrix(3);
      m[3] = x;
      return model::transform(m, model::cuboid({9, 9, 9}));
    };
    // Between x = low and x = high, somewhere near 0 where doubles tell the two apart.
    const double low = std::ldexp(uniform(random, 0, 1), -66), high = low + std::ldexp(1, -68);
    auto down = identity_matrix(3);
    down[7] = down[11] = -4.5;
    const auto slab = model::transform(down, model::subtract({slab_at(low), slab_at(high)}));
    const Network<3> network = compile<3>(model::intersect({slab, mesh}), {.coincidence = 0});
    const auto result = evaluate_all(network, 0, keep_everything());
    for (const auto& refinement : result.refinements) {
      const auto& batch = refinement->cells;
      for (std::size_t cell = 0; cell < batch.size(); ++cell) {
        const auto points = batch.cell_points(cell);
        double widest = 0;
        Point middle(3, 0);
        for (std::size_t k = 0; k < points.size(); ++k) {
          if (k % 3 == 0) widest = std::max(widest, std::fabs(points[k]));
          middle[k % 3] += points[k] / (static_cast<Real>(points.size()) / 3);
        }
        if (widest > 1e-15) continue;
        ASSERT_NE(batch.label[cell], Label::fuzzy);
        const Where truth = where(mesh, middle, 1e-4L);
        if (truth.doubtful) continue;
        ASSERT_EQ(batch.label[cell] == Label::in, truth.inside);
        (truth.inside ? in : out)++;
      }
    }
  }
  EXPECT_GT(in, 0);
  EXPECT_GT(out, 0);
}

TEST(MeshProducer, MayBeModelledFarFromWhereItEndsUp) {
  const double far = std::ldexp(1, 30);
  auto away = identity_matrix(3), back = identity_matrix(3);
  away[3] = back[3] = far;
  back[3] = -far;
  std::vector<std::array<double, 3>> points;
  for (int i = 0; i < 8; ++i) points.push_back({far + (i & 1), double(i >> 1 & 1), double(i >> 2)});
  const auto box = model::polyhedron(
      points, {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}});
  EXPECT_NEAR(volume<3>(model::transform(back, box)), 1, 1e-12);
  EXPECT_NEAR(volume<3>(box), 1, 1e-6);
}

TEST(Compile, WarnsOfWhatItLeavesOut) {
  const auto plate = model::cuboid({1, 1, 1e-12}), cube = model::cuboid({1, 1, 1});
  const auto both = model::unite({model::cuboid({2, 1, 1}), plate});
  const auto warnings = compile<3>(both, {}).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("primitive 1"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("--coincidence 0"), std::string::npos);
  EXPECT_TRUE(compile<3>(both, {.coincidence = 0}).warnings.empty());
  EXPECT_TRUE(compile<3>(model::unite({cube, model::cuboid({2, 1, 1})}), {}).warnings.empty());
  const auto unbounded = compile<3>(model::complement(cube), {}).warnings;
  ASSERT_EQ(unbounded.size(), 1U);
  EXPECT_NE(unbounded[0].find("cut off"), std::string::npos);
}

/// Firing is hasty where many operands are left; deciding is not.
TEST(Localizer, LooksCloselyAtWhatItWillNotCut) {
  Random random(7);
  std::vector<model::Expression> small;
  for (int i = 0; i < 300; ++i)
    small.push_back(model::transform(free_matrix(random, 3, 3), model::cuboid({0.3, 0.3, 0.3})));
  const std::vector<double> turned{0.8, -0.6, 0, 0, 0.6, 0.8, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const auto box = model::transform(turned, model::cuboid({5, 5, 5}, true));
  const Network<3> network = compile<3>(model::intersect({box, model::unite(small)}), {});
  geometry::Splitter<3> splitter(network.table);
  Localizer<3> localizer(network, splitter);
  int hasty = 0;
  for (const auto plane : network.planes_of(network.producers[0])) {
    Cell<3> root = geometry::root_cell(network.table), beyond;
    if (splitter.classify(root, plane.id()) != Position::crossing) continue;
    splitter.split(root, plane.id(), plane.flipped() ? &beyond : nullptr,
                   plane.flipped() ? nullptr : &beyond);
    Words left;
    Localizer<3>::Cut cut;
    EXPECT_EQ(localizer.decide(network.program, beyond, left).label, Label::out);
    hasty += localizer.fire(network.program, beyond, left, cut).label == Label::fuzzy;
  }
  EXPECT_GT(hasty, 0) << "no cell made a difference";
}

/// The stream of a transformed producer is the image of the producer's: the same refinements, each cell the
/// image of a cell with the same label.
TEST(Transformer, MapsAStreamOfRefinementsToItsImage) {
  for (int round = 0; round < samples::rounds(50); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<double> m = identity_matrix(3), identity = m;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 4; ++j) m[4 * i + j] = uniform(random, -2, 2);
    const auto minor = [&](std::size_t a, std::size_t b) {
      return m[4 + a] * m[8 + b] - m[4 + b] * m[8 + a];
    };
    const double determinant = m[0] * minor(1, 2) - m[1] * minor(0, 2) + m[2] * minor(0, 1);
    if (std::fabs(determinant) < 0.3) continue;
    const model::Expression primitive =
        chance(random, 0.5) ? model::cuboid({1, 2, 3}) : model::cylinder(1, 1, 0.5, 7);
    const auto in = [&](const model::Expression& e) { return check_producer<3>(e, random); };
    const double before = in(primitive), after = in(model::transform(m, primitive));
    EXPECT_NEAR(after, before * std::fabs(determinant), 1e-11 * after);

    // Hyperplane by hyperplane: the image of a point is on the same side of the image of a hyperplane.
    const geometry::Polytope<3> box = geometry::unit_box<3>();
    const Transformer<3> transformer(m);
    const Box<3> bounds = transformer.image(Box<3>{box.lower, box.upper});
    double reach = 0;
    for (std::size_t i = 0; i < 3; ++i)
      reach = std::max({reach, std::fabs(bounds.lower[i]), std::fabs(bounds.upper[i])});
    geometry::HyperplaneTable<3> table(bounds.lower, bounds.upper, reach);
    const std::uint32_t first = table.add_covectors(box.covectors),
                        map = table.add_map(transformer.matrix(), bounds.lower, bounds.upper);
    ASSERT_NE(table.orientation(map), 0);
    table.add_occurrences(map, first, 6);
    const auto codes = table.merge(0);
    ASSERT_EQ(codes.size(), 6U);
    for (int sample = 0; sample < 20; ++sample) {
      std::array<double, 3> x, image;
      for (double& coordinate : x) coordinate = uniform(random, -0.5, 1.5);
      for (std::size_t i = 0; i < 3; ++i)
        image[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
      for (std::size_t k = 0; k < 6; ++k) {
        const auto& c = box.covectors[k].rounded;
        const double value = static_cast<double>(c[0] * x[0] + c[1] * x[1] + c[2] * x[2] + c[3]);
        const double mapped = table.rounded(codes[k].id()).at(image);
        if (std::fabs(value) > 1e-9) {
          EXPECT_EQ(value < 0, (mapped < 0) != codes[k].flipped());
        }
      }
    }
    EXPECT_FALSE(HasFailure());
  }
}

TEST(Transformer, ComposesAndIsSingularWhereItsMatrixIs) {
  const Transformer<2> scale(std::vector<double>{2, 0, 0, 0, 3, 0, 0, 0, 1}),
      shift(std::vector<double>{1, 0, 5, 0, 1, 7, 0, 0, 1});
  const Box<2> unit{{0, 0}, {1, 1}};
  const Box<2> image = shift.after(scale).image(unit), other = scale.after(shift).image(unit);
  EXPECT_NEAR(image.upper[0], 7, 1e-12);
  EXPECT_NEAR(image.lower[1], 7, 1e-12);
  EXPECT_NEAR(other.lower[0], 10, 1e-12);
  EXPECT_NEAR(other.upper[1], 24, 1e-12);
  EXPECT_LE(image.lower[0], 5);
  const Transformer<2> flat(std::vector<double>{1, 1, 0, 2, 2, 0, 0, 0, 1});
  geometry::HyperplaneTable<2> table(unit.lower, unit.upper, 4);
  EXPECT_EQ(table.orientation(table.add_map(flat.matrix())), 0);
}

TEST(Complement, MapsAStreamToItsComplement) {
  EXPECT_EQ(Complement::map(Answer{Label::in, 3}), (Answer{Label::out, no_owner}));
  EXPECT_EQ(Complement::map(Answer{Label::out}), (Answer{Label::in, no_owner}));
  EXPECT_EQ(Complement::map(Answer{Label::fuzzy}).label, Label::fuzzy);
  Random random(5);
  const auto cube = model::cuboid({1, 1, 1}), world = model::cuboid({3, 3, 3}, true);
  EXPECT_NEAR(volume<3>(model::intersect({world, model::complement(cube)})), 26, 1e-11);
}

/// What three-valued logic knows of a combiner's operands: the answer that all completions agree in.
std::optional<bool> truth(Word kind, const std::vector<Label>& operands) {
  std::set<bool> possible;
  const std::size_t n = operands.size();
  for (unsigned completion = 0; completion < (1U << n); ++completion) {
    bool consistent = true, all = true, any = false, odd = false;
    for (std::size_t i = 0; i < n; ++i) {
      const bool in = (completion >> i & 1U) != 0;
      consistent &= operands[i] == Label::fuzzy || in == (operands[i] == Label::in);
      all &= in;
      any |= in;
      odd ^= in;
    }
    if (consistent)
      possible.insert(kind == Program::kind_unite ? any : kind == Program::kind_intersect ? all : odd);
  }
  return possible.size() == 1 ? std::optional(*possible.begin()) : std::nullopt;
}

/// The streams of the operands come in token by token: at each, some operands that were undecided are
/// refined. What the combiner emits must be what all completions agree in, as soon as they do, and it must
/// never take it back.
TEST(Combiner, FoldsStreamsOfRefinementsIntoOne) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(5000); ++round) {
    const Word kind = static_cast<Word>(pick(random, 1, 3));
    std::vector<Label> known(static_cast<std::size_t>(pick(random, 1, 6)), Label::fuzzy);
    std::vector<std::int32_t> owner(known.size());
    for (auto& p : owner) p = chance(random, 0.3) ? no_owner : pick(random, 0, 9);
    std::vector<std::size_t> left(known.size());
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
    Word memory = 0;
    for (;;) {
      for (const std::size_t i : left)
        if (chance(random, 0.4)) known[i] = chance(random, 0.5) ? Label::in : Label::out;
      Combiner combiner(kind, memory);
      std::optional<Answer> answer;
      std::vector<std::size_t> undecided;
      for (const std::size_t i : left) {
        if (known[i] == Label::fuzzy)
          undecided.push_back(i);
        else if (combiner.fold({known[i], known[i] == Label::in ? owner[i] : no_owner})) {
          answer = Answer{known[i], known[i] == Label::in ? owner[i] : no_owner};
          break;
        }
      }
      if (!answer && undecided.empty()) answer = combiner.answer();
      const auto expected = truth(kind, known);
      ASSERT_EQ(answer.has_value(), expected.has_value());
      if (answer) {
        ASSERT_EQ(answer->label == Label::in, *expected);
        if (answer->label == Label::in &&
            kind != Program::kind_unite) {  // the lowest owner of the operands that are IN
          std::int32_t lowest = no_owner;
          for (std::size_t i = 0; i < known.size(); ++i)
            if (known[i] == Label::in && owner[i] >= 0 && (lowest < 0 || owner[i] < lowest))
              lowest = owner[i];
          ASSERT_EQ(answer->owner, lowest);
        }
        if (answer->label == Label::out) {
          ASSERT_EQ(answer->owner, no_owner);
        }
        break;
      }
      // A combiner that remembers nothing may leave the word to its last operand.
      if (combiner.is_transparent() && undecided.size() == 1) {
        for (const Label last : {Label::in, Label::out}) {
          auto completed = known;
          completed[undecided[0]] = last;
          ASSERT_EQ(truth(kind, completed), last == Label::in);
        }
      }
      memory = combiner.memory();
      left = undecided;
    }
  }
}

/// Any number of consumers; the cells that they get are final: disjoint, none twice, together the solid.
TEST(Consumer, GetsEveryDecidedCellOnce) {
  const auto e =
      model::subtract({model::cuboid({4, 4, 4}), model::sphere(3, 20), model::cylinder(4, 1, 1, 12)});
  const Network<3> network = compile<3>(e, {});
  struct Ledger : Consumer {
    std::set<std::vector<double>> cells;
    std::map<std::uint32_t, std::uint64_t> next;  // by worker
    double in = 0;
    void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override {
      const auto& batch = refinement->cells;
      EXPECT_EQ(refinement->first, next[refinement->worker]) << "the cells of a worker come in their order";
      next[refinement->worker] += batch.size();
      for (std::size_t cell = 0; cell < batch.size(); ++cell) {
        const auto points = batch.cell_points(cell);
        EXPECT_TRUE(cells.insert({points.begin(), points.end()}).second) << "a cell twice";
        if (batch.label[cell] == Label::in) in += batch.volume[cell];
      }
    }
  } first, second;
  std::vector<Consumer*> consumers{&first, &second};
  const auto result = evaluate(network, partition(network, 2).regions, keep_everything(2), consumers);
  const auto& totals = result.totals;
  EXPECT_EQ(first.cells.size(), totals.in_cells + totals.out_cells + totals.fuzzy_cells);
  EXPECT_EQ(first.cells, second.cells);
  EXPECT_NEAR(first.in, totals.in.value().volume(), 1e-11);
}

}  // namespace
}  // namespace bsp2::dataflow
