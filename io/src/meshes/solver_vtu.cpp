#include <algorithm>
#include <bit>
#include <numeric>
#include <string_view>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"

// Raw arrays at the end of the file, each after its length. Source: "VTK file formats", XML, appended data.

namespace bsp2::io {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint8_t vtk_tetrahedron = 10, vtk_quadratic_tetrahedron = 24, vtk_polyhedron = 42;

/// The file in pieces: what is between the arrays, and the arrays as they are in memory.
class VtuFile {
 public:
  explicit VtuFile(const SolverMesh& mesh) : mesh_(mesh) {}

  void write(const std::filesystem::path& path) {
    static_assert(sizeof(meshing::Point) == 3 * sizeof(double));
    mesh_.polyhedra ? find_polyhedra() : find_tetrahedra();
    text_ << "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece "
             "NumberOfPoints=\""
          << mesh_.points().size() << "\" NumberOfCells=\"" << types_.size() << "\">\n<Points>\n";
    add("Points", "Float64", 3, mesh_.points());
    text_ << "</Points>\n<Cells>\n";
    add("connectivity", "Int64", 1, connectivity_);
    add("offsets", "Int64", 1, offsets_);
    add("types", "UInt8", 1, types_);
    if (mesh_.polyhedra) {
      add("faces", "Int64", 1, faces_);
      add("faceoffsets", "Int64", 1, face_offsets_);
    }
    text_ << "</Cells>\n<CellData Scalars=\"volume\">\n";
    add("volume", "Int32", 1, mesh_.volume);
    text_ << "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    std::vector<std::string_view> pieces{text_.text()};
    for (const Array& array : arrays_) {
      pieces.emplace_back(reinterpret_cast<const char*>(&array.size), sizeof array.size);
      pieces.emplace_back(array.bytes, array.size);
    }
    pieces.emplace_back("\n</AppendedData>\n</VTKFile>\n");
    write_file(path, [&pieces, at = std::size_t{0}]() mutable -> std::string_view {
      constexpr std::size_t most = 1 << 20;
      while (at < pieces.size() && pieces[at].empty()) ++at;
      if (at == pieces.size()) return {};
      const std::string_view next = pieces[at].substr(0, most);
      pieces[at].remove_prefix(next.size());
      return next;
    });
  }

 private:
  struct Array {
    const char* bytes;
    std::uint64_t size;
  };
  const SolverMesh& mesh_;
  MeshText text_;
  std::vector<Array> arrays_;
  std::uint64_t offset_ = 0;  // of the next one
  std::vector<std::int64_t> connectivity_, offsets_, faces_, face_offsets_;
  std::vector<std::uint8_t> types_;

  template <typename T>
  void add(const char* name, const char* type, int components, const std::vector<T>& values) {
    text_ << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\"" << components
          << "\" format=\"appended\" offset=\"" << offset_ << "\"/>\n";
    arrays_.push_back({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
    offset_ += sizeof(std::uint64_t) + arrays_.back().size;
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
    // Faces by cells, by counting.
    std::vector<std::uint32_t> begin(complex.cells() + 1);
    std::size_t corners = 0;
    const auto for_each_side = [&](const auto& take) {
      for (std::uint32_t face = 0; face < complex.faces(); ++face)
        for (const std::int32_t cell : {complex.owner[face], complex.neighbour[face]})
          if (cell != meshing::Complex::outside) take(face, static_cast<std::size_t>(cell));
    };
    for_each_side([&](std::uint32_t face, std::size_t cell) {
      ++begin[cell + 1];
      corners += complex.points_of(face).size();
    });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> faces(begin.back()), next(begin.begin(), begin.end() - 1);
    for_each_side([&](std::uint32_t face, std::size_t cell) { faces[next[cell]++] = face; });
    faces_.reserve(complex.cells() + faces.size() + corners);
    connectivity_.reserve(corners / 2);  // each is on three faces, mostly
    std::vector<std::uint32_t> points;
    for (std::size_t cell = 0; cell < complex.cells(); ++cell) {
      geometry::Interruption::check();
      points.clear();
      faces_.push_back(begin[cell + 1] - begin[cell]);
      for (std::uint32_t i = begin[cell]; i < begin[cell + 1]; ++i)
        add_face(complex, faces[i], complex.owner[faces[i]] != static_cast<std::int32_t>(cell), points);
      face_offsets_.push_back(static_cast<std::int64_t>(faces_.size()));
      std::sort(points.begin(), points.end());
      points.erase(std::unique(points.begin(), points.end()), points.end());
      connectivity_.insert(connectivity_.end(), points.begin(), points.end());
      offsets_.push_back(static_cast<std::int64_t>(connectivity_.size()));
      types_.push_back(vtk_polyhedron);
    }
  }

  void add_face(const meshing::Complex& complex, std::uint32_t face, bool is_reversed,
                std::vector<std::uint32_t>& points) {
    const auto cycle = complex.points_of(face);
    points.insert(points.end(), cycle.begin(), cycle.end());
    faces_.push_back(static_cast<std::int64_t>(cycle.size()));
    is_reversed ? faces_.insert(faces_.end(), cycle.rbegin(), cycle.rend())
                : faces_.insert(faces_.end(), cycle.begin(), cycle.end());
  }
};

}  // namespace

void write_solver_vtu(const std::filesystem::path& path, const SolverMesh& mesh) {
  VtuFile(mesh).write(path);
}

}  // namespace bsp2::io
