#include "bsp2/meshing/groups/groups.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {
namespace {

using Kind = GroupRule::Condition::Kind;

std::string without_spaces(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t'; });
  return text;
}

GroupRule::Condition parse_condition(const std::string& text, const std::string& whole) {
  const auto wrong = [&]() -> Error {
    return Error("--group: '" + text + "' in '" + whole +
                 "' is no condition; write for example x==min, z==max, y==2.5, x<=1 or z>=0, and & between "
                 "several");
  };
  if (text.size() < 4 || text[0] < 'x' || text[0] > 'z') throw wrong();
  const std::string sign = text.substr(1, 2), value = text.substr(3);
  GroupRule::Condition condition{Kind::equal, text[0] - 'x'};
  if (sign == "==" && (value == "min" || value == "max")) {
    condition.kind = value == "min" ? Kind::least : Kind::most;
    return condition;
  }
  if (sign != "==" && sign != "<=" && sign != ">=") throw wrong();
  condition.kind = sign == "==" ? Kind::equal : sign == "<=" ? Kind::at_most : Kind::at_least;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), condition.value);
  if (error != std::errc() || end != value.data() + value.size() || !std::isfinite(condition.value))
    throw wrong();
  return condition;
}

}  // namespace

GroupRule parse_group(const std::string& text) {
  const auto equal = text.find('=');
  if (equal == std::string::npos || equal == 0)
    throw Error("--group: '" + text + "' must be NAME=PREDICATE, for example left=x==min");
  GroupRule rule{text.substr(0, equal), {}};
  while (rule.name.ends_with(' ')) rule.name.pop_back();
  const std::string predicate = without_spaces(text.substr(equal + 1));
  for (std::size_t begin = 0; begin <= predicate.size();) {
    const std::size_t end = std::min(predicate.find('&', begin), predicate.size());
    rule.conditions.push_back(parse_condition(predicate.substr(begin, end - begin), text));
    begin = end + 1;
  }
  return rule;
}

Groups::Groups(std::vector<std::string> part_names, std::vector<GroupRule> rules,
               std::span<const Point> points, double tolerance)
    : part_names_(std::move(part_names)), rules_(std::move(rules)), tolerance_(tolerance) {
  lower_.fill(std::numeric_limits<double>::infinity());
  upper_.fill(-std::numeric_limits<double>::infinity());
  for (const Point& point : points)
    for (std::size_t k = 0; k < 3; ++k) {
      lower_[k] = std::min(lower_[k], point[k]);
      upper_[k] = std::max(upper_[k], point[k]);
    }
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

bool Groups::holds(const GroupRule& rule, const Point& point) const {
  return std::all_of(rule.conditions.begin(), rule.conditions.end(), [&](const auto& condition) {
    const auto axis = static_cast<std::size_t>(condition.axis);
    const double x = point[axis];
    switch (condition.kind) {
      case Kind::least:
        return x <= lower_[axis] + tolerance_;
      case Kind::most:
        return x >= upper_[axis] - tolerance_;
      case Kind::equal:
        return std::fabs(x - condition.value) <= tolerance_;
      case Kind::at_most:
        return x <= condition.value + tolerance_;
      default:
        return x >= condition.value - tolerance_;
    }
  });
}

std::int32_t Groups::group_of(std::int32_t part, std::int32_t other, std::span<const std::uint32_t> corners,
                              std::span<const Point> points) {
  const bool is_interface = other != PlaneSide::nothing;
  std::string name = part_names_.empty() ? "outside" : name_of(part) + "|" + name_of(other);
  for (const GroupRule& rule : rules_)
    if (std::all_of(corners.begin(), corners.end(),
                    [&](std::uint32_t corner) { return holds(rule, points[corner]); })) {
      name = rule.name;
      break;
    }
  const auto [entry, is_new] =
      number_.try_emplace({name, is_interface}, static_cast<std::int32_t>(groups_.size()));
  if (is_new) {
    groups_.push_back(name);
    is_interface_.push_back(is_interface);
  }
  return entry->second;
}

std::vector<std::string> Groups::empty_rules() const {
  std::vector<std::string> names;
  for (const GroupRule& rule : rules_)
    if (std::find(groups_.begin(), groups_.end(), rule.name) == groups_.end()) names.push_back(rule.name);
  return names;
}

}  // namespace bsp2::meshing
