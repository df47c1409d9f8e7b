#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bsp2/supersteps/render/picture_format.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// What the colour of a cell tells.
enum class Shade : std::uint8_t {
  colour,  ///< the model's own colours; stone where it has none
  part,
  rank,  ///< who computed the cell
  region,
  label,
  level  ///< how many cuts made the cell
};

/// Which edges are drawn as lines.
enum class Edges : std::uint8_t {
  none,
  feature,  ///< of the solid: where its faces meet in more than 30 degrees, and where one is before another
  cells
};

/// The format that a file's ending names.
std::optional<PictureFormat> picture_format(const std::filesystem::path& path);

/// Loads what draws pictures, so that a run does not find at its end that it cannot. Any thread. @throws
/// Error if that fails.
void check_pictures();

/// What is on one side of a plane across an axis is cut off.
struct PictureSection {
  int axis = 0;
  double at = 0;
  bool keeps_upper = true;  ///< what is left has x_axis >= at; else x_axis <= at
};

struct CanvasMemory;

/// Memory that pictures have one after the other, so that it need not be made anew for each. One at a time.
class PictureMemory {
 public:
  PictureMemory();
  PictureMemory(PictureMemory&&) noexcept;
  PictureMemory& operator=(PictureMemory&&) noexcept;
  ~PictureMemory();
  [[nodiscard]] CanvasMemory& parts() const { return *parts_; }

 private:
  std::unique_ptr<CanvasMemory> parts_;
};

/// Camera and looks of a picture. Lengths and points are in model units; in the plane z = 0.
struct PictureOptions {
  PictureFormat format = PictureFormat::png;
  int width = 1000, height = 1000;  ///< pixels; in PDF points
  Shade shade = Shade::colour;
  Edges edges = Edges::none;
  bool transparent = false;  ///< no background
  bool legend = false;       ///< what the colours tell, but for Shade::colour
  bool axes = false;         ///< where they point, and of a parallel projection the scale
  /// Where the viewer stands: a perspective picture. None: a parallel projection; D = 3 from the front (-y),
  /// the right and above, D = 2 the plane itself.
  std::optional<std::array<double, 3>> eye;
  /// What is in the middle of the picture. None: the middle of the solid's bounds, and the picture is filled
  /// as it fits.
  std::optional<std::array<double, 3>> look;
  /// Regions are moved away from the middle, by so many times their distance from it.
  double explode = 0;
  /// The viewer goes so many degrees around the vertical line through what is looked at, to the right. D = 3.
  double turn = 0;
  /// Above 0: the picture is as wide as the ball around the solid's bounds, so many times as large: pictures
  /// of several turns, sections and explosions are at one scale then.
  double ball = 0;
  std::optional<PictureSection> section;  ///< D = 3, from an eye outside the solid
  std::optional<unsigned> most_level;     ///< cells that more cuts made are not drawn
  Bounds bounds;                    ///< what the picture is made to show; empty: what there is to be drawn
  PictureMemory* memory = nullptr;  ///< may be null; of a PNG picture
  /// Told the share of this rank's cells that is drawn, in [0, 1], now and then; may be empty.
  std::function<void(double done)> on_progress;
};

/// Rendering: every rank draws the cells that it holds, from the back to the front in the order of its own
/// BSP tree; the master puts the layers over each other in the order of the partition. No depths are
/// exchanged. The picture is that which one rank would draw: PNG and SVG files byte for byte.
///
/// From an eye within an IN cell the inner sides of the boundary are seen, as if the solid were clear.
/// IN cells are opaque but for the model's own colours, FUZZY cells let half of what is behind them through,
/// OUT cells are not drawn. What is FUZZY when a run is complete is the skin of curved solids: it is drawn as
/// the surface that it encloses, but for Shade::label. Facets of round primitives are lit as if they were
/// bent, and corners are darker. z is up. Collective, within Ranks::together. Cost: h = what is drawn.
/// @param at_eye is told, on all ranks, what is where the eye is; OUT without one, and for D = 2.
/// @return the bytes of the file on the master, nothing elsewhere.
/// @throws bsp2::Error for dimensions other than 2 and 3, and for an eye that is where it looks; with several
/// ranks these, and all that fails on one of them, are an AgreedFailure. Source: the paper, section 4.2,
/// "Rendering"; fig. 7 for what explodes.
std::string render(Ranks& ranks, const RunResult& result, const PictureOptions& options = {},
                   geometry::Label* at_eye = nullptr);

/// `render` by this process alone, for cells without regions. Not collective.
std::string render(SolidMesh mesh, geometry::BspTree tree, const PictureOptions& options = {});

}  // namespace bsp2::supersteps
