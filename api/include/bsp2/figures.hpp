#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/error.hpp"
#include "bsp2/expression.hpp"

/// What was found, in figures. Part of bsp2.hpp, which says what holds of all.
namespace bsp2 {

/// Between which values a number of the solid is: equal where nothing is left FUZZY.
struct Interval {
  double least = 0, most = 0;
};

/// Integrals over a solid of dimension D. Lengths are in the model's units.
struct Measures {
  Interval volume;
  Vector centroid;              ///< D numbers, of the IN cells; empty if there are none
  std::vector<Vector> inertia;  ///< (D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells
  std::vector<Vector> inertia_least, inertia_most;  ///< of the solid; empty where nothing is FUZZY
};

/// A part of the model that has a name; its number is in the cells.
struct Part {
  std::int32_t number = 0;
  std::string name;
  std::optional<std::array<std::uint8_t, 4>> color;  ///< red, green, blue, opacity, if all of it has one
  double volume = 0;                                 ///< of its IN cells
};

/// What a superstep cost, one value a rank. See docs/supersteps.md.
struct Superstep {
  std::string name;
  unsigned step = 0;
  std::vector<double> seconds;         ///< from its begin to that of the next
  std::vector<double> work_seconds;    ///< without the time in which the rank only waited for others
  std::vector<double> hidden_seconds;  ///< that the main thread communicated while workers computed
  std::vector<std::uint64_t> bytes_sent, bytes_received, cells;
  std::vector<std::uint64_t> hidden_bytes;  ///< sent or received, whichever is more, meanwhile
  double predicted_seconds = 0;             ///< w + g h + l
};

/// A mesh for solvers in figures.
struct MeshFigures {
  bool polyhedra = false;
  std::uint64_t points = 0, cells = 0, faces = 0;
  std::uint64_t outer_faces = 0, overused_faces = 0;          ///< of one cell, and of more than two
  std::vector<std::pair<std::string, double>> volumes;        ///< content by name
  std::vector<std::pair<std::string, std::uint64_t>> groups;  ///< faces by name
  double volume = 0;
  double size = 0, clean = 0;
  // Of tetrahedra.
  std::uint64_t cells_at_first = 0, moved_points = 0, bent_edges = 0, taken_away = 0;
  double largest_move = 0;
  double smallest_angle = 0, largest_angle = 0, mean_smallest_angle = 0;  ///< dihedral, in degrees
  double smallest_aspect = 0, mean_aspect = 0;                            ///< regular: 1, flat: 0
  std::array<std::uint64_t, 18> histogram{};      ///< of angles, a bar each ten degrees
  std::array<std::uint64_t, 3> below{};           ///< tetrahedra with an angle below 1, 5 and 10 degrees
  std::array<std::uint64_t, 3> below_of_solid{};  ///< of these: where the solid itself is as sharp
  double seconds_of_cells = 0, seconds_of_shape = 0;
};

/// What a report tells of an evaluation. Lengths are in the model's units.
struct Figures {
  /// An output that could not be made.
  struct Failed {
    std::string text;
    bool is_users_mistake = false;  ///< a full disk, a path: else an error of ours
    std::filesystem::path file;  ///< that is not there, or another evaluation's; empty: none of the library's
  };
  struct Boundary {
    std::uint64_t triangles = 0;
    double area = 0;
    bool closed = false;
    std::string digest;
  };
  /// What the cells of a file were cut into.
  struct Simplices {
    std::uint64_t count = 0;
    double smallest_angle = 180;         ///< degrees
    std::uint64_t incomplete_cells = 0;  ///< of which something is left out, flat in doubles
    double left_out_volume = 0;          ///< of all these together
  };
  struct Drawing {
    std::uint64_t lines = 0;
    std::string sheet;
    double scale = 1;
  };

  std::string model;
  int dimension = 3;
  unsigned ranks = 1, threads = 1, regions = 1, level = 0;
  std::uint64_t primitives = 0, hyperplanes = 0;
  bool has_cells = true;  ///< false: the surface was found without any (Options::surface_only)
  std::uint64_t in_cells = 0, fuzzy_cells = 0;
  std::optional<std::uint64_t> out_cells;  ///< where they are kept
  double in_volume = 0, fuzzy_volume = 0;
  Measures measures;
  std::vector<std::pair<std::string, Measures>> named_measures;  ///< of the model's `measure`, in its order
  std::vector<Part> parts;
  std::optional<double> tolerance;  ///< of round solids, given or chosen
  std::optional<double> angle;      ///< likewise, given: as seen from `eye`, in degrees
  Vector eye;
  Vector lower, upper;  ///< bounds of the IN cells; empty if there are none
  std::optional<Boundary> boundary;
  std::optional<Simplices> simplices;
  std::optional<MeshFigures> solver_mesh;
  std::optional<Drawing> drawing;
  std::string digest;  ///< of the set of cells
  bool is_complete = true;
  bool is_interrupted = false;
  std::uint64_t splits = 0, predicates = 0, exact_fallbacks = 0;
  double seconds = 0, cpu_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<Superstep> supersteps;  ///< also those of earlier sessions
  std::vector<std::string> warnings, notes;
  std::vector<Failed> failed;                  ///< alike on all ranks
  std::vector<std::filesystem::path> written;  ///< of Outputs; of several files that are one, that to open
};

/// What a snapshot holds.
struct SnapshotInfo {
  std::string model;
  int dimension = 3;
  double coincidence = 0;
  bool curved = false, parts_by_colour = false;
  std::optional<unsigned> level;
  std::optional<double> tolerance, angle;
  Vector eye;
  bool keep_in = true, keep_fuzzy = true, keep_out = false;
  std::uint64_t regions = 0, unfinished_regions = 0;
  std::uint64_t steps = 0;
  std::uint64_t in_cells = 0, out_cells = 0;  ///< finished
  double in_volume = 0;                       ///< likewise
  std::string digest;                         ///< likewise
  std::uint64_t undecided = 0;
  bool is_complete = false;                     ///< nothing is left but what a level leaves
  bool has_surface = false, has_faces = false;  ///< which need not be found again
};

/// @throws Error if it cannot be read.
BSP2_API SnapshotInfo snapshot_info(const std::filesystem::path& snapshot);

/// What was found of a mesh in a file.
struct MeshCheck {
  std::filesystem::path file;
  MeshFigures figures;
  std::vector<std::string> faults, notes;  ///< valid if there are no faults
  /// All of it as JSON. @throws Error if it cannot be written.
  BSP2_API void write(const std::filesystem::path& report) const;
};

/// Looks at any mesh of tetrahedra in a file of gmsh: whether each is right side out, which is decided
/// exactly, and whether faces are used once or twice, from two sides; triangles in groups have to be faces.
/// Of second order the corners count.
/// @throws Error if it cannot be read, or is no mesh of tetrahedra.
BSP2_API MeshCheck check_mesh(const std::filesystem::path& file);

}  // namespace bsp2
