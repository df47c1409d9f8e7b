#include "viewer/levels.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "viewer/message.hpp"
#include "viewer/packing.hpp"
#include "viewer/received.hpp"
#include "viewer/voxels.hpp"

namespace bsp2::api {
namespace {

using nlohmann::json;
using Point = std::array<double, 3>;

/// What is in one place, and looks alike, is one vertex.
struct Spot {
  std::array<std::uint16_t, 3> place;
  std::uint32_t looks;
  friend bool operator==(const Spot&, const Spot&) = default;
};
struct SpotHash {
  std::size_t operator()(const Spot& key) const {
    std::uint64_t h = std::uint64_t{key.place[0]} | std::uint64_t{key.place[1]} << 16 |
                      std::uint64_t{key.place[2]} << 32 | std::uint64_t{key.looks} << 48;
    h = (h ^ key.looks) * 0xd6e8feb86659fd93U;
    return h ^ (h >> 29);
  }
};

/// The vertices of a message on a coarser lattice.
class CoarseVertices {
 public:
  CoarseVertices(const Received& from, int level) : step_(std::exp2(level)) {
    const Numbers places = from.whole("positions");
    has_parts_ = from.has("parts");
    has_tints_ = from.has("tints");
    if (has_parts_) old_parts_ = from.whole("parts");
    if (has_tints_) old_tints_ = from.whole("tints");
    const double step = from.header()["step"];
    for (std::size_t i = 0; i < 3; ++i) {
      old_origin_[i] = from.header()["origin"][i];
      origin_[i] = std::floor(old_origin_[i] / step_) * step_;
    }
    of_.reserve(places.size() / 3);
    for (std::size_t v = 0; v < places.size(); v += 3) add(places.data() + v, step);
  }
  /// What has become of a vertex.
  [[nodiscard]] std::uint32_t operator[](std::uint32_t old) const { return of_[old]; }
  /// Adds those that are used, and names them anew.
  void write(Message& message, Numbers& triangles, Numbers& edges) const {
    Numbers name(places_.size() / 3, unused);
    std::vector<std::uint16_t> positions, parts, tints;
    for (Numbers* indices : {&triangles, &edges})
      for (std::uint32_t& v : *indices) {
        if (name[v] == unused) {
          name[v] = static_cast<std::uint32_t>(positions.size() / 3);
          positions.insert(positions.end(), places_.begin() + 3 * v, places_.begin() + 3 * v + 3);
          if (!parts_.empty()) parts.push_back(parts_[v]);
          if (!tints_.empty()) tints.push_back(tints_[v]);
        }
        v = name[v];
      }
    message["origin"] = origin_;
    message["step"] = step_;
    message.add("positions", positions, 3);
    if (has_parts_) message.add("parts", parts);  // also where nothing is left
    if (has_tints_) message.add("tints", tints);
  }

 private:
  static constexpr std::uint32_t unused = 0xffffffffU;
  double step_;
  bool has_parts_ = false, has_tints_ = false;
  Point origin_{}, old_origin_{};
  Numbers old_parts_, old_tints_, of_;
  std::vector<std::uint16_t> places_, parts_, tints_;
  std::unordered_map<Spot, std::uint32_t, SpotHash> known_;

  void add(const std::uint32_t* old_place, double old_step) {
    Spot key{};
    for (std::size_t i = 0; i < 3; ++i)
      key.place[i] = static_cast<std::uint16_t>(std::clamp(
          std::round((old_origin_[i] + old_step * old_place[i]) / step_) - origin_[i] / step_, 0.0, 65535.0));
    const std::size_t old = of_.size();
    const std::uint32_t part = old_parts_.empty() ? 0 : old_parts_[old];
    const std::uint32_t tint = old_tints_.empty() ? 0 : old_tints_[old];
    key.looks = part | tint << 16;
    const auto [found, is_new] = known_.try_emplace(key, static_cast<std::uint32_t>(places_.size() / 3));
    of_.push_back(found->second);
    if (!is_new) return;
    places_.insert(places_.end(), key.place.begin(), key.place.end());
    if (!old_parts_.empty()) parts_.push_back(static_cast<std::uint16_t>(part));
    if (!old_tints_.empty()) tints_.push_back(static_cast<std::uint16_t>(tint));
  }
};

/// What is left of the triangles, and of whose they are.
class Left {
 public:
  Numbers triangles, counts, owners;  ///< `owners`: those of the message that have some
  std::size_t opaque = 0, in_cells = 0;

  explicit Left(const Received& from) : of_in_(from.header().value("inCells", std::size_t{0})) {}
  /// By ascending owners.
  void add(std::initializer_list<std::uint32_t> triangle, std::uint32_t owner) {
    triangles.insert(triangles.end(), triangle);
    if (owners.empty() || owners.back() != owner) {
      owners.push_back(owner);
      counts.push_back(0);
      in_cells += owner < of_in_ ? 1 : 0;
    }
    ++counts.back();
    opaque += owner < of_in_ ? 1 : 0;
  }

 private:
  std::size_t of_in_;  // cells that are IN come first
};

/// @param is_kept asks whether one of the opaque triangles is, by a vertex of it.
template <class IsKept>
Left left_of(const Received& from, const CoarseVertices& vertices, const IsKept& is_kept) {
  const Numbers triangles = from.whole("triangles"), owners = from.owners();
  const std::size_t opaque = from.is_piece() ? owners.size() : from.header()["opaque"].get<std::size_t>();
  Left left(from);
  for (std::size_t i = 0; i < owners.size(); ++i) {
    if (i < opaque && !is_kept(triangles[3 * i])) continue;
    const std::uint32_t a = vertices[triangles[3 * i]], b = vertices[triangles[3 * i + 1]],
                        c = vertices[triangles[3 * i + 2]];
    if (a != b && b != c && c != a) left.add({a, b, c}, owners[i]);
  }
  return left;
}

/// Edges that still have two ends, each once.
Numbers edges_left(const Received& from, const CoarseVertices& vertices) {
  Numbers edges;
  if (!from.has("edges")) return edges;
  std::unordered_set<std::uint64_t> known;
  const Numbers old = from.whole("edges");
  for (std::size_t i = 0; i + 1 < old.size(); i += 2) {
    const auto [a, b] = std::minmax({vertices[old[i]], vertices[old[i + 1]]});
    if (a != b && known.insert(std::uint64_t{a} << 32 | b).second) edges.insert(edges.end(), {a, b});
  }
  return edges;
}

template <typename Number>
std::vector<Number> chosen(const std::vector<Number>& of, const Numbers& which) {
  std::vector<Number> some;
  some.reserve(which.size());
  for (const std::uint32_t i : which) some.push_back(of[i]);
  return some;
}

/// Adds those of an array that belong to owners that are left.
void add_chosen(Message& message, const Received& from, const char* name, const Numbers& owners) {
  const std::string type = from.header()["arrays"][name][0];
  if (type == "f32")
    message.add(name, chosen(from.numbers<float>(name), owners));
  else if (type == "i32")
    message.add(name, chosen(from.numbers<std::int32_t>(name), owners));
  else
    message.add_small(name, chosen(from.whole(name), owners), 1);
}

/// With all of a header but where its arrays are.
Message begun(const json& header) {
  Message message(header["kind"].get_ref<const std::string&>().c_str(), header["run"]);
  for (const auto& [name, value] : header.items())
    if (name != "arrays") message[name.c_str()] = value;
  return message;
}

/// Adds what a level has but vertices and edges.
void add_left(Message& message, const Received& from, const Left& left) {
  message.add_indices("triangles", left.triangles, 1);
  message.add_small(from.is_piece() ? "ofFace" : "ofCell", left.counts);
  for (const char* name : {"faces", "solids", "areas", "cellParts", "levels", "volumes"})
    if (from.has(name)) add_chosen(message, from, name, left.owners);
  if (from.is_piece()) return;
  message["opaque"] = left.opaque;
  message["inCells"] = left.in_cells;
}

std::string on_lattice(const Received& from, int level) {
  Message message = begun(from.header());
  const CoarseVertices vertices(from, level == Detail::nothing ? from.header()["finest"].get<int>() : level);
  Left left(from);
  Numbers edges;
  if (level != Detail::nothing) {
    left = left_of(from, vertices, [](std::uint32_t) { return true; });
    edges = edges_left(from, vertices);
  }
  vertices.write(message, left.triangles, edges);
  if (from.is_piece()) message.add_indices("edges", edges, 1);
  add_left(message, from, left);
  return message.bytes();
}

/// What each owner looks like, as its vertices have it; nothing where they have nothing.
Numbers looks_of(const Received& from, const Numbers& triangles, const Numbers& owners) {
  if (!from.has("parts")) return {};
  const Numbers parts = from.whole("parts"), tints = from.has("tints") ? from.whole("tints") : Numbers{};
  Numbers looks(owners.empty() ? 0 : owners.back() + 1, 0);
  for (std::size_t i = 0; i < owners.size(); ++i) {
    const std::uint32_t v = triangles[3 * i];
    looks[owners[i]] = parts[v] | (tints.empty() ? 0 : tints[v] << 16);
  }
  return looks;
}

/// Vertices of hulls, on a lattice with sixteen steps along the edge of a voxel, and triangles that have not
/// collapsed on it.
class HullVertices {
 public:
  HullVertices(const Received& from, int exponent) : lost_(std::max(0, exponent - 4)), left_(from) {}

  void add(const Voxels::Hull& hull) {
    const auto first = static_cast<std::uint32_t>(looks_.size());
    for (const Voxels::Point& point : hull.points)
      for (const double x : point)
        places_.push_back(static_cast<std::uint16_t>(std::round(std::ldexp(x, -lost_))));
    looks_.insert(looks_.end(), hull.looks.begin(), hull.looks.end());
    for (std::size_t i = 0; i < hull.owners.size(); ++i) {
      const std::uint32_t *corners = hull.triangles.data() + 3 * i, a = first + corners[0],
                          b = first + corners[1], c = first + corners[2];
      if (!are_one(a, b) && !are_one(b, c) && !are_one(c, a)) left_.add({a, b, c}, hull.owners[i]);
    }
  }
  void write(Message& message, const Received& from) const {
    message["step"] = std::ldexp(from.header()["step"].get<double>(), lost_);
    message.add("positions", places_, 3);
    std::vector<std::uint16_t> parts, tints;
    for (const std::uint32_t look : looks_) {
      parts.push_back(static_cast<std::uint16_t>(look));
      tints.push_back(static_cast<std::uint16_t>(look >> 16));
    }
    if (from.has("parts")) message.add("parts", parts);
    if (from.has("tints")) message.add("tints", tints);
    add_left(message, from, left_);
  }

 private:
  int lost_;
  Left left_;
  std::vector<std::uint16_t> places_;
  Numbers looks_;

  [[nodiscard]] bool are_one(std::uint32_t a, std::uint32_t b) const {
    return std::equal(&places_[3 * a], &places_[3 * a] + 3, &places_[3 * b]);
  }
};

/// Without edges: there is less than a voxel between them.
std::string of_voxels(const Received& from, int edge_exponent) {
  const Numbers triangles = from.whole("triangles"), owners = from.owners(),
                looks = looks_of(from, triangles, owners);
  const int exponent = edge_exponent - std::ilogb(from.header()["step"].get<double>());
  HullVertices vertices(from, exponent);
  for (const Voxels& voxels : voxels_of(from, exponent)) vertices.add(voxels.hull(looks));
  Message message = begun(from.header());
  message["voxels"] = true;
  vertices.write(message, from);
  if (from.is_piece()) message.add_indices("edges", {});
  return message.bytes();
}

}  // namespace

std::int32_t part_named(std::uint32_t number) {
  return number == no_number ? -1 : static_cast<std::int32_t>(number);
}

std::vector<std::int32_t> parts_in(const Received& from) {
  if (!from.has("parts")) return {};
  const Numbers parts = from.whole("parts"), corners = from.whole("triangles");
  std::set<std::int32_t> all;
  const std::size_t opaque = from.header()["opaque"];
  for (std::size_t i = 0; i < 3 * opaque; i += 3) all.insert(part_named(parts[corners[i]]));
  return {all.begin(), all.end()};
}

std::string without_parts(const std::string& bytes, const std::set<std::int32_t>& parts) {
  const Received from(bytes);
  const Numbers part_of = from.whole("parts");
  Message message = begun(from.header());
  const CoarseVertices vertices(from, std::ilogb(from.header()["step"].get<double>()));
  Left left = left_of(from, vertices,
                      [&](std::uint32_t vertex) { return !parts.contains(part_named(part_of[vertex])); });
  Numbers no_edges;
  vertices.write(message, left.triangles, no_edges);
  add_left(message, from, left);
  return message.bytes();
}

std::vector<Voxels> voxels_of(const Received& from, std::optional<int> edge_exponent) {
  const Numbers places = from.whole("positions"), corners = from.whole("triangles"), owners = from.owners();
  const int exponent = edge_exponent ? *edge_exponent : Voxels::first_exponent(places, corners);
  const std::size_t opaque = from.is_piece() ? owners.size() : from.header()["opaque"].get<std::size_t>();
  const std::span all_corners(corners), all_owners(owners);
  std::vector<Voxels> voxels;
  voxels.emplace_back(places, all_corners.first(3 * opaque), all_owners.first(opaque), exponent);
  voxels.emplace_back(places, all_corners.subspan(3 * opaque), all_owners.subspan(opaque), exponent);
  return voxels;
}

std::string coarser(const std::string& bytes, int level) {
  const Received from(bytes);
  return Detail::is_of_voxels(level) ? of_voxels(from, level - Detail::voxels) : on_lattice(from, level);
}

}  // namespace bsp2::api
