#include "faces/edge_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace bsp2::geometry {
namespace {

/// The part that is next to a face on its counter-clockwise side about an edge, or on the other one.
std::int32_t part_beside(const FaceAtEdge& face, bool counter_clockwise) {
  return face.forward == counter_clockwise ? face.face->other : face.face->owner;
}

/// Out of the face's part.
std::array<double, 3> normal_of(const HyperplaneTable<3>& table, OrientedHyperplane outward) {
  const auto& plane = table.rounded(outward.id());
  return outward.flipped() ? plane.opposite().normal : plane.normal;
}

}  // namespace

bool EdgeOrder::are_about_one_edge(std::span<const FaceAtEdge> faces) {
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (part_beside(faces[i], true) != part_beside(faces[(i + 1) % faces.size()], false)) return false;
  return true;
}

bool EdgeOrder::make_pairs(std::span<FaceAtEdge> faces) {
  // By the part that begins with a face, counter-clockwise, and what is before it.
  std::map<std::array<std::int32_t, 2>, std::vector<FaceAtEdge>> open;
  std::vector<FaceAtEdge> pairs, closing;
  const auto close = [&](const FaceAtEdge& face) {
    auto& opened = open[{part_beside(face, false), part_beside(face, true)}];
    if (opened.empty()) return false;
    pairs.insert(pairs.end(), {opened.back(), face});
    opened.pop_back();
    return true;
  };
  for (const FaceAtEdge& face : faces) {
    if (close(face)) continue;
    if (const std::int32_t begins = part_beside(face, true); begins != Skin::outside)
      open[{begins, part_beside(face, false)}].push_back(face);
    else
      closing.push_back(face);  // by one that follows, around the edge
  }
  if (!std::ranges::all_of(closing, close) || pairs.size() != faces.size()) return false;
  std::ranges::copy(pairs, faces.begin());
  return true;
}

/// On which side of the plane of one face another one leaves their edge: 1 = counter-clockwise of it, seen
/// from the edge's higher end, by less than half a turn; 0 = in its plane. Exact.
int EdgeOrder::side(const FaceAtEdge& of, const FaceAtEdge& other) {
  const OrientedHyperplane outward = of.face->outward;
  if (outward.id() == other.face->outward.id()) return 0;
  const int side = exact_.side(*other.apex, outward.id());
  return outward.flipped() == of.forward ? -side : side;
}

/// The quarter of the turn from one face that another one leaves the edge in: 0 = with it, 1 = in the first
/// half, 2 = opposite to it, 3 = in the second half.
int EdgeOrder::quarter(const FaceAtEdge& of, const FaceAtEdge& other) {
  const int where = side(of, other);
  if (where != 0) return where > 0 ? 1 : 3;
  const bool is_opposite = (of.face->outward == other.face->outward) != (of.forward == other.forward);
  return is_opposite ? 2 : 0;
}

void EdgeOrder::sort(std::span<FaceAtEdge> faces) {
  if (faces.size() < 3) return;
  const FaceAtEdge first = faces.front();
  std::stable_sort(faces.begin() + 1, faces.end(), [&](const FaceAtEdge& a, const FaceAtEdge& b) {
    const int of_a = quarter(first, a), of_b = quarter(first, b);
    return of_a != of_b ? of_a < of_b : side(a, b) > 0;
  });
}

double EdgeOrder::angle(const FaceAtEdge& face, const FaceAtEdge& next) {
  constexpr double half = std::numbers::pi;
  const int where = quarter(face, next);
  if (where == 0) return 2 * half;
  if (where == 2) return half;
  const auto a = normal_of(exact_.table(), face.face->outward),
             b = normal_of(exact_.table(), next.face->outward);
  const double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
               sine = std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                 a[0] * b[1] - a[1] * b[0]);
  const double nearer = std::atan2(sine, face.forward == next.forward ? cosine : -cosine);
  return where == 1 ? nearer : 2 * half - nearer;
}

}  // namespace bsp2::geometry
