#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/dataflow/shapes/patch.hpp"
#include "bsp2/geometry/families/computed_family.hpp"

namespace bsp2::dataflow {

/// The patches of a spline or subdivision surface of k parameters in E^D, halved again and again in all
/// parameters at once: as deep as somebody asks. Each has a number, a box that holds it, and 2 (D - k)
/// hyperplanes between which it lies, across its mean tangents. All of them enclose it for certain: they
/// allow for all rounding.
///
/// In the tree's frame coordinates are at most 1 in size; x = scale y + origin places it in the model.
/// Nodes are made when they are first asked for; what they are does not depend on when, nor on who asks.
/// Thread rule: any number of threads may ask.
/// Source: docs/curved.md.
template <int D>
class PatchTree final : public geometry::ComputedFamily<D> {
 public:
  using Point = std::array<double, D>;
  struct Placement {
    double scale = 1;  ///< a power of two
    Point origin{};
  };
  /// @param roots patches of one k < D each, in the frame. @param error bounds how far their coordinates are
  /// off.
  /// @param weight_ratio the largest weight by the smallest. @param limit at most so many hyperplanes get a
  /// number.
  /// @param closed whether the patches together have no boundary; k = D - 1, D = 2 or 3.
  PatchTree(std::vector<Patch<D>> roots, const Placement& placement, double error, double weight_ratio,
            bool closed, std::uint64_t limit);
  ~PatchTree() override;

  /// A patch, by its number: those of level 0 are 0 ... roots() - 1.
  using Number = std::uint32_t;
  class Node {
   public:
    [[nodiscard]] const Box<D>& box() const { return box_; }
    [[nodiscard]] double size() const { return size_; }  ///< the longest side of the box
    [[nodiscard]] const std::vector<std::array<std::int64_t, D + 1>>& hyperplanes() const {
      return hyperplanes_;
    }
    /// On which sides of a hyperplane points are, for certain, whose coordinates are off by at most `error`.
    struct Sides {
      bool all_positive, some_negative;
    };
    [[nodiscard]] Sides sides(std::size_t hyperplane, std::span<const Point> points, double error) const;
    /// The hyperplane's value at a point, rounded, by the length of its normal.
    [[nodiscard]] double at(std::size_t hyperplane, const Point& point) const;
    /// False where all points are certainly beyond one of the hyperplanes.
    [[nodiscard]] bool may_be_between(std::span<const Point> points, double error) const;

   private:
    friend class PatchTree;
    Patch<D> patch_;
    Box<D> box_;
    double size_ = 0;
    std::vector<std::array<std::int64_t, D + 1>> hyperplanes_;
    mutable std::atomic<Node*> halves_{nullptr};  // an array; made by whoever needs it first
  };
  [[nodiscard]] Number roots() const { return roots_; }
  [[nodiscard]] std::uint32_t levels() const { return levels_; }  ///< of the deepest patches
  [[nodiscard]] std::uint32_t level(Number number) const;
  /// @pre level(number) < levels().
  [[nodiscard]] Number first_half(Number number) const;
  [[nodiscard]] std::uint32_t halves() const { return std::uint32_t{1} << parameters_; }
  [[nodiscard]] const Node& node(Number number) const;
  /// The halves of a node of this level, in the order of their numbers.
  [[nodiscard]] const Node* halves_of(const Node& node, std::uint32_t level) const;
  [[nodiscard]] const Placement& placement() const { return placement_; }
  [[nodiscard]] bool closed() const { return closed_; }

  /// How many hyperplanes a patch has; they are number * that + 0, 1, ... of the family.
  [[nodiscard]] std::uint32_t hyperplanes() const { return 2 * static_cast<std::uint32_t>(D - parameters_); }
  [[nodiscard]] std::uint32_t count() const override { return first_of_level_.back() * hyperplanes(); }
  [[nodiscard]] std::array<std::int64_t, D + 1> covector(std::uint32_t number) const override {
    return node(number / hyperplanes()).hyperplanes_[number % hyperplanes()];
  }

  /// How often the closed surface winds around a point in the frame, whose coordinates are off by at most
  /// `error`.
  /// @return nothing where the patches are not small enough to tell, or the point is too near to them.
  [[nodiscard]] std::optional<int> winding(const Point& point, double error) const;

 private:
  Placement placement_;
  double error_, halving_error_ = 0;
  bool closed_;
  int parameters_;
  Number roots_;
  std::uint32_t levels_ = 0;
  std::vector<Number> first_of_level_;  // levels_ + 2 of them
  Node* nodes_;                         // the roots

  [[nodiscard]] double error_at(std::uint32_t level) const { return error_ + halving_error_ * (level + 2); }
  void finish(Node& node, std::uint32_t level) const;
  void add_hyperplanes(Node& node, const std::vector<Point>& points, double error) const;
  static void release(Node* nodes, std::size_t count, std::size_t halves);
  [[nodiscard]] std::optional<std::uint32_t> level_around(const Node& node, std::uint32_t level,
                                                          const Point& point, double error) const;
  struct Segment;
  [[nodiscard]] bool count_crossings(const Node& node, std::uint32_t level, const Segment& segment,
                                     int& winding) const;
};

}  // namespace bsp2::dataflow
