#include "bsp2/geometry/surface/skin_share.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "faces/brep_piece.hpp"
#include "surface/face_triangulation.hpp"
#include "surface/no_index.hpp"
#include "surface/skin_steps.hpp"
#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {

namespace {

/// Who decides whose own a face is.
std::size_t place_of(const Skin::Face& face, std::size_t shares) {
  return (std::uint64_t{face.outward.code} * 0x9e3779b97f4a7c15u >> 32) % shares;
}

/// Holds the exact edge.
CertainBox box_of(const PointSet& points, const Skin::Edge& edge) {
  CertainBox box = CertainBox::empty();
  box.add(points.vertices[edge.from]);
  box.add(points.vertices[edge.to]);
  return box;
}

/// Takes some edges out of a skin, with their ends and faces, which stay in their order.
class Extract {
 public:
  Extract(std::size_t vertices, std::size_t faces) : vertex_(vertices, none), face_(faces, none) {}

  /// @param name, planes of a vertex.
  template <typename NameOf, typename PlanesOf>
  Skin take(const Skin& skin, std::span<const std::uint32_t> edges, const NameOf& name,
            const PlanesOf& planes) {
    std::vector<std::uint32_t> vertices, faces;
    for (const std::uint32_t edge : edges) {
      const Skin::Edge& e = skin.edges[edge];
      note(e.from, vertex_, vertices);
      note(e.to, vertex_, vertices);
      note(e.face, face_, faces);
    }
    number(vertices, vertex_);
    number(faces, face_);
    Skin part;
    for (const std::uint32_t vertex : vertices) {
      part.vertices.push_back(name(vertex));
      const auto known = planes(vertex);
      part.incident.insert(part.incident.end(), known.begin(), known.end());
      part.incident_offset.push_back(static_cast<std::uint32_t>(part.incident.size()));
    }
    for (const std::uint32_t face : faces) part.faces.push_back(skin.faces[face]);
    for (const std::uint32_t edge : edges) {
      const Skin::Edge& e = skin.edges[edge];
      part.edges.push_back({vertex_[e.from], vertex_[e.to], face_[e.face], e.across});
    }
    for (const std::uint32_t vertex : vertices) vertex_[vertex] = none;
    for (const std::uint32_t face : faces) face_[face] = none;
    return part;
  }

 private:
  std::vector<std::uint32_t> vertex_, face_;  // new numbers

  static void note(std::uint32_t index, std::vector<std::uint32_t>& numbers,
                   std::vector<std::uint32_t>& list) {
    if (numbers[index] != none) return;
    numbers[index] = 0;
    list.push_back(index);
  }
  static void number(std::vector<std::uint32_t>& list, std::vector<std::uint32_t>& numbers) {
    std::sort(list.begin(), list.end());
    for (std::uint32_t i = 0; i < list.size(); ++i) numbers[list[i]] = i;
  }
};

void tell(const ToldShare& told, double done) {
  Interruption::check();
  if (told) told(done);
}

}  // namespace

struct SkinShare::Implementation {
  Implementation(const HyperplaneTable<3>& t, std::uint32_t own, std::uint32_t all, unsigned threads_of_it)
      : table(t), share(own), shares(all), threads(threads_of_it) {}
  const HyperplaneTable<3>& table;
  std::uint32_t share, shares;
  unsigned threads;
  ExactPoints exact{table};
  Skin skin;  // with vertices until there are points
  PointSet points;
  std::size_t own_faces = 0;  // they come first, then those of which there are only some edges
  BoxGroups groups;           // of the own edges
  bool is_divided = false;    // the edges, at all points that are ends of others
  FaceTriangles triangles;
  std::size_t own_edges = 0, triangulated_points = 0;
  bool has_crossings = false;

  void divide(const ToldShare& told) {
    unite_points(table, points, skin);
    tell(told, 0.25);
    add_up_lines(exact, threads, points, skin);
    add_up(skin.edges);
    tell(told, 0.4);
    EdgeSplitter(exact, threads).split(points, skin.faces, skin.edges);
    add_up(skin.edges);
    tell(told, 0.55);
    join_straight_edges(exact, threads, points, own_faces, skin);
    tell(told, 0.7);
  }

  void divide(std::span<const Name> crossings) {
    PointSet all;
    for (std::size_t point = 0; point < triangulated_points; ++point)
      all.add(points.vertices[point], points.planes_of(point));
    for (const Name& name : crossings) {
      const Vertex<3> vertex = canonical_vertex(table, name);
      all.add(vertex, vertex.hyperplanes);
    }
    points = std::move(all);
    const std::size_t undivided = count_own_edges();
    divide_at(exact, points, triangulated_points, skin);
    if (has_crossings && count_own_edges() <= undivided)
      throw std::logic_error("edges of a face of the boundary that cross cannot be divided");
  }

  [[nodiscard]] BoxGroups::BoxOf box_of_edge() const {
    return [this](std::uint32_t edge) { return box_of(points, skin.edges[edge]); };
  }
  [[nodiscard]] std::size_t count_own_edges() const {
    return static_cast<std::size_t>(std::count_if(skin.edges.begin(), skin.edges.end(),
                                                  [&](const auto& edge) { return edge.face < own_faces; }));
  }

  /// Points that others may have, too.
  [[nodiscard]] std::vector<bool> shared_points() const {
    std::vector<bool> is_shared(points.size());
    for (std::size_t i = own_edges; i < skin.edges.size(); ++i)
      is_shared[skin.edges[i].from] = is_shared[skin.edges[i].to] = true;
    return is_shared;
  }

  /// The own faces; they are gone then.
  TriangulatedSkin take_skin() {
    skin.edges.resize(own_edges);
    return with_surface({std::move(points), std::move(skin.faces), std::move(skin.edges), {}, {}, {}},
                        std::exchange(triangles, {}));
  }
};

SkinShare::SkinShare(const HyperplaneTable<3>& table, Skin skin, unsigned share, unsigned shares,
                     unsigned threads)
    : implementation_(std::make_unique<Implementation>(table, share, shares, threads)) {
  implementation_->skin = std::move(skin);
  sort_faces(implementation_->skin);
}
SkinShare::~SkinShare() = default;

std::vector<std::vector<SkinShare::Claim>> SkinShare::claims() const {
  const Skin& skin = implementation_->skin;
  const std::uint32_t shares = implementation_->shares;
  std::vector<std::uint32_t> edges(skin.faces.size());
  for (const Skin::Edge& edge : skin.edges) ++edges[edge.face];
  std::vector<std::vector<Claim>> claims(shares);
  for (std::size_t face = 0; face < skin.faces.size(); ++face)
    claims[place_of(skin.faces[face], shares)].push_back({skin.faces[face], edges[face]});
  return claims;
}

std::vector<std::vector<SkinShare::Decision>> SkinShare::decide(
    const std::vector<std::vector<Claim>>& claims) {
  struct Entry {
    Claim claim;
    std::uint32_t share;
  };
  std::vector<Entry> entries;
  for (std::uint32_t share = 0; share < claims.size(); ++share)
    for (const Claim& claim : claims[share]) entries.push_back({claim, share});
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return is_before(a.claim.face, b.claim.face); });
  std::vector<std::vector<Decision>> decisions(claims.size());
  for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    std::size_t most = begin;
    for (; end < entries.size() && entries[end].claim.face == entries[begin].claim.face; ++end)
      if (entries[end].claim.edges > entries[most].claim.edges) most = end;
    if (end - begin < 2) continue;
    for (std::size_t i = begin; i < end; ++i)
      decisions[entries[i].share].push_back({entries[i].claim.face, entries[most].share});
  }
  return decisions;
}

std::vector<Skin> SkinShare::hand_over(std::span<const Decision> decisions) {
  Implementation& mine = *implementation_;
  Skin& skin = mine.skin;
  std::vector<std::uint32_t> owner(skin.faces.size(), mine.share);
  for (const Decision& decision : decisions) {
    const auto at = std::lower_bound(skin.faces.begin(), skin.faces.end(), decision.face, is_before);
    if (at != skin.faces.end() && *at == decision.face)
      owner[static_cast<std::size_t>(at - skin.faces.begin())] = decision.owner;
  }
  std::vector<std::vector<std::uint32_t>> edges(mine.shares);
  for (std::uint32_t i = 0; i < skin.edges.size(); ++i)
    if (const std::uint32_t to = owner[skin.edges[i].face]; to != mine.share) edges[to].push_back(i);
  std::vector<Skin> parts(mine.shares);
  Extract extract(skin.vertices.size(), skin.faces.size());
  for (std::size_t to = 0; to < parts.size(); ++to)
    if (!edges[to].empty())
      parts[to] = extract.take(
          skin, edges[to], [&](std::uint32_t vertex) { return skin.vertices[vertex]; },
          [&](std::uint32_t vertex) {
            return std::span(skin.incident)
                .subspan(skin.incident_offset[vertex],
                         skin.incident_offset[vertex + std::size_t{1}] - skin.incident_offset[vertex]);
          });
  std::erase_if(skin.edges, [&](const Skin::Edge& edge) { return owner[edge.face] != mine.share; });
  return parts;
}

void SkinShare::take_over(const Skin& faces) { implementation_->skin.append(faces); }

std::vector<CertainBox> SkinShare::boxes() {
  Implementation& mine = *implementation_;
  sort_faces(mine.skin);
  mine.skin.weld();
  mine.points = take_points(mine.table, mine.threads, mine.skin);
  mine.own_faces = mine.skin.faces.size();
  mine.groups.make(mine.skin.edges.size(), mine.box_of_edge());
  return mine.groups.boxes();
}

std::vector<Skin> SkinShare::neighbours(const std::vector<std::vector<CertainBox>>& boxes) const {
  const Implementation& mine = *implementation_;
  std::vector<Skin> parts(mine.shares);
  Extract extract(mine.points.size(), mine.skin.faces.size());
  for (std::size_t to = 0; to < parts.size(); ++to) {
    if (to == mine.share) continue;
    const std::vector<std::uint32_t> edges = mine.groups.touching(boxes[to], mine.box_of_edge());
    if (!edges.empty())
      parts[to] = extract.take(
          mine.skin, edges, [&](std::uint32_t point) { return mine.points.vertices[point].hyperplanes; },
          [&](std::uint32_t point) { return mine.points.planes_of(point); });
  }
  return parts;
}

void SkinShare::take_neighbours(const Skin& edges) {
  if (edges.edges.empty()) return;
  Implementation& mine = *implementation_;
  Skin some = edges;
  const PointSet points = take_points(mine.table, mine.threads, some);
  const auto first_point = static_cast<std::uint32_t>(mine.points.size()),
             first_face = static_cast<std::uint32_t>(mine.skin.faces.size());
  for (std::size_t point = 0; point < points.size(); ++point)
    mine.points.add(points.vertices[point], points.planes_of(point));
  mine.skin.faces.insert(mine.skin.faces.end(), some.faces.begin(), some.faces.end());
  for (const Skin::Edge& edge : some.edges)
    mine.skin.edges.push_back(
        {first_point + edge.from, first_point + edge.to, first_face + edge.face, edge.across});
}

std::vector<SkinShare::Name> SkinShare::triangulate(std::span<const Name> crossings, const ToldShare& told) {
  Implementation& mine = *implementation_;
  if (!mine.is_divided)
    mine.divide(told);
  else
    mine.divide(crossings);
  mine.is_divided = true;
  rename_points(mine.exact, mine.threads, mine.points, mine.skin);
  mine.own_edges = mine.count_own_edges();
  mine.triangulated_points = mine.points.size();
  mine.triangles = triangulated_faces(mine.exact, mine.threads, mine.points, mine.skin.faces,
                                      std::span(mine.skin.edges).first(mine.own_edges), [](std::size_t) {});
  tell(told, 1);
  std::vector<Name> found;
  for (std::size_t point = mine.triangulated_points; point < mine.points.size(); ++point)
    found.push_back(mine.points.vertices[point].hyperplanes);
  mine.has_crossings = !found.empty();
  return found;
}

SurfacePiece SkinShare::take() {
  const auto is_shared = implementation_->shared_points();
  return surface_piece_of(implementation_->take_skin(),
                          [&](std::uint32_t point) { return is_shared[point]; });
}

BrepPiece SkinShare::take_faces() {
  const auto is_shared = implementation_->shared_points();
  return brep_piece_of(implementation_->exact, implementation_->take_skin(),
                       [&](std::uint32_t point) { return is_shared[point]; });
}

}  // namespace bsp2::geometry
