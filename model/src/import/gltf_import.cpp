// glTF 2.0, as text (.gltf) and as one binary file (.glb).
// Source: Khronos Group, "glTF 2.0 Specification", ISO/IEC 12113:2022.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "import/imports.hpp"
#include "import/part_names.hpp"

namespace bsp2::model {
namespace {

using Json = nlohmann::json;

/// Limits on what copies of one mesh may grow to, and on how deep nodes may lie.
constexpr std::size_t most_placed = 1'000'000, most_elements = 20'000'000, most_nesting = 1000;

/// Rows of an affine map.
using Affine = std::array<std::array<double, 4>, 3>;

/// Metres with y up become millimetres with z up.
constexpr Affine to_model{{{1000, 0, 0, 0}, {0, 0, -1000, 0}, {0, 1000, 0, 0}}};

Affine operator*(const Affine& outer, const Affine& inner) {
  Affine result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      double sum = k == 3 ? outer[i][3] : 0;
      for (std::size_t j = 0; j < 3; ++j) sum += outer[i][j] * inner[j][k];
      result[i][k] = sum;
    }
  return result;
}

bool is_mirror(const Affine& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
         0;
}

double srgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  const double y = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return std::round(y * 255) / 255;  // as other formats have it
}

/// The bytes that text in base64 stands for; nothing if it is none.
std::optional<std::string> from_base64(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+' || c == '-' ? 62
                      : c == '/' || c == '_' ? 63
                                             : -1;
    if (value < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFF);
  }
  return bytes;
}

/// The name of a file as a URI has it, with %20 and the like.
std::string decoded_uri(std::string_view uri) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      text += static_cast<char>(16 * digit(uri[i + 1]) + digit(uri[i + 2]));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

class GltfReader {
 public:
  GltfReader(std::string_view bytes, const std::filesystem::path& path) : path_(path) {
    const std::string_view text = bytes.starts_with("glTF") ? json_chunk(bytes) : bytes;
    try {
      json_ = Json::parse(text);
    } catch (const Json::exception& error) {
      fail("its JSON is damaged: " + plain(error.what()));
    }
  }

  ImportedParts read() {
    if (!json_.is_object()) fail("is no glTF: its JSON is no object");
    check_version();
    check_extensions();
    for (const std::size_t root : roots()) visit(root, to_model, "", 0);
    return finished();
  }

 private:
  /// Numbers of one kind in a buffer.
  struct View {
    std::string_view bytes;
    std::size_t stride = 0;  // 0: next to each other
  };
  struct Primitive {
    std::vector<Point3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::optional<Colour> colour;
  };
  struct Mesh {
    std::string name;
    std::vector<Primitive> primitives;
    std::size_t triangles = 0, points = 0;
  };

  const std::filesystem::path& path_;
  Json json_;
  std::string_view binary_;
  std::map<std::size_t, std::string> buffers_;
  std::map<std::size_t, Mesh> meshes_;
  ImportedParts result_;
  PartNames names_;
  std::size_t nodes_ = 0, triangles_ = 0, points_ = 0;
  std::size_t lines_ = 0, skins_ = 0, morphs_ = 0, many_coloured_ = 0;

  [[noreturn]] void fail(const std::string& text) const { throw Error(path_.string() + ": " + text); }

  /// What the JSON library says, without its own name.
  static std::string plain(std::string text) {
    if (const std::size_t end = text.find("] "); end != std::string::npos) text = text.substr(end + 2);
    return printable_name(text);
  }

  static std::uint32_t word(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
  }

  /// Of a binary file; finds the other chunk, too.
  std::string_view json_chunk(std::string_view bytes) {
    constexpr std::uint32_t json = 0x4E4F534A, binary = 0x004E4942;
    if (bytes.size() < 12) fail("is cut off: it has no whole header");
    if (const std::uint32_t version = word(bytes, 4); version != 2)
      fail("is glTF of the version " + std::to_string(version) + "; version 2 is read");
    const std::size_t length = word(bytes, 8);
    if (length > bytes.size())
      fail("is cut off: " + counted(bytes.size(), "# byte[s] of ") + std::to_string(length) + " are there");
    std::string_view text;
    for (std::size_t at = 12; at + 8 <= length;) {
      const std::size_t size = word(bytes, at);
      const std::uint32_t kind = word(bytes, at + 4);
      if (size > length - at - 8)
        fail("byte " + std::to_string(at) +
             ": a chunk is longer than the file: " + counted(size, "# byte[s]"));
      if (kind == json && text.empty()) text = bytes.substr(at + 8, size);
      if (kind == binary && binary_.empty()) binary_ = bytes.substr(at + 8, size);
      at += 8 + size;
    }
    if (text.empty()) fail("there is no JSON in it");
    return text;
  }

  // What the JSON has, with the place where it has something else.

  [[nodiscard]] const Json* find(const Json& object, const char* name) const {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(name);
    return found == object.end() ? nullptr : &*found;
  }
  std::size_t index(const Json& value, const std::string& place) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xFFFFFFFFFFFFu)
      fail(place + ": expected a whole number from 0");
    return value.get<std::size_t>();
  }
  std::size_t index(const Json& object, const char* name, const std::string& place,
                    std::optional<std::size_t> missing = std::nullopt) const {
    const Json* value = find(object, name);
    if (value != nullptr) return index(*value, place + "." + name);
    if (!missing) fail(place + ": it has no '" + name + "'");
    return *missing;
  }
  std::string string(const Json& object, const char* name) const {
    const Json* value = find(object, name);
    return value != nullptr && value->is_string() ? value->get<std::string>() : "";
  }
  template <std::size_t N>
  std::array<double, N> numbers(const Json& object, const char* name, const std::string& place,
                                const std::array<double, N>& missing) const {
    const Json* value = find(object, name);
    if (value == nullptr) return missing;
    std::array<double, N> result{};
    bool is_right = value->is_array() && value->size() == N;
    for (std::size_t i = 0; i < N && is_right; ++i) {
      is_right = (*value)[i].is_number();
      if (is_right) result[i] = (*value)[i].template get<double>();
      is_right = is_right && std::fabs(result[i]) <= largest_coordinate;
    }
    if (!is_right) fail(place + "." + name + ": expected " + counted(N, "# number[s]"));
    return result;
  }
  /// An element of an array at the top.
  const Json& element(const char* list, std::size_t which) const {
    const Json* all = find(json_, list);
    if (all == nullptr || !all->is_array() || which >= all->size())
      fail("there are no " + place_of(list, which));
    if (!(*all)[which].is_object()) fail(place_of(list, which) + ": expected an object");
    return (*all)[which];
  }
  static std::string place_of(const char* list, std::size_t which) {
    return std::string(list) + "[" + std::to_string(which) + "]";
  }

  void check_version() const {
    const Json* asset = find(json_, "asset");
    const std::string version = asset != nullptr ? string(*asset, "version") : "";
    if (!version.starts_with("2."))
      fail(version.empty() ? "is no glTF 2: it has no asset.version"
                           : "is glTF of the version " + printable_name(version) + "; version 2 is read");
  }

  /// What is needed to understand the file, as it says itself.
  void check_extensions() const {
    const Json* required = find(json_, "extensionsRequired");
    if (required == nullptr || !required->is_array()) return;
    for (const Json& each : *required) {
      const std::string name = each.is_string() ? printable_name(each.get<std::string>()) : "";
      const bool is_known = name == "KHR_mesh_quantization" || name.starts_with("KHR_materials_") ||
                            name.starts_with("KHR_texture_") || name.starts_with("KHR_lights_");
      if (is_known) continue;
      const bool is_packed =
          name.find("draco") != std::string::npos || name.find("meshopt") != std::string::npos;
      fail("it needs the extension " + name +
           (is_packed ? ": its triangles are compressed, which is not read; "
                        "write it again without compression"
                      : ", which is not read"));
    }
  }

  std::vector<std::size_t> indices(const Json& object, const char* name, const std::string& place) const {
    std::vector<std::size_t> result;
    const Json* list = find(object, name);
    if (list == nullptr) return result;
    if (!list->is_array()) fail(place + "." + name + ": expected a list");
    for (const Json& each : *list) result.push_back(index(each, place + "." + name));
    return result;
  }

  /// The nodes of the scene; without one, all that are no children.
  std::vector<std::size_t> roots() const {
    if (const Json* scenes = find(json_, "scenes");
        scenes != nullptr && scenes->is_array() && !scenes->empty()) {
      const std::size_t scene = index(json_, "scene", "the file", 0);
      return indices(element("scenes", scene), "nodes", place_of("scenes", scene));
    }
    const Json* nodes = find(json_, "nodes");
    std::vector<std::size_t> result;
    if (nodes == nullptr || !nodes->is_array()) return result;
    std::vector<bool> is_child(nodes->size());
    for (std::size_t i = 0; i < nodes->size(); ++i)
      for (const std::size_t child : indices((*nodes)[i], "children", place_of("nodes", i)))
        if (child < is_child.size()) is_child[child] = true;
    for (std::size_t i = 0; i < nodes->size(); ++i)
      if (!is_child[i]) result.push_back(i);
    return result;
  }

  Affine map_of(const Json& node, const std::string& place) const {
    if (find(node, "matrix") != nullptr) {
      const auto m = numbers<16>(node, "matrix", place, {});
      Affine map{};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 4; ++k) map[i][k] = m[4 * k + i];
      return map;
    }
    const auto [x, y, z, w] = numbers<4>(node, "rotation", place, {0, 0, 0, 1});
    const auto scale = numbers<3>(node, "scale", place, {1, 1, 1});
    const auto move = numbers<3>(node, "translation", place, {0, 0, 0});
    const double norm = x * x + y * y + z * z + w * w, s = norm > 0 ? 2 / norm : 0;
    Affine map{{{1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), move[0]},
                {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w), move[1]},
                {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y), move[2]}}};
    for (auto& row : map)
      for (std::size_t k = 0; k < 3; ++k) row[k] *= scale[k];
    return map;
  }

  void visit(std::size_t which, const Affine& outer, const std::string& outer_name, std::size_t depth) {
    const std::string place = place_of("nodes", which);
    if (++nodes_ > most_placed || depth > most_nesting)
      fail(place + ": nodes are in each other more than " + std::to_string(most_nesting) +
           " deep, or more than " + std::to_string(most_placed) + " times");
    const Json& node = element("nodes", which);
    const Affine map = outer * map_of(node, place);
    const std::string own = printable_name(string(node, "name")), name = own.empty() ? outer_name : own;
    if (find(node, "skin") != nullptr) ++skins_;
    if (find(node, "mesh") != nullptr) add(mesh(index(node, "mesh", place)), map, own, outer_name);
    for (const std::size_t child : indices(node, "children", place)) visit(child, map, name, depth + 1);
  }

  /// A mesh where a node puts it is a part.
  void add(const Mesh& mesh, const Affine& map, const std::string& own_name, const std::string& outer_name) {
    if (mesh.triangles == 0) return;
    triangles_ += mesh.triangles;
    points_ += mesh.points;
    if (!result_.parts.empty() && std::max(triangles_, points_) > most_elements)
      fail("its nodes have more than " + std::to_string(most_elements) + " triangles or points together");
    ImportedPart part;
    part.name = names_.once(!own_name.empty() ? own_name : !mesh.name.empty() ? mesh.name : outer_name);
    part.colour = mesh.primitives.front().colour;
    const bool is_mirrored = is_mirror(map);
    for (const Primitive& primitive : mesh.primitives) {
      if (primitive.colour != part.colour) part.colour.reset();
      const auto first = static_cast<std::uint32_t>(part.mesh.points.size());
      for (const Point3& p : primitive.points) {
        Point3 placed;
        for (std::size_t i = 0; i < 3; ++i)
          placed[i] = map[i][0] * p[0] + map[i][1] * p[1] + map[i][2] * p[2] + map[i][3];
        part.mesh.add_point(placed);
      }
      for (const auto& [a, b, c] : primitive.triangles)
        part.mesh.add_face(is_mirrored ? std::array{first + a, first + c, first + b}
                                       : std::array{first + a, first + b, first + c});
    }
    const bool is_of_one_colour = std::all_of(
        mesh.primitives.begin(), mesh.primitives.end(),
        [&](const Primitive& primitive) { return primitive.colour == mesh.primitives.front().colour; });
    if (!is_of_one_colour) {
      part.colour.reset();
      ++many_coloured_;
    }
    result_.parts.push_back(std::move(part));
  }

  const Mesh& mesh(std::size_t which) {
    const auto [found, is_new] = meshes_.try_emplace(which);
    Mesh& mesh = found->second;
    if (!is_new) return mesh;
    const std::string place = place_of("meshes", which);
    const Json& json = element("meshes", which);
    mesh.name = printable_name(string(json, "name"));
    const Json* primitives = find(json, "primitives");
    if (primitives == nullptr || !primitives->is_array()) fail(place + ": it has no 'primitives'");
    for (std::size_t i = 0; i < primitives->size(); ++i)
      read_primitive((*primitives)[i], place + ".primitives[" + std::to_string(i) + "]", mesh);
    return mesh;
  }

  void read_primitive(const Json& json, const std::string& place, Mesh& mesh) {
    constexpr std::size_t mode_triangles = 4, mode_strip = 5, mode_fan = 6;
    const std::size_t mode = index(json, "mode", place, mode_triangles);
    if (mode < mode_triangles) {
      ++lines_;
      return;
    }
    if (mode > mode_fan) fail(place + ".mode: there is no mode " + std::to_string(mode));
    const Json* attributes = find(json, "attributes");
    if (attributes == nullptr || find(*attributes, "POSITION") == nullptr) return;
    if (find(json, "targets") != nullptr) ++morphs_;
    Primitive primitive;
    const std::size_t positions = index(*attributes, "POSITION", place + ".attributes");
    each_number<3>(positions, "VEC3", [&](const std::array<double, 3>& p) { primitive.points.push_back(p); });
    std::vector<std::uint32_t> corners;
    if (find(json, "indices") != nullptr) {
      const std::size_t accessor = index(json, "indices", place);
      each_number<1>(accessor, "SCALAR", [&](const std::array<double, 1>& number) {
        if (!(number[0] < static_cast<double>(primitive.points.size())))
          fail(place_of("accessors", accessor) + ": a triangle names point " +
               std::to_string(static_cast<std::uint64_t>(number[0])) + ", but there are " +
               std::to_string(primitive.points.size()) + ", the first being 0");
        corners.push_back(static_cast<std::uint32_t>(number[0]));
      });
    } else {
      for (std::uint32_t i = 0; i < primitive.points.size(); ++i) corners.push_back(i);
    }
    if (mode == mode_triangles && corners.size() % 3 != 0)
      fail(place + ": " + counted(corners.size(), "# corner[s] [is|are] no triangles"));
    for (std::size_t i = 0; i + 2 < corners.size(); i += mode == mode_triangles ? 3 : 1) {
      const bool is_odd = mode == mode_strip && i % 2 == 1;
      const std::uint32_t a = corners[mode == mode_fan ? 0 : i], b = corners[i + 1], c = corners[i + 2];
      primitive.triangles.push_back(is_odd ? std::array{b, a, c} : std::array{a, b, c});
    }
    primitive.colour = colour_of(json, place);
    mesh.triangles += primitive.triangles.size();
    mesh.points += primitive.points.size();
    if (std::max(mesh.triangles, mesh.points) > most_elements)
      fail(place + ": its mesh has more than " + std::to_string(most_elements) + " triangles or points");
    if (!primitive.triangles.empty()) mesh.primitives.push_back(std::move(primitive));
  }

  std::optional<Colour> colour_of(const Json& primitive, const std::string& place) const {
    if (find(primitive, "material") == nullptr) return std::nullopt;
    const std::size_t which = index(primitive, "material", place);
    const Json& material = element("materials", which);
    const Json* model = find(material, "pbrMetallicRoughness");
    if (model == nullptr || find(*model, "baseColorFactor") == nullptr) return std::nullopt;
    const auto [red, green, blue, alpha] =
        numbers<4>(*model, "baseColorFactor", place_of("materials", which), {1, 1, 1, 1});
    return Colour{srgb(red), srgb(green), srgb(blue), opacity(material, alpha)};
  }

  /// What is opaque says so by saying nothing; what is masked is there or not there.
  [[nodiscard]] double opacity(const Json& material, double alpha) const {
    const std::string mode = string(material, "alphaMode");
    return mode == "BLEND" ? std::clamp(alpha, 0.0, 1.0) : 1;
  }

  std::string_view buffer(std::size_t which) {
    const std::string place = place_of("buffers", which);
    const Json& json = element("buffers", which);
    const std::size_t length = index(json, "byteLength", place);
    std::string_view bytes = binary_;
    if (find(json, "uri") != nullptr) {
      const auto [found, is_new] = buffers_.try_emplace(which);
      if (is_new) found->second = bytes_of_uri(string(json, "uri"), place);
      bytes = found->second;
    }
    if (bytes.size() < length)
      fail(place + ": is cut off: " + counted(bytes.size(), "# byte[s] of ") + std::to_string(length) +
           " are there");
    return bytes.substr(0, length);
  }

  std::string bytes_of_uri(const std::string& uri, const std::string& place) const {
    if (uri.starts_with("data:")) {
      const std::size_t comma = uri.find(',');
      if (comma == std::string::npos ||
          std::string_view(uri).substr(0, comma).find("base64") == std::string::npos)
        fail(place + ".uri: its data is no base64");
      auto bytes = from_base64(std::string_view(uri).substr(comma + 1));
      if (!bytes) fail(place + ".uri: its base64 is damaged");
      return *std::move(bytes);
    }
    const std::filesystem::path file = decoded_uri(uri);
    const bool is_inside = !file.empty() && file.is_relative() && uri.find("://") == std::string::npos &&
                           file.lexically_normal().begin()->string() != "..";
    const std::string shown = "'" + printable_name(uri.substr(0, 100)) + (uri.size() > 100 ? "...'" : "'");
    if (!is_inside) fail(place + ".uri: names no file beside this one: " + shown);
    const std::filesystem::path other = path_.parent_path() / file;
    std::error_code error;  // such as that the name is too long, where a data: is damaged
    if (!std::filesystem::is_regular_file(other, error))
      fail(place + ".uri: there is no file " + shown + " beside this one");
    return read_text(other);
  }

  View view(std::size_t which, const std::string& user) {
    const std::string place = place_of("bufferViews", which);
    const Json& json = element("bufferViews", which);
    if (const Json* extensions = find(json, "extensions");
        extensions != nullptr && find(*extensions, "EXT_meshopt_compression") != nullptr)
      fail(place + ": it is compressed (EXT_meshopt_compression), which is not read; write it again without");
    const std::string_view bytes = buffer(index(json, "buffer", place));
    const std::size_t offset = index(json, "byteOffset", place, 0), length = index(json, "byteLength", place);
    if (offset > bytes.size() || length > bytes.size() - offset)
      fail(place + ": it goes beyond its buffer, which " + user + " needs");
    return {bytes.substr(offset, length), index(json, "byteStride", place, 0)};
  }

  static std::size_t size_of(std::size_t component) {
    switch (component) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
      default:
        return 0;
    }
  }

  template <typename T>
  static double at(const char* from, bool normalized) {
    std::array<unsigned char, sizeof(T)> raw{};
    std::memcpy(raw.data(), from, sizeof(T));
    std::uint32_t bits = 0;
    for (std::size_t i = sizeof(T); i-- > 0;) bits = bits << 8 | raw[i];
    if constexpr (std::is_same_v<T, float>) {
      float value = 0;
      std::memcpy(&value, &bits, sizeof value);
      return value;
    } else {
      const double value = static_cast<T>(bits);
      return normalized ? std::max(value / std::numeric_limits<T>::max(), -1.0) : value;
    }
  }

  static double component_at(const char* from, std::size_t component, bool normalized) {
    switch (component) {
      case 5120:
        return at<std::int8_t>(from, normalized);
      case 5121:
        return at<std::uint8_t>(from, normalized);
      case 5122:
        return at<std::int16_t>(from, normalized);
      case 5123:
        return at<std::uint16_t>(from, normalized);
      case 5125:
        return at<std::uint32_t>(from, normalized);
      default:
        return at<float>(from, normalized);
    }
  }

  /// Numbers of a buffer view, a row of N each. @return its rows.
  template <std::size_t N, typename Take>
  void each_in_view(const View& view, std::size_t offset, std::size_t count, std::size_t component,
                    bool normalized, const std::string& place, Take take) {
    const std::size_t row = N * size_of(component), stride = view.stride == 0 ? row : view.stride;
    if (stride < row || stride > 252 + row) fail(place + ": its byteStride is wrong");
    const bool fits = offset <= view.bytes.size() && view.bytes.size() - offset >= row &&
                      (count - 1) <= (view.bytes.size() - offset - row) / stride;
    if (count > 0 && !fits)
      fail(place + ": " + counted(count, "# element[s] [is|are] not in its bufferView; it is cut off"));
    for (std::size_t i = 0; i < count; ++i) {
      std::array<double, N> numbers;
      for (std::size_t k = 0; k < N; ++k) {
        numbers[k] = component_at(view.bytes.data() + offset + i * stride + k * size_of(component), component,
                                  normalized);
        if (!(std::fabs(numbers[k]) <= largest_coordinate))
          fail(place + ": element " + std::to_string(i) + " has a number that is not finite or too large");
      }
      take(i, numbers);
    }
  }

  /// Calls take(numbers) for each element of an accessor.
  template <std::size_t N, typename Take>
  void each_number(std::size_t which, const char* type, Take take) {
    const std::string place = place_of("accessors", which);
    const Json& json = element("accessors", which);
    const std::size_t count = index(json, "count", place), component = index(json, "componentType", place);
    const Json* normal = find(json, "normalized");
    const bool normalized = normal != nullptr && normal->is_boolean() && normal->get<bool>();
    if (string(json, "type") != type)
      fail(place + ": expected the type " + type + ", found '" + printable_name(string(json, "type")) + "'");
    if (size_of(component) == 0 || (N == 1 && (component == 5126 || component == 5120 || component == 5122)))
      fail(place + ": a componentType of " + std::to_string(component) + " cannot stand there");
    const Json* sparse = find(json, "sparse");
    if (sparse == nullptr && find(json, "bufferView") == nullptr)
      fail(place + ": it has no bufferView" +
           std::string(find(json_, "extensionsUsed") != nullptr
                           ? ", as what is compressed has none; write it again without compression"
                           : ""));
    if (sparse == nullptr) {
      const View from = view(index(json, "bufferView", place), place);
      each_in_view<N>(from, index(json, "byteOffset", place, 0), count, component, normalized, place,
                      [&](std::size_t, const std::array<double, N>& numbers) { take(numbers); });
      return;
    }
    for (const auto& numbers : sparse_numbers<N>(json, *sparse, count, component, normalized, place))
      take(numbers);
  }

  /// Zeros, or what a view has, of which some are replaced.
  template <std::size_t N>
  std::vector<std::array<double, N>> sparse_numbers(const Json& json, const Json& sparse, std::size_t count,
                                                    std::size_t component, bool normalized,
                                                    const std::string& place) {
    if (count > most_elements)
      fail(place + ": it has more than " + std::to_string(most_elements) + " elements");
    std::vector<std::array<double, N>> all(count);
    const auto store = [&](std::size_t i, const std::array<double, N>& numbers) { all[i] = numbers; };
    if (find(json, "bufferView") != nullptr)
      each_in_view<N>(view(index(json, "bufferView", place), place), index(json, "byteOffset", place, 0),
                      count, component, normalized, place, store);
    const Json *where = find(sparse, "indices"), *what = find(sparse, "values");
    if (where == nullptr || what == nullptr) fail(place + ".sparse: it has no 'indices' or no 'values'");
    const std::size_t changed = index(sparse, "count", place + ".sparse");
    const std::size_t kind = index(*where, "componentType", place + ".sparse.indices");
    if (kind != 5121 && kind != 5123 && kind != 5125)
      fail(place + ".sparse.indices: a componentType of " + std::to_string(kind) + " cannot stand there");
    std::vector<std::size_t> places;
    each_in_view<1>(view(index(*where, "bufferView", place + ".sparse.indices"), place),
                    index(*where, "byteOffset", place, 0), changed, kind, false, place + ".sparse.indices",
                    [&](std::size_t, const std::array<double, 1>& number) {
                      if (!(number[0] < static_cast<double>(count)))
                        fail(place + ".sparse.indices: there is no element " +
                             std::to_string(static_cast<std::uint64_t>(number[0])));
                      places.push_back(static_cast<std::size_t>(number[0]));
                    });
    each_in_view<N>(view(index(*what, "bufferView", place + ".sparse.values"), place),
                    index(*what, "byteOffset", place, 0), changed, component, normalized,
                    place + ".sparse.values",
                    [&](std::size_t i, const std::array<double, N>& numbers) { store(places[i], numbers); });
    return all;
  }

  /// What is passed over, by kind.
  ImportedParts finished() {
    const auto note = [&](std::size_t count, const std::string& text) {
      if (count > 0) result_.notes.push_back(text);
    };
    note(lines_, counted(lines_, "# primitive[s] of lines or points [is|are] passed over"));
    note(skins_, counted(skins_,
                         "# skin[s] [is|are] passed over: [its mesh stands as it is|their meshes stand as "
                         "they are] at rest"));
    note(morphs_,
         counted(morphs_,
                 "# primitive[s] [has|have] shapes that [it turns|they turn] into, which are passed over"));
    note(many_coloured_, counted(many_coloured_,
                                 "# mesh[es] [has|have] triangles of several colours; a part has one colour, "
                                 "so [it comes|they come] without"));
    if (const Json* animations = find(json_, "animations"); animations != nullptr && animations->is_array())
      note(animations->size(), counted(animations->size(), "# animation[s] [is|are] passed over"));
    if (result_.parts.empty()) fail("there are no triangles in it");
    return std::move(result_);
  }
};

}  // namespace

ImportedParts import_gltf(std::string_view bytes, const std::filesystem::path& path) {
  return GltfReader(bytes, path).read();
}

}  // namespace bsp2::model
