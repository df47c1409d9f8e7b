#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "surface/no_index.hpp"

namespace bsp2::geometry {

/// A corner of a convex polygon on a plane: a point, and what carries the edge from there to the next corner.
struct PlaneCorner {
  std::uint32_t point;
  HyperplaneId across;
};

/// The points of a plane, each known by two other hyperplanes; the same two name the same point.
class PlanePoints {
 public:
  explicit PlanePoints(const HyperplaneTable<3>& table) : table_(table) {}
  void clear(HyperplaneId plane) {
    plane_ = plane;
    vertices_.clear();
    heads_.assign(64, none);
    next_.clear();
    keys_.clear();
  }
  /// The point in which the plane meets two others.
  std::uint32_t find(HyperplaneId a, HyperplaneId b) {
    return find(a, b, [&] { return canonical_vertex(table_, {plane_, a, b}); });
  }
  /// The point in which the plane meets two others. @param make gives a vertex that is this point, of
  /// whatever hyperplanes, where it is new.
  template <typename Make>
  std::uint32_t find(HyperplaneId a, HyperplaneId b, Make&& make) {
    const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    for (std::uint32_t at = heads_[slot(key)]; at != none; at = next_[at])
      if (keys_[at] == key) return at;
    if (vertices_.size() == heads_.size()) grow();
    vertices_.push_back(make());
    keys_.push_back(key);
    std::uint32_t& head = heads_[slot(key)];
    next_.push_back(head);
    return head = static_cast<std::uint32_t>(vertices_.size() - 1);
  }
  [[nodiscard]] const std::vector<Vertex<3>>& vertices() const { return vertices_; }
  /// The two hyperplanes that name a point.
  [[nodiscard]] std::pair<HyperplaneId, HyperplaneId> name(std::uint32_t point) const {
    return {static_cast<HyperplaneId>(keys_[point] >> 32), static_cast<HyperplaneId>(keys_[point])};
  }

 private:
  const HyperplaneTable<3>& table_;
  HyperplaneId plane_ = 0;
  std::vector<Vertex<3>> vertices_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> heads_, next_;  // a hash table, chained

  [[nodiscard]] std::size_t slot(std::uint64_t key) const {
    return (key * 0x9e3779b97f4a7c15u >> 32) & (heads_.size() - 1);
  }
  void grow() {
    heads_.assign(4 * heads_.size(), none);
    for (std::uint32_t i = 0; i < keys_.size(); ++i) {
      std::uint32_t& head = heads_[slot(keys_[i])];
      next_[i] = head;
      head = i;
    }
  }
};

/// The skin on one plane: the sum of the outlines of polygons, in which what runs along each other in
/// opposite directions cancels. Thread rule: one thread at a time.
class PlaneSkin {
 public:
  explicit PlaneSkin(ExactPoints& exact) : exact_(exact), points_(exact.table()), adder_(exact) {}

  void clear(HyperplaneId plane) {
    plane_ = plane;
    points_.clear(plane);
    also_on_.clear();
    faces_.clear();
    edges_.clear();
  }
  [[nodiscard]] PlanePoints& points() { return points_; }
  [[nodiscard]] const PlanePoints& points() const { return points_; }
  /// A point is found to be on one more hyperplane than those of its vertex, and those that name it.
  void add_incidence(std::uint32_t point, HyperplaneId id) { also_on_.emplace_back(point, id); }
  /// @return the number of the skin that looks to the positive side (flipped: to the negative one), in front
  /// of this owner. @param other the part that it looks into.
  std::uint32_t face_of(bool flipped, std::int32_t owner, std::int32_t other = Skin::outside);
  /// @param forward the polygon is on the left of its edges, seen from where the face looks to.
  void add_loop(std::span<const PlaneCorner> corners, std::uint32_t face, bool forward);
  /// Appends the sum: what is seen to cancel, which is nearly all that does, is gone.
  void append_to(Skin& skin);

 private:
  ExactPoints& exact_;
  PlanePoints points_;
  LineAdder adder_;
  HyperplaneId plane_ = 0;
  std::vector<std::pair<std::uint32_t, HyperplaneId>> also_on_;
  std::vector<Skin::Face> faces_;
  EdgeChain edges_;
  PointSet united_;

  void reduce();
};

}  // namespace bsp2::geometry
