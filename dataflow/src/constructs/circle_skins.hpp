#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::dataflow {

/// A circle in the model.
struct Circle {
  std::array<double, 2> centre;
  double radius;
  [[nodiscard]] double angle_of(const std::array<double, 2>& point) const;
  [[nodiscard]] std::array<double, 2> at(double angle) const;
};

/// Where two circles meet: no point, two, or one where they touch, or miss each other by rounding alone.
std::vector<std::array<double, 2>> meetings(const Circle& a, const Circle& b, double rounding);
/// Where a circle and the line normal . x + offset = 0 do. @pre the normal is of unit length.
std::vector<std::array<double, 2>> meetings(const Circle& circle, const std::array<double, 2>& normal,
                                            double offset, double rounding);

/// The circles of a plane network, and where it is certain that they bound the solid.
///
/// A FUZZY cell is localized once more. Where one operand is left, and it is a circle, the solid in the cell
/// is what is within that circle, or what is outside: so all of the circle in the cell is boundary. Where
/// several circles are left that may end at the points in which they meet, and nowhere else. Straight
/// operands may be left where the run ended early: of such a cell nothing is known.
class CircleSkins {
 public:
  /// @param reach of the coordinates.
  CircleSkins(const Network<2>& network, double reach);
  /// The next FUZZY cell. They are numbered from 0.
  void add(const geometry::CellBatch& batch, std::size_t cell) {
    cells_.push_back({&batch, cell, {}, false, nobody, nobody});
  }
  /// After all cells have been added.
  void find();

  [[nodiscard]] bool is_empty() const { return cells_.empty(); }
  /// The circles that are left in a FUZZY cell; none: something else is left as well.
  [[nodiscard]] std::span<const std::uint32_t> circles_of(std::uint32_t cell) const {
    if (cells_[cell].is_unknown) return {};
    return cells_[cell].circles;
  }
  [[nodiscard]] const Circle& circle(std::uint32_t number) const { return circles_[number]; }
  /// Of all FUZZY cells: by no more can the polygon differ from the solid.
  [[nodiscard]] double area() const;
  /// Whether a line is a tangent, a chord or a spoke of what is curved.
  [[nodiscard]] bool is_of_curve(geometry::HyperplaneId line) const;
  /// What lengths differ by that are equal but for rounding.
  [[nodiscard]] double rounding() const { return rounding_; }

  /// What lies beside a piece of a circle that is asked about.
  enum class Beside : std::uint8_t {
    ends,     ///< the piece ends there: other circles must not cross it
    boundary  ///< more of the circle, which bounds the solid on the same side
  };
  /// A piece of a circle, from an angle on to the left.
  struct Arc {
    std::uint32_t circle;
    std::int32_t part;   ///< that it bounds
    bool is_inside;      ///< the part is within the circle, and not around it
    double from, sweep;  ///< sweep > 0, at most a whole turn
  };
  /// Whether a piece of a circle certainly bounds the solid, if any of it does: it lies in cells where it is
  /// left, and where others are left, too, they do not cross it. (A single one may between pieces that bound
  /// the solid on the same side: then it does not matter there.)
  /// @param alone whether in some of the piece it has to be the only thing that is left: then the answer does
  /// not hang on an "if".
  [[nodiscard]] bool bounds(const Arc& arc, Beside beside, bool alone) const;
  /// Likewise, of the whole circle.
  [[nodiscard]] bool bounds_all_around(std::uint32_t circle, std::int32_t part, bool is_inside) const;

 private:
  /// Where nothing is; other than any part.
  static constexpr std::int32_t nobody = std::numeric_limits<std::int32_t>::min();
  struct FuzzyCell {
    const geometry::CellBatch* batch;
    std::size_t cell;
    std::vector<std::uint32_t> circles;
    bool is_unknown;
    std::int32_t inside,
        outside;  ///< of a single circle that is left: which part is within it, and around it
  };
  /// A piece of a circle in a cell: angles, from < to <= from + 2 pi.
  struct Span {
    double from, to;
    std::uint32_t cell;
  };
  const Network<2>& network_;
  double rounding_;
  std::vector<Circle> circles_;
  std::vector<std::vector<Span>> spans_;       // of each circle
  std::vector<std::int32_t> circle_of_round_;  // by index into Network::rounds; -1: it is none
  std::vector<std::pair<geometry::HyperplaneId, geometry::HyperplaneId>> families_;  // ascending
  std::vector<FuzzyCell> cells_;

  void add_circle(const Round<2>& round, std::size_t index);
  void find(const geometry::Cell<2>& around, std::span<const Word> program, std::span<std::uint32_t> cells,
            class CellCutter& cutter);
  void take(FuzzyCell& cell, std::span<const Word> left) const;
  void add_spans(std::uint32_t number);
  /// Whether nothing but its circle is left in a cell, and what it bounds there.
  [[nodiscard]] bool is_alone(const Span& span) const { return cells_[span.cell].circles.size() == 1; }
  [[nodiscard]] bool has_side(const Span& span, std::int32_t part, bool is_inside) const;
  [[nodiscard]] std::vector<Span> within(const Arc& arc) const;
  [[nodiscard]] std::size_t crossings(const Arc& arc, const std::vector<Span>& spans, double from,
                                      double to) const;
};

}  // namespace bsp2::dataflow
