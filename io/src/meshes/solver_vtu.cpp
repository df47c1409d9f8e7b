#include <algorithm>
#include <bit>
#include <span>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"

// Raw arrays at the end of the file, each after its length. Source: "VTK file formats", XML, appended data.

namespace bsp2::io {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint8_t vtk_tetrahedron = 10, vtk_quadratic_tetrahedron = 24, vtk_polyhedron = 42;

class VtuText {
 public:
  explicit VtuText(const SolverMesh& mesh) : mesh_(mesh) {}

  std::string run() {
    mesh_.polyhedra ? find_polyhedra() : find_tetrahedra();
    std::vector<double> points;
    for (const auto& p : mesh_.points()) points.insert(points.end(), p.begin(), p.end());
    text_ << "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece "
             "NumberOfPoints=\""
          << mesh_.points().size() << "\" NumberOfCells=\"" << types_.size() << "\">\n<Points>\n";
    add("Points", "Float64", 3, std::span<const double>(points));
    text_ << "</Points>\n<Cells>\n";
    add("connectivity", "Int64", 1, std::span<const std::int64_t>(connectivity_));
    add("offsets", "Int64", 1, std::span<const std::int64_t>(offsets_));
    add("types", "UInt8", 1, std::span<const std::uint8_t>(types_));
    if (mesh_.polyhedra) {
      add("faces", "Int64", 1, std::span<const std::int64_t>(faces_));
      add("faceoffsets", "Int64", 1, std::span<const std::int64_t>(face_offsets_));
    }
    text_ << "</Cells>\n<CellData Scalars=\"volume\">\n";
    add("volume", "Int32", 1, std::span<const std::int32_t>(mesh_.volume));
    text_ << "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    return text_.text() + data_ + "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  const SolverMesh& mesh_;
  MeshText text_;
  std::string data_;
  std::vector<std::int64_t> connectivity_, offsets_, faces_, face_offsets_;
  std::vector<std::uint8_t> types_;

  template <typename T>
  void add(const char* name, const char* type, int components, std::span<const T> values) {
    text_ << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\"" << components
          << "\" format=\"appended\" offset=\"" << data_.size() << "\"/>\n";
    const std::uint64_t bytes = values.size_bytes();
    data_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
    data_.append(reinterpret_cast<const char*>(values.data()), bytes);
  }

  void find_tetrahedra() {
    for (std::size_t i = 0; i < mesh_.tetrahedra.tetrahedra.size(); ++i) {
      geometry::Interruption::check();
      const auto& t = mesh_.tetrahedra.tetrahedra[i];
      connectivity_.insert(connectivity_.end(), t.begin(), t.end());
      if (!mesh_.middles.empty())
        connectivity_.insert(connectivity_.end(), mesh_.middles[i].begin(), mesh_.middles[i].end());
      offsets_.push_back(static_cast<std::int64_t>(connectivity_.size()));
      types_.push_back(mesh_.middles.empty() ? vtk_tetrahedron : vtk_quadratic_tetrahedron);
    }
  }

  void find_polyhedra() {
    const meshing::Complex& complex = *mesh_.polyhedra;
    std::vector<std::vector<std::uint32_t>> faces(complex.cells());
    for (std::uint32_t face = 0; face < complex.faces(); ++face)
      for (const std::int32_t cell : {complex.owner[face], complex.neighbour[face]})
        if (cell != meshing::Complex::outside) faces[static_cast<std::size_t>(cell)].push_back(face);
    std::vector<std::uint32_t> points;
    for (std::size_t cell = 0; cell < faces.size(); ++cell) {
      geometry::Interruption::check();
      points.clear();
      faces_.push_back(static_cast<std::int64_t>(faces[cell].size()));
      for (const std::uint32_t face : faces[cell]) {
        const auto cycle = complex.points_of(face);
        points.insert(points.end(), cycle.begin(), cycle.end());
        faces_.push_back(static_cast<std::int64_t>(cycle.size()));
        const auto at = static_cast<std::ptrdiff_t>(faces_.size());
        faces_.insert(faces_.end(), cycle.begin(), cycle.end());
        if (complex.owner[face] != static_cast<std::int32_t>(cell))
          std::reverse(faces_.begin() + at, faces_.end());
      }
      face_offsets_.push_back(static_cast<std::int64_t>(faces_.size()));
      std::sort(points.begin(), points.end());
      points.erase(std::unique(points.begin(), points.end()), points.end());
      connectivity_.insert(connectivity_.end(), points.begin(), points.end());
      offsets_.push_back(static_cast<std::int64_t>(connectivity_.size()));
      types_.push_back(vtk_polyhedron);
    }
  }
};

}  // namespace

void write_solver_vtu(const std::filesystem::path& path, const SolverMesh& mesh) {
  write_file(path, VtuText(mesh).run());
}

}  // namespace bsp2::io
