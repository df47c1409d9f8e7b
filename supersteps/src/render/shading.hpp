#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "render/ink.hpp"
#include "render/overlay.hpp"

namespace bsp2::supersteps {

/// What the colours of a picture stand for: numbers of parts, ranks, regions, levels; 0 and 1: IN and FUZZY.
/// The same on all ranks.
struct Numbers {
  std::vector<std::int64_t> present;  ///< ascending; of what is drawn
  /// Collective, if the shade has a legend; else nothing is there.
  static Numbers of(Ranks& ranks, const RunResult& result, const PictureOptions& options);
};

/// Of curved solids: to which they are refined.
double skin_thickness(const RunResult& result);

/// Colours of cells under full light, and how much of what is behind them is hidden.
class Inks {
 public:
  Inks(const RunResult& result, const PictureOptions& options, const Numbers& numbers);
  [[nodiscard]] Ink of(const geometry::CellBatch& batch, std::size_t cell) const;
  /// Of a number, as in a legend.
  [[nodiscard]] Colour of(std::int64_t number) const;

 private:
  const RunResult& result_;
  Shade shade_;
  std::int64_t least_ = 0, most_ = 1;  // levels
  double skin_;                        // thickness of what is FUZZY and encloses a curved surface, at most
  bool has_skins_ = false;
  /// By region: what most of its IN cells belong to.
  struct Owner {
    std::int32_t primitive = geometry::no_primitive, part = geometry::no_part;
  };
  std::unordered_map<std::uint32_t, Owner> owner_of_region_;

  void find_owners();
  [[nodiscard]] RoundPlace skin_of(const geometry::CellBatch& batch, std::size_t cell) const;
  [[nodiscard]] Ink skin(const geometry::CellBatch& batch, std::size_t cell, const RoundPlace& round) const;
  [[nodiscard]] Ink owned(const Owner& owner) const;
  [[nodiscard]] Ink model_ink(std::int32_t primitive) const;
};

/// What the colours of a picture tell, with names, in its upper left corner.
void add_legend(Overlay& overlay, const RunResult& result, const PictureOptions& options,
                const Numbers& numbers);

/// In the lower corners: a bar of a round length, where the projection is parallel, and where the axes point.
void add_axes(Overlay& overlay, const PictureOptions& options, const Camera& camera, const Frame& frame,
              int dimension);

}  // namespace bsp2::supersteps
