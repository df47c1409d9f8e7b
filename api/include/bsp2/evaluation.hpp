#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/error.hpp"
#include "bsp2/expression.hpp"
#include "bsp2/figures.hpp"
#include "bsp2/order.hpp"
#include "bsp2/outputs.hpp"

/// From expressions to cells. Part of bsp2.hpp, which says what holds of all.
namespace bsp2 {

/// The processes that evaluate together. See docs/api.md, "Ranks".
class BSP2_API Ranks {
 public:
  /// This process alone. MPI is not touched.
  Ranks();
  /// All processes that a launcher (mpirun, srun) started with this one; alone, if there is none. MPI is
  /// started, if nobody has done that yet, and ended when the process exits.
  static Ranks launched();
  [[nodiscard]] int rank() const;
  [[nodiscard]] int count() const;
  [[nodiscard]] bool is_master() const { return rank() == 0; }
  /// Does something on all ranks and waits for them: if it throws on one of them, all of them throw that. It
  /// makes no collective calls. Collective. @param timeout as Options::timeout.
  void together(const std::function<void()>& work, std::optional<double> timeout = {}) const;

  class Implementation;
  /// For the library.
  explicit Ranks(std::shared_ptr<Implementation> implementation);
  [[nodiscard]] const std::shared_ptr<Implementation>& implementation() const { return implementation_; }

 private:
  std::shared_ptr<Implementation> implementation_;
};

/// What is known of the points of a cell.
namespace label {
inline constexpr std::uint8_t out = 0, in = 1, fuzzy = 2;
}

/// What a superstep is for.
enum class Phase : std::uint8_t {
  preparation,  ///< nothing is found yet: a model is read, or a snapshot
  computation,  ///< cells are refined
  completion    ///< what was found is brought together, saved, drawn or written
};

/// How far an evaluation is.
struct Progress {
  std::string superstep;  ///< "compilation", "computation", ..., or "writing FILE"
  Phase phase = Phase::preparation;
  double done = 0;          ///< share of it, in [0, 1], where that is known
  std::uint64_t cells = 0;  ///< so far
  unsigned begun = 0;       ///< supersteps and files so far, this one counted
};

/// Where the cells of all ranks go.
enum class Collect : std::uint8_t {
  automatic,  ///< to the master up to 200,000 cells, else as `file`
  master,
  tree,  ///< to the master, up a binary tree of masters
  file   ///< nowhere: each rank keeps its own and writes them itself
};

/// What to find, and how far to go. As the options of `bsp2 run` of the same name; the same on all ranks.
struct Options {
  unsigned threads = 0;             ///< of each rank; 0: one a core
  std::optional<unsigned> regions;  ///< rounded up to a power of two; none: by the model
  std::optional<unsigned> level;    ///< stop after so many cuts in a row; the rest stays FUZZY
  std::optional<double> tolerance;  ///< round solids are refined until FUZZY cells are thinner
  /// x, y, z and a length, of which the nearest counts, in space: the tolerance is that of edges as long as
  /// `size` (none: as the largest length), and less by the square of what is shorter here, so what is round
  /// gets facets that are shorter in the same measure.
  std::vector<std::array<double, 4>> size_field;
  std::optional<double> size;
  std::optional<double> angle;         ///< or are seen thinner from `eye`, in degrees
  std::vector<double> eye;             ///< D numbers
  Order order = Order::depth;          ///< what is refined first
  std::optional<double> budget;        ///< seconds for the computation; the rest stays FUZZY
  std::optional<std::uint64_t> cells;  ///< end at about so many, FUZZY ones counted
  std::optional<unsigned> steps;       ///< end after so many computations as long as `budget`; 0: at once
  bool curved = false;                 ///< spheres, cylinders and circles are truly round
  double coincidence = 1e-9;           ///< hyperplanes closer than this share of the model are one
  bool parts_by_colour = false;        ///< each colour is a part; else each `part` node
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells are held
  bool strict = false;                                       ///< a warning is an error
  bool measures_only = false;                                ///< no cells are held: only figures
  bool surface = false;  ///< the surface is found with the cells: with several ranks it cannot
                         ///< be found later
  /// Only the surface and figures are wanted of a solid of space: where it can be found without cells, none
  /// are made, and none are read of a snapshot that holds it.
  bool surface_only = false;
  bool faces = false;     ///< its faces, too, which files for CAD programs hold, and those of parts for
                          ///< printers; likewise
  bool contacts = false;  ///< which cells touch; likewise
  std::optional<std::filesystem::path> snapshot;  ///< written at the end, or whenever a budget has passed
  std::optional<double> timeout;  ///< after which a silent rank ends all, in seconds; of this evaluation
  /// Told about ten times a second, on the master, by the thread that evaluates.
  std::function<void(const Progress&)> progress;
  /// Asked up to twenty times a second, on several ranks more often, by the thread that evaluates (on each
  /// rank): true ends the evaluation soon. The result is then not complete, and has no cells; a snapshot has
  /// what there is. If it comes while the surface is found, the cells are there, and the surface is not.
  std::function<bool()> stop;
  /// What is computed is seen through: `stop` ends the computation and long work after it (a film, a mesh for
  /// solvers), but not the reading of a model, and what was found until then is written to `snapshot`.
  bool stop_gently = false;
  Collect collect = Collect::automatic;
  Outputs
      outputs;  ///< files that are written as part of it. With a film or a mesh all cells go to the master
  /// Nothing is wanted but `outputs`, `snapshot` and figures: the result has no cells. They are made if a
  /// file needs them, and given up one by one while the surface is found.
  bool outputs_only = false;
  std::string dashes;  ///< before names of options in messages about `outputs`: "--" in those of a program
};

/// The cells, as flat arrays: n cells with p points, f faces and v corners of faces in all.
struct Cells {
  int dimension = 3;
  std::span<const double> points;                     ///< p x D, each cell's own
  std::span<const std::uint32_t> point_offset;        ///< n + 1: cell i has points [offset[i], offset[i + 1])
  std::span<const std::uint32_t> face_offset;         ///< n + 1: likewise its faces (of dimension D - 1)
  std::span<const std::uint32_t> face_vertex_offset;  ///< f + 1: face j has these corners
  /// v: 0 is the first point of the cell. In space counter-clockwise as seen from outside; above, a set.
  std::span<const std::uint16_t> face_vertices;
  std::span<const std::uint8_t> labels;      ///< n: label::in, label::fuzzy or label::out
  std::span<const std::int32_t> primitives;  ///< n: which primitive of the source it belongs to; -1: none
  std::span<const std::int32_t> parts;       ///< n: which part; 0 where nothing has a name, -1: none
  std::span<const std::uint32_t> regions;    ///< n: which region of the partition
  std::span<const std::uint16_t> levels;     ///< n: cuts that made it
  std::span<const double> volumes;           ///< n: content of dimension D
  [[nodiscard]] std::size_t size() const { return labels.size(); }
};

/// The surface of the IN cells, watertight: triangles, counter-clockwise as seen from outside.
struct Surface {
  std::span<const double> points;            ///< 3 numbers each
  std::span<const std::uint32_t> triangles;  ///< 3 indices of points each
  std::span<const std::int32_t> parts;       ///< of each triangle: the part behind it
  double area = 0;
  bool closed = false;  ///< each edge is used equally often in both directions
  std::string digest;
  std::shared_ptr<const void> owner;  ///< of the arrays: they live as long as this
};

/// The surface as maximal plane faces, maximal straight edges and vertices, and what they bound: what
/// programs for CAD and for drawings build on. p points, e edges, f faces with l loops and u sides of faces
/// on edges, s solids with h shells, t triangles. Where parts of the solid meet, their interface is a face,
/// too. Non-manifold where it must be: any number of faces may meet in an edge, an even one where no parts
/// meet. The combinatorics are exact; numbers are rounded.
struct Brep {
  static constexpr std::int32_t outside = -2;  ///< where no part of the solid is, whatever its number

  std::vector<double> points;              ///< 3 p
  std::vector<std::uint32_t> edges;        ///< 2 e: the points at their ends
  std::vector<double> normals;             ///< 3 f: of unit length, out of the part behind the face
  std::vector<double> offsets;             ///< f: normal * x + offset = 0 on the face
  std::vector<std::int32_t> parts;         ///< 2 f: behind it, and in front: `outside`, or a part
  std::vector<std::uint32_t> loop_offset;  ///< f + 1: face i has loops [offset[i], offset[i + 1]), first the
                                           ///< outer one, then those of holes
  std::vector<std::uint32_t> use_offset;   ///< l + 1: likewise the edges of a loop, in its order
  std::vector<std::uint32_t> uses;         ///< u: an edge
  std::vector<std::uint8_t> forward;       ///< u: 1 from its first end to its second. The face is on the left
  std::vector<double> angles;              ///< u: about the edge, from this face to the next; radians
  std::vector<std::uint32_t> around_offset;  ///< e + 1: edge i has [offset[i], offset[i + 1]) of `around`
  std::vector<std::uint32_t> around;         ///< u: indices of `uses`, counter-clockwise about their edge as
                                             ///< seen from its second end
  std::vector<std::int32_t> solid_parts;     ///< s: the part that it is a connected piece of
  std::vector<double> solid_volumes;         ///< s
  std::vector<std::uint32_t> shell_offset;   ///< s + 1: first the outer shell, then those of cavities
  std::vector<double> shell_volumes;         ///< h: below 0 of a cavity
  std::vector<std::uint32_t> side_offset;    ///< h + 1: shell i has faces [offset[i], offset[i + 1])
  std::vector<std::uint32_t> sides;          ///< a face; one that is an interface is in two shells
  std::vector<std::uint8_t> is_front;        ///< likewise: 1 if the shell's part is in front of the face
  std::vector<std::uint32_t> triangles;      ///< 3 t, face by face, counter-clockwise seen against the normal
  std::vector<std::uint32_t> triangle_faces;  ///< t
  bool closed = false;                        ///< all faces about each edge agree on what is between them
};

/// Two IN cells that touch in more than an edge.
struct Contact {
  std::array<std::uint64_t, 2> cell;
  std::array<std::uint16_t, 2> face;  ///< of each cell, from 0
  double area = 0;
};

/// Where n points are: an entry a point.
struct Locations {
  std::vector<std::uint8_t> labels;             ///< of the cell that it is in
  std::vector<std::int32_t> primitives, parts;  ///< likewise; -1: none
  std::vector<double> distances;  ///< to the nearest point that has, or may have, another label; < 0 inside
  std::vector<double> nearest;    ///< n x D: such a point
};

/// A mesh of tetrahedra that meet face to face, right side out, with names of volumes and of faces.
class BSP2_API SolverMesh {
 public:
  // The arrays live as long as the mesh: p points, t tetrahedra, s triangles of the outside and of
  // interfaces.
  [[nodiscard]] std::span<const double> points() const;                ///< 3 p
  [[nodiscard]] std::span<const std::uint32_t> tetrahedra() const;     ///< 4 t: (b-a) x (c-a) points to d
  [[nodiscard]] std::span<const std::int32_t> volumes() const;         ///< t: as in volume_names()
  [[nodiscard]] std::span<const std::uint32_t> triangles() const;      ///< 3 s
  [[nodiscard]] std::span<const std::int32_t> groups() const;          ///< s: as in group_names()
  [[nodiscard]] const std::vector<std::string>& volume_names() const;  ///< of parts; else "solid"
  [[nodiscard]] const std::vector<std::string>& group_names() const;   ///< "steel|outside", ...
  [[nodiscard]] double volume() const;
  [[nodiscard]] double smallest_angle() const;  ///< dihedral, in degrees
  [[nodiscard]] double largest_angle() const;
  [[nodiscard]] const std::vector<std::string>& warnings() const;
  [[nodiscard]] const std::vector<std::string>& notes() const;  ///< what is as it should be

  /// Writes .msh, .inp, .xdmf, .vtu or, as a folder, a case of OpenFOAM. @param second_order with points in
  /// the middle of edges. @param gmsh_version 41 or 22. @throws Error if it cannot be written.
  void write(const std::filesystem::path& path, bool second_order = false, int gmsh_version = 41) const;

  class Implementation;
  explicit SolverMesh(std::shared_ptr<const Implementation> implementation)
      : implementation_(std::move(implementation)) {}

 private:
  std::shared_ptr<const Implementation> implementation_;
};

/// What an evaluation has found. With several ranks the master has all, the others know what is marked
/// collective, unless the cells stay where they were found (`is_collected`).
class BSP2_API Result {
 public:
  [[nodiscard]] int dimension() const;
  [[nodiscard]] bool is_complete() const;     ///< nothing is undecided but what a level leaves
  [[nodiscard]] bool is_interrupted() const;  ///< by Options::stop
  [[nodiscard]] bool is_collected() const;    ///< the master has all cells; else each rank its own
  [[nodiscard]] bool has_cells() const;       ///< they were made, and are held
  [[nodiscard]] bool is_of_master() const;    ///< of the rank that has all cells, where one has them
  [[nodiscard]] std::string digest() const;   ///< of the set of cells; empty if none were made

  /// The arrays live as long as the result.
  [[nodiscard]] const Cells& cells() const;
  [[nodiscard]] const Measures& measures() const;
  [[nodiscard]] Interval volume() const { return measures().volume; }
  /// What the `measure` nodes found, by name.
  [[nodiscard]] std::map<std::string, Measures> named_measures() const;
  /// Corners of the bounding box of the IN cells; empty if there are none.
  [[nodiscard]] std::pair<Vector, Vector> bounds() const;
  [[nodiscard]] std::vector<Part> parts() const;

  /// The surface; found now, if it was not. Of the master. @throws Error unless the dimension is 3 and the
  /// IN cells are held.
  [[nodiscard]] Surface surface() const;
  /// Its faces, edges and solids. Likewise.
  [[nodiscard]] Brep faces() const;
  /// Likewise.
  [[nodiscard]] std::vector<Contact> contacts() const;
  /// Where points are. Of the master. @param points D numbers each. @throws Error unless IN and FUZZY cells
  /// are held.
  [[nodiscard]] Locations locate(std::span<const double> points) const;

  /// A mesh for solvers of the IN cells. Likewise. @throws Error also if no valid mesh is found.
  [[nodiscard]] SolverMesh solver_mesh(const SolverMeshOptions& options = {}) const;

  /// Writes a file in the format that its ending names: .pvtu and .vtu (the cells), .stl, .ply, .obj, .vtp
  /// and what else there is for surfaces, .png, .svg, .pdf (a picture), .json (the report), .csg (the model),
  /// .h5 (the snapshot, if Options::snapshot had one made). Collective. It is there when it is complete.
  /// @return warnings. @throws Error if it cannot be written.
  std::vector<std::string> write(const std::filesystem::path& path, const WriteOptions& options = {}) const;
  /// A picture as the bytes of a file. Collective; empty but on the master. @param format png, svg or pdf.
  [[nodiscard]] std::string picture(const std::string& format = "png", const View& view = {}) const;

  /// Draws an animation of the IN and FUZZY cells of a solid of space, seen as `view` says but for what
  /// moves. Of the master, which has all cells. @param path .apng, .gif, .mp4 or .webm. @throws Error as
  /// `write`.
  void animate(const std::filesystem::path& path, const Film& film, const View& view = {}) const;

  /// What `report` tells; the figures of one evaluation, of the master.
  [[nodiscard]] Figures figures() const;
  /// report.json, see docs/report.md.
  [[nodiscard]] std::string report() const;
  [[nodiscard]] std::vector<std::string> warnings() const;
  [[nodiscard]] std::vector<std::string> notes() const;  ///< what is as it should be, but may surprise

  class Implementation;
  explicit Result(std::shared_ptr<Implementation> implementation)
      : implementation_(std::move(implementation)) {}

 private:
  std::shared_ptr<Implementation> implementation_;
};

/// While one lives, what its thread asks of the library ends soon once `stop` says so: a text that is read,
/// an evaluation, a surface, contacts, a mesh for solvers. It ends with an Error, "interrupted"; nothing is
/// half done then, and it can be asked for again. Thread rule: made and gone on the thread that asks.
class BSP2_API Stoppable {
 public:
  /// @param stop asked at most twenty times a second, by the thread that made this.
  explicit Stoppable(std::function<bool()> stop);
  ~Stoppable();
  Stoppable(const Stoppable&) = delete;
  Stoppable& operator=(const Stoppable&) = delete;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Evaluates an expression. The cells depend on it and on the options, not on ranks and threads. Collective:
/// all ranks give the same expression and options.
/// @throws Error for a model that cannot be evaluated, options that make no sense, files that cannot be read.
/// After an error that arose with several ranks, nothing more can be done with them.
BSP2_API Result evaluate(const Expression& expression, const Options& options = {}, const Ranks& ranks = {});

/// Evaluates the model in a file, as an expression is. The master alone reads it; what it names by relative
/// paths, each rank reads for itself. Nothing of it is held beside the evaluation.
BSP2_API Result evaluate(const std::filesystem::path& model, const Options& options = {},
                         const Ranks& ranks = {});

/// Goes on from a snapshot, whoever wrote it: model, regions, coincidence, curved, parts and keep are its
/// own. Collective.
BSP2_API Result resume(const std::filesystem::path& snapshot, const Options& options = {},
                       const Ranks& ranks = {});

/// Makes an engineering drawing of a solid of space and writes it. Collective. @param files .svg, .pdf, .dxf.
/// @return what there is to say about it. @throws Error as `evaluate`, and for a drawing that makes no sense.
BSP2_API std::vector<std::string> draw(const Expression& expression,
                                       const std::vector<std::filesystem::path>& files,
                                       const DrawingOptions& drawing = {}, const Options& options = {},
                                       const Ranks& ranks = {});

}  // namespace bsp2
