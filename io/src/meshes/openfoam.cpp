#include <algorithm>
#include <set>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"

// Source: the OpenFOAM user guide, "Mesh description". Faces inside come first, by owner and then by
// neighbour; those of a patch follow each other.

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using meshing::Complex;

class FoamWriter {
 public:
  FoamWriter(const fs::path& marker, const SolverMesh& mesh, const Complex& complex,
             const std::vector<std::int32_t>& group)
      : marker_(marker), folder_(folder_of(marker)), mesh_(mesh), complex_(complex) {
    std::vector<std::vector<std::uint32_t>> outer(mesh.groups.size());
    inner_faces_.resize(mesh.groups.size());
    for (std::uint32_t face = 0; face < complex.faces(); ++face) {
      const auto g = static_cast<std::size_t>(group[face]);
      if (complex.neighbour[face] == Complex::outside) {
        outer[g].push_back(face);
      } else {
        if (group[face] >= 0) inner_faces_[g].push_back(order_.size());
        order_.push_back(face);
      }
    }
    inner_ = order_.size();
    for (const auto& faces : outer) {
      first_.push_back(order_.size());
      order_.insert(order_.end(), faces.begin(), faces.end());
    }
    first_.push_back(order_.size());
  }

  void run() {
    make_folder(folder_);
    write_mesh();
    make_folder(folder_ / "system");

    // checkMesh and the like ask for these; whoever has some keeps them.
    write_dictionary("controlDict",
                     "application     none;\nstartFrom       startTime;\nstartTime       0;\nstopAt          "
                     "endTime;\nendTime         1;\ndeltaT          1;\nwriteControl    timeStep;\n"
                     "writeInterval   1;\n");
    write_dictionary("fvSchemes",
                     "ddtSchemes { default steadyState; }\ngradSchemes { default Gauss linear; }\n"
                     "divSchemes { default none; }\nlaplacianSchemes { default Gauss linear corrected; }\n"
                     "interpolationSchemes { default linear; }\nsnGradSchemes { default corrected; }\n");
    write_dictionary("fvSolution", "solvers { }\n");
    write_file(marker_, "");
  }

 private:
  const fs::path marker_, folder_;
  const SolverMesh& mesh_;
  const std::vector<std::string> group_names_ = plain_names(mesh_.groups),
                                 volume_names_ = plain_names(mesh_.volumes);
  const Complex& complex_;
  std::vector<std::uint32_t> order_;                   // of faces in the files
  std::vector<std::size_t> first_;                     // of the outer ones of each group, and their end
  std::vector<std::vector<std::size_t>> inner_faces_;  // of each group
  std::size_t inner_ = 0;
  fs::path scratch_;  // where files are until all are written

  /// A case whose files are written again, and not to the end, stays as it was.
  void write_mesh() {
    const TemporaryDirectory scratch(folder_);
    scratch_ = scratch.path();
    write_points();
    write_faces();
    write_labels("owner", complex_.owner, order_.size());
    write_labels("neighbour", complex_.neighbour, inner_);
    write_boundary();
    write_cell_zones();
    write_face_zones();
    const fs::path target = folder_ / "constant" / "polyMesh";
    make_folder(target);
    for (const auto& file : fs::directory_iterator(scratch_)) move(file.path(), target);
  }

  static void move(const fs::path& file, const fs::path& folder) {
    const fs::path target = folder / file.filename();
    std::error_code error;
    fs::rename(file, target, error);
    if (error) throw Error("cannot write '" + target.string() + "': " + error.message());
  }

  void header(MeshText& text, std::string_view type, std::string_view object,
              std::string_view location = "constant/polyMesh") const {
    text << "FoamFile\n{\n    version     2.0;\n    format      ascii;\n    class       " << type
         << ";\n    note        \"nPoints:" << complex_.points.size() << " nCells:" << complex_.cells()
         << " nFaces:" << complex_.faces() << " nInternalFaces:" << inner_ << "\";\n    location    \""
         << location << "\";\n    object      " << object << ";\n}\n\n";
  }
  void write(const char* name, const MeshText& text) const { write_file(scratch_ / name, text.text()); }

  void write_dictionary(const char* name, std::string_view content) const {
    if (fs::exists(folder_ / "system" / name)) return;
    MeshText text;
    header(text, "dictionary", name, "system");
    text << content;
    write_file(folder_ / "system" / name, text.text());
  }

  void write_points() const {
    MeshText text;
    header(text, "vectorField", "points");
    text << complex_.points.size() << "\n(\n";
    for (const auto& [x, y, z] : complex_.points) text << '(' << x << ' ' << y << ' ' << z << ")\n";
    text << ")\n";
    write("points", text);
  }

  void write_faces() const {
    MeshText text;
    header(text, "faceList", "faces");
    text << order_.size() << "\n(\n";
    for (const std::uint32_t face : order_) {
      const auto points = complex_.points_of(face);
      text << points.size() << '(';
      for (std::size_t k = 0; k < points.size(); ++k) text << (k > 0 ? " " : "") << points[k];
      text << ")\n";
    }
    text << ")\n";
    write("faces", text);
  }

  void write_labels(const char* name, const std::vector<std::int32_t>& values, std::size_t count) const {
    MeshText text;
    header(text, "labelList", name);
    text << count << "\n(\n";
    for (std::size_t i = 0; i < count; ++i) text << values[order_[i]] << '\n';
    text << ")\n";
    write(name, text);
  }

  void write_boundary() const {
    MeshText text;
    header(text, "polyBoundaryMesh", "boundary");
    const auto count = [&](std::size_t g) { return first_[g + 1] - first_[g]; };
    std::size_t patches = 0;
    for (std::size_t g = 0; g < mesh_.groups.size(); ++g) patches += count(g) > 0 ? 1 : 0;
    text << patches << "\n(\n";
    for (std::size_t g = 0; g < mesh_.groups.size(); ++g)
      if (count(g) > 0)
        text << "    " << group_names_[g] << "\n    {\n        type            patch;\n        nFaces"
             << "          " << count(g) << ";\n        startFace       " << first_[g] << ";\n    }\n";
    text << ")\n";
    write("boundary", text);
  }

  void write_cell_zones() const {
    MeshText text;
    header(text, "regIOobject", "cellZones");
    text << mesh_.volumes.size() << "\n(\n";
    for (std::size_t zone = 0; zone < mesh_.volumes.size(); ++zone) {
      text << volume_names_[zone] << "\n{\n    type cellZone;\n    cellLabels List<label>\n"
           << std::count(mesh_.volume.begin(), mesh_.volume.end(), static_cast<std::int32_t>(zone))
           << "\n(\n";
      for (std::size_t cell = 0; cell < mesh_.volume.size(); ++cell)
        if (mesh_.volume[cell] == static_cast<std::int32_t>(zone)) text << cell << '\n';
      text << ");\n}\n";
    }
    text << ")\n";
    write("cellZones", text);
  }

  void write_face_zones() const {
    MeshText text;
    header(text, "regIOobject", "faceZones");
    text << std::ranges::count_if(inner_faces_, [](const auto& faces) { return !faces.empty(); }) << "\n(\n";
    for (std::size_t g = 0; g < mesh_.groups.size(); ++g) {
      const std::vector<std::size_t>& faces = inner_faces_[g];
      if (faces.empty()) continue;
      // All look out of the volume of the first face's owner.
      const auto volume = [&](std::size_t i) {
        return mesh_.volume[static_cast<std::size_t>(complex_.owner[order_[i]])];
      };
      text << group_names_[g] << "\n{\n    type faceZone;\n    faceLabels List<label>\n"
           << faces.size() << "\n(\n";
      for (const std::size_t i : faces) text << i << '\n';
      text << ");\n    flipMap List<bool>\n" << faces.size() << "\n(\n";
      for (const std::size_t i : faces) text << (volume(i) == volume(faces.front()) ? "0\n" : "1\n");
      text << ");\n}\n";
    }
    text << ")\n";
    write("faceZones", text);
  }
};

}  // namespace

void write_openfoam(const fs::path& marker, const SolverMesh& mesh) {
  if (mesh.polyhedra) return FoamWriter(marker, mesh, *mesh.polyhedra, mesh.group_of_face).run();
  std::vector<std::uint32_t> triangle;
  const Complex complex = complex_of(mesh.tetrahedra, triangle);
  std::vector<std::int32_t> group;
  for (const std::uint32_t t : triangle) group.push_back(t == ~0U ? -1 : mesh.group_of_triangle[t]);
  FoamWriter(marker, mesh, complex, group).run();
}

}  // namespace bsp2::io
