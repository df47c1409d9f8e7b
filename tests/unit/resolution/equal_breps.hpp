#pragma once

// Whether two complexes are the same.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <tuple>

#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::geometry {

/// Array by array, bit by bit.
inline void expect_same(const Brep& brep, const Brep& of_one) {
  const auto expect_equal = [](const auto& some, const auto& others, const auto& values) {
    ASSERT_EQ(some.size(), others.size());
    for (std::size_t i = 0; i < some.size(); ++i) ASSERT_EQ(values(some[i]), values(others[i])) << i;
  };
  ASSERT_EQ(brep.points, of_one.points);
  ASSERT_EQ(brep.triangles, of_one.triangles);
  ASSERT_EQ(brep.face_of_triangle, of_one.face_of_triangle);
  expect_equal(brep.faces, of_one.faces, [](const Brep::Face& f) {
    return std::tuple(f.normal, f.offset, f.part, f.other, f.first_loop, f.loops);
  });
  expect_equal(brep.loops, of_one.loops, [](const Brep::Loop& l) { return std::tuple(l.first_use, l.uses); });
  expect_equal(brep.edges, of_one.edges,
               [](const Brep::Edge& e) { return std::tuple(e.ends, e.first, e.count); });
  ASSERT_EQ(brep.uses_of_edges, of_one.uses_of_edges);
  expect_equal(brep.uses, of_one.uses, [](const Brep::Use& u) {
    return std::tuple(u.edge, u.face, u.forward, std::bit_cast<std::uint64_t>(u.angle));
  });
  expect_equal(brep.shells, of_one.shells, [](const Brep::Shell& s) {
    return std::tuple(s.part, s.solid, s.first, s.count, s.is_cavity, std::bit_cast<std::uint64_t>(s.volume));
  });
  expect_equal(brep.faces_of_shells, of_one.faces_of_shells,
               [](const Brep::Side& s) { return std::tuple(s.face, s.is_front); });
  expect_equal(brep.solids, of_one.solids, [](const Brep::Solid& s) {
    return std::tuple(s.part, s.first_shell, s.shells, std::bit_cast<std::uint64_t>(s.volume));
  });
  ASSERT_EQ(brep.is_closed, of_one.is_closed);
}

}  // namespace bsp2::geometry
