#include "bsp2/api/products/solver_mesh.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>

#include "bsp2/api/products/group_rule.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/suggestion.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/groups/groups.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"
#include "bsp2/meshing/tetrahedra/dual.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::api {
namespace {

using Clock = std::chrono::steady_clock;
using meshing::Complex;
using meshing::Point;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double diagonal(const Point& low, const Point& high) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += (high[k] - low[k]) * (high[k] - low[k]);
  return std::sqrt(sum);
}

/// The diagonals of the bounds of all, and of the smallest part: of its largest piece, since pieces may be
/// far from each other.
struct Extents {
  double all = 0, smallest_part = 0;

  explicit Extents(const Complex& complex) : piece_(complex.cells()) {
    std::iota(piece_.begin(), piece_.end(), 0U);
    Box whole;
    for (std::size_t face = 0; face < complex.faces(); ++face) {
      const auto owner = static_cast<std::uint32_t>(complex.owner[face]);
      const auto neighbour = static_cast<std::uint32_t>(complex.neighbour[face]);
      if (complex.neighbour[face] != Complex::outside && complex.part[owner] == complex.part[neighbour])
        piece_[root(owner)] = root(neighbour);
    }
    std::map<std::uint32_t, Box> pieces;
    for (std::size_t face = 0; face < complex.faces(); ++face) {
      geometry::Interruption::check();
      for (const std::int32_t cell : {complex.owner[face], complex.neighbour[face]})
        if (cell != Complex::outside)
          for (const std::uint32_t p : complex.points_of(face)) {
            pieces[root(static_cast<std::uint32_t>(cell))].add(complex.points[p]);
            whole.add(complex.points[p]);
          }
    }
    std::map<std::int32_t, double> parts;
    for (const auto& [piece, box] : pieces) {
      double& size = parts[complex.part[piece]];
      size = std::max(size, diagonal(box.low, box.high));
    }
    all = smallest_part = diagonal(whole.low, whole.high);
    for (const auto& [part, size] : parts) smallest_part = std::min(smallest_part, size);
  }

 private:
  struct Box {
    Point low{1e308, 1e308, 1e308}, high{-1e308, -1e308, -1e308};
    void add(const Point& p) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
  };
  std::vector<std::uint32_t> piece_;  // of each cell: one nearer to that which stands for all of its piece

  std::uint32_t root(std::uint32_t cell) {
    while (piece_[cell] != cell) cell = piece_[cell] = piece_[piece_[cell]];
    return cell;
  }
};

meshing::SizeField field_of(const std::vector<std::array<double, 4>>& rows) {
  std::vector<meshing::SizeField::Entry> entries;
  for (const auto& [x, y, z, size] : rows) entries.push_back({{x, y, z}, size});
  return meshing::SizeField(std::move(entries));
}

/// Of a length in a size field of the largest: what is shorter refines what is round no further, which takes
/// cells by its square.
constexpr double least_share = 1.0 / 64;
/// As much of the smallest part is absorbed if nobody says how much.
constexpr double usual_clean = 1e-6;
/// And up to so many times that where no valid mesh is found else.
constexpr double most_times = 16;

/// See tolerance_shares.
std::vector<std::array<double, 4>> squared_shares(std::vector<std::array<double, 4>> rows,
                                                  std::optional<double> size) {
  double whole = size.value_or(0);
  if (!(whole > 0))
    for (const auto& row : rows) whole = std::max(whole, row[3]);
  for (auto& row : rows) {
    const double share = std::clamp(row[3] / whole, least_share, 1.0);
    row[3] = share * share;
  }
  return rows;
}

class SolverMeshMaker {
 public:
  SolverMeshMaker(const SolverMeshOptions& options, const supersteps::RunResult& result,
                  std::string_view dashes)
      : options_(options), result_(result), dashes_(dashes) {}

  MadeSolverMesh run() {
    const auto start = Clock::now();
    tell_what_is_left_out();
    Complex complex = result_.asked->complex(result_);
    if (complex.cells() == 0)
      throw Error("there is nothing to mesh: " + supersteps::why_nothing_is_in(result_.report));
    summary_.seconds_of_cells = seconds_since(start);
    summary_.polyhedra = options_.polyhedra || options_.dual;
    const Extents extents(complex);
    summary_.clean = options_.clean.value_or(least_size(extents.smallest_part));
    most_clean_ = most_times * usual_clean * extents.smallest_part;
    summary_.size = options_.size.value_or(options_.size_field.empty() ? extents.all / 20 : field_.largest());
    std::vector<meshing::GroupRule> rules;
    for (const std::string& text : options_.groups) rules.push_back(parse_group(text));
    groups_.emplace(result_.part_names, part_colours(), std::move(rules), complex.points,
                    std::max(options_.clean.value_or(most_clean_), 1e-9 * extents.all));
    options_.polyhedra ? take(std::move(complex)) : make_tetrahedra(complex);
    for (const std::string& name : groups_->empty_rules())
      made_.warnings.push_back(dashes_ + "group " + name + ": no face is where it says, or another " +
                               dashes_ +
                               "group before it has "
                               "them, so there is no such group" +
                               about_colours(name));
    mesh_.volumes = groups_->volumes();
    mesh_.groups = groups_->groups();
    count();
    summary_.points = mesh_.points().size();
    return std::move(made_);
  }

 private:
  const SolverMeshOptions& options_;
  const supersteps::RunResult& result_;
  const std::string dashes_;
  MadeSolverMesh made_;
  MeshFigures& summary_ = made_.summary;
  io::SolverMesh& mesh_ = made_.mesh;
  const meshing::SizeField field_ = field_of(options_.size_field);
  std::optional<meshing::Groups> groups_;
  double most_clean_ = 0;  // if nobody says how much

  /// What is absorbed if nobody says: of what is round, what is as small as that is exact.
  [[nodiscard]] double least_size(double part) const {
    const double exact = result_.report.tolerance.value_or(0);
    return std::max(usual_clean * part, std::min(exact, 0.01 * part));
  }
  /// Where what is round is more exact, less is absorbed.
  [[nodiscard]] meshing::SizeField clean_by_place() const {
    if (options_.clean || !result_.report.tolerance_by_place || options_.size_field.empty()) return {};
    auto rows = squared_shares(options_.size_field, options_.size);
    for (auto& row : rows) row[3] *= summary_.clean;
    return field_of(rows);
  }

  void tell_what_is_left_out() {
    if (result_.report.tolerance_by_place) {
      const double least = least_share * options_.size.value_or(field_.largest());
      if (std::ranges::any_of(options_.size_field, [&](const auto& row) { return row[3] < least; }))
        made_.notes.push_back(fmt::format(
            "lengths in the size field below a 64th of the largest ({:.3g}) do not refine what is round any "
            "further",
            least));
    }
    const supersteps::RunReport& report = result_.report;
    if (report.fuzzy_cells > 0)
      made_.notes.push_back(fmt::format(
          "the mesh is made of what is inside for sure: {} of a volume of {:.6g}, {}; of what is round, a "
          "smaller {}tolerance leaves out less",
          counted(report.fuzzy_cells, "# cell[s] that [is|are] still undecided (FUZZY),"),
          report.fuzzy_volume, counted(report.fuzzy_cells, "[is|are] left out"), dashes_));
  }

  /// A group of what has a colour needs parts that have one.
  [[nodiscard]] std::string about_colours(const std::string& group) const {
    const bool asks = std::ranges::any_of(options_.groups, [&](const std::string& text) {
      const meshing::GroupRule rule = parse_group(text);
      return rule.name == group && !rule.colours.empty();
    });
    return asks && part_colours().empty()
               ? "; no part has a colour, since there are none in the model, or for want of " + dashes_ +
                     "parts colour"
               : "";
  }

  [[nodiscard]] std::map<std::int32_t, meshing::Rgba> part_colours() const {
    std::map<std::int32_t, meshing::Rgba> colours;
    for (const supersteps::NamedPart& part : result_.report.named_parts)
      if (part.colour) colours[part.part] = *part.colour;
    return colours;
  }

  void take(Complex complex) {
    std::vector<meshing::GroupFace> faces;
    for (std::size_t face = 0; face < complex.faces(); ++face) {
      const auto part_of = [&](std::int32_t cell) {
        return cell == Complex::outside ? meshing::PlaneSide::nothing
                                        : complex.part[static_cast<std::size_t>(cell)];
      };
      std::int32_t part = part_of(complex.owner[face]), other = part_of(complex.neighbour[face]);
      Point outward = complex.outward[face];
      if (other != meshing::PlaneSide::nothing && other < part) {
        std::swap(part, other);
        for (double& x : outward) x = -x;
      }
      faces.push_back({complex.points_of(face), outward});
      mesh_.group_of_face.push_back(
          part == other ? -1 : groups_->group_of(part, other, complex.points_of(face), complex.points));
    }
    groups_->divide(faces, mesh_.group_of_face);
    take_cells(std::move(complex));
  }

  /// Of a mesh in which a tetrahedron is flat nobody has any use, of thin ones little: then more is absorbed,
  /// unless somebody has said how much. @param volume gets that before anything has moved.
  meshing::ShapeReport shape(const Complex& complex, meshing::ShapeOptions& options, double& volume) {
    const double usual = options.clean;
    for (;;) {
      mesh_.tetrahedra = meshing::tetrahedra_of(complex);
      volume = total(meshing::volumes_of(mesh_.tetrahedra, 0));
      refuse_too_many(options);
      const meshing::ShapeReport shaped = meshing::shape(mesh_.tetrahedra, options);
      const bool is_last = shaped.turned == 0 || options_.clean || !(2 * options.clean <= most_clean_);
      if (is_last) {
        summary_.clean = shaped.clean;
        tell_what_was_too_little(usual, options.clean, shaped);
        return shaped;
      }
      options.clean = summary_.clean *= 2;
      options.clean_by_place = clean_by_place();
    }
  }

  /// A size in another unit than the model's would take days until memory ends.
  void refuse_too_many(const meshing::ShapeOptions& options) const {
    constexpr double most = 1e9;
    if (!(options.size > 0)) return;
    const auto [count, length] = meshing::expected_count(mesh_.tetrahedra, options);
    if (count > most)
      throw Error(
          fmt::format("edges of {:.3g} would make some {:.1e} tetrahedra, and more than {:.0e} are not made; "
                      "sizes are in the units of the model",
                      length, count, most));
  }

  /// @param rather_than_flat what was absorbed instead.
  void tell_what_was_too_little(double usual, double rather_than_flat, const meshing::ShapeReport& shaped) {
    if (!(shaped.clean > usual)) return;
    std::string why = rather_than_flat > usual ? "a tetrahedron stayed flat" : "";
    if (shaped.thin_spared > 0)
      why += (why.empty() ? "" : ", and ") +
             counted(shaped.thin_spared, "# more tetrahedr[on|a] had an angle below 1 degree");
    made_.notes.push_back(
        fmt::format("what is smaller than {:.3g} is absorbed, {:.0f} times as much as usual: with less, {}",
                    shaped.clean, shaped.clean / usual, why));
  }

  void make_tetrahedra(const Complex& complex) {
    const auto start = Clock::now();
    meshing::ShapeOptions options{.clean = summary_.clean,
                                  .most_clean = options_.clean ? 0 : most_clean_,
                                  .clean_by_place = clean_by_place(),
                                  .size = summary_.size,
                                  .size_of_part = sizes_of_parts(),
                                  .field = field_,
                                  .growth = options_.growth,
                                  .steepest_growth = steepest_growth(),
                                  .threads = result_.report.threads};
    // What is truly round is refined to a tolerance: farther than some of these nothing is moved.
    constexpr double far = 4;
    if (result_.report.tolerance)
      options.true_place = [&](std::span<const std::uint32_t> planes, const Point& point) {
        auto place = result_.asked->on_true_surface(result_, planes, point);
        return place && diagonal(point, *place) <= far * *result_.report.tolerance ? place : std::nullopt;
      };
    double before = 0;
    const meshing::ShapeReport shaped = shape(complex, options, before);
    if (shaped.turned > 0)
      throw std::runtime_error(fmt::format(
          "no valid mesh was found: of {} {} flat or turned over, since the model has details "
          "that are as small as doubles are rounded; a larger {}clean (now {:.3g}) may absorb them",
          counted(mesh_.tetrahedra.tetrahedra.size(), "# tetrahedr[on|a]"),
          counted(shaped.turned, "# [is|are]"), dashes_, shaped.clean));
    if (mesh_.tetrahedra.tetrahedra.empty())
      throw Error(fmt::format("nothing is left to mesh: all of the solid is smaller than {}clean {:.3g}",
                              dashes_, shaped.clean));
    tell_what_parts_are_gone(complex, shaped.clean);
    summary_.cells_at_first = shaped.tetrahedra_at_first;
    summary_.moved_points = shaped.moved_points;
    summary_.bent_edges = shaped.bent_edges;
    summary_.largest_move = shaped.largest_move;
    summary_.taken_away = shaped.taken_away;
    tell_what_moved(shaped, before, total(meshing::volumes_of(mesh_.tetrahedra, 0)));
    name_faces();
    options_.dual ? make_dual() : tell_quality();
    tell_details(shaped);
    summary_.seconds_of_shape = seconds_since(start);
  }

  void tell_what_parts_are_gone(const Complex& complex, double clean) {
    const std::set<std::int32_t> had(complex.part.begin(), complex.part.end()),
        has(mesh_.tetrahedra.part.begin(), mesh_.tetrahedra.part.end());
    for (const std::int32_t part : had)
      if (part >= 0 && static_cast<std::size_t>(part) < result_.part_names.size() && !has.contains(part))
        made_.warnings.push_back(fmt::format(
            "part '{}' is not in the mesh: all of it is thinner than {:.3g}, and absorbed; a smaller "
            "{}clean keeps what is thicker than that",
            result_.part_names[static_cast<std::size_t>(part)], clean, dashes_));
  }

  /// @param before the volume then.
  void tell_what_moved(const meshing::ShapeReport& shaped, double before, double now) {
    constexpr double much = 0.01;
    std::string absorbed;
    const auto add = [&](const std::string& what) { absorbed += (absorbed.empty() ? "" : ", ") + what; };
    if (shaped.moved_points > 0)
      add(counted(shaped.moved_points, "# corner[s] of the solid [was|were] moved"));
    if (shaped.bent_edges > 0)
      add(counted(shaped.bent_edges, "# edge[s] [was|were] bent to lead through a corner"));
    if (shaped.taken_away > 0) add(counted(shaped.taken_away, "# flat tetrahedr[on was|a were] taken away"));
    if (shaped.largest_move > 0)
      absorbed +=
          fmt::format(", by {:.3g} at most, to absorb what is smaller than {:.3g} ({}clean{})",
                      shaped.largest_move, shaped.clean, dashes_, options_.clean ? "" : " by default");
    std::string placed;
    if (shaped.placed > 0)
      placed = fmt::format("{} put on the true surface of what is round, by {:.3g} at most",
                           counted(shaped.placed, "# point[ was|s were]"), shaped.largest_placing);
    const std::string text = absorbed + (absorbed.empty() || placed.empty() ? "" : ", and ") + placed;
    if (text.empty()) return;
    const double change = before > 0 ? (now - before) / before : 0;
    (shaped.placed == 0 && std::abs(change) > much ? made_.warnings : made_.notes)
        .push_back(text +
                   fmt::format("; the volume changed by {:.3g} ({:.3g} %)", now - before, 100 * change));
  }

  /// What was too much to be meshed finely, where that has left thin tetrahedra.
  void tell_details(const meshing::ShapeReport& shaped) {
    if (shaped.too_many == 0 || summary_.below[2] == 0) return;
    made_.notes.push_back(fmt::format(
        "where the solid is thinner than {:.2g} tetrahedra are thin, too: good ones would be more than {}; a "
        "larger {}clean (now {:.3g}) absorbs what is thin",
        shaped.detail * summary_.size, counted(std::llround(shaped.too_many), "#"), dashes_, summary_.clean));
  }

  static double total(const std::vector<double>& volumes) {
    double sum = 0;
    for (const double volume : volumes) sum += volume;
    return sum;
  }

  /// Whoever asks for edges that grow slowly gets them everywhere.
  [[nodiscard]] double steepest_growth() const {
    constexpr double steep = 1;
    return options_.growth < SolverMeshOptions{}.growth ? options_.growth : std::max(steep, options_.growth);
  }
  [[nodiscard]] std::vector<double> sizes_of_parts() const {
    std::vector<double> sizes(result_.part_names.size(), 0);
    for (const auto& [name, size] : options_.part_sizes) {
      const auto found = std::find(result_.part_names.begin(), result_.part_names.end(), name);
      if (found == result_.part_names.end())
        throw Error(dashes_ + "part-size: the model has no part '" + name + "'" +
                    suggestion(name, std::vector<std::string_view>(result_.part_names.begin(),
                                                                   result_.part_names.end())));
      sizes[static_cast<std::size_t>(found - result_.part_names.begin())] = size;
    }
    return sizes;
  }

  void name_faces() {
    const auto& tets = mesh_.tetrahedra;
    std::vector<meshing::GroupFace> faces;
    for (std::size_t i = 0; i < tets.triangles.size(); ++i) {
      const meshing::PlaneSide& side = tets.sides[tets.side[i]];
      mesh_.group_of_triangle.push_back(
          groups_->group_of(side.part, side.other, tets.triangles[i], tets.points));
      faces.push_back({tets.triangles[i], side.outward});
    }
    groups_->divide(faces, mesh_.group_of_triangle);
    for (const std::int32_t part : tets.part) mesh_.volume.push_back(groups_->volume_of(part));
    for (const std::uint32_t side : tets.side)
      summary_.outer_faces += tets.sides[side].other == meshing::PlaneSide::nothing;
    summary_.faces = (4 * tets.tetrahedra.size() + summary_.outer_faces) / 2;
  }

  /// In the place of the tetrahedra.
  void make_dual() {
    meshing::Dual dual = meshing::dual_of(mesh_.tetrahedra, mesh_.group_of_triangle);
    if (dual.wrong_faces > 0)
      made_.warnings.push_back(
          counted(dual.wrong_faces,
                  "# face[s] of the dual [is|are] turned or skew, which solvers for finite volumes "
                  "may refuse: another size may do, or tetrahedra"));
    for (const std::uint32_t triangle : dual.triangle_of_face)
      mesh_.group_of_face.push_back(
          triangle == meshing::Dual::no_triangle ? -1 : mesh_.group_of_triangle[triangle]);
    mesh_.tetrahedra = {};
    mesh_.group_of_triangle.clear();
    mesh_.volume.clear();
    take_cells(std::move(dual.complex));
  }

  void take_cells(Complex complex) {
    for (const std::int32_t part : complex.part) mesh_.volume.push_back(groups_->volume_of(part));
    summary_.faces = complex.faces();
    summary_.outer_faces = static_cast<std::uint64_t>(
        std::count(complex.neighbour.begin(), complex.neighbour.end(), Complex::outside));
    mesh_.polyhedra = std::move(complex);
  }

  void tell_quality() {
    const meshing::Quality quality = meshing::quality_of(mesh_.tetrahedra);
    if (quality.turned > 0) throw std::runtime_error("a tetrahedron is turned over, against all care");
    add_quality(quality, summary_);
  }

  void count() {
    summary_.cells = mesh_.volume.size();
    for (const std::string& name : mesh_.groups) summary_.groups.emplace_back(name, 0);
    for (const auto* groups : {&mesh_.group_of_triangle, &mesh_.group_of_face})
      for (const std::int32_t group : *groups)
        if (group >= 0) ++summary_.groups[static_cast<std::size_t>(group)].second;
    for (const std::string& name : mesh_.volumes) summary_.volumes.emplace_back(name, 0);
    if (mesh_.polyhedra) {
      count_polyhedra();
    } else {
      const auto& tets = mesh_.tetrahedra;
      meshing::Tetrahedra copy;  // volumes by name
      copy.points = tets.points;
      copy.tetrahedra = tets.tetrahedra;
      copy.part = mesh_.volume;
      const auto volumes = meshing::volumes_of(copy, mesh_.volumes.size());
      for (std::size_t i = 0; i < mesh_.volumes.size(); ++i) summary_.volumes[i].second = volumes[i];
    }
    for (const auto& [name, volume] : summary_.volumes) summary_.volume += volume;
  }

  /// Cones over the faces, of which each counts for its two cells.
  void count_polyhedra() {
    const Complex& complex = *mesh_.polyhedra;
    for (std::size_t face = 0; face < complex.faces(); ++face) {
      const auto points = complex.points_of(face);
      double cone = 0;
      for (std::size_t k = 1; k + 1 < points.size(); ++k) {
        const Point &o = complex.points[points[0]], &a = complex.points[points[k]],
                    &b = complex.points[points[k + 1]];
        // Seen from a corner of the solid, not from the origin, which may be far away.
        const Point& eye = complex.points[0];
        std::array<Point, 3> m;
        for (std::size_t i = 0; i < 3; ++i)
          m[0][i] = o[i] - eye[i], m[1][i] = a[i] - eye[i], m[2][i] = b[i] - eye[i];
        for (std::size_t i = 0; i < 3; ++i)
          cone +=
              m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]) / 6;
      }
      const auto add = [&](std::int32_t cell, double volume) {
        if (cell == Complex::outside) return;
        summary_.volumes[static_cast<std::size_t>(mesh_.volume[static_cast<std::size_t>(cell)])].second +=
            volume;
      };
      add(complex.owner[face], cone);
      add(complex.neighbour[face], -cone);
    }
  }
};

}  // namespace

void add_quality(const meshing::Quality& quality, MeshFigures& figures) {
  figures.smallest_angle = quality.smallest_angle;
  figures.largest_angle = quality.largest_angle;
  figures.mean_smallest_angle = quality.mean_smallest_angle;
  figures.smallest_aspect = quality.smallest_aspect;
  figures.mean_aspect = quality.mean_aspect;
  figures.histogram = quality.histogram;
  figures.below = quality.tetrahedra_below;
  figures.below_of_solid = quality.of_solid;
}

std::shared_ptr<const meshing::SizeField> tolerance_shares(
    const std::vector<std::array<double, 4>>& size_field, std::optional<double> size) {
  if (size_field.empty()) return nullptr;
  return std::make_shared<const meshing::SizeField>(field_of(squared_shares(size_field, size)));
}

MadeSolverMesh make_solver_mesh(const SolverMeshOptions& options, const supersteps::RunResult& result,
                                std::string_view dashes) {
  if (!result.asked) throw std::logic_error("the cells of a mesh are not at hand");
  return SolverMeshMaker(options, result, dashes).run();
}

}  // namespace bsp2::api
