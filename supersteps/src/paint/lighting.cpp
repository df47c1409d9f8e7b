#include "paint/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bsp2::supersteps {

namespace {

// The second light is for what is turned away from the first one.
const Vector first_light = normalized({-0.5, 0.6, 0.7}), from_beside = normalized({0.9, 0.1, 0.4});

}  // namespace

double brightness(const Vector& normal) {
  return 0.5 + 0.1 * normal[1] + 0.48 * std::max(0.0, dot(normal, first_light)) +
         0.18 * std::max(0.0, dot(normal, from_beside));
}

Lighting::Lighting(const Camera& camera, const Frame& frame, const RoundFaces* round,
                   std::span<const Vector> shifts, double radius, double skin)
    : camera_(camera), frame_(frame), round_(round), radius_(radius), skin_(skin) {
  if (round == nullptr) return;
  placements_ = round->seen(camera);
  for (const Vector& shift : shifts) shifts_.push_back(camera.turn(shift));
}

Vector Lighting::point(const SeenFacet& facet, const Point2& place) const {
  return camera_.meet(facet.plane, frame_.unplace(place));
}

Vector Lighting::normal(const SeenFacet& facet, const Vector& point) const {
  if (facet.round.body < 0 || round_ == nullptr) return facet.normal();
  const Vector unmoved = facet.region < shifts_.size() ? difference(point, shifts_[facet.region]) : point;
  return round_->normal(facet.round, placements_[static_cast<std::size_t>(facet.round.body)], unmoved,
                        facet.normal());
}

bool Lighting::is_edge(const SeenFacet* a, const Point2& at_a, const SeenFacet* b, const Point2& at_b) const {
  if (a == nullptr || b == nullptr) return true;
  if (!a->is_lit() || !b->is_lit()) return false;
  if (a->plane == b->plane && a->round.body < 0 && b->round.body < 0) return false;
  const Vector here = point(*a, at_a), there = point(*b, at_b);
  static const double least = std::cos(30 * std::numbers::pi / 180);
  if (dot(normal(*a, here), normal(*b, there)) < least) return true;
  // Beside each other: from one place to the other both planes change so much at most, and the depths differ
  // by no more. A skin has steps, as thick as it is.
  const double change = std::fabs(point(*a, at_b)[2] - here[2]) + std::fabs(point(*b, at_a)[2] - there[2]);
  const double sample = std::fabs(at_a[0] - at_b[0]) + std::fabs(at_a[1] - at_b[1]);
  const double size = (camera_.is_perspective() ? -here[2] : 1) * sample / frame_.scale();
  const double step = a->round.side != 0 && b->round.side != 0 ? 4 * skin_ : 0;
  return !(std::fabs(here[2] - there[2]) <= 1.5 * change + size + step);
}

}  // namespace bsp2::supersteps
