#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/outline.hpp"
#include "bsp2/geometry/surface/round_solid.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"

namespace bsp2::meshing {
struct Complex;
}

namespace bsp2::supersteps {

/// An output that could not be made. The others are made all the same.
struct FailedOutput {
  std::string text;
  bool is_users = false;       ///< a full disk, a path: else an error of ours
  std::filesystem::path file;  ///< that is not there, or another run's; empty: none of the program's own
};

/// The simplices that the cells of a mesh were cut into, in figures.
struct SimplexReport {
  std::uint64_t simplices = 0;
  double smallest_angle = 180;  ///< degrees: between two faces of a tetrahedron, or two sides of a triangle
  std::uint64_t incomplete_cells =
      0;  ///< cells of which something is left out: rounded to doubles it would be flat or inverted
  double left_out_volume = 0;  ///< of all these together

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& simplices& smallest_angle& incomplete_cells& left_out_volume;
  }
};

/// The surface of the IN cells in figures.
/// What a surface file is without. Lengths are in model units.
struct CleaningReport {
  std::filesystem::path file;
  double length = 0;                ///< no edge is shorter, no triangle thinner, but for those that are left
  std::uint64_t merged_points = 0;  ///< corners that became one with another
  std::uint64_t slivers = 0;        ///< thin triangles that neighbours took in
  std::uint64_t left_out = 0;       ///< corners within a face or a straight edge
  std::uint64_t left = 0;           ///< thin triangles that would have spoiled others
  std::uint64_t triangles = 0;      ///< in the file
  double moved = 0;                 ///< the farthest that a corner came
  double volume_change = 0;
  bool has_given_up = false;    ///< the surface would have crossed itself, and is as it was
  std::uint64_t crossings = 0;  ///< triangles that cross others near to what has changed, and did so before
};

struct BoundaryReport {
  std::uint64_t triangles = 0;
  double area = 0.0;
  bool closed = false;  ///< every edge is used equally often in both directions: counted, not assumed
  std::string digest;   ///< of points, triangles and parts, byte for byte
  std::vector<CleaningReport> cleaned;  ///< a file each, of those that were looked at
};

/// Integrals over a solid. Lengths are in model units; moments are about the origin.
struct Measures {
  double in_volume = 0.0, fuzzy_volume = 0.0;  ///< the true volume is between in and in + fuzzy
  std::vector<double> centroid;                ///< D: of the IN cells
  std::vector<std::vector<double>>
      inertia;  ///< (D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells
  /// While FUZZY cells remain, between which values the solid's own moments are: (D+1) x (D+1), least and
  /// most.
  std::vector<std::vector<double>> inertia_least, inertia_most;
};

/// What a `measure` of the model found, in the coordinates that its children have there.
struct NamedMeasures : Measures {
  std::string name;
  int dimension = 3;
};

/// Red, green, blue, opacity.
using Rgba = std::array<std::uint8_t, 4>;
inline constexpr Rgba uncoloured{237, 219, 189, 255};  ///< what has no colour of its own: stone

/// A part of the model that has a name; the number is in the cell data.
struct NamedPart {
  std::int32_t part;
  std::string name;
  std::optional<Rgba> colour;  ///< if all of it has one
  double volume = 0;           ///< of its IN cells
};

/// A mesh of the model whose faces wind around some points more than once, or the wrong way round, while the
/// volume counts each point of a solid once.
struct OverlappingMesh {
  std::string place;  ///< "file:line:column" in the model
  std::string file;   ///< that it was imported from, or empty
  std::uint64_t primitive = 0, triangles = 0;
  std::optional<double> volume_by_faces;  ///< each point as often as the faces wind around it; nothing under
                                          ///< a construct (a hull, a projection, ...)
};

/// What a run found; with several ranks, complete on the master. Lengths are in model units; moments are
/// about the origin.
struct RunReport : Measures {
  std::string model;
  int dimension = 3;
  unsigned ranks = 1, threads = 1, regions = 1, level = 0;
  std::uint64_t primitives = 0, hyperplanes = 0;
  bool has_cells = true;  ///< false: the surface was found without any (RunOptions::surface_only)
  std::uint64_t in_cells = 0, fuzzy_cells = 0;
  std::optional<std::uint64_t> out_cells;  ///< when OUT cells are kept
  std::optional<double> tolerance;         ///< of round solids, given or chosen
  bool tolerance_by_place = false;         ///< shares of it (RunOptions::tolerance_shares)
  std::optional<double> angle;             ///< likewise, given: as seen from `eye`, in degrees
  std::vector<double> eye;
  std::vector<NamedPart> named_parts;      ///< in the order of their numbers
  std::vector<NamedMeasures> measures;     ///< on the master, in the order of the model
  std::vector<double> lower, upper;        ///< bounds of the IN cells; empty if there are none
  std::optional<BoundaryReport> boundary;  ///< when asked for
  std::optional<SimplexReport> simplices;  ///< of the mesh that was written, if it is of simplices
  std::string digest;                      ///< of the set of cells, order-independent
  bool complete = true;                    ///< nothing is left undecided but what `level` leaves
  bool interrupted = false;
  std::vector<SuperstepRecord> supersteps;  ///< also those of earlier sessions
  std::vector<SuperstepRecord> earlier;     ///< only those: of the snapshot that was resumed
  std::uint64_t splits = 0, predicates = 0, exact_fallbacks = 0;
  double seconds = 0.0, cpu_seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;                   ///< what is as it should be, but may surprise
  std::vector<FailedOutput> failed;                 ///< alike on all ranks
  std::vector<OverlappingMesh> overlapping_meshes;  ///< on the master, in the order of the model
};

/// What to tell where a finished run has no IN cell: the solid is empty, or all that may be solid is FUZZY.
[[nodiscard]] std::string why_nothing_is_in(const RunReport& report);

/// The cells of a finished run.
struct SolidMesh {
  int dimension = 3;
  std::vector<std::shared_ptr<const geometry::CellBatch>>
      batches;  // shared: several consumers hold the same batches
};

/// A box, D numbers each; empty vectors: none.
struct Bounds {
  std::vector<double> lower, upper;
};

/// Where a point is. See geometry::PointAnswer.
struct Answer {
  geometry::Label label = geometry::Label::out;
  std::int32_t primitive = geometry::no_primitive, part = geometry::no_part;  ///< of the cell
  double distance = 0;          ///< to the nearest point that has, or may have, another label
  std::vector<double> nearest;  ///< such a point
};

struct RunResult;
class RoundFaces;

/// What a finished run can be asked later: it keeps the hyperplanes. Of the master, if that has all cells, or
/// for the complex that all have made.
/// Not collective; one thread at a time.
class Asked {
 public:
  virtual ~Asked() = default;
  /// Where points are. @param points D numbers each.
  [[nodiscard]] virtual std::vector<Answer> locate(const RunResult& result,
                                                   std::span<const double> points) const = 0;
  /// Finds the surface of the IN cells, as a run with `boundary` does, and tells of it in the report; nothing
  /// unless D = 3, the outlines of a plane solid if D = 2. A boundary that is there stays as it is, in its
  /// place; its faces are found.
  virtual void find_boundary(RunResult& result, bool with_faces) const = 0;
  /// Which IN cells touch, and where; none unless D = 3.
  [[nodiscard]] virtual std::vector<geometry::Contact> contacts(const RunResult& result) const = 0;
  /// The IN cells as a complex that conforms; of a run with RunOptions::complex it is taken away from the
  /// result. @throws bsp2::Error unless D = 3.
  [[nodiscard]] virtual meshing::Complex complex(const RunResult& result) const = 0;
  /// Where a point on the facets of what is truly round belongs: on its surface, and in those of the planes
  /// that are of the model. @param planes that the point is on. @return none if nothing there is round, or
  /// there is no such place near it. Any number of threads may ask.
  [[nodiscard]] virtual std::optional<std::array<double, 3>> on_true_surface(
      const RunResult& result, std::span<const std::uint32_t> planes,
      const std::array<double, 3>& point) const = 0;
};

/// What a rank holds after a run.
struct RunResult {
  RunReport report;
  bool is_collected = true;  ///< the master has all cells; else each rank has those of its regions
  bool keeps_in = true, keeps_fuzzy = true, keeps_out = false;  ///< in effect: of a snapshot, its own
  SolidMesh mesh;
  geometry::BspTree tree;       ///< its leaves are the cells of the mesh, in the order of the batches
  geometry::BspTree partition;  ///< leaf k >= 1 is region k - 1
  std::vector<std::int32_t> rank_of_region;              ///< who computed it
  std::vector<std::optional<Rgba>> colour_of_primitive;  ///< as the model says; empty if it has no colours
  std::shared_ptr<const RoundFaces>
      round_faces;  ///< of pictures, D = 3; null: nothing is round. Shared: results are copied
  std::vector<geometry::RoundSolid> untouched_rounds;  ///< of D = 3: in the solid as they are, for CAD files
  std::vector<std::string> part_names;  ///< by number; empty: nothing has a name, and the whole is part 0
  Bounds bounds;                        ///< of the model, before it is evaluated: they contain the solid
  std::optional<geometry::TriangleSurface> boundary;           ///< on the master, when asked for
  std::optional<geometry::Brep> faces;                         ///< likewise
  std::optional<std::vector<geometry::PartOutline>> outlines;  ///< of a plane solid, likewise
  /// When asked for, the contacts that this rank found, by cells. Cells are counted through all regions in
  /// their order: as in the batches of the mesh, where it is collected.
  std::vector<geometry::Contact> contacts;
  std::vector<Answer> answers;                ///< likewise, to RunOptions::points
  std::shared_ptr<meshing::Complex> complex;  ///< with RunOptions::complex, on the master of several ranks
  std::shared_ptr<const Asked> asked;  ///< with RunOptions::can_be_asked, on the master if it has all cells,
                                       ///< or their complex
};

/// Who draws a region, and answers for its cells.
inline int drawer_of(const RunResult& result, std::size_t region) {
  return result.is_collected ? 0 : result.rank_of_region.at(region);
}

}  // namespace bsp2::supersteps
