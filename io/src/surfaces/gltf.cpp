// glTF 2.0, as text (.gltf) and as one binary file (.glb).
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "bsp2/geometry/support/error.hpp"
#include "surfaces/division.hpp"
#include "surfaces/shading.hpp"
#include "surfaces/text.hpp"
#include "surfaces/writers.hpp"

namespace bsp2::io {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of the specification.
constexpr int component_float = 5126, component_uint = 5125, target_vertices = 34962, target_indices = 34963,
              mode_lines = 1, mode_triangles = 4;

/// Three bytes as four letters.
std::string base64(std::string_view bytes) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? letters[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// Colours of files are sRGB, those of materials are linear.
double linear(std::uint8_t channel) {
  const double x = channel / 255.0;
  const double y = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
  return std::round(1e6 * y) / 1e6;
}

class Gltf {
 public:
  Gltf(const SingleSurface& surface, const PartLabels& labels) : surface_(surface), labels_(labels) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "bsp2"}};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json::object()});
    if (surface.triangles.empty()) return;
    const ShadedSurface shading = shaded(surface);
    const auto pieces = pieces_by_part(shading.point.size(), shading.triangles, surface.owner);
    // Views first, so that each kind of number has one, and the parts their places in it.
    for (const PartPiece& piece : pieces) {
      add_positions(piece.points.size(), [&](std::size_t i) { return shading.point[piece.points[i]]; });
      add_part(piece);
      for (const std::uint32_t vertex : piece.points) append(normals_, shading.normal[vertex]);
      for (const CornerIndices& t : piece.triangles) append(indices_, t);
    }
    if (!shading.sharp_edges.empty()) add_edges(shading);
    close();
  }

  [[nodiscard]] std::string take(GltfForm form) {
    if (form == GltfForm::text) {
      if (!bytes_.empty())
        json_["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(bytes_);
      return json_.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
    }
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    constexpr std::uint64_t head = 12, of_chunk = 8;
    const std::uint64_t size =
        head + of_chunk + text.size() + (bytes_.empty() ? 0 : of_chunk + bytes_.size());
    if (size > std::numeric_limits<std::uint32_t>::max())
      throw Error("it would be larger than 4 GiB, which .glb files cannot be");
    std::string file;
    file.reserve(size);
    append(file, std::array<std::uint32_t, 5>{0x46546c67, 2, static_cast<std::uint32_t>(size),
                                              static_cast<std::uint32_t>(text.size()), 0x4e4f534a});
    file += text;
    if (!bytes_.empty()) {
      append(file, std::array<std::uint32_t, 2>{static_cast<std::uint32_t>(bytes_.size()), 0x004e4942});
      file += bytes_;
    }
    return file;
  }

 private:
  enum View { view_positions, view_normals, view_indices };
  const SingleSurface& surface_;
  const PartLabels& labels_;
  Json json_;
  std::string positions_, normals_, indices_, bytes_;
  std::map<SurfaceParts::Colour, std::size_t> material_of_;

  template <typename T>
  static void append(std::string& to, const T& value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  /// @return its number.
  std::size_t add(const char* list, Json entry) {
    json_[list].push_back(std::move(entry));
    return json_[list].size() - 1;
  }

  /// Its numbers begin where those of the view end up to now.
  std::size_t add_accessor(View view, int component, std::size_t count, const char* type) {
    const std::string& bytes = view == view_positions ? positions_
                               : view == view_normals ? normals_
                                                      : indices_;
    return add("accessors", {{"bufferView", static_cast<int>(view)},
                             {"byteOffset", bytes.size()},
                             {"componentType", component},
                             {"count", count},
                             {"type", type}});
  }

  /// Positions of points, with their bounds.
  template <class PointOf>
  void add_positions(std::size_t count, PointOf&& point_of) {
    const std::size_t accessor = add_accessor(view_positions, component_float, count, "VEC3");
    SinglePoint3 low, high;
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    for (std::size_t i = 0; i < count; ++i) {
      const SinglePoint3& point = surface_.points[point_of(i)];
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], point[k]);
        high[k] = std::max(high[k], point[k]);
      }
      append(positions_, point);
    }
    json_["accessors"][accessor]["min"] = low;
    json_["accessors"][accessor]["max"] = high;
  }

  std::size_t material(const SurfaceParts::Colour& colour, const std::string& name) {
    const auto [found, is_new] = material_of_.try_emplace(colour, 0);
    if (!is_new) return found->second;
    const auto [r, g, b, opacity] = colour;
    Json entry{
        {"name", name},
        {"pbrMetallicRoughness",
         {{"baseColorFactor", {linear(r), linear(g), linear(b), std::round(1e6 * opacity / 255) / 1e6}},
          {"metallicFactor", 0},
          {"roughnessFactor", 0.7}}}};
    if (opacity < 255) entry["alphaMode"] = "BLEND";
    return found->second = add("materials", std::move(entry));
  }

  /// After its positions.
  void add_part(const PartPiece& piece) {
    const std::int32_t owner = piece.owner;
    const std::string name = labels_.name(owner);
    const std::size_t positions = json_["accessors"].size() - 1;
    const std::size_t normals = add_accessor(view_normals, component_float, piece.points.size(), "VEC3");
    const std::size_t indices =
        add_accessor(view_indices, component_uint, 3 * piece.triangles.size(), "SCALAR");
    const Json primitive{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}},
                         {"indices", indices},
                         {"material", material(labels_.shown_colour(owner), name)},
                         {"mode", mode_triangles}};
    const std::size_t mesh = add("meshes", {{"name", name}, {"primitives", Json::array({primitive})}});
    add("nodes", {{"name", name}, {"mesh", mesh}});
  }

  void add_edges(const ShadedSurface& shading) {
    std::vector<std::uint32_t> used, number(surface_.points.size(), no_half_edge);
    for (const auto& edge : shading.sharp_edges)
      for (const std::uint32_t point : edge)
        if (number[point] == no_half_edge) {
          number[point] = static_cast<std::uint32_t>(used.size());
          used.push_back(point);
        }
    add_positions(used.size(), [&](std::size_t i) { return used[i]; });
    const std::size_t positions = json_["accessors"].size() - 1;
    const std::size_t indices =
        add_accessor(view_indices, component_uint, 2 * shading.sharp_edges.size(), "SCALAR");
    for (const auto& edge : shading.sharp_edges)
      append(indices_, std::array<std::uint32_t, 2>{number[edge[0]], number[edge[1]]});
    const std::size_t lines =
        add("materials",
            {{"name", "edges"},
             {"pbrMetallicRoughness",
              {{"baseColorFactor", {0.01, 0.01, 0.012, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1}}}});
    const Json primitive{{"attributes", {{"POSITION", positions}}},
                         {"indices", indices},
                         {"material", lines},
                         {"mode", mode_lines}};
    const std::size_t mesh = add("meshes", {{"name", "edges"}, {"primitives", Json::array({primitive})}});
    add("nodes", {{"name", "edges"}, {"mesh", mesh}});
  }

  /// glTF counts in metres, and up is y.
  void add_root() {
    Json children = Json::array();
    for (std::size_t i = 0; i < json_["nodes"].size(); ++i) children.push_back(i);
    const double half = -std::sqrt(0.5);
    const std::size_t root = add("nodes", {{"name", one_line(labels_.whole())},
                                           {"rotation", {half, 0, 0, -half}},
                                           {"scale", {0.001, 0.001, 0.001}},
                                           {"children", children}});
    json_["scenes"][0]["nodes"] = Json::array({root});
  }

  void close() {
    add_root();
    for (const auto& [numbers, stride] :
         {std::pair{&positions_, 12}, std::pair{&normals_, 12}, std::pair{&indices_, 0}}) {
      Json view{{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", numbers->size()}};
      if (stride > 0) view["byteStride"] = stride;
      view["target"] = stride > 0 ? target_vertices : target_indices;
      add("bufferViews", std::move(view));
      bytes_ += *numbers;
      *numbers = {};
    }
    json_["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
  }
};

}  // namespace

std::string to_gltf(const SingleSurface& surface, const PartLabels& labels, GltfForm form) {
  return Gltf(surface, labels).take(form);
}

}  // namespace bsp2::io
