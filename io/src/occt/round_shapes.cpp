#include "occt/round_shapes.hpp"

#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <Precision.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Ax2.hxx>
#include <optional>
#include <variant>

namespace bsp2::io {
namespace {

using geometry::Brep;
using geometry::RoundSolid;

/// Lengths in a shape, and what two of them differ by, are this or 0: ten times what would be a point.
const double shortest = 10 * Precision::Confusion();

class RoundMaker {
 public:
  explicit RoundMaker(const RoundSolid& round)
      : frame_({round.origin[0], round.origin[1], round.origin[2]}, {round.z[0], round.z[1], round.z[2]},
               {round.x[0], round.x[1], round.x[2]}) {}

  std::optional<TopoDS_Solid> operator()(const RoundSolid::Ball& ball) const {
    if (ball.radius < shortest) return std::nullopt;
    return BRepPrimAPI_MakeSphere(frame_, ball.radius).Solid();
  }
  std::optional<TopoDS_Solid> operator()(const RoundSolid::Cone& cone) const {
    const double narrow = std::min(cone.bottom, cone.top), wide = std::max(cone.bottom, cone.top);
    if (cone.height < shortest || wide < shortest) return std::nullopt;
    if (narrow == wide) return BRepPrimAPI_MakeCylinder(frame_, wide, cone.height).Solid();
    if (wide - narrow < shortest || (narrow > 0 && narrow < shortest)) return std::nullopt;
    return BRepPrimAPI_MakeCone(frame_, cone.bottom, cone.top, cone.height).Solid();
  }
  std::optional<TopoDS_Solid> operator()(const RoundSolid::Torus& torus) const {
    if (torus.minor < shortest || torus.major - torus.minor < shortest) return std::nullopt;
    return BRepPrimAPI_MakeTorus(frame_, torus.major, torus.minor).Solid();
  }

 private:
  gp_Ax2 frame_;
};

/// A corner of its outer shell.
const std::array<double, 3>& corner_of(const Brep& brep, const Brep::Solid& solid) {
  const Brep::Side& side = brep.sides_of(brep.shells[solid.first_shell]).front();
  const Brep::Loop& loop = brep.loops_of(brep.faces[side.face]).front();
  return brep.points[brep.from(brep.uses_of(loop).front())];
}

bool is_in_box(const std::array<double, 3>& point, const RoundSolid& round) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (point[axis] < round.lower[axis] || point[axis] > round.upper[axis]) return false;
  return true;
}

}  // namespace

RoundShapes round_shapes(const Brep& brep, std::span<const RoundSolid> rounds) {
  RoundShapes result{{}, std::vector<bool>(brep.solids.size(), true)};
  std::vector<const RoundSolid*> made;
  for (const RoundSolid& round : rounds) {
    const auto shape = std::visit(RoundMaker(round), round.shape);
    if (!shape) continue;
    result.solids.emplace_back(round.part, *shape);
    made.push_back(&round);
  }
  for (std::size_t i = 0; i < brep.solids.size(); ++i) {
    const auto& corner = corner_of(brep, brep.solids[i]);
    result.others[i] = std::none_of(made.begin(), made.end(),
                                    [&](const RoundSolid* round) { return is_in_box(corner, *round); });
  }
  return result;
}

}  // namespace bsp2::io
