#include "bsp2/meshing/groups/groups.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

using Sign = GroupRule::Condition::Sign;
using Bound = GroupRule::Condition::Bound;

/// Where the mesh ends, for conditions that ask for that.
void give_value(GroupRule::Condition& condition, std::span<const Point> points) {
  if (condition.bound == Bound::given || points.empty()) return;
  const auto lower = [&](const Point& a, const Point& b) {
    return dot(condition.normal, a) < dot(condition.normal, b);
  };
  const auto [least, most] = std::minmax_element(points.begin(), points.end(), lower);
  condition.value = dot(condition.normal, condition.bound == Bound::least ? *least : *most);
  condition.bound = Bound::given;
}

/// In degrees.
double angle_between(const Point& a, const Point& b) {
  const Point sine = cross(a, b);
  return std::atan2(std::sqrt(dot(sine, sine)), dot(a, b)) * 180 / std::numbers::pi;
}

/// Faces by pieces: each is called by the first face in it.
class Pieces {
 public:
  explicit Pieces(std::size_t faces) : first_(faces) {
    std::iota(first_.begin(), first_.end(), std::size_t{0});
  }
  std::size_t of(std::size_t face) {
    while (first_[face] != face) face = first_[face] = first_[first_[face]];
    return face;
  }
  void join(std::size_t a, std::size_t b) {
    const auto [low, high] = std::minmax({of(a), of(b)});
    first_[high] = low;
  }

 private:
  std::vector<std::size_t> first_;
};

/// Edges of some faces, in order.
struct EdgeOfFace {
  std::array<std::uint32_t, 2> ends;
  std::size_t face;
  friend auto operator<=>(const EdgeOfFace&, const EdgeOfFace&) = default;
};

std::vector<EdgeOfFace> edges_of(std::span<const GroupFace> faces, const std::vector<std::size_t>& some) {
  std::vector<EdgeOfFace> edges;
  for (const std::size_t face : some)
    for (std::size_t i = 0, n = faces[face].corners.size(); i < n; ++i) {
      const auto [low, high] = std::minmax({faces[face].corners[i], faces[face].corners[(i + 1) % n]});
      edges.push_back({{low, high}, face});
    }
  std::sort(edges.begin(), edges.end());
  return edges;
}

/// A billionth of a degree is what rounding makes of normals.
Pieces smooth_pieces(std::span<const GroupFace> faces, const std::vector<std::size_t>& some, double angle) {
  Pieces pieces(faces.size());
  const std::vector<EdgeOfFace> edges = edges_of(faces, some);
  for (auto a = edges.begin(); a != edges.end(); ++a)
    for (auto b = a + 1; b != edges.end() && b->ends == a->ends; ++b)
      if (angle_between(faces[a->face].outward, faces[b->face].outward) <= angle + 1e-9)
        pieces.join(a->face, b->face);
  return pieces;
}

}  // namespace

Groups::Groups(std::vector<std::string> part_names, std::map<std::int32_t, Rgba> part_colours,
               std::vector<GroupRule> rules, std::span<const Point> points, double tolerance)
    : part_names_(std::move(part_names)),
      part_colours_(std::move(part_colours)),
      rules_(std::move(rules)),
      is_followed_(rules_.size(), false),
      tolerance_(tolerance) {
  for (GroupRule& rule : rules_)
    for (GroupRule::Condition& condition : rule.conditions) give_value(condition, points);
}

std::string Groups::name_of(std::int32_t part) const {
  if (part == PlaneSide::nothing) return "outside";
  if (part >= 0 && static_cast<std::size_t>(part) < part_names_.size())
    return part_names_[static_cast<std::size_t>(part)];
  return part_names_.empty() ? "solid" : "rest";
}

std::int32_t Groups::volume_of(std::int32_t part) {
  const auto [entry, is_new] = volume_of_part_.try_emplace(part, static_cast<std::int32_t>(volumes_.size()));
  if (is_new) volumes_.push_back(name_of(part));
  return entry->second;
}

bool Groups::has_colour(std::int32_t part, const Rgba& colour) const {
  const auto found = part_colours_.find(part);
  if (found == part_colours_.end()) return false;
  const std::size_t channels = colour[3] == 255 ? 3 : 4;
  return std::equal(colour.begin(), colour.begin() + channels, found->second.begin());
}

bool Groups::holds(const GroupRule::Condition& condition, const Point& point) const {
  const double off = dot(condition.normal, point) - condition.value;
  const double tolerance = tolerance_ * std::sqrt(dot(condition.normal, condition.normal));
  return (condition.sign == Sign::at_least || off <= tolerance) &&
         (condition.sign == Sign::at_most || off >= -tolerance);
}

std::int32_t Groups::group_of(std::int32_t part, std::int32_t other, std::span<const std::uint32_t> corners,
                              std::span<const Point> points) {
  geometry::Interruption::check();
  std::string name = part_names_.empty() ? "outside" : name_of(part) + "|" + name_of(other);
  const auto follows = [&](const GroupRule& rule) {
    return std::all_of(
               rule.colours.begin(), rule.colours.end(),
               [&](const Rgba& colour) { return has_colour(part, colour) || has_colour(other, colour); }) &&
           std::all_of(rule.conditions.begin(), rule.conditions.end(), [&](const auto& condition) {
             return std::all_of(corners.begin(), corners.end(),
                                [&](std::uint32_t corner) { return holds(condition, points[corner]); });
           });
  };
  Named named =
      other == PlaneSide::nothing ? Named::outside : Named::between;  // a part may be called 'outside'
  if (const auto rule = std::find_if(rules_.begin(), rules_.end(), follows); rule != rules_.end()) {
    name = rule->name;
    named = Named::by_rule;
    is_followed_[static_cast<std::size_t>(rule - rules_.begin())] = true;
  }
  const auto [entry, is_new] = number_.try_emplace({name, named}, static_cast<std::int32_t>(groups_.size()));
  if (is_new) groups_.push_back(name);
  return entry->second;
}

const GroupRule* Groups::rule_called(const std::string& name) const {
  const auto found =
      std::find_if(rules_.begin(), rules_.end(), [&](const GroupRule& rule) { return rule.name == name; });
  return found == rules_.end() ? nullptr : &*found;
}

void Groups::divide(std::span<const GroupFace> faces, std::vector<std::int32_t>& group) {
  std::map<std::string, int> pieces_called;
  const std::vector<std::string> names = groups_;  // before there are more
  for (std::size_t number = 0; number < names.size(); ++number) {
    const GroupRule* rule = rule_called(names[number]);
    if (rule == nullptr || !rule->angle) continue;
    std::vector<std::size_t> some;
    for (std::size_t face = 0; face < faces.size(); ++face)
      if (group[face] == static_cast<std::int32_t>(number)) some.push_back(face);
    Pieces pieces = smooth_pieces(faces, some, *rule->angle);
    std::map<std::size_t, std::int32_t> group_of_piece;
    for (const std::size_t face : some) {
      geometry::Interruption::check();
      const std::size_t piece = pieces.of(face);
      const auto [entry, is_new] = group_of_piece.try_emplace(piece, static_cast<std::int32_t>(number));
      if (is_new) {
        if (piece != some.front()) {
          entry->second = static_cast<std::int32_t>(groups_.size());
          groups_.emplace_back();
        }
        groups_[static_cast<std::size_t>(entry->second)] =
            rule->name + "_" + std::to_string(++pieces_called[rule->name]);
      }
      group[face] = entry->second;
    }
  }
}

std::vector<std::string> Groups::empty_rules() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < rules_.size(); ++i)
    if (!is_followed_[i] && std::find(groups_.begin(), groups_.end(), rules_[i].name) == groups_.end())
      names.push_back(rules_[i].name);
  return names;
}

}  // namespace bsp2::meshing
