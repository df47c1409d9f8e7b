// Files of meshes: what is written is read back, and what is damaged is an error that says where.

#include <gtest/gtest.h>
#include <zip.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "import/zip_file.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::model {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// A tetrahedron with three faces replaced by tents again and again: closed, counter-clockwise from outside,
/// coordinates that floats hold.
TriangleMesh random_mesh(std::mt19937& random, int tents) {
  TriangleMesh mesh{{{0, 0, 0}, {64, 0, 0}, {0, 64, 0}, {0, 0, 64}},
                    {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  for (int i = 0; i < tents; ++i) {
    const std::size_t which = random() % mesh.triangles.size();
    const auto [a, b, c] = mesh.triangles[which];
    Point3 apex;
    for (std::size_t k = 0; k < 3; ++k)
      apex[k] = std::round(1024 * ((mesh.points[a][k] + mesh.points[b][k] + mesh.points[c][k]) / 3 +
                                   static_cast<double>(random() % 2048) / 1024 - 1)) /
                1024;
    const auto d = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back(apex);
    mesh.triangles[which] = {a, b, d};
    mesh.triangles.insert(mesh.triangles.end(), {{b, c, d}, {c, a, d}});
  }
  return mesh;
}

template <typename T>
void put(std::string& bytes, T value, bool is_big = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (is_big != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string stl_text(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(17);
  out << "solid a name\n";
  for (const auto& triangle : mesh.triangles) {
    out << " facet normal nan -nan(ind) 0\n  OUTER loop\n";
    for (const std::uint32_t i : triangle)
      out << "   vertex " << mesh.points[i][0] << '\t' << mesh.points[i][1] << " +" << mesh.points[i][2] + 100
          << "e0\r\n";
    out << "  endloop\n endfacet\n";
  }
  out << "endsolid a name\n";
  return out.str();
}

std::string stl_binary(const TriangleMesh& mesh) {
  std::string bytes = "solid, as headers of binary files may begin";
  bytes.resize(80);
  put(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    bytes.append(12, '\x7F');
    for (const std::uint32_t i : triangle)
      for (const double x : mesh.points[i]) put(bytes, static_cast<float>(x));
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string off(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(17);
  out << "COFF # with colours\n\n" << mesh.points.size() << " " << mesh.triangles.size() << " 0\n";
  for (const auto& p : mesh.points)
    out << p[0] << ' ' << p[1] << ' ' << p[2] << " 0.1 0.2 0.3 1\n# between\n";
  for (const auto& t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << " 255 0 0\n";
  return out.str();
}

std::string obj(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(17);
  out << "# a comment\nmtllib none.mtl\no thing\n";
  for (const auto& p : mesh.points) out << "v " << p[0] << ' ' << p[1] << " \\\n " << p[2] << "\nvn 0 0 1\n";
  const std::size_t n = mesh.points.size();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    if (i % 3 == 0)
      out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    else if (i % 3 == 1)
      out << "f -" << n - t[0] << "//1 -" << n - t[1] << "//1 -" << n - t[2] << "//1\n";
    else
      out << "f " << t[0] + 1 << "/1/1 " << t[1] + 1 << "/1/1 " << t[2] + 1 << "/1/1 # here too\n";
  }
  return out.str();
}

std::string ply_header(const TriangleMesh& mesh, const char* format) {
  return std::string("ply\nformat ") + format +
         " 1.0\ncomment no comment\nelement thing 2\nproperty list uchar short numbers\nproperty double "
         "more\nelement vertex " +
         std::to_string(mesh.points.size()) +
         "\nproperty uchar red\nproperty double x\nproperty float y\nproperty double z\nelement face " +
         std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nproperty uint flags\nend_header\n";
}

std::string ply_text(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(17);
  out << ply_header(mesh, "ascii") << "2 -5 6 0.5\n0 1e-3\n";
  for (const auto& p : mesh.points) out << "255 " << p[0] << ' ' << p[1] << ' ' << p[2] << "\n";
  for (const auto& t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << " 7\n";
  return out.str();
}

std::string ply_binary(const TriangleMesh& mesh, bool is_big) {
  std::string bytes = ply_header(mesh, is_big ? "binary_big_endian" : "binary_little_endian");
  for (const int count : {2, 0}) {
    put(bytes, static_cast<std::uint8_t>(count));
    for (int i = 0; i < count; ++i) put(bytes, static_cast<std::int16_t>(-5), is_big);
    put(bytes, 0.5, is_big);
  }
  for (const auto& p : mesh.points) {
    put(bytes, std::uint8_t{255});
    put(bytes, p[0], is_big), put(bytes, static_cast<float>(p[1]), is_big), put(bytes, p[2], is_big);
  }
  for (const auto& t : mesh.triangles) {
    put(bytes, std::uint8_t{3});
    for (const std::uint32_t i : t) put(bytes, static_cast<std::int32_t>(i), is_big);
    put(bytes, std::uint32_t{7}, is_big);
  }
  return bytes;
}

std::string amf(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(17);
  out << "<?xml version=\"1.0\"?>\n<amf unit=\"inch\"><metadata type=\"x\">y</metadata><object "
         "id=\"0\"><mesh><vertices>\n";
  for (const auto& p : mesh.points)
    out << "<vertex><coordinates><x>" << p[0] << "</x><y> " << p[1] << "</y><z>" << p[2]
        << "</z></coordinates></vertex>\n";
  out << "<edge><v1>999</v1><dx1>1</dx1><v2>99</v2></edge></vertices><volume>";
  for (const auto& t : mesh.triangles)
    out << "<triangle><v1>" << t[0] << "</v1><v2>" << t[1] << "</v2><v3>" << t[2] << "</v3></triangle>\n";
  out << "</volume></mesh></object></amf>\n";
  return out.str();
}

/// A zip file of these entries.
std::string zipped(const std::filesystem::path& folder,
                   const std::vector<std::pair<std::string, std::string>>& entries) {
  const std::string path = folder / "made.zip";
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  for (const auto& [name, text] : entries)
    zip_file_add(archive, name.c_str(), zip_source_buffer(archive, text.data(), text.size(), 0), 0);
  zip_close(archive);
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string object_3mf(const TriangleMesh& mesh, int id) {
  std::ostringstream out;
  out.precision(17);
  out << "<object id=\"" << id << "\" type=\"model\"><mesh><vertices>\n";
  for (const auto& p : mesh.points)
    out << "<vertex x=\"" << p[0] << "\" y=\"" << p[1] << "\" z=\"" << p[2] << "\"/>\n";
  out << "</vertices><triangles>";
  for (const auto& t : mesh.triangles)
    out << "<triangle v1=\"" << t[0] << "\" v2=\"" << t[1] << "\" v3=\"" << t[2] << "\" pid=\"1\"/>\n";
  out << "</triangles></mesh></object>";
  return out.str();
}

std::string model_3mf(const std::string& resources, const std::string& build) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" "
         "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
         "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\n<resources>" +
         resources + "</resources><build>" + build + "</build></model>\n";
}

const std::string relations =
    "<?xml version=\"1.0\"?><Relationships "
    "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
    "Target=\"/3D/other.model\" Id=\"r\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";

class MeshFile : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder_;

  double volume_of(const ImportedMesh& mesh) const { return volume(*closed_mesh(mesh.points, mesh.faces)); }
  std::string message(const std::string& name, const std::string& bytes) const {
    const auto path = folder_.path() / name;
    std::ofstream(path, std::ios::binary) << bytes;
    try {
      import_mesh(path);
    } catch (const Error& error) {
      const std::string text = error.what(), where = path.string();
      return text.starts_with(where) ? text.substr(where.size()) : text;
    }
    return "no error";
  }
  std::string package(const std::string& resources, const std::string& build) const {
    return zipped(folder_.path(), {{"3D/3dmodel.model", model_3mf(resources, build)}});
  }
  /// A mesh in every format that one object goes into, with the name that its format has.
  std::vector<std::pair<std::string, std::string>> all_formats(const TriangleMesh& mesh) const {
    return {{"a.stl", stl_text(mesh)},
            {"B.STL", stl_binary(mesh)},
            {"a.off", off(mesh)},
            {"a.obj", obj(mesh)},
            {"a.ply", ply_text(mesh)},
            {"b.ply", ply_binary(mesh, false)},
            {"c.ply", ply_binary(mesh, true)},
            {"a.amf", amf(mesh)},
            {"b.amf", zipped(folder_.path(), {{"readme", "x"}, {"x.amf", amf(mesh)}})},
            {"a.3mf", package(object_3mf(mesh, 7), "<item objectid=\"7\"/>")}};
  }
};

TEST_F(MeshFile, EveryFormatIsReadBack) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(5); ++round) {
    const TriangleMesh mesh = random_mesh(random, round * 20);
    const double expected = volume(mesh);
    for (const auto& [name, bytes] : all_formats(mesh)) {
      EXPECT_EQ(message(name, bytes), "no error") << name;
      const ImportedMesh read = import_mesh(folder_.path() / name);
      EXPECT_EQ(read.faces.size(), mesh.triangles.size()) << name;
      EXPECT_NEAR(volume_of(read), expected, 1e-9 * expected) << name;
    }
  }
}

TEST_F(MeshFile, CoordinatesAreDoublesWhereTheFormatHasThem) {
  const TriangleMesh mesh{{{0, 0, 0}, {0.1, 0, 0}, {0, 1e-200, 0}, {0, 0, 1.0 / 3}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  for (const auto& [name, bytes] : all_formats(mesh)) {
    if (name == "B.STL") continue;
    ASSERT_EQ(message(name, bytes), "no error") << name;
    const ImportedMesh read = import_mesh(folder_.path() / name);
    EXPECT_NE(
        std::find_if(read.points.begin(), read.points.end(), [](const Point3& p) { return p[0] == 0.1; }),
        read.points.end())
        << name;
  }
}

/// Any damage is an error with its line or byte, or another mesh; never anything else.
TEST_F(MeshFile, DamagedFilesAreErrors) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const TriangleMesh mesh = random_mesh(random, 3);
  for (const auto& [name, bytes] : all_formats(mesh)) {
    for (int round = 0; round < samples::rounds(100); ++round) {
      std::string damaged = bytes;
      for (int i = static_cast<int>(random() % 4); i >= 0; --i)
        damaged[random() % damaged.size()] = static_cast<char>(random());
      if (round % 3 == 0) damaged.resize(random() % damaged.size());
      const std::string text = message(name, damaged);
      if (text == "no error" || damaged.empty()) continue;
      const bool has_place = text.size() > 1 && text[0] == ':' &&
                             (std::isdigit(static_cast<unsigned char>(text[1])) || text.starts_with(": "));
      EXPECT_TRUE(has_place) << name << ": " << text;
    }
  }
}

/// However much of the end is missing. A text may lack the end of its last line, an OBJ file has no end.
TEST_F(MeshFile, WhatIsCutOffIsNeverHalfAMesh) {
  std::mt19937 random(1);
  const TriangleMesh mesh = random_mesh(random, 1);
  for (const auto& [name, bytes] : all_formats(mesh)) {
    if (name == "a.obj") continue;
    const std::size_t step = 1 + bytes.size() / 50;
    for (std::size_t size = 1; size < bytes.size(); size += step) {
      const std::string text = message(name, bytes.substr(0, size));
      const bool has_whole_facets = name == "B.STL" && size > 84 &&
                                    (size - 84) % 50 == 0;  // its header may be wrong: read, with a warning
      if (text == "no error" && !(has_whole_facets && !import_mesh(folder_.path() / name).warnings.empty())) {
        EXPECT_GT(size + 20, bytes.size()) << name << " cut at " << size << " of " << bytes.size();
      }
    }
  }
}

TEST_F(MeshFile, ErrorsSayWhere) {
  EXPECT_EQ(message("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2 three\n"),
            ":4: expected a coordinate, found 'three'");
  EXPECT_EQ(message("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n"),
            ":4: expected a coordinate, found the end of the line");
  EXPECT_EQ(message("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2 inf\n"),
            ":4: the coordinate inf is not finite or too large");
  EXPECT_EQ(message("m.stl", "solid x\nfacet\nouter loop\nvertex 1 2 3\nvertex 1 2 4\nendloop\n"),
            ":6: a facet of fewer than three corners");
  EXPECT_EQ(message("m.stl", "solid x\n"),
            ":2: expected 'facet' or 'endsolid', found the end of the file; it is cut off");
  std::string binary = stl_binary({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  EXPECT_EQ(message("m.stl", binary.substr(0, 130)),
            ": byte 80: the number of facets is 1, which takes 134 bytes in all, but the file has 130; it is "
            "cut off, or no STL file");
  binary[84 + 12 + 4 + 2] = '\x80', binary[84 + 12 + 4 + 3] = '\x7F';
  EXPECT_EQ(message("m.stl", binary), ": byte 100: a coordinate of facet 0 is not finite");
  EXPECT_EQ(message("m.stl", "PK"),
            ": neither an STL text, which begins with 'solid', nor long enough for a binary STL file, which "
            "has a header of 84 bytes");
  EXPECT_EQ(message("m.off", "OFF\n1 1 0\n0 0 0\n3 0 1 2\n"),
            ":4: face 0 names point 1, but there are 1, the first being 0");
  EXPECT_EQ(
      message("m.off", "OFF\n1000000000 1 0\n0 0 0\n"),
      ":3: the numbers of points and faces are 1000000000 and 1, more than the file holds; it is cut off");
  EXPECT_EQ(message("m.off", "4OFF\n1 1 0\n"), ":1: '4OFF' is not a mesh in three dimensions");
  EXPECT_EQ(message("m.obj", "v 0 0 0\nf 1 2 3\n"),
            ":2: a face names point 2, but there are 1 so far, the first being 1");
  EXPECT_EQ(message("m.obj", "v 0 0 0\nf 1 -2 3\n"),
            ":2: a face names point -2, but there are 1 so far, the first being 1");
  EXPECT_EQ(message("m.obj", "v 0 0\n"), ":1: expected a coordinate, found the end of the line");
  EXPECT_EQ(message("m.obj", "# x\nmtllib a.mtl\n\n\x01 noise\nmore\n"),
            ":4: expected 'v', 'f' or another keyword of OBJ files, found '?'");
  EXPECT_EQ(message("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nof_its_own 7\nf 1 2 3\n"), "no error");
  EXPECT_EQ(message("m.ply", "ply\nformat binary 1.0\n"),
            ":2: expected 'ascii', 'binary_little_endian' or 'binary_big_endian', found 'binary'");
  EXPECT_EQ(
      message("m.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n"),
      ":6: 4,000,000,000 elements 'vertex' are more than the file holds; it is cut off");
  EXPECT_EQ(
      message(
          "m.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n"),
      ":7: a coordinate of point 0 is missing, not finite or too large");
  EXPECT_EQ(message("m.amf", "<amf>\n<object><mesh><vertices><vertex><coordinates><x>1</x>\n</coordinates>"),
            ":3: a vertex without all of its coordinates");
  EXPECT_EQ(message("m.amf", "<svg/>"), ":1: expected the element 'amf'");
  EXPECT_EQ(message("m.3mf", "no zip"), ": is no zip file, or a damaged one: Not a zip archive");
  EXPECT_EQ(message("m.3mf", package("<object id=\"1\"/>", "<item objectid=\"2\"/>")),
            ": there is no object 2 in 3D/3dmodel.model");
  EXPECT_EQ(message("m.3mf", zipped(folder_.path(), {{"a", "b"}})),
            ": there is no 3D/3dmodel.model in this 3MF file");
  EXPECT_NE(message("nothing.xyz", "x").find("*.xyz"), std::string::npos);
  EXPECT_THROW(import_mesh(folder_.path()), Error);
  EXPECT_THROW(import_mesh(folder_.path() / "missing.stl"), Error);
}

/// What is given as a model, and is something else.
TEST_F(MeshFile, OtherKindsAreCalledByTheirNames) {
  const auto refusal = [&](const std::string& name, const std::string& bytes) -> std::string {
    const auto path = folder_.path() / name;
    std::ofstream(path, std::ios::binary) << bytes;
    try {
      read_model_text(path);
    } catch (const Error& error) {
      return std::string(error.what()).substr(path.string().size());
    }
    return "no error";
  };
  EXPECT_EQ(refusal("p.png", "\x89PNG\r\n\x1a\n and more"),
            ": is a picture (PNG), not a model; 'surface(file = ...)' in a model takes one as heights");
  EXPECT_EQ(refusal("p.jpg", "\xFF\xD8\xFF\xE0"), ": is a picture (JPEG), not a model");
  EXPECT_EQ(refusal("m.zip", "PK\x03\x04 and more"), ": is a ZIP archive, not a model; unpack it");
  EXPECT_EQ(refusal("m.csg.gz", "\x1F\x8B\x08"), ": is compressed by gzip; unpack it");
  EXPECT_TRUE(refusal("m.dae", "\xEF\xBB\xBF <?xml version='1.0'?>")
                  .starts_with(": is XML or HTML, not a model as text: files named *.dae are not read; "));
  EXPECT_EQ(refusal("m", "<COLLADA>"), ": is XML or HTML, not a model as text");
  EXPECT_EQ(refusal("m.csg", "<html>"), ": is XML or HTML, not a model as text");
  EXPECT_EQ(refusal("m.csg", "cube(1);"), "no error");
  EXPECT_EQ(refusal("m.scad", "\xEF\xBB\xBFuse <other.scad>\ncube(1);"), "no error");
  EXPECT_EQ(refusal("m.h5", "\x89HDX\r\n\x1a\n"),
            ": is no model; it looks like a snapshot whose first bytes are damaged");
}

TEST_F(MeshFile, PackagesPutObjectsTogether) {
  const TriangleMesh unit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const std::string pair =
      "<object id=\"2\"><components><component objectid=\"1\"/><component objectid=\"1\" transform=\"2 0 0 0 "
      "1 0 0 0 1 10 0 0\"/></components></object>";
  const std::string root = model_3mf(object_3mf(unit, 1) + pair,
                                     "<item objectid=\"2\" transform=\"0 1 0 -1 0 0 0 0 3 0 0 5\"/><item "
                                     "objectid=\"4\" p:path=\"/3D/more.model\"/>");
  const std::string more = model_3mf(object_3mf(unit, 4), "");
  const std::string bytes =
      zipped(folder_.path(), {{"_rels/.rels", relations}, {"3D/other.model", root}, {"3D/more.model", more}});
  ASSERT_EQ(message("a.3mf", bytes), "no error");
  const ImportedMesh mesh = import_mesh(folder_.path() / "a.3mf");
  EXPECT_EQ(mesh.faces.size(), 12U);
  EXPECT_NEAR(volume_of(mesh), (3 + 6 + 1) / 6.0, 1e-12);
  double high = 0;
  for (const Point3& p : mesh.points) high = std::max(high, p[1]);
  EXPECT_EQ(high, 12) << "x, doubled and moved, is y in the end";
}

/// The name is that of the innermost object that has one, and is there once; colours are of objects, or of
/// all triangles alike.
TEST_F(MeshFile, PackagesHaveNamesAndColours) {
  const TriangleMesh unit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const auto object = [&](unsigned id, const std::string& attributes) {
    std::string text = object_3mf(unit, static_cast<int>(id));
    const std::string of_triangles = " pid=\"1\"";
    for (std::size_t at; (at = text.find(of_triangles)) != std::string::npos;)
      text.erase(at, of_triangles.size());
    return text.insert(text.find("<object") + 7, " " + attributes);
  };
  const std::string colours =
      "<basematerials id=\"7\"><base name=\"x\" displaycolor=\"#00FF00\"/><base name=\"y\" "
      "displaycolor=\"#FF000033\"/></basematerials>";
  const std::string objects =
      colours + object(1, "name=\"gear\" pid=\"7\" pindex=\"1\"") + object(2, "") +
      "<object id=\"3\" name=\"all\"><components><component objectid=\"1\"/><component "
      "objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/></components></object>";
  ASSERT_EQ(message("a.3mf", package(objects,
                                     "<item objectid=\"3\"/><item objectid=\"1\" transform=\"1 0 0 0 1 "
                                     "0 0 0 1 9 0 0\"/>")),
            "no error");
  const ImportedParts read = import_parts(folder_.path() / "a.3mf");
  ASSERT_EQ(read.parts.size(), 3U);
  EXPECT_EQ(read.parts[0].name, "gear");
  EXPECT_EQ(read.parts[0].colour, (Colour{1, 0, 0, 0.2}));
  EXPECT_EQ(read.parts[1].name, "all");
  EXPECT_EQ(read.parts[1].colour, std::nullopt);
  EXPECT_EQ(read.parts[2].name, "gear (2)");
}

/// Nothing is scaled, which whoever has another unit is told.
TEST_F(MeshFile, UnitsAreToldOf) {
  EXPECT_TRUE(notes_of_unit("millimeter").empty());
  EXPECT_EQ(
      notes_of_unit("inch"),
      std::vector<std::string>{"it is in inches; nothing is scaled, one of them is one unit of the model, "
                               "and scale(25.4) makes millimetres of them"});
  EXPECT_EQ(notes_of_unit("parsec").size(), 1U);
  const std::string amf =
      "<amf unit=\"inch\"><object id=\"1\"><mesh><vertices/></mesh></object><constellation id=\"2\"/></amf>";
  const std::vector<std::string> notes = import_amf(amf, "m.amf").notes;
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_TRUE(notes[0].starts_with("it is in inches")) << notes[0];
  EXPECT_TRUE(notes[1].starts_with("1 constellation is not read")) << notes[1];
}

TEST_F(MeshFile, MirrorImagesInPackagesAreNotInsideOut) {
  const TriangleMesh unit{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const std::string items =
      "<item objectid=\"1\" transform=\"-2 0 0 0 1 0 0 0 1 10 0 0\"/><item objectid=\"1\" transform=\"0 1 0 "
      "1 0 0 0 0 1 20 0 0\"/><item objectid=\"1\"/>";
  ASSERT_EQ(message("a.3mf", package(object_3mf(unit, 1), items)), "no error");
  const ImportedMesh mesh = import_mesh(folder_.path() / "a.3mf");
  std::vector<std::string> warnings;
  const auto repaired = repaired_mesh(mesh.points, mesh.faces, Holes::cap,
                                      [&](const std::string& text) { warnings.push_back(text); });
  ASSERT_TRUE(repaired.has_value());
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  EXPECT_NEAR(volume(*repaired), 4 / 6.0, 1e-12);
}

/// Objects of two objects each, 40 times over: 2^40 of them.
TEST_F(MeshFile, PackagesCannotFillTheMemory) {
  std::string resources = object_3mf(
      {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}}, 1);
  for (int id = 2; id < 42; ++id) {
    const std::string component = "<component objectid=\"" + std::to_string(id - 1) + "\"/>";
    resources += "<object id=\"" + std::to_string(id) + "\"><components>" + component + component +
                 "</components></object>";
  }
  EXPECT_NE(
      message("a.3mf", package(resources, "<item objectid=\"41\"/>")).find("more than 1000000 components"),
      std::string::npos);
  const std::string itself = "<object id=\"1\"><components><component objectid=\"1\"/></components></object>";
  EXPECT_NE(message("a.3mf", package(itself, "<item objectid=\"1\"/>"))
                .find("names object 1, which has not been told of"),
            std::string::npos);
}

/// Entities in entities, ten each, files that are elsewhere, and what names itself: none of it is unfolded or
/// read.
TEST_F(MeshFile, XmlCannotFillTheMemory) {
  std::string entities = "<!ENTITY e0 \"0000000000\">";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "&e" + std::to_string(i - 1) + ";";
    entities += "<!ENTITY e" + std::to_string(i) + " \"";
    for (int k = 0; k < 10; ++k) entities += before;
    entities += "\">";
  }
  const auto with = [](const std::string& declarations, const std::string& word) {
    return "<!DOCTYPE amf [" + declarations + "]><amf><object><mesh><vertices><vertex><coordinates><x>" +
           word + "</x></coordinates></vertex></vertices></mesh></object></amf>";
  };
  const std::string number = ":1: expected a number, found ''";
  const std::vector<std::pair<std::string, std::string>> texts{
      {with(entities, "&e11;"), ":1: this is no XML: "},
      {with("<!ENTITY a \"&b;\"><!ENTITY b \"&a;\">", "&a;"), ":1: this is no XML: "},
      {with("<!ENTITY a SYSTEM \"file:///dev/zero\">", "&a;"), number},
      {with("<!ENTITY a \"1\">", "&b;"), ":1: this is no XML: Entity 'b' not defined"}};
  for (const auto& [text, expected] : texts) {
    EXPECT_EQ(message("m.amf", text).substr(0, expected.size()), expected) << text.substr(0, 200);
    EXPECT_EQ(message("m.amf", zipped(folder_.path(), {{"m.amf", text}})).substr(0, expected.size()),
              expected);
  }
}

/// A thousand times as long as the file: elements that take memory, and others.
TEST_F(MeshFile, ZipFilesCannotFillTheMemory) {
  const auto many = [](std::string_view piece) {
    std::string text;
    while (text.size() <= Unpacking::always) text += piece;
    return text;
  };
  const std::string expected = ": is more than 100 times as long once it is unpacked";
  const std::string bytes =
      package("<object id=\"1\"><mesh><vertices>" + many("<vertex x=\"0\" y=\"0\" z=\"0\"/>"), "");
  ASSERT_LT(bytes.size(), Unpacking::always / Unpacking::most_times);
  EXPECT_EQ(message("m.3mf", bytes).substr(0, expected.size()), expected);
  const std::string amf = zipped(folder_.path(), {{"m.amf", "<amf><object>" + many("<x>1 </x>")}});
  EXPECT_EQ(message("m.amf", amf).substr(0, expected.size()), expected);
}

/// Not as if it were missing.
TEST_F(MeshFile, EncryptedEntriesAreToldAsSuch) {
  const std::string path = folder_.path() / "made.zip";
  for (const std::string name : {"3D/3dmodel.model", "_rels/.rels"})
    for (const zip_uint16_t method : {ZIP_EM_TRAD_PKWARE, ZIP_EM_AES_256}) {
      zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
      const auto number =
          zip_file_add(archive, name.c_str(), zip_source_buffer(archive, "<model/>", 8, 0), 0);
      if (zip_file_set_encryption(archive, static_cast<zip_uint64_t>(number), method, "secret") != 0) {
        zip_discard(archive);  // this libzip cannot
        continue;
      }
      ASSERT_EQ(zip_close(archive), 0);
      std::ifstream made(path, std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(made), {}};
      for (const char* file : {"m.3mf", "m.amf"})
        if (std::string_view(file) == "m.amf" || name.starts_with("3D")) {
          EXPECT_EQ(message(file, bytes),
                    ": '" + name + "' in it is encrypted; write the file without a password");
        }
    }
}

/// Nothing is looked for outside of the package, and what is in it is no zip file again.
TEST_F(MeshFile, NamesInPackagesStayInThem) {
  const std::string inner = package("", "");
  const std::string above =
      "<Relationships><Relationship Target=\"/../../etc/passwd\" Type=\"/3dmodel\"/></Relationships>";
  EXPECT_EQ(message("m.3mf", zipped(folder_.path(),
                                    {{"_rels/.rels", above}, {"3D/3dmodel.model", model_3mf("", "")}})),
            ": there is no ../../etc/passwd in this 3MF file");
  EXPECT_EQ(message("m.3mf", zipped(folder_.path(), {{"3D/3dmodel.model", inner}}))
                .find(": 3D/3dmodel.model:1: this is no XML"),
            0U);
  EXPECT_EQ(message("m.amf", zipped(folder_.path(), {{"m.amf", inner}})).find(":1: this is no XML"), 0U);
}

/// Wherever a package is cut off, and whatever its directory says of how much there is.
TEST_F(MeshFile, DirectoriesOfZipFilesAreNotTrusted) {
  const std::string whole = package("", "");
  for (std::size_t size = 4; size < whole.size(); ++size)
    EXPECT_EQ(message("m.3mf", whole.substr(0, size)).find(": is no zip file, or a damaged one"), 0U) << size;
  const std::size_t directory = whole.find("PK\1\2"), last = whole.find("PK\5\6");
  ASSERT_NE(last, std::string::npos);
  for (const std::size_t at :
       {last + 8, last + 10, last + 12, last + 16, directory + 20, directory + 24, directory + 42}) {
    std::string damaged = whole;
    damaged.replace(at, 2, "\xff\x7f");
    const std::string text = message("m.3mf", damaged);
    EXPECT_TRUE(text == "no error" || text.starts_with(": ")) << at << ' ' << text;
  }
}

}  // namespace
}  // namespace bsp2::model
