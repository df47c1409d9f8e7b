#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"
#include "outputs/modules.hpp"

// As dolfinx reads it: the grid `mesh`, and tags as grids of their own, `cell_tags` and `facet_tags`. Tags
// are the numbers of volumes and groups, from 1 on; an attribute of the .h5 tells their names.

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

class XdmfWriter {
 public:
  XdmfWriter(const fs::path& path, const SolverMesh& mesh)
      : path_(path), h5_(fs::path(path).replace_extension(".h5")), mesh_(mesh) {}

  void run() {
    const auto& tets = mesh_.tetrahedra;
    for (const auto& p : mesh_.points()) points_.insert(points_.end(), p.begin(), p.end());
    const bool is_second = !mesh_.middles.empty();
    const std::size_t corners = is_second ? 10 : 4, corners_2 = is_second ? 6 : 3;
    for (std::size_t i = 0; i < tets.tetrahedra.size(); ++i) {
      geometry::Interruption::check();
      cells_.insert(cells_.end(), tets.tetrahedra[i].begin(), tets.tetrahedra[i].end());
      if (is_second) cells_.insert(cells_.end(), mesh_.middles[i].begin(), mesh_.middles[i].end());
    }
    for (std::size_t i = 0; i < tets.triangles.size(); ++i) {
      facets_.insert(facets_.end(), tets.triangles[i].begin(), tets.triangles[i].end());
      if (is_second)
        facets_.insert(facets_.end(), mesh_.triangle_middles[i].begin(), mesh_.triangle_middles[i].end());
    }
    for (const std::int32_t volume : mesh_.volume) cell_tags_.push_back(volume + 1);
    for (const std::int32_t group : mesh_.group_of_triangle) facet_tags_.push_back(group + 1);
    const auto n = tets.tetrahedra.size(), m = tets.triangles.size();
    const std::vector<Hdf5Array> arrays{{"points", points_.data(), nullptr, mesh_.points().size(), 3},
                                        {"cells", nullptr, cells_.data(), n, corners},
                                        {"cell_tags", nullptr, cell_tags_.data(), n, 1},
                                        {"facets", nullptr, facets_.data(), m, corners_2},
                                        {"facet_tags", nullptr, facet_tags_.data(), m, 1}};
    std::string names;
    for (std::size_t i = 0; i < mesh_.volumes.size(); ++i)
      names += "volume " + std::to_string(i + 1) + " " + mesh_.volumes[i] + "\n";
    for (std::size_t i = 0; i < mesh_.groups.size(); ++i)
      names += "group " + std::to_string(i + 1) + " " + mesh_.groups[i] + "\n";
    hdf5_module().write_arrays(h5_, arrays, names);
    write_xml(is_second, n, m, corners, corners_2, names);
  }

 private:
  const fs::path& path_;
  fs::path h5_;
  const SolverMesh& mesh_;
  std::vector<double> points_;
  std::vector<std::int64_t> cells_, facets_, cell_tags_, facet_tags_;

  [[nodiscard]] std::string item(const char* name, const char* type, std::size_t rows,
                                 std::size_t columns) const {
    return "<DataItem Dimensions=\"" + std::to_string(rows) +
           (columns > 1 ? " " + std::to_string(columns) : "") + "\" NumberType=\"" + type +
           "\" Precision=\"8\" Format=\"HDF\">" + h5_.filename().string() + ":/" + name + "</DataItem>";
  }

  void write_xml(bool is_second, std::size_t n, std::size_t m, std::size_t corners, std::size_t corners_2,
                 const std::string& names) const {
    const auto topology = [&](const char* type, const char* name, std::size_t count, std::size_t nodes) {
      return "<Topology TopologyType=\"" + std::string(type) + "\" NumberOfElements=\"" +
             std::to_string(count) + "\" NodesPerElement=\"" + std::to_string(nodes) + "\">" +
             item(name, "Int", count, nodes) + "</Topology>\n";
    };
    const char* tets = is_second ? "Tetrahedron_10" : "Tetrahedron";
    const char* triangles = is_second ? "Triangle_6" : "Triangle";
    const std::string geometry = "<Geometry GeometryType=\"XYZ\">" +
                                 item("points", "Float", mesh_.points().size(), 3) + "</Geometry>\n";
    const auto tags = [&](const char* name, const std::string& cells, std::size_t count) {
      return "<Grid Name=\"" + std::string(name) + "\" GridType=\"Uniform\">\n" + cells + geometry +
             "<Attribute Name=\"" + name + "\" AttributeType=\"Scalar\" Center=\"Cell\">" +
             item(name, "Int", count, 1) + "</Attribute>\n</Grid>\n";
    };
    std::string text =
        "<?xml version=\"1.0\"?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n<Xdmf Version=\"3.0\">\n<Domain>\n";
    std::string comment = names;  // names in a comment must not end it
    for (std::size_t at = 0; (at = comment.find("--", at)) != std::string::npos;) comment[at] = '_';
    text += "<!--\n" + comment + "-->\n";
    text += "<Grid Name=\"mesh\" GridType=\"Uniform\">\n" + topology(tets, "cells", n, corners) + geometry +
            "</Grid>\n";
    text += tags("cell_tags", topology(tets, "cells", n, corners), n);
    text += tags("facet_tags", topology(triangles, "facets", m, corners_2), m);
    text += "</Domain>\n</Xdmf>\n";
    write_file(path_, text);
  }
};

}  // namespace

void write_xdmf(const fs::path& path, const SolverMesh& mesh) { XdmfWriter(path, mesh).run(); }

}  // namespace bsp2::io
