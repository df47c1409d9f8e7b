#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

/// The steps from a skin to faces that can be triangulated, in their order. All are the same for any number
/// of threads.
///
/// What becomes of a point depends on the edges alone that it is on, in whatever faces. So the steps may be
/// made for some faces, the own ones, which are there as a whole and come first, together with those edges of
/// others that come near to theirs.
namespace bsp2::geometry {

/// Puts the faces in an order that does not depend on how they were found; equal ones are one.
void sort_faces(Skin& skin);

/// Of faces: by their planes, sides and parts.
bool is_before(const Skin::Face& a, const Skin::Face& b);

/// The vertices of a skin, each with what it is known to lie on; the skin has none any more. Equal ones may
/// be there under several names. @pre the names ascend, or nearly so, else this takes longer.
PointSet take_points(const HyperplaneTable<3>& table, unsigned threads, Skin& skin);

/// Makes one of equal points; the edges are renumbered. @return the new number of each point.
std::vector<std::uint32_t> unite_points(const HyperplaneTable<3>& table, PointSet& points, Skin& skin);

/// Adds up the edges of each plane line by line: those on both sides of a cut between regions were added up
/// apart.
void add_up_lines(ExactPoints& exact, unsigned threads, const PointSet& points, Skin& skin);

/// Joins the edges of the own faces at vertices in which no more happens than that straight edges go on, in
/// all faces: one, or several that cross. Whether a vertex is where edges only cross depends on how the skin
/// was found. @pre no vertex lies inside an edge.
void join_straight_edges(ExactPoints& exact, unsigned threads, const PointSet& points, std::size_t own_faces,
                         Skin& skin);

/// Gives the points names and numbers that do not depend on how the skin was found, and so their coordinates:
/// of the planes of faces that meet in a point those three that are furthest from parallel. Points without
/// edges are gone. The edges are sorted by face, and by their ends within one.
/// @param is_named of each point, whether it has edges, and that name already; empty: none.
void rename_points(ExactPoints& exact, unsigned threads, PointSet& points, Skin& skin,
                   std::vector<std::uint8_t> is_named = {});

/// Divides edges at the points from `first` on, which may be the same as others.
void divide_at(ExactPoints& exact, PointSet& points, std::size_t first, Skin& skin);

}  // namespace bsp2::geometry
