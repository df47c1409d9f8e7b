#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// A set of faces by a name of the user's: those all of whose corners are where a predicate says.
struct GroupRule {
  struct Condition {
    enum class Kind : std::uint8_t { equal, at_most, at_least, least, most } kind;
    int axis;
    double value = 0;  ///< of the first three
  };
  std::string name;
  std::vector<Condition> conditions;  ///< all of them
};

/// Reads `NAME=PREDICATE`, a predicate being conditions that are joined by `&`: `x==min`, `z==max`, `y==2.5`,
/// `x<=1`, `z>=0`. @throws bsp2::Error that says what is wrong.
GroupRule parse_group(const std::string& text);

/// Names of volumes and of faces: volumes by part, faces by what is on their two sides (`steel|outside`,
/// `copper|steel`), or as a rule says. Of several rules the first one that fits counts.
class Groups {
 public:
  /// @param part_names by number; where nothing has a name, the whole is `solid`, and its faces `outside`.
  /// @param tolerance by which corners may miss what a rule says.
  Groups(std::vector<std::string> part_names, std::vector<GroupRule> rules, std::span<const Point> points,
         double tolerance);

  /// The number of a part's volume.
  std::int32_t volume_of(std::int32_t part);
  /// The number of a face's group. @param other as in PlaneSide.
  std::int32_t group_of(std::int32_t part, std::int32_t other, std::span<const std::uint32_t> corners,
                        std::span<const Point> points);

  [[nodiscard]] const std::vector<std::string>& volumes() const { return volumes_; }
  [[nodiscard]] const std::vector<std::string>& groups() const { return groups_; }
  /// Whether a group is between two parts.
  [[nodiscard]] const std::vector<bool>& is_interface() const { return is_interface_; }
  /// Names of rules that no face has followed.
  [[nodiscard]] std::vector<std::string> empty_rules() const;

 private:
  std::vector<std::string> part_names_;
  std::vector<GroupRule> rules_;
  Point lower_{}, upper_{};
  double tolerance_;
  std::vector<std::string> volumes_, groups_;
  std::vector<bool> is_interface_;
  std::map<std::int32_t, std::int32_t> volume_of_part_;
  std::map<std::pair<std::string, bool>, std::int32_t> number_;

  [[nodiscard]] std::string name_of(std::int32_t part) const;
  [[nodiscard]] bool holds(const GroupRule& rule, const Point& point) const;
};

}  // namespace bsp2::meshing
