#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <unordered_set>

#include "viewer/levels.hpp"
#include "viewer/received.hpp"
#include "viewer/voxels.hpp"

namespace bsp2::api {
namespace {

using nlohmann::json;
using Point = std::array<double, 3>;

constexpr std::uint32_t few_triangles = 24;  // as Gaze lets everything have

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

/// For each vertex one that it hangs together with by triangles, the same for all that do.
Numbers things_of(std::size_t vertices, const Numbers& corners) {
  Numbers thing(vertices);
  std::iota(thing.begin(), thing.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (thing[v] != v) v = thing[v] = thing[thing[v]];
    return v;
  };
  for (std::size_t at = 0; at < corners.size(); at += 3)
    for (const std::size_t other : {at + 1, at + 2}) {
      const auto [low, high] = std::minmax({root(corners[at]), root(corners[other])});
      thing[high] = low;
    }
  for (std::uint32_t v = 0; v < vertices; ++v) thing[v] = root(v);
  return thing;
}

/// Counts triangles that do not collapse at levels from that of a message to a last one, and finds the last
/// level at which each thing still has some. There, one that does collapse is taken to stay so.
void count_triangles(const Received& from, int last, Detail& detail) {
  const Numbers places = from.whole("positions");
  const Numbers all_corners = from.whole("triangles");
  Numbers corners = all_corners;
  const int finest = from.header()["finest"];
  const double step = from.header()["step"];
  const Point origin = from.header()["origin"];
  // Points that are a step apart stay so.
  int level = std::max(finest, std::ilogb(step) + std::ilogb(std::max(1U, shortest_side(places, corners))));
  Numbers counts(static_cast<std::size_t>(std::max(0, std::min(level, last) - finest) + 1),
                 static_cast<std::uint32_t>(corners.size() / 3));
  detail.whole = std::max(finest, std::min(level, last));
  const Numbers things = things_of(places.size() / 3, corners);
  const auto count_things = [&] {
    std::unordered_set<std::uint32_t> some;
    for (std::size_t at = 0; at < corners.size(); at += 3) some.insert(things[corners[at]]);
    return some.size();
  };
  const std::size_t all_things = count_things();
  std::vector<std::int32_t> coarse(places.size());
  while (++level <= last && counts.back() > 0) {
    const double scale = std::exp2(-level);
    for (std::size_t i = 0; i < places.size(); ++i)
      coarse[i] = static_cast<std::int32_t>(std::round((origin[i % 3] + step * places[i]) * scale) -
                                            std::floor(origin[i % 3] * scale));
    const auto are_one = [&](std::uint32_t a, std::uint32_t b) {
      return std::equal(&coarse[3 * a], &coarse[3 * a] + 3, &coarse[3 * b]);
    };
    const auto has_collapsed = [&](const std::array<std::uint32_t, 3>& triangle) {
      const auto& [a, b, c] = triangle;
      return are_one(a, b) || are_one(b, c) || are_one(c, a);
    };
    std::uint32_t count = 0;
    for (std::size_t at = 0; at < all_corners.size(); at += 3)
      if (!has_collapsed({all_corners[at], all_corners[at + 1], all_corners[at + 2]})) ++count;
    counts.push_back(count);
    std::size_t left = 0;
    for (std::size_t at = 0; at < corners.size(); at += 3) {
      const std::array<std::uint32_t, 3> triangle{corners[at], corners[at + 1], corners[at + 2]};
      if (has_collapsed(triangle)) continue;
      for (const std::uint32_t corner : triangle) corners[left++] = corner;
    }
    corners.resize(left);
    if (detail.whole == level - 1 && count_things() == all_things) detail.whole = level;
  }
  detail.triangles = std::move(counts);
}

/// Likewise at levels of voxels; of as few triangles as two boxes have there need be none.
void count_voxels(const Received& from, Detail& detail) {
  if (detail.triangles.front() <= few_triangles) return;
  std::vector<Voxels> all = voxels_of(from);
  detail.finest_voxels = all.front().exponent() + std::ilogb(from.header()["step"].get<double>());
  for (;;) {
    std::size_t count = 0;
    for (const Voxels& voxels : all) count += voxels.count();
    detail.triangles_of_voxels.push_back(static_cast<std::uint32_t>(count));
    if (std::all_of(all.begin(), all.end(), [](const Voxels& voxels) { return voxels.is_one(); })) return;
    for (Voxels& voxels : all) voxels.coarsen();
  }
}

Detail detail_of(const Received& from) {
  const json& header = from.header();
  Detail detail;
  const bool is_piece = from.is_piece();
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
  count_triangles(from, extent > 0 ? std::ilogb(extent) : detail.finest, detail);
  count_voxels(from, detail);
  detail.coarser = coarser;
  if (is_piece) return detail;
  detail.parts = parts_in(from);
  detail.without = [](const std::string& bytes, const std::set<std::int32_t>& hidden) {
    std::string left = without_parts(bytes, hidden);
    auto of_left = std::make_shared<const Detail>(detail_of(Received(left)));
    return std::pair(std::move(left), std::shared_ptr<const Detail>(std::move(of_left)));
  };
  return detail;
}

}  // namespace

void put_detailed(Scene& scene, const std::string& key, std::string bytes) {
  auto detail = std::make_shared<const Detail>(detail_of(Received(bytes)));
  scene.put(key, std::move(bytes), std::move(detail));
}

}  // namespace bsp2::api
