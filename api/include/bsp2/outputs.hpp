#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/error.hpp"

/// Files that are made of what was found, and how they look. Part of bsp2.hpp, which says what holds of all.
namespace bsp2 {

/// How pictures look.
struct View {
  int width = 1000, height = 1000;            ///< pixels
  std::string shade = "color";                ///< or part, rank, region, label, level
  std::string edges = "none";                 ///< or feature: those of the solid, cells: of all cells
  bool legend = true;                         ///< what the colours tell, but for "color"
  bool axes = false;                          ///< where they point, and without an eye a bar for the scale
  bool transparent = false;                   ///< without a background
  std::optional<std::array<double, 3>> eye;   ///< none: a parallel projection
  std::optional<std::array<double, 3>> look;  ///< what is in the middle
  double explode = 0;  ///< regions move apart by so many times their way from the middle
};

/// How an animation moves; all at once, from the first picture to the last.
struct Film {
  /// Where the viewer stands, and what is looked at; none: the middle.
  struct Camera {
    std::array<double, 3> eye{};
    std::optional<std::array<double, 3>> look;
  };
  /// What a plane across an axis has passed is cut off.
  struct Sweep {
    int axis = 0;
    double from = 0, to = 0;
  };
  unsigned count = 100;  ///< of pictures
  double rate = 25;      ///< a second
  bool turns = false;    ///< once around the solid
  bool grows = false;    ///< from the cells of the first cuts to all
  std::vector<Camera> path;
  std::optional<std::array<double, 2>> explode;  ///< View::explode from one to the other
  std::optional<Sweep> sweep;
};

struct WriteOptions {
  bool tets = false;  ///< a .pvtu of simplices
  /// Of a surface of triangles: without shorter edges and thinner triangles, in model units; 0: as it is;
  /// none: what the format can tell apart. See docs/formats.md.
  std::optional<double> clean;
  View view;
};

/// What a mesh for solvers is like. Lengths in model units. See docs/meshing.md.
struct SolverMeshOptions {
  std::optional<double> size;  ///< of edges; 0: the cells' own tetrahedra; none: a twentieth of the diagonal
  std::vector<std::pair<std::string, double>> part_sizes;  ///< likewise in parts, by name
  /// x, y, z and size: edges are no longer than the size at the nearest of these places; without `size` as
  /// long. Options::size_field refines what is round alike.
  std::vector<std::array<double, 4>> size_field;
  double growth = 0.6;  ///< by which share of the distance edges may grow from fine to coarse
  /// What is shorter is absorbed; none: a millionth of the smallest part, of what is round its tolerance if
  /// that is more; and up to 16 millionths where the mesh would not be valid, or have angles below 1 degree
  /// that the solid does not have.
  std::optional<double> clean;
  std::vector<std::string> groups;  ///< faces by name: "NAME=WHERE", see docs/meshing.md
  bool polyhedra = false;           ///< the cells as they are instead: for files, there are no arrays of them
  bool dual = false;  ///< polyhedra about the points of the tetrahedra instead, for finite volumes: likewise
};

/// A file with a mesh for solvers.
struct SolverMeshOutput {
  std::filesystem::path file;  ///< .msh, .inp, .xdmf, .vtu or, a folder, a case of OpenFOAM
  SolverMeshOptions mesh;
  bool second_order = false;  ///< with points in the middle of edges
  int gmsh_version = 41;      ///< or 22
};

/// What an engineering drawing shows, in the words of `bsp2 draw`. See docs/drawing.md.
struct DrawingOptions {
  std::vector<std::string> views{"front", "top", "left", "iso"};  ///< also back, right, bottom
  std::vector<std::string> sections;         ///< "A=x:10": cut there, seen as usual; "A=-x:10" the other way
  std::vector<std::string> dimensions;       ///< "front:0,0,0:40,0,0": the distance of two points in a view
  std::string hidden = "dashed";             ///< edges behind faces: dashed, none, all
  std::string smooth = "none";               ///< edges between facets of what is round: none, thin
  double smooth_angle = 30;                  ///< degrees: facets that meet in less are of something round
  bool centre_lines = true, overall = true;  ///< axes of what is round, and overall dimensions
  std::string sheet = "A3";                  ///< to A0
  std::string scale = "auto";                ///< "1:2", ...; auto: the largest usual one that fits
  std::string projection = "first";          ///< or third
  std::string title = "model", author, number, material, date;  ///< no date: today
};

/// A drawing, in one file or in several.
struct DrawingOutput {
  std::vector<std::filesystem::path> files;  ///< .svg, .pdf, .dxf
  DrawingOptions drawing;
};

/// Files that are written as part of an evaluation: it finds what they need, and no more. Each is made by
/// itself; one that fails takes no other along (Figures::failed), but for a drawing and a mesh for solvers,
/// which are made before the others and throw. Where it could not be written from the
/// start, nothing is computed. Folders are made where they are missing. The master alone writes, but for
/// cells.
struct Outputs {
  std::optional<std::filesystem::path> cells;   ///< .pvtu
  bool tets = false;                            ///< there and in `series`: simplices
  std::vector<std::filesystem::path> surfaces;  ///< each as its ending says, of plane solids the outlines
  std::optional<double> clean;                  ///< as WriteOptions::clean
  std::optional<std::filesystem::path> picture;
  View view;                                      ///< of `picture` and of `frames`
  std::optional<Film> film;                       ///< the picture is an animation: .apng, .gif, .mp4, .webm
  std::optional<std::filesystem::path> report;    ///< .json
  std::optional<std::filesystem::path> table;     ///< .csv: what each superstep cost each rank
  std::optional<std::filesystem::path> snapshot;  ///< a copy of Options::snapshot, at the end
  /// A picture of each step, as long as Options::budget says: PREFIX0000.png and so on, 0000.png where the
  /// prefix is a folder. With `frames` or `series` the evaluation goes on until all is decided.
  std::optional<std::filesystem::path> frames;
  std::optional<std::filesystem::path> series;  ///< .pvd: the cells of each step, over time
  std::optional<SolverMeshOutput> solver_mesh;
  std::optional<DrawingOutput> drawing;
  std::vector<std::filesystem::path> read;  ///< files that options came from: none of them is written
  /// A folder that shows this evaluation alone: what of the names below is not written there this time goes,
  /// be it of an earlier one. What these names stand for and the model's dimension does not allow is left
  /// out, with a warning.
  std::optional<std::filesystem::path> folder;
  static constexpr const char *cells_name = "solid.pvtu", *surface_name = "boundary.stl",
                              *picture_name = "view.png", *snapshot_name = "snapshot.h5",
                              *report_name = "report.json";

  [[nodiscard]] bool of_steps() const { return frames || series; }
};

}  // namespace bsp2
