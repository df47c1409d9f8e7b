#pragma once

// A producer driven alone, as a stream of refinements.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/cell_view.hpp"
#include "bsp2/dataflow/process/process.hpp"
#include "bsp2/geometry/cells/measures.hpp"
#include "geometry/cell_samples.hpp"

namespace bsp2::dataflow {

/// Where points are, by the membership of the expression.
inline auto truth_of(const model::Expression& e) {
  return [e](const Point& x) { return where(e, x, 1e-12L); };
}

/// Of points in a cell, those on one side of a hyperplane that cuts it; which of them lie on it is not for
/// doubles to say.
template <int D>
std::vector<std::array<double, D>> points_beside(const std::vector<std::array<double, D>>& points,
                                                 const geometry::Hyperplane<D>& h, double sign) {
  std::vector<std::array<double, D>> beside;
  double length = 0;
  for (const double x : h.normal) length += std::fabs(x);
  for (const auto& point : points)
    if (sign * h.at(point) > 2 * h.error + 1e-10 * length) beside.push_back(point);
  return beside;
}

/// Drives the producer alone: each output cell refines the one it replaces, and its labels are true, as
/// `truth` (of a point, a Where) tells. Halves fill their cell, so nothing is emitted twice and nothing is
/// left out.
/// @param has_needles a cell without advice may be long if it has no volume to speak of: of a prism it is as
/// long as it is.
/// @param on_surface points that no decided cell has inside.
template <int D, typename P, typename Truth>
void check_stream_of(const Network<D>& network, const P& producer, unsigned deepest, const Truth& truth,
                     Random& random, bool has_needles = false,
                     std::vector<std::array<double, D>> on_surface = {}) {
  geometry::Splitter<D> splitter(network.table);
  geometry::CellWriter<D> writer(network.table);
  CellView<D> view(splitter);
  struct Item {
    geometry::Cell<D> cell;
    Words state;
    unsigned level;
    std::vector<std::array<double, D>> on_surface;
  };
  std::vector<Item> stack;
  stack.push_back({geometry::root_cell(network.table),
                   {Program::kind_leaf | Program::whole, Program::header, 0},
                   0,
                   std::move(on_surface)});
  const double whole = writer.measure(stack[0].cell).volume();
  double decided = 0, fuzzy = 0;
  while (!stack.empty()) {
    const Item at = std::move(stack.back());
    stack.pop_back();
    view.look_at(at.cell);
    Words left;
    const geometry::Label label = producer.ask(at.state.data(), view, left);
    const double volume = writer.measure(at.cell).volume();
    if (label != geometry::Label::fuzzy) {
      decided += volume;
      ASSERT_TRUE(at.on_surface.empty())
          << "a point of the surface is in a cell that is decided, at level " << at.level;
      for (int i = 0; i < (label == geometry::Label::in ? 30 : 3); ++i) {
        const Where there = truth(point_in(at.cell, random));
        ASSERT_TRUE(there.doubtful || there.inside == (label == geometry::Label::in));
      }
      continue;
    }
    left[1] = static_cast<Word>(left.size());
    ASSERT_GT(producer.undecided(left.data()), 0U);
    if (at.level == deepest) {
      fuzzy += volume;
      continue;
    }
    const Advice advice = producer.advise(left.data(), view);
    if (advice.none) {  // slivers where planes of several wedges nearly meet, by the rounding of chords and
                        // tangents
      ASSERT_TRUE(view.extent().radius(view.cell()) < 1e-6 || (has_needles && volume < 1e-12 * whole));
      fuzzy += volume;
      continue;
    }
    ASSERT_EQ(splitter.classify(at.cell, advice.plane.id()), geometry::Position::crossing);
    const auto h = network.table.rounded(advice.plane.id());
    Item negative{{}, left, at.level + 1, points_beside<D>(at.on_surface, h, -1)},
        positive{{}, left, at.level + 1, points_beside<D>(at.on_surface, h, 1)};
    splitter.split(at.cell, advice.plane.id(), &negative.cell, &positive.cell);
    const double parts = writer.measure(negative.cell).volume() + writer.measure(positive.cell).volume();
    ASSERT_NEAR(parts, volume, 1e-12 * whole) << "the halves are not the cell";
    Words unused;
    if (advice.beyond_is_out) {
      view.look_at(advice.plane.flipped() ? negative.cell : positive.cell);
      ASSERT_EQ(producer.ask(left.data(), view, unused), geometry::Label::out);
    }
    unused.clear();
    if (advice.behind_is_in) {
      view.look_at(advice.plane.flipped() ? positive.cell : negative.cell);
      ASSERT_EQ(producer.ask(left.data(), view, unused), geometry::Label::in);
    }
    stack.push_back(std::move(negative));
    stack.push_back(std::move(positive));
  }
  EXPECT_NEAR(decided + fuzzy, whole, 1e-10 * whole);
}

}  // namespace bsp2::dataflow
