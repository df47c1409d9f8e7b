#include "surfaces/division.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::io {
namespace {

/// Parts are numbered from -1; here from 0.
std::size_t place_of(std::int32_t owner) { return static_cast<std::size_t>(owner + 1); }

/// @param group of each part, by place: pieces are made in the order of their first parts.
std::vector<PartPiece> pieces_by_group(std::size_t points, const std::vector<CornerIndices>& triangles,
                                       const std::vector<std::int32_t>& owner,
                                       const std::vector<std::uint32_t>& group) {
  std::vector<std::size_t> count(group.size());
  std::vector<bool> is_used(group.size());
  for (const std::int32_t part : owner) {
    ++count[group[place_of(part)]];
    is_used[place_of(part)] = true;
  }
  std::vector<PartPiece> pieces;
  std::vector<std::size_t> piece_of(group.size());
  for (std::size_t place = 0; place < group.size(); ++place) {
    if (!is_used[place]) continue;
    if (std::size_t& piece = piece_of[group[place]]; count[group[place]] > 0) {
      piece = pieces.size();
      pieces.emplace_back().of_whole.reserve(count[group[place]]);
      count[group[place]] = 0;
    }
    pieces[piece_of[group[place]]].owners.push_back(static_cast<std::int32_t>(place) - 1);
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    pieces[piece_of[group[place_of(owner[t])]]].of_whole.push_back(t);
  std::vector<std::uint32_t> number(points, no_half_edge);
  for (PartPiece& piece : pieces) {
    piece.triangles.reserve(piece.of_whole.size());
    for (const std::uint32_t t : piece.of_whole) {
      CornerIndices& corners = piece.triangles.emplace_back(triangles[t]);
      for (std::uint32_t& corner : corners) {
        if (number[corner] == no_half_edge) {
          number[corner] = static_cast<std::uint32_t>(piece.points.size());
          piece.points.push_back(corner);
        }
        corner = number[corner];
      }
    }
    for (const std::uint32_t point : piece.points) number[point] = no_half_edge;
  }
  return pieces;
}

std::size_t places(const std::vector<std::int32_t>& owner) {
  return owner.empty() ? 1 : place_of(*std::max_element(owner.begin(), owner.end())) + 1;
}

std::vector<std::uint32_t> each_by_itself(std::size_t count) {
  std::vector<std::uint32_t> group(count);
  std::iota(group.begin(), group.end(), 0U);
  return group;
}

/// Parts of which one is not closed without the other, by place, each group named by its first part.
std::vector<std::uint32_t> touching_parts(const SingleSurface& surface) {
  std::vector<std::uint32_t> group = each_by_itself(places(surface.owner));
  if (std::adjacent_find(surface.owner.begin(), surface.owner.end(), std::not_equal_to<>()) ==
      surface.owner.end())
    return group;
  const auto root = [&](std::uint32_t i) {
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  };
  struct Use {
    std::uint64_t edge;
    std::uint32_t place;
    int direction;
  };
  std::vector<Use> uses;
  uses.reserve(3 * surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = surface.triangles[t][k], to = surface.triangles[t][(k + 1) % 3];
      const auto [low, high] = std::minmax(from, to);
      uses.push_back({std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(place_of(surface.owner[t])),
                      from < to ? 1 : -1});
    }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.place < b.place;
  });
  for (std::size_t first = 0, end = 0; first < uses.size(); first = end) {
    std::uint32_t open_part = no_half_edge;  // the first one that is not closed at this edge
    while (end < uses.size() && uses[end].edge == uses[first].edge) {
      const std::uint32_t place = uses[end].place;
      int sum = 0;
      for (; end < uses.size() && uses[end].edge == uses[first].edge && uses[end].place == place; ++end)
        sum += uses[end].direction;
      if (sum == 0) continue;
      if (open_part == no_half_edge) open_part = place;
      const std::uint32_t a = root(open_part), b = root(place);
      group[std::max(a, b)] = std::min(a, b);
    }
  }
  for (std::uint32_t i = 0; i < group.size(); ++i) group[i] = root(i);
  return group;
}

/// "a + b + c", not too long.
std::string joined_name(const std::vector<std::int32_t>& owners, const PartLabels& labels) {
  constexpr std::size_t most = 4;
  std::string name;
  for (std::size_t i = 0; i < owners.size() && i < most; ++i)
    name += (i > 0 ? " + " : "") + labels.name(owners[i]);
  if (owners.size() > most) name += " + " + std::to_string(owners.size() - most) + " more";
  return name;
}

/// What becomes of parts that touch. @param parts so many. @param objects that they are now.
std::string told_of(std::size_t parts, std::size_t objects, const std::string& name,
                    const PartLabels& labels) {
  std::string text =
      counted(parts, "# part[s] [touches|touch] ") +
      counted(objects, "[each other|others], and a surface has nothing between parts that touch: ");
  text += counted(objects, "they are # object[s], [|as ]'") + name + "'";
  return text + (labels.are_coloured() ? ", whose triangles have the colours of their parts" : "");
}

}  // namespace

std::vector<PartPiece> pieces_by_part(std::size_t points, const std::vector<CornerIndices>& triangles,
                                      const std::vector<std::int32_t>& owner) {
  return pieces_by_group(points, triangles, owner, each_by_itself(places(owner)));
}

std::vector<PrintedObject> printed_objects(const SingleSurface& surface, const PartLabels& labels,
                                           std::vector<std::string>& notes) {
  std::vector<PrintedObject> objects;
  Touching touching;
  std::size_t joined = 0, groups = 0;  // parts that touch others, and the objects that they are
  std::string example;
  for (PartPiece& piece :
       pieces_by_group(surface.points.size(), surface.triangles, surface.owner, touching_parts(surface))) {
    PrintedObject& object = objects.emplace_back();
    object.name = joined_name(piece.owners, labels);
    if (piece.owners.size() > 1) {
      joined += piece.owners.size();
      ++groups;
      if (example.empty()) example = object.name;
    }
    object.owners = std::move(piece.owners);
    for (const std::uint32_t point : piece.points) object.mesh.points.push_back(surface.points[point]);
    for (const std::uint32_t t : piece.of_whole) object.mesh.owner.push_back(surface.owner[t]);
    object.mesh.triangles = std::move(piece.triangles);
    make_manifold(object.mesh, touching);
  }
  if (joined > 0) notes.push_back(told_of(joined, groups, example, labels));
  if (const std::string told = touching.told(); !told.empty()) notes.push_back(told);
  return objects;
}

}  // namespace bsp2::io
