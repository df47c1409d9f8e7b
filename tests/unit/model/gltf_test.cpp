// glTF as other programs write it: matrices, gaps in buffers, sparse accessors, strips, small numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "builder/polyhedron.hpp"
#include "import/imports.hpp"

namespace bsp2::model {
namespace {

template <typename T>
void append_number(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string letters_of(const std::string& bytes) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? letters[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A tetrahedron of 1 x 1 x 1 metres; its points are apart, with a gap before and after each.
struct Sample {
  std::string buffer = "a gap...";  // 8 bytes
  std::string nodes = R"([{"name": "corner", "mesh": 0}])";
  std::string material =
      R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0.2158605, 0.5]}, "alphaMode": "BLEND"})";
  std::string positions =
      R"({"bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 4, "type": "VEC3"})";
  std::string primitive = R"({"attributes": {"POSITION": 0}, "indices": 1, "material": 0})";
  std::string more;

  Sample() {
    for (const auto& [x, y, z] : {Point3{0, 0, 0}, Point3{1, 0, 0}, Point3{0, 1, 0}, Point3{0, 0, 1}}) {
      append_number(buffer, 1e30F);
      for (const double c : {x, y, z}) append_number(buffer, static_cast<float>(c));
    }
    for (const int i : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3})
      append_number(buffer, static_cast<std::uint8_t>(i));
  }
  [[nodiscard]] std::string text() const {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": )" + nodes +
           R"(, "meshes": [{"name": "m", "primitives": [)" + primitive + R"(]}], "materials": [)" + material +
           R"(], "accessors": [)" + positions +
           R"(, {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"}],
           "bufferViews": [{"buffer": 0, "byteOffset": 8, "byteLength": 64, "byteStride": 16},
                           {"buffer": 0, "byteOffset": 72, "byteLength": 12}],
           "buffers": [{"byteLength": )" +
           std::to_string(buffer.size()) + R"(, "uri": "data:application/octet-stream;base64,)" +
           letters_of(buffer) + "\"}]" + more + "}";
  }
};

ImportedParts read(const Sample& sample) { return import_gltf(sample.text(), "x.gltf"); }

double volume_of(const ImportedPart& part) {
  const auto mesh = closed_mesh(part.mesh.points, part.mesh.faces);
  return mesh ? signed_volume(mesh->points, mesh->triangles) : 0;
}

std::string message_of(const std::function<void()>& read_it) {
  try {
    read_it();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Gltf, IsInMillimetresWithZUp) {
  const ImportedParts parts = read({});
  ASSERT_EQ(parts.parts.size(), 1U);
  EXPECT_EQ(parts.parts[0].name, "corner");
  EXPECT_EQ(parts.parts[0].colour, (Colour{1, 0, 128 / 255.0, 0.5}));
  EXPECT_NEAR(volume_of(parts.parts[0]), 1e9 / 6, 1e-3);
  EXPECT_EQ(parts.parts[0].mesh.points,
            (std::vector<Point3>{{0, 0, 0}, {1000, 0, 0}, {0, 0, 1000}, {0, -1000, 0}}));
}

TEST(Gltf, AlphaCountsWhereItIsBlended) {
  for (const char* mode :
       {"", R"(, "alphaMode": "OPAQUE")", R"(, "alphaMode": "MASK")", R"(, "alphaMode": 7)"}) {
    Sample sample;
    sample.material =
        R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.5]})" + std::string(mode) + "}";
    EXPECT_EQ(read(sample).parts.at(0).colour, (Colour{1, 0, 0, 1})) << mode;
  }
}

/// Nodes in each other, by matrix and by rotation, scale and translation, one of them a mirror.
TEST(Gltf, NodesPlaceMeshes) {
  Sample sample;
  sample.nodes =
      R"([{"name": "all", "children": [1, 2], "scale": [0.001, 0.001, 0.001]},
          {"matrix": [2,0,0,0, 0,3,0,0, 0,0,4,0, 10,0,0,1], "mesh": 0},
          {"name": "mirror", "scale": [-1, 1, 1], "translation": [0, 5, 0],
           "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "mesh": 0}])";
  const ImportedParts parts = read(sample);
  ASSERT_EQ(parts.parts.size(), 2U);
  EXPECT_EQ(parts.parts[0].name, "m") << "a node without a name is called as its mesh";
  EXPECT_NEAR(volume_of(parts.parts[0]), 24 / 6.0, 1e-9);
  EXPECT_NEAR(volume_of(parts.parts[1]), 1 / 6.0, 1e-9) << "not inside out";
  EXPECT_NEAR(parts.parts[0].mesh.points[1][0], 12, 1e-12);
  EXPECT_NEAR(parts.parts[1].mesh.points[0][2], 5, 1e-12);
}

TEST(Gltf, SparseAccessorsReplaceSome) {
  Sample sample;
  // The second point becomes (2, 0, 0): its index and its numbers follow the others in the buffer.
  append_number(sample.buffer, std::uint8_t{1});
  sample.buffer.append(3, '\0');
  for (const float x : {2.0F, 0.0F, 0.0F}) append_number(sample.buffer, x);
  const std::string views = R"("bufferViews": [)";
  sample.positions =
      R"({"bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 4, "type": "VEC3",
          "sparse": {"count": 1, "indices": {"bufferView": 2, "componentType": 5121},
                     "values": {"bufferView": 2, "byteOffset": 4}}})";
  std::string text = sample.text();
  text.insert(text.find(views) + views.size() + text.substr(text.find(views) + views.size()).find("}]") + 1,
              R"(, {"buffer": 0, "byteOffset": 84, "byteLength": 16})");
  const ImportedParts parts = import_gltf(text, "x.gltf");
  EXPECT_NEAR(volume_of(parts.parts[0]), 2e9 / 6, 1e-3);
}

TEST(Gltf, RefusesWhatIsNotRead) {
  const auto refused = [](const std::function<void(Sample&)>& change, const std::string& part) {
    Sample sample;
    change(sample);
    const std::string message = message_of([&] { read(sample); });
    EXPECT_EQ(message.find("x.gltf: "), 0U) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  refused([](Sample& s) { s.more = R"(, "extensionsRequired": ["KHR_draco_mesh_compression"])"; },
          "compressed");
  refused([](Sample& s) { s.more = R"(, "extensionsRequired": ["EXT_meshopt_compression"])"; }, "compressed");
  refused([](Sample& s) { s.more = R"(, "extensionsRequired": ["X_new"])"; }, "X_new");
  refused([](Sample& s) { s.buffer.resize(80); }, "bufferViews[1]: it goes beyond its buffer");
  refused([](Sample& s) { s.buffer.back() = 9; }, "a triangle names point 9, but there are 4");
  refused([](Sample& s) { s.nodes = R"([{"children": [0]}])"; }, "nodes[0]: nodes are in each other");
  refused([](Sample& s) { s.nodes = R"([{"mesh": 7}])"; }, "there are no meshes[7]");
  refused([](Sample& s) { s.nodes = R"([{"mesh": -1}])"; }, "nodes[0].mesh: expected a whole number");
  refused([](Sample& s) { s.nodes = R"([{"mesh": 0, "matrix": [1]}])"; },
          "nodes[0].matrix: expected 16 numbers");
  refused(
      [](Sample& s) {
        s.positions = R"({"bufferView": 0, "componentType": 5126, "count": 99999999999, "type": "VEC3"})";
      },
      "accessors[0]: 99,999,999,999 elements are not in its bufferView");
  refused([](Sample& s) { s.primitive = R"({"attributes": {"POSITION": 0}, "mode": 1})"; }, "no triangles");
  EXPECT_NE(message_of([] { import_gltf("{\"asset\": ", "x.gltf"); }).find("JSON is damaged"),
            std::string::npos);
  EXPECT_NE(message_of([] { import_gltf("{}", "x.gltf"); }).find("no asset.version"), std::string::npos);
}

/// No system has names that long: a `data:` that is damaged in its first letters is such a one.
TEST(Gltf, NamesOfFilesMayBeTooLong) {
  std::string text = Sample().text();
  text.replace(text.find("data:"), 5, std::string(5000, 'd'));
  const std::string message = message_of([&] { import_gltf(text, "x.gltf"); });
  EXPECT_EQ(message.find("x.gltf: buffers[0].uri: there is no file 'ddd"), 0U) << message;
  EXPECT_LT(message.size(), 300U);
  EXPECT_NE(message_of([] { import_mesh(std::string(5000, 'd') + ".stl"); }).find("there is no file"),
            std::string::npos);
}

TEST(Gltf, BinaryFilesHaveTheirBuffer) {
  Sample sample;
  std::string json = sample.text();
  const std::size_t uri = json.find(", \"uri\"");
  json.erase(uri, json.find("\"}]", uri) + 1 - uri);
  while (json.size() % 4 != 0) json += ' ';
  std::string bytes = "glTF";
  for (const std::size_t word : {std::size_t{2}, 28 + json.size() + sample.buffer.size(), json.size()})
    append_number(bytes, static_cast<std::uint32_t>(word));
  bytes += "JSON" + json;
  append_number(bytes, static_cast<std::uint32_t>(sample.buffer.size()));
  bytes += std::string("BIN\0", 4) + sample.buffer;
  EXPECT_NEAR(volume_of(import_gltf(bytes, "x.glb").parts.at(0)), 1e9 / 6, 1e-3);
  for (std::size_t length = 0; length < bytes.size(); length += 7)
    ASSERT_NE(message_of([&] { import_gltf(std::string_view(bytes).substr(0, length), "x.glb"); }),
              "no error")
        << length;
}

}  // namespace
}  // namespace bsp2::model
