#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"
#include "bsp2/geometry/surface/skin_builder.hpp"
#include "surface/mesh_clipper.hpp"
#include "surface/operand_facets.hpp"
#include "surface/sided_expression.hpp"
#include "surface/whole_facets.hpp"

namespace bsp2::dataflow {

/// A box between planes across the axes that no operand ends in, with what of the expression is undecided
/// there. An operand is undecided in a box if it has facets there.
struct SurfaceBox {
  /// Positions on the table's grid.
  std::array<std::uint32_t, 3> low{}, high{};
  Words program;  ///< leaves without state; empty: there is no surface in the box
  /// An undecided leaf; in the order of the program.
  struct Operand {
    std::uint32_t producer, end;  ///< its facets end here; they begin where those of the operand before end
  };
  geometry::Buffer<Operand> operands;
  geometry::Buffer<std::uint32_t> facets;
  std::uint8_t in_vain = 0;  ///< so many cuts in a row have told next to nothing

  [[nodiscard]] std::span<const std::uint32_t> facets_of(std::size_t operand) const {
    const std::uint32_t begin = operand == 0 ? 0 : operands[operand - 1].end;
    return {facets.data() + begin, operands[operand].end - begin};
  }
};

/// A box in which the surface is found by cells: facets of meshes lie in planes of others there, or end in
/// them, or may not bound their mesh.
struct HotBox {
  std::array<std::uint32_t, 3> low{}, high{};
  std::vector<Word> program;  ///< localized
};

/// The sides of a box, or of a region.
struct BoxSides {
  std::array<std::uint32_t, 3> low, high;
};

/// What of facets of meshes is told when all regions are done: whether they meet other operands in any.
struct FacetsAcrossRegions {
  std::vector<WholeFacet> whole;  ///< these do not
  /// A facet that meets no other operand in a region, and reaches beyond that.
  struct Part {
    WholeFacet facet;
    BoxSides region;
  };
  std::vector<Part> parts;
  std::vector<std::uint32_t> touched;  ///< those that do, or that end there undecided
};

/// What one thread looks for the surface with. Thread rule: one thread at a time.
class SurfaceTracer {
 public:
  /// @param stop somebody else ends the work by it: the surface is not complete then.
  SurfaceTracer(const Network<3>& network, const OperandFacets& facets, const std::atomic<bool>& stop);

  /// All of the model that is in the space of the facets.
  [[nodiscard]] SurfaceBox whole();
  struct Cut {
    int axis;
    std::uint32_t position;
  };
  /// Nothing where the facets are to be looked at one by one.
  [[nodiscard]] std::optional<Cut> choose_cut(const SurfaceBox& box);
  [[nodiscard]] std::array<SurfaceBox, 2> halve(const SurfaceBox& box, const Cut& cut);

  /// Finds the surface in a region, box by box, but for facets of meshes that meet no other operand there.
  void trace(SurfaceBox region, geometry::Skin& skin);
  /// These, of all regions since this was last asked.
  [[nodiscard]] FacetsAcrossRegions take_across() { return std::exchange(across_, {}); }
  /// Adds what of facets is in their regions.
  void add_parts(std::span<const FacetsAcrossRegions::Part> parts, geometry::Skin& skin);
  [[nodiscard]] std::uint64_t boxes() const { return boxes_; }
  /// The boxes that have been left to cells since this was last asked.
  [[nodiscard]] std::vector<HotBox> take_hot() { return std::exchange(hot_, {}); }
  /// Whether too many operands meet in one place; then the surface is not complete.
  [[nodiscard]] bool has_given_up() const { return has_given_up_; }

 private:
  using Label = geometry::Label;
  using Polygon = MeshClipper::Polygon;
  using Part = MeshClipper::Part;
  using Sides = BoxSides;
  /// A point in a box, and how often a mesh winds around it.
  struct Winding {
    std::array<double, 3> point;
    std::int32_t number;
  };
  struct Operand {
    Label label;  ///< of the box as a whole
    bool is_mesh;
    std::uint32_t producer;
    std::uint32_t begin, end;        ///< of its facets
    std::optional<Winding> known{};  ///< of a mesh; found when it is needed
  };
  /// A facet in a box that no other operand ends in.
  struct Untouched {
    std::uint32_t facet, box;  ///< box: index into boxes_of_untouched_
    bool reversed;             ///< the solid is on the outer side
  };

  const Network<3>& network_;
  const OperandFacets& source_;
  const std::atomic<bool>& stop_;
  geometry::PolygonSplitter kernel_;
  MeshClipper clipper_;
  geometry::SkinBuilder skin_;
  std::uint64_t boxes_ = 0;
  bool has_given_up_ = false;

  // Of the region at hand.
  Sides region_{};
  std::vector<std::uint8_t> touched_;  // facets that meet other operands, or end in a decided box
  std::vector<std::uint32_t> touched_list_;
  std::vector<Untouched> untouched_;
  std::vector<Sides> boxes_of_untouched_;
  std::vector<HotBox> hot_;
  FacetsAcrossRegions across_;

  // Of the box at hand.
  Sides box_{};
  bool is_untold_ = false;  // what has been found in it is not all: cells have to tell
  SidedExpression expression_;
  std::vector<Operand> operands_;
  std::vector<FacetInBox> facets_;
  Polygon corners_;                                                       // of these
  std::vector<std::pair<geometry::HyperplaneId, std::uint32_t>> planes_;  // of these, with the operands
  std::vector<geometry::HyperplaneId> shared_planes_;
  std::vector<std::uint32_t> order_;
  std::vector<Label> labels_;
  struct End {
    double at, weight;
    bool upper;
  };
  std::vector<End> ends_;
  struct Extent {
    std::array<double, 3> low, high;
    double weight;
  };
  std::vector<Extent> extents_;
  Polygon scratch_;
  geometry::Buffer<std::uint32_t> crossing_;

  void begin(const SurfaceBox& region);
  void end(geometry::Skin& skin);
  void touch(std::span<const std::uint32_t> facets);
  void find_extents(const SurfaceBox& box);
  struct Place {
    double cost, at;
  };
  [[nodiscard]] std::optional<Place> place_between(const SurfaceBox& box, int axis, double total);
  [[nodiscard]] std::optional<Cut> free_cut(const SurfaceBox& box, int axis, double at) const;
  [[nodiscard]] std::optional<Cut> cut_in_the_middle(const SurfaceBox& box) const;
  SurfaceBox half(const SurfaceBox& box, const Cut& cut, bool upper);
  Label simplify(const SurfaceBox& box, const Word*& at, std::size_t& leaf, SurfaceBox& to);
  [[nodiscard]] Label label_at_centre(std::uint32_t producer, const Sides& box);
  [[nodiscard]] std::optional<Winding> winding_in(std::uint32_t producer, const Sides& box) const;
  bool clip(std::uint32_t facet, const Sides& box, Polygon& polygon);

  [[nodiscard]] bool is_within(std::uint32_t facet, const Sides& box) const;
  void add_piece(const WholeFacet& whole, const Sides& box, Polygon& polygon);
  [[nodiscard]] bool has_mesh(const SurfaceBox& box) const;
  [[nodiscard]] bool has_doubtful(const SurfaceBox& box) const;
  void leave_to_cells(const SurfaceBox& box);
  void write_whole(const SurfaceBox& box, const Word*& at, std::size_t& leaf, std::vector<Word>& to) const;
  void find_pieces(const SurfaceBox& box);
  void load(const SurfaceBox& box);
  void find_shared_planes();
  void find_pieces_of(std::uint32_t operand);
  void order_operands(std::uint32_t own, geometry::OrientedHyperplane outward, const Box<3>& bounds);
  [[nodiscard]] bool has_facet_in(const Operand& operand, geometry::HyperplaneId id) const;
  [[nodiscard]] std::optional<geometry::OrientedHyperplane> facet_in(const Operand& operand,
                                                                     geometry::HyperplaneId id) const;
  bool cut_along(const Operand& operand, geometry::HyperplaneId own, Polygon& piece,
                 std::vector<Part>& beyond);
  [[nodiscard]] Label part(Operand& operand, geometry::HyperplaneId own, Polygon& piece,
                           std::vector<Part>& others);
  [[nodiscard]] std::optional<Label> label_around(Operand& operand, const Polygon& piece) const;
  void hold_against(Polygon& polygon, std::uint32_t own, geometry::OrientedHyperplane outward,
                    std::size_t next);
  [[nodiscard]] bool is_settled(const Polygon& polygon, geometry::OrientedHyperplane outward);
};

}  // namespace bsp2::dataflow
