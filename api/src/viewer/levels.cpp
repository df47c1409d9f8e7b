#include "viewer/levels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>

#include "viewer/message.hpp"

namespace bsp2::api {
namespace {

using nlohmann::json;
using Numbers = std::vector<std::uint32_t>;
using Point = std::array<double, 3>;

/// A message, to be read.
class Received {
 public:
  explicit Received(const std::string& bytes) : header_(header_of(bytes)) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), sizeof length);
    arrays_ = bytes.data() + sizeof length + length;
  }
  static json header_of(const std::string& bytes) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), sizeof length);
    return json::parse(bytes.data() + sizeof length, bytes.data() + sizeof length + length);
  }
  [[nodiscard]] const json& header() const { return header_; }
  [[nodiscard]] bool has(const char* name) const { return header_["arrays"].contains(name); }
  [[nodiscard]] Numbers whole(const char* name) const {
    const std::string type = header_["arrays"][name][0];
    if (type == "u8") return numbers<std::uint8_t, std::uint32_t>(name);
    if (type == "u16") return numbers<std::uint16_t, std::uint32_t>(name);
    return numbers<std::uint32_t, std::uint32_t>(name);
  }
  template <typename Stored, typename Number = Stored>
  [[nodiscard]] std::vector<Number> numbers(const char* name) const {
    const json& place = header_["arrays"][name];
    std::vector<Stored> stored(place[2].get<std::size_t>());
    if (!stored.empty())
      std::memcpy(stored.data(), arrays_ + place[1].get<std::size_t>(), stored.size() * sizeof(Stored));
    const std::size_t stride = place[3];
    if constexpr (std::is_integral_v<Stored>)
      for (std::size_t i = stride; stride > 0 && i < stored.size(); ++i)
        stored[i] = static_cast<Stored>(stored[i] + stored[i - stride]);
    return {stored.begin(), stored.end()};
  }

 private:
  json header_;
  const char* arrays_;
};

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
    if (from.has("parts")) old_parts_ = from.whole("parts");
    if (from.has("tints")) old_tints_ = from.whole("tints");
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
    if (!old_parts_.empty()) message.add("parts", parts);
    if (!old_tints_.empty()) message.add("tints", tints);
  }

 private:
  static constexpr std::uint32_t unused = 0xffffffffU;
  double step_;
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
struct Left {
  Numbers triangles, counts, owners;  ///< `owners`: those of the message that have some
  std::size_t opaque = 0, in_cells = 0;
};

Left left_of(const Received& from, const char* counts, const CoarseVertices& vertices) {
  const Numbers triangles = from.whole("triangles"), of_owner = from.whole(counts);
  const std::size_t in_cells = from.header().value("inCells", std::size_t{0});
  Left left;
  std::size_t at = 0;
  for (std::uint32_t owner = 0; owner < of_owner.size(); ++owner) {
    std::uint32_t count = 0;
    for (const std::size_t end = at + 3 * std::size_t{of_owner[owner]}; at < end; at += 3) {
      const std::uint32_t a = vertices[triangles[at]], b = vertices[triangles[at + 1]],
                          c = vertices[triangles[at + 2]];
      if (a == b || b == c || c == a) continue;
      left.triangles.insert(left.triangles.end(), {a, b, c});
      ++count;
    }
    if (count == 0) continue;
    left.owners.push_back(owner);
    left.counts.push_back(count);
    if (owner < in_cells) {
      ++left.in_cells;
      left.opaque += count;
    }
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

/// The shortest side of a triangle, by its extent along an axis; in steps.
std::uint32_t shortest_side(const Numbers& places, const Numbers& corners) {
  std::uint32_t shortest = 0xffff;
  for (std::size_t at = 0; at < corners.size(); ++at) {
    const std::size_t next = at % 3 == 2 ? at - 2 : at + 1;
    std::uint32_t side = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t p = places[3 * corners[at] + i], q = places[3 * corners[next] + i];
      side = std::max(side, p > q ? p - q : q - p);
    }
    shortest = std::min(shortest, side);
  }
  return shortest;
}

/// How many triangles do not collapse at levels from that of a message to a last one. One that does is taken
/// to stay so.
Numbers triangles_left(const Received& from, int last) {
  const Numbers places = from.whole("positions");
  Numbers corners = from.whole("triangles");
  const int finest = from.header()["finest"];
  const double step = from.header()["step"];
  const Point origin = from.header()["origin"];
  // Points that are a step apart stay so.
  int level = std::max(finest, std::ilogb(step) + std::ilogb(std::max(1U, shortest_side(places, corners))));
  Numbers counts(static_cast<std::size_t>(std::max(0, std::min(level, last) - finest) + 1),
                 static_cast<std::uint32_t>(corners.size() / 3));
  std::vector<std::int32_t> coarse(places.size());
  while (++level <= last && counts.back() > 0) {
    const double scale = std::exp2(-level);
    for (std::size_t i = 0; i < places.size(); ++i)
      coarse[i] = static_cast<std::int32_t>(std::round((origin[i % 3] + step * places[i]) * scale) -
                                            std::floor(origin[i % 3] * scale));
    const auto are_one = [&](std::uint32_t a, std::uint32_t b) {
      return std::equal(&coarse[3 * a], &coarse[3 * a] + 3, &coarse[3 * b]);
    };
    std::size_t left = 0;
    for (std::size_t at = 0; at < corners.size(); at += 3) {
      const std::array<std::uint32_t, 3> triangle{corners[at], corners[at + 1], corners[at + 2]};
      const auto& [a, b, c] = triangle;
      if (are_one(a, b) || are_one(b, c) || are_one(c, a)) continue;
      for (const std::uint32_t corner : triangle) corners[left++] = corner;
    }
    corners.resize(left);
    counts.push_back(static_cast<std::uint32_t>(left / 3));
  }
  return counts;
}

Detail detail_of(const Received& from) {
  const json& header = from.header();
  Detail detail;
  const bool is_piece = header["kind"] == "piece";
  detail.kind = is_piece ? Detail::Kind::surface : Detail::Kind::cells;
  detail.run = header["run"];
  detail.number = header[is_piece ? "piece" : "region"];
  if (is_piece) detail.part = header["part"];
  detail.lower = header["box"][0];
  detail.upper = header["box"][1];
  detail.finest = header["finest"];
  double extent = 0;
  for (std::size_t i = 0; i < 3; ++i) extent = std::max(extent, detail.upper[i] - detail.lower[i]);
  constexpr int halvings = 3;  // it has 8 to 16 steps then
  detail.coarsest = extent > 0 ? std::max(detail.finest, std::ilogb(extent) - halvings) : detail.finest;
  detail.triangles = triangles_left(from, extent > 0 ? std::ilogb(extent) : detail.finest);
  detail.coarser = coarser;
  return detail;
}

}  // namespace

std::string coarser(const std::string& bytes, int level) {
  const Received from(bytes);
  const bool is_piece = from.header()["kind"] == "piece";
  const char* counts = is_piece ? "ofFace" : "ofCell";
  Message message = begun(from.header());
  const CoarseVertices vertices(from, level == Detail::nothing ? from.header()["finest"].get<int>() : level);
  Left left;
  Numbers edges;
  if (level != Detail::nothing) {
    left = left_of(from, counts, vertices);
    edges = edges_left(from, vertices);
  }
  vertices.write(message, left.triangles, edges);
  message.add_indices("triangles", left.triangles, 1);
  if (is_piece) message.add_indices("edges", edges, 1);
  message.add_small(counts, left.counts);
  for (const char* name : {"faces", "solids", "areas", "cellParts", "levels", "volumes"})
    if (from.has(name)) add_chosen(message, from, name, left.owners);
  if (!is_piece) {
    message["opaque"] = left.opaque;
    message["inCells"] = left.in_cells;
  }
  return message.bytes();
}

void put_detailed(Scene& scene, const std::string& key, std::string bytes) {
  auto detail = std::make_shared<const Detail>(detail_of(Received(bytes)));
  scene.put(key, std::move(bytes), std::move(detail));
}

}  // namespace bsp2::api
