#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// Red, green, blue, opacity.
using Rgba = std::array<std::uint8_t, 4>;

/// A set of faces by a name of the user's: those all of whose corners are where the conditions say, and that
/// are of a part of a colour, if there are colours.
struct GroupRule {
  /// A plane or a half-space: `normal` times a corner is `value`, or at most or at least that.
  struct Condition {
    enum class Sign : std::uint8_t { equal, at_most, at_least } sign = Sign::equal;
    enum class Bound : std::uint8_t { given, least, most } bound = Bound::given;
    Point normal{};
    double value = 0;  ///< where it is given: else the least or the most that a point of the mesh has
  };
  std::string name;
  std::vector<Condition> conditions;  ///< all of them
  std::vector<Rgba> colours;          ///< all of them; one without opacity fits any
  /// Divided into pieces, `NAME_1`, `NAME_2`, ..., whose faces meet at no more degrees.
  std::optional<double> angle;
};

/// A face of a mesh, as `Groups::divide` needs it.
struct GroupFace {
  std::span<const std::uint32_t> corners;  ///< a cycle
  Point outward;                           ///< unit normal, out of the part of the lower number
};

/// Names of volumes and of faces: volumes by part, faces by what is on their two sides (`steel|outside`,
/// `copper|steel`), or as a rule says. Of several rules the first one that fits counts.
class Groups {
 public:
  /// @param part_names by number; where nothing has a name, the whole is `solid`, and its faces `outside`.
  /// @param part_colours by number; a part that is missing has none.
  /// @param tolerance by which corners may miss what a rule says.
  Groups(std::vector<std::string> part_names, std::map<std::int32_t, Rgba> part_colours,
         std::vector<GroupRule> rules, std::span<const Point> points, double tolerance);

  /// The number of a part's volume.
  std::int32_t volume_of(std::int32_t part);
  /// The number of a face's group. @param other as in PlaneSide.
  std::int32_t group_of(std::int32_t part, std::int32_t other, std::span<const std::uint32_t> corners,
                        std::span<const Point> points);

  /// When all faces have a group: divides those of rules with an angle. Pieces are numbered in the order of
  /// their first faces.
  /// @param group of each face; -1: none. Gets the new numbers.
  void divide(std::span<const GroupFace> faces, std::vector<std::int32_t>& group);

  [[nodiscard]] const std::vector<std::string>& volumes() const { return volumes_; }
  [[nodiscard]] const std::vector<std::string>& groups() const { return groups_; }
  /// Names of rules that no face has followed.
  [[nodiscard]] std::vector<std::string> empty_rules() const;

 private:
  std::vector<std::string> part_names_;
  std::map<std::int32_t, Rgba> part_colours_;
  std::vector<GroupRule> rules_;   ///< all values given
  std::vector<bool> is_followed_;  ///< of each rule
  double tolerance_;
  std::vector<std::string> volumes_, groups_;
  std::map<std::int32_t, std::int32_t> volume_of_part_;
  enum class Named : std::uint8_t { by_rule, outside, between };
  std::map<std::pair<std::string, Named>, std::int32_t> number_;

  [[nodiscard]] std::string name_of(std::int32_t part) const;
  [[nodiscard]] bool has_colour(std::int32_t part, const Rgba& colour) const;
  [[nodiscard]] bool holds(const GroupRule::Condition& condition, const Point& point) const;
  [[nodiscard]] const GroupRule* rule_called(const std::string& name) const;
};

}  // namespace bsp2::meshing
