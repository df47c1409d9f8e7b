#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "editing/star.hpp"

namespace bsp2::meshing {

/// A mesh that is changed step by step: edges collapse, are split or removed, faces are flipped, points move.
///
/// A step that is refused changes nothing. Its measure is `shape_of`, so "better" means that the worst
/// tetrahedron has become better. Points have a *kind*: corners stay, those of an edge stay on it, those of a
/// plane side stay in it. Those that are shared with other meshes stay, and all on sides between them.
/// Thread rule: one thread at a time.
class Editor {
 public:
  static constexpr std::uint32_t none = ~0U;
  static constexpr std::int32_t inner = -1;  ///< of a face that is on no side
  enum Kind : std::uint8_t { shared = 0, corner = 1, on_edge = 2, on_side = 3, inside = 4 };

  struct Tetrahedron {
    std::array<std::uint32_t, 4> point;
    std::array<std::int32_t, 4> side;  ///< of the face opposite of each point, or `inner`
    std::int32_t part;
    double shape;
    [[nodiscard]] bool is_gone() const { return point[0] == none; }
    [[nodiscard]] std::array<std::array<std::uint32_t, 2>, 6> edges() const {
      return {{{point[0], point[1]},
               {point[0], point[2]},
               {point[0], point[3]},
               {point[1], point[2]},
               {point[1], point[3]},
               {point[2], point[3]}}};
    }
    [[nodiscard]] int place_of(std::uint32_t p) const {
      return point[0] == p ? 0 : point[1] == p ? 1 : point[2] == p ? 2 : point[3] == p ? 3 : -1;
    }
  };

  enum class Gain : std::uint8_t { less, no_more, none_deeper };  ///< of what is turned over
  /// Two edges of a tetrahedron that have no point in common.
  using Across = std::array<std::array<std::uint32_t, 2>, 2>;

  /// @param kinds of the points; none: they are found.
  explicit Editor(const Tetrahedra& mesh, std::vector<Kind> kinds = {});
  /// What there is now; unused points are gone. @param map gets the new number of each point, or `none`.
  [[nodiscard]] Tetrahedra result(std::vector<std::uint32_t>& map) const;
  /// Numbers points and tetrahedra anew, so that what is near in space is near in memory; what is gone has no
  /// number any more. @return the new number of each point, or `none`.
  std::vector<std::uint32_t> arrange();

  [[nodiscard]] std::size_t size() const { return tetrahedra_.size(); }  ///< with those that are gone
  [[nodiscard]] std::size_t count() const { return tetrahedra_.size() - free_.size(); }  ///< without them
  [[nodiscard]] const Tetrahedron& at(std::uint32_t t) const { return tetrahedra_[t]; }
  [[nodiscard]] std::size_t point_count() const { return points_.size(); }
  [[nodiscard]] const Point& point(std::uint32_t p) const { return points_[p]; }
  [[nodiscard]] Kind kind(std::uint32_t p) const { return kind_[p]; }
  [[nodiscard]] std::span<const std::uint32_t> star(std::uint32_t p) const { return star_[p]; }
  [[nodiscard]] std::vector<std::uint32_t> neighbours(std::uint32_t p) const;  ///< ascending
  /// Finds the neighbours of a point in any order, in memory that is used again.
  void find_neighbours(std::uint32_t p, std::vector<std::uint32_t>& all) const;
  [[nodiscard]] double length(std::uint32_t u, std::uint32_t v) const;
  [[nodiscard]] double volume(std::uint32_t t) const;
  /// The point of the segment between two others that is nearest to a point; nothing if that is an end.
  [[nodiscard]] std::optional<Point> foot_on_edge(std::uint32_t m, std::uint32_t u, std::uint32_t v) const;
  /// How far it is from there.
  [[nodiscard]] std::optional<double> distance_from_edge(std::uint32_t m, std::uint32_t u,
                                                         std::uint32_t v) const;
  /// Whether an edge is one of the solid: it is on sides, and not on one alone that goes on across it.
  [[nodiscard]] bool is_sharp(std::uint32_t u, std::uint32_t v) const {
    const Ring ring = ring_of(u, v);
    return !ring.is_inside() && !ring.is_flat();
  }
  /// Whether an edge is on sides.
  [[nodiscard]] bool is_on_surface(std::uint32_t u, std::uint32_t v) const {
    return !ring_of(u, v).is_inside();
  }
  /// The smallest angle that a part of the solid has at an edge, in radians; what is not beside each other
  /// counts together.
  [[nodiscard]] double smallest_wedge(std::uint32_t u, std::uint32_t v) const;
  [[nodiscard]] double worst_at(std::uint32_t p) const;
  [[nodiscard]] const PlaneSide& side(std::int32_t number) const {
    return sides_[static_cast<std::size_t>(number)];
  }
  [[nodiscard]] std::size_t side_count() const { return sides_.size(); }
  /// The tetrahedron on the other side of a face, or `none`.
  [[nodiscard]] std::uint32_t beyond(std::uint32_t t, int face) const;
  [[nodiscard]] Point middle(std::uint32_t t) const;
  /// Planes of the sides that a point is on, ascending.
  void find_planes(std::uint32_t p, std::vector<std::uint32_t>& planes) const;

  struct CollapseLimits {
    double shape;   ///< of what comes of it, or what is there now if that is worse
    double length;  ///< of edges that come of it
  };
  /// Moves u to v, along what u is on.
  bool collapse(std::uint32_t u, std::uint32_t v, const CollapseLimits& limits);
  /// Moves one of them to the other, that which is on less if it may.
  bool collapse_either(std::uint32_t u, std::uint32_t v, const CollapseLimits& limits);
  /// A new point in the middle of an edge. @param least the shape of what comes of it, at least.
  /// @return the point, or `none` if it was refused.
  std::uint32_t split(std::uint32_t u, std::uint32_t v, double least);
  /// Splits an edge where that makes the worst tetrahedron around it better; one of the surface in its
  /// middle.
  bool split_better(std::uint32_t u, std::uint32_t v);
  /// A new point at x in place of a tetrahedron and of as many around it as must be taken out for all that
  /// comes of it to be of a better shape than `least`.
  bool insert(std::uint32_t t, const Point& x, double least);
  /// The point inside of a tetrahedron with one outer face moves into that face, which it divides: of the
  /// tetrahedron nothing is left. @param least the shape of what is around the point then, at least.
  bool divide_face(std::uint32_t t, double least);
  /// Takes an edge away and fills the hole anew, if that is better. An edge in a plane side is swapped in it.
  bool remove_edge(std::uint32_t u, std::uint32_t v);
  /// Two tetrahedra become three, if that is better. @param face of t, opposite of its point at this place.
  bool flip_face(std::uint32_t t, int face);
  /// Moves a point to where its worst tetrahedron is better.
  bool smooth(std::uint32_t p);
  /// Lets `smooth` leave it where it is until something around it changes.
  void settle(std::uint32_t p) { settled_[p] = clock_ + 1; }
  /// Moves a point of any kind there, if no tetrahedron becomes worse than `least` that was not.
  bool put(std::uint32_t p, const Point& to, double least);
  /// From now on a point of the surface stays where it is.
  void hold(std::uint32_t p) { kind_[p] = std::min(kind_[p], corner); }
  /// Moves a point of any kind if fewer tetrahedra are flat or turned over then, and none is that was not.
  bool nudge(std::uint32_t p, const Point& to);

  /// Rises with every change; and when something around a point has changed for the last time.
  [[nodiscard]] std::uint64_t clock() const { return clock_; }
  /// As if something around a point had changed, and around its neighbours.
  void touch(std::uint32_t p);
  [[nodiscard]] std::uint64_t changed_at(std::uint32_t p) const { return changed_[p]; }

  // Mending: these steps may change what touches what, so who asks for them says where it is close enough.
  // None leaves a tetrahedron turned over by more than those that have gone.

  /// Moves a point inside to where all around it is right side out, if there is such a place.
  bool centre(std::uint32_t p);
  /// Moves u to v, whatever they are on; as many may be turned over as before, or more if these are flat but
  /// for rounding.
  bool merge(std::uint32_t u, std::uint32_t v, bool may_leave_more);
  /// An edge that leads by a point of its tetrahedra leads through it then.
  bool lead_through(std::uint32_t u, std::uint32_t v, std::uint32_t m, Gain gain);
  /// How far two such edges pass by each other; nothing where they do not cross, seen from there.
  [[nodiscard]] std::optional<double> gap_between(const Across& edges) const;
  /// Two edges of the tetrahedron that cross both lead through a new point, the last one then.
  bool cross_edges(std::uint32_t t, const Across& edges);
  /// Where tetrahedra are all around one of its points twice, which merging leaves, the point becomes two.
  bool separate(std::uint32_t t);
  /// Takes out the tetrahedron with those around it, and fills the hole from a new point inside.
  bool hollow(std::uint32_t t);
  /// What may be taken away together, how far the surface moves then, and the way of those that move
  /// farthest, along which the others go less far, where that is known.
  struct Peel {
    std::vector<std::uint32_t> tetrahedra;
    double depth;
    std::optional<Point> way;
    std::int32_t side;  ///< of what faces out then and did not before
  };
  /// A tetrahedron, or a plate of several flat ones where that alone would move the surface by more than
  /// `most`. Nothing if it has no outer faces. Of what stands out of the solid as a fin both sides move to
  /// each other, and are gone.
  [[nodiscard]] std::optional<Peel> look_at_peel(std::uint32_t t, double most) const;
  /// Takes these away.
  bool peel(const Peel& peel);

 private:
  /// The tetrahedra around an edge, and what is on it.
  struct Ring {
    std::vector<std::uint32_t> tetrahedra;
    std::vector<std::pair<std::uint32_t, std::int32_t>> sides;  // of faces at the edge: third point, side
    [[nodiscard]] bool is_inside() const { return sides.empty(); }
    [[nodiscard]] bool is_flat() const { return sides.size() == 2 && sides[0].second == sides[1].second; }
    [[nodiscard]] Kind kind_on_edge() const { return is_inside() ? inside : is_flat() ? on_side : on_edge; }
  };
  /// A part of a ring between two faces on a side, or all of it, to be filled without its edge.
  struct Arc {
    std::vector<std::uint32_t> points;
    std::vector<std::array<std::int32_t, 2>> outer;  // of each step: the side of its face at v, and at u
    std::int32_t part = 0;
    bool is_closed = false;
    std::vector<std::array<int, 3>> triangles;
  };

  struct New {
    std::array<std::uint32_t, 4> point;
    std::array<std::int32_t, 4> side;
    std::int32_t part;
  };
  struct Change {
    std::vector<std::uint32_t> removed;
    std::vector<New> added;
    std::vector<std::pair<std::array<std::uint32_t, 3>, std::int32_t>> hints;
    std::int32_t side = inner;  // of faces that were on none
  };
  /// Areas of the faces of a tetrahedron that nothing is beyond of, and of its others.
  struct OuterFaces {
    double outer = 0, other = 0;
    std::size_t count = 0;      // of outer ones
    std::int32_t side = inner;  // of the largest outer one
    Across edges{};             // if there are two: what they have in common, and what the others have
  };
  /// A face of a tetrahedron before or after a change.
  struct FaceUse {
    std::array<std::uint32_t, 3> face;  // ascending
    enum From : std::uint8_t { gone, kept, made } from;
    std::uint32_t index;
    int place;
    std::int32_t side, part;
    bool is_even;  // on which side of the face the tetrahedron is
  };

  std::vector<PlaneSide> sides_;
  std::vector<Point> points_;
  std::vector<Kind> kind_;
  std::vector<Tetrahedron> tetrahedra_;
  std::vector<std::uint32_t> free_;
  std::vector<std::vector<std::uint32_t>> star_;
  std::uint64_t clock_ = 1;
  std::vector<std::uint64_t> changed_;       // by point, as clock_ was
  std::vector<std::uint64_t> settled_;       // by point: when it was smoothed in vain
  mutable std::vector<std::uint32_t> seen_;  // by point: the call of `neighbours` that has seen it
  mutable std::uint32_t call_ = 0;
  Star star_here_;                    // what `smooth` looks at, and
  std::vector<std::uint32_t> along_;  // what it draws points of the surface to: kept for their memory

  [[nodiscard]] bool is_fixed(std::uint32_t u, std::uint32_t v, const Ring& ring) const {
    return kind_[u] == shared && kind_[v] == shared && !ring.is_inside();
  }
  [[nodiscard]] Kind find_kind(std::uint32_t p) const;
  [[nodiscard]] Ring ring_of(std::uint32_t u, std::uint32_t v) const;
  [[nodiscard]] double shape(const std::array<std::uint32_t, 4>& p) const;
  [[nodiscard]] bool may_go_along(std::uint32_t u, std::uint32_t v, const Ring& ring) const;
  [[nodiscard]] bool keeps_topology(std::uint32_t u, std::uint32_t v, const Ring& ring) const;
  [[nodiscard]] std::vector<std::int32_t> key_of(const Ring& ring) const;
  [[nodiscard]] std::optional<std::array<std::uint32_t, 2>> ends_along(std::uint32_t p) const;
  [[nodiscard]] bool keeps_faces(std::uint32_t p, const Point& to, std::uint32_t but = none) const;
  double look_at_star(std::uint32_t p, Star& star) const;
  void find_along(std::uint32_t p);
  [[nodiscard]] bool leads_along(std::uint32_t p, const Point& way) const;
  [[nodiscard]] Point middle_of(const std::vector<std::uint32_t>& points) const;
  bool arcs_of(std::uint32_t u, std::uint32_t v, const Ring& ring, std::vector<Arc>& arcs) const;
  [[nodiscard]] bool is_new(const Arc& arc) const;
  double fill(Arc& arc, std::uint32_t u, std::uint32_t v, double enough) const;
  std::uint32_t add_point(const Point& x, Kind kind);
  void drop_last_point();
  void move(std::uint32_t p, const Point& to);
  std::uint32_t add(const std::array<std::uint32_t, 4>& points, const std::array<std::int32_t, 4>& sides,
                    std::int32_t part);
  void remove(std::uint32_t t);
  void arrange_tetrahedra(const std::vector<std::uint32_t>& map);
  [[nodiscard]] Point middle_between(std::uint32_t u, std::uint32_t v) const;
  [[nodiscard]] double worst_with_middle(const Ring& ring, std::uint32_t u, std::uint32_t v, std::uint32_t m,
                                         double enough) const;
  void replace_with_middle(const Ring& ring, std::uint32_t u, std::uint32_t v, std::uint32_t m);
  [[nodiscard]] double depth(const std::array<std::uint32_t, 4>& p) const;
  [[nodiscard]] std::vector<FaceUse> uses_of(const Change& change) const;
  [[nodiscard]] bool is_better(const Change& change, Gain gain) const;
  std::int32_t side_like(std::int32_t like, std::int32_t part, std::int32_t other, const Point& normal);
  bool apply(const Change& change);
  static void hint(Change& change, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::int32_t side);
  [[nodiscard]] std::array<std::uint32_t, 3> face_opposite(std::uint32_t t, int place) const;
  template <typename Try>
  bool find_inside(const std::vector<std::array<std::uint32_t, 3>>& faces, const Point& start,
                   const Try& try_it) const;
  [[nodiscard]] std::vector<std::uint32_t> reached_around(std::uint32_t p, std::uint32_t t) const;
  bool cancel(Change& change, std::uint32_t u, std::uint32_t v, const New& tet) const;
  void divide(Change& change, std::uint32_t u, std::uint32_t v, std::uint32_t m) const;
  [[nodiscard]] std::optional<std::array<Point, 2>> nearest_of(const Across& edges) const;
  [[nodiscard]] OuterFaces outer_faces_of(std::uint32_t t) const;
  [[nodiscard]] bool is_outer(std::int32_t side) const {
    return side != inner && sides_[static_cast<std::size_t>(side)].other == PlaneSide::nothing;
  }
  [[nodiscard]] std::optional<Peel> peel_alone(std::uint32_t t) const;
  [[nodiscard]] std::optional<Peel> plate_around(std::uint32_t t, double most) const;
  [[nodiscard]] std::optional<Peel> plate_towards(const Point& normal, std::uint32_t t, double most) const;
  [[nodiscard]] std::vector<std::pair<int, double>> faces_towards(const Point& normal, std::uint32_t t,
                                                                  double width) const;
  [[nodiscard]] Point largest_normal(std::uint32_t t) const;
  bool peel(std::uint32_t t);
  [[nodiscard]] std::optional<Point> way_inwards(std::uint32_t t) const;
  void set_side(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::int32_t side);
};

}  // namespace bsp2::meshing
