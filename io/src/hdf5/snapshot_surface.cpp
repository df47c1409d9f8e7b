#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <system_error>
#include <type_traits>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "files/replacing.hpp"
#include "hdf5/arrays.hpp"
#include "hdf5/hdf5.hpp"
#include "hdf5/snapshot_format.hpp"

// The surface in a snapshot: only what does not follow from the rest. Lists that others divide into parts are
// in their order, so how many belong to each is all that is told of them.

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::Brep;
using geometry::TriangleSurface;
using hdf5::check;
using hdf5::Failure;
using hdf5::Handle;
using snapshot::faces_group;
using snapshot::surface_group;

/// How a value is stored: as one number, or as several in a row.
template <typename T>
struct Stored {
  using Number = std::conditional_t<std::is_same_v<T, bool>, std::uint8_t, T>;
  static constexpr std::size_t columns = 1;
};
template <typename T, std::size_t N>
struct Stored<std::array<T, N>> {
  using Number = T;
  static constexpr std::size_t columns = N;
};

/// Puts the arrays into a file.
class Writer {
 public:
  explicit Writer(hid_t file) : file_(file) {}
  template <typename T>
  void list(const char* name, const std::vector<T>& rows) {
    write(name, reinterpret_cast<const typename Stored<T>::Number*>(rows.data()), rows.size(),
          Stored<T>::columns);
  }
  template <typename Row, typename T>
  void column(const char* name, const std::vector<Row>& rows, T Row::*member) {
    std::vector<typename Stored<T>::Number> values(rows.size() * Stored<T>::columns);
    auto* at = values.data();
    for (const Row& row : rows) {
      std::memcpy(at, &(row.*member), sizeof(T));
      at += Stored<T>::columns;
    }
    write(name, values.data(), rows.size(), Stored<T>::columns);
  }

 private:
  hid_t file_;

  template <typename Number>
  void write(const char* name, const Number* values, std::size_t rows, std::size_t columns) {
    const Handle dataset = hdf5::make_array(file_, name, hdf5::file_type<Number>(), rows, columns);
    if (rows > 0)
      check(H5Dwrite(dataset, hdf5::memory_type<Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
  }
};

/// Gets them back.
class Reader {
 public:
  explicit Reader(hid_t file) : file_(file) {}
  template <typename T>
  void list(const char* name, std::vector<T>& rows) {
    const auto values = read<T>(name);
    rows.resize(values.size() / Stored<T>::columns);
    if (!rows.empty()) std::memcpy(rows.data(), values.data(), rows.size() * sizeof(T));
  }
  /// The first column of a table says how many rows it has.
  template <typename Row, typename T>
  void column(const char* name, std::vector<Row>& rows, T Row::*member) {
    const auto values = read<T>(name);
    const std::size_t count = values.size() / Stored<T>::columns;
    if (table_ != &rows) rows.resize(count);
    table_ = &rows;
    if (rows.size() != count) throw Failure(std::string("the array ") + name + " does not fit the others");
    const auto* at = values.data();
    for (Row& row : rows) {
      if constexpr (std::is_same_v<T, bool>)
        row.*member = *at != 0;
      else
        std::memcpy(&(row.*member), at, sizeof(T));
      at += Stored<T>::columns;
    }
  }

 private:
  hid_t file_;
  const void* table_ = nullptr;

  template <typename T>
  [[nodiscard]] auto read(const char* name) const {
    return hdf5::read_array<typename Stored<T>::Number>(file_, name, Stored<T>::columns);
  }
};

// Both ways meet the arrays in one order: `Way` is a Writer or a Reader.

template <typename Way, typename Surface>
void pass_triangles(Way& way, Surface& surface) {
  way.list("surface/points", surface.points);
  way.list("surface/triangles", surface.triangles);
  way.list("surface/part", surface.owner);
}

template <typename Way, typename Complex>
void pass_faces(Way& way, Complex& brep) {
  way.list("faces/points", brep.points);
  way.column("faces/edge_ends", brep.edges, &Brep::Edge::ends);
  way.column("faces/edge_uses", brep.edges, &Brep::Edge::count);
  way.list("faces/uses_of_edges", brep.uses_of_edges);
  way.column("faces/face_normal", brep.faces, &Brep::Face::normal);
  way.column("faces/face_offset", brep.faces, &Brep::Face::offset);
  way.column("faces/face_part", brep.faces, &Brep::Face::part);
  way.column("faces/face_other", brep.faces, &Brep::Face::other);
  way.column("faces/face_loops", brep.faces, &Brep::Face::loops);
  way.column("faces/loop_uses", brep.loops, &Brep::Loop::uses);
  way.column("faces/use_edge", brep.uses, &Brep::Use::edge);
  way.column("faces/use_forward", brep.uses, &Brep::Use::forward);
  way.column("faces/use_angle", brep.uses, &Brep::Use::angle);
  way.column("faces/solid_part", brep.solids, &Brep::Solid::part);
  way.column("faces/solid_shells", brep.solids, &Brep::Solid::shells);
  way.column("faces/solid_volume", brep.solids, &Brep::Solid::volume);
  way.column("faces/shell_sides", brep.shells, &Brep::Shell::count);
  way.column("faces/shell_volume", brep.shells, &Brep::Shell::volume);
  way.column("faces/side_face", brep.faces_of_shells, &Brep::Side::face);
  way.column("faces/side_is_front", brep.faces_of_shells, &Brep::Side::is_front);
  way.list("faces/triangles", brep.triangles);
  way.list("faces/triangle_face", brep.face_of_triangle);
}

/// Finds where the part of each row begins. @throws Failure if one has none, or all together are not the
/// whole.
template <typename Row>
void divide(std::vector<Row>& rows, std::uint32_t Row::*first, std::uint32_t Row::*count, std::size_t whole) {
  std::uint64_t end = 0;
  for (Row& row : rows) {
    row.*first = static_cast<std::uint32_t>(end);
    end += row.*count;
    if (row.*count == 0) throw Failure("the surface has faces without edges, or the like");
    if (end > whole) break;
  }
  if (end != whole) throw Failure("the faces of the surface do not fit");
}

template <typename Rows, typename Index>
void check_indices(const Rows& rows, std::size_t end, const Index& index_of) {
  if (!std::ranges::all_of(rows, [&](const auto& row) { return index_of(row) < end; }))
    throw Failure("the surface has indices beyond its end");
}

std::uint32_t highest(const std::array<std::uint32_t, 3>& corners) { return std::ranges::max(corners); }

void check_points(const std::vector<std::array<double, 3>>& points) {
  for (const auto& point : points)
    if (!std::ranges::all_of(point, [](double x) { return std::isfinite(x); }))
      throw Failure("the surface has points that are nowhere");
}

/// @param parts how many the model has. @param lowest `no_part`, or Brep::outside.
void check_part(std::int32_t part, std::int32_t parts, std::int32_t lowest = geometry::no_part) {
  if (part < lowest || part >= parts)
    throw Failure("the surface is of part " + std::to_string(part) + ", parts are fewer than " +
                  std::to_string(parts));
}

TriangleSurface read_triangles(Reader& reader, std::int32_t parts) {
  TriangleSurface surface;
  pass_triangles(reader, surface);
  check_points(surface.points);
  check_indices(surface.triangles, surface.points.size(), highest);
  if (surface.owner.size() != surface.triangles.size()) throw Failure("the surface is incomplete");
  for (const std::int32_t part : surface.owner) check_part(part, parts);
  return surface;
}

/// Each use is listed once, at its edge.
void check_uses(const Brep& brep) {
  std::vector<bool> is_listed(brep.uses.size());
  for (std::uint32_t edge = 0; edge < brep.edges.size(); ++edge)
    for (std::uint32_t i = 0; i < brep.edges[edge].count; ++i) {
      const std::uint32_t use = brep.uses_of_edges[brep.edges[edge].first + i];
      if (is_listed[use] || brep.uses[use].edge != edge) throw Failure("the edges of the surface do not fit");
      is_listed[use] = true;
    }
  if (brep.uses_of_edges.size() != brep.uses.size()) throw Failure("the edges of the surface do not fit");
}

/// What follows from the order of the lists. @throws Failure if they do not fit.
void complete(Brep& brep) {
  divide(brep.edges, &Brep::Edge::first, &Brep::Edge::count, brep.uses_of_edges.size());
  divide(brep.faces, &Brep::Face::first_loop, &Brep::Face::loops, brep.loops.size());
  divide(brep.loops, &Brep::Loop::first_use, &Brep::Loop::uses, brep.uses.size());
  divide(brep.solids, &Brep::Solid::first_shell, &Brep::Solid::shells, brep.shells.size());
  divide(brep.shells, &Brep::Shell::first, &Brep::Shell::count, brep.faces_of_shells.size());
  for (std::uint32_t face = 0; face < brep.faces.size(); ++face)
    for (const Brep::Loop& loop : brep.loops_of(brep.faces[face]))
      for (std::uint32_t i = 0; i < loop.uses; ++i) brep.uses[loop.first_use + i].face = face;
  for (std::uint32_t solid = 0; solid < brep.solids.size(); ++solid)
    for (std::uint32_t i = 0; i < brep.solids[solid].shells; ++i) {
      Brep::Shell& shell = brep.shells[brep.solids[solid].first_shell + i];
      shell.part = brep.solids[solid].part;
      shell.solid = solid;
      shell.is_cavity = i > 0;
    }
}

Brep read_faces(hid_t file, Reader& reader, std::int32_t parts) {
  Brep brep;
  pass_faces(reader, brep);
  complete(brep);
  const std::size_t faces = brep.faces.size(), points = brep.points.size();
  check_indices(brep.edges, points, [](const auto& edge) { return std::ranges::max(edge.ends); });
  check_indices(brep.uses_of_edges, brep.uses.size(), std::identity());
  check_indices(brep.uses, brep.edges.size(), [](const auto& use) { return use.edge; });
  check_indices(brep.faces_of_shells, faces, [](const auto& side) { return side.face; });
  check_indices(brep.triangles, points, highest);
  check_indices(brep.face_of_triangle, faces, std::identity());
  if (brep.face_of_triangle.size() != brep.triangles.size() || !std::ranges::is_sorted(brep.face_of_triangle))
    throw Failure("the triangles of the faces do not fit");
  check_points(brep.points);
  check_uses(brep);
  for (const Brep::Face& face : brep.faces) {
    check_part(face.part, parts);
    check_part(face.other, parts, Brep::outside);
  }
  for (const Brep::Solid& solid : brep.solids) check_part(solid.part, parts);
  const Handle group(H5Gopen2(file, faces_group, H5P_DEFAULT), H5Gclose);
  brep.is_closed = hdf5::read_attribute<std::uint32_t>(group, "closed") != 0;
  return brep;
}

template <typename T>
std::uint64_t bytes_of(const std::vector<T>& rows) {
  return rows.size() * sizeof(T);
}

/// What a surface takes, rather more.
std::uint64_t room_for(const TriangleSurface& surface, const Brep* brep) {
  std::uint64_t bytes = bytes_of(surface.points) + bytes_of(surface.triangles) + bytes_of(surface.owner);
  if (brep != nullptr)
    bytes += bytes_of(brep->points) + bytes_of(brep->edges) + bytes_of(brep->faces) + bytes_of(brep->loops) +
             bytes_of(brep->uses) + bytes_of(brep->uses_of_edges) + bytes_of(brep->shells) +
             bytes_of(brep->faces_of_shells) + bytes_of(brep->solids) + bytes_of(brep->triangles) +
             bytes_of(brep->face_of_triangle);
  return bytes + bytes / 64 + (std::uint64_t{1} << 16);
}

void put_into(const fs::path& path, const TriangleSurface& surface, const Brep* brep) {
  const hdf5::Silence silence;
  const Handle access = snapshot::file_access();
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, access), H5Fclose);
  for (const char* group : {surface_group, faces_group})
    if (H5Lexists(file, group, H5P_DEFAULT) > 0) check(H5Ldelete(file, group, H5P_DEFAULT));
  Writer writer(file);
  pass_triangles(writer, surface);
  if (brep != nullptr) {
    pass_faces(writer, *brep);
    const Handle group(H5Gopen2(file, faces_group, H5P_DEFAULT), H5Gclose);
    hdf5::write_attribute(group, "closed", static_cast<std::uint32_t>(brep->is_closed));
  }
  file.close();
}

}  // namespace

void snapshot::add_surface(const fs::path& path, const TriangleSurface& surface, const Brep* faces) {
  const fs::path unfinished = unfinished_name(path);
  const WritingLock lock(path);
  const struct Removed {
    const fs::path& file;
    bool is_ours;
    ~Removed() {
      std::error_code ignored;
      if (is_ours) fs::remove(file, ignored);
    }
  } removed{unfinished, lock.why_not().empty()};  // unless it is in place
  std::string why = lock.why_not();
  try {
    if (why.empty()) why = lack_of_room(path, fs::file_size(path) + room_for(surface, faces));
    if (why.empty()) {
      fs::copy_file(path, unfinished, fs::copy_options::overwrite_existing);
      put_into(unfinished, surface, faces);
      if (const std::error_code error = put_in_place(path)) why = error.message();
    }
  } catch (const fs::filesystem_error& error) {
    why = error.code().message();
  } catch (const Failure& failure) {
    why = failure.what();
  }
  if (!why.empty()) throw Error("cannot add the surface to the snapshot '" + path.string() + "': " + why);
}

std::optional<SnapshotSurface> snapshot::read_surface(const fs::path& path, std::int32_t parts,
                                                      bool with_faces) {
  return of_file(path, [&](hid_t file) -> std::optional<SnapshotSurface> {
    if (H5Lexists(file, surface_group, H5P_DEFAULT) <= 0) return std::nullopt;
    Reader reader(file);
    SnapshotSurface surface{read_triangles(reader, parts), std::nullopt};
    if (with_faces && H5Lexists(file, faces_group, H5P_DEFAULT) > 0)
      surface.faces = read_faces(file, reader, parts);
    return surface;
  });
}

}  // namespace bsp2::io
