#include "surfaces/manifold.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/disjoint_sets.hpp"

namespace bsp2::io {
namespace {

/// Of each corner of the triangles (corner k of triangle t is 3 t + k) the ring of triangles about its point.
std::vector<std::uint32_t> rings_of(const std::vector<HalfEdge>& partner) {
  geometry::DisjointSets sets(partner.size());
  for (HalfEdge h = 0; h < partner.size(); ++h) {
    if (partner[h] == no_half_edge || partner[h] < h) continue;
    sets.unite(h, next_of(partner[h]));
    sets.unite(next_of(h), partner[h]);
  }
  std::vector<std::uint32_t> ring(partner.size());
  for (std::uint32_t corner = 0; corner < ring.size(); ++corner) ring[corner] = sets.find(corner);
  return ring;
}

/// Gives each ring but the first about a point a point of its own. @return which points had several.
template <typename Real>
std::set<std::uint32_t> separate_rings(ManifoldMesh<Real>& mesh, const std::vector<std::uint32_t>& ring_of) {
  std::vector<std::uint32_t> first_ring(mesh.points.size(), no_half_edge);
  std::map<std::uint32_t, std::uint32_t> point_of_ring;  // of all others
  std::set<std::uint32_t> doubled;
  for (std::uint32_t corner = 0; corner < ring_of.size(); ++corner) {
    std::uint32_t& point = mesh.triangles[corner / 3][corner % 3];
    std::uint32_t& first = first_ring[point];
    if (first == no_half_edge) first = ring_of[corner];
    if (first == ring_of[corner]) continue;
    const auto [found, is_new] =
        point_of_ring.try_emplace(ring_of[corner], static_cast<std::uint32_t>(mesh.points.size()));
    doubled.insert(point);
    if (is_new) mesh.points.push_back(Point3Of<Real>(mesh.points[point]));
    point = found->second;
  }
  return doubled;
}

/// Edges that four triangles or more still share, as both ends of several wedges belong to one ring: the
/// point in the middle that each of their half-edges gets.
template <typename Real>
std::map<HalfEdge, std::uint32_t> middles_of(ManifoldMesh<Real>& mesh, const EdgePairs& pairs) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<HalfEdge>> sharing;
  for (const HalfEdge h : pairs.crowded) {
    const HalfEdge next = next_of(h);
    sharing[std::minmax(mesh.triangles[h / 3][h % 3], mesh.triangles[next / 3][next % 3])].push_back(h);
  }
  std::map<HalfEdge, std::uint32_t> middles;
  for (const auto& [ends, half_edges] : sharing) {
    if (half_edges.size() <= 2) continue;
    const Point3Of<Real> a = mesh.points[ends.first], b = mesh.points[ends.second];
    Point3Of<Real> middle;
    for (std::size_t k = 0; k < 3; ++k) middle[k] = static_cast<Real>((double{a[k]} + b[k]) / 2);
    if (middle == a || middle == b) continue;  // nothing is between them
    for (const HalfEdge h : half_edges) {
      if (pairs.partner[h] == no_half_edge || middles.contains(h)) continue;
      middles[h] = middles[pairs.partner[h]] = static_cast<std::uint32_t>(mesh.points.size());
      mesh.points.push_back(middle);
    }
  }
  return middles;
}

/// Takes points into the edges of triangles, each of which becomes two, three or four.
template <typename Real>
void take_in(ManifoldMesh<Real>& mesh, const std::map<HalfEdge, std::uint32_t>& middles) {
  std::set<std::uint32_t> concerned;
  for (const auto& [h, middle] : middles) concerned.insert(h / 3);
  for (const std::uint32_t t : concerned) {
    std::vector<std::uint32_t> outline;
    for (HalfEdge h = 3 * t; h < 3 * t + 3; ++h) {
      outline.push_back(mesh.triangles[t][h % 3]);
      if (const auto middle = middles.find(h); middle != middles.end()) outline.push_back(middle->second);
    }
    // Ears at corners between two middles, so that none is flat; with one middle two triangles from it.
    const std::int32_t owner = mesh.owner[t];
    std::vector<CornerIndices> pieces;
    const auto is_middle = [&](std::uint32_t point) {
      return std::none_of(mesh.triangles[t].begin(), mesh.triangles[t].end(),
                          [&](std::uint32_t corner) { return corner == point; });
    };
    while (outline.size() > 3) {
      const std::size_t n = outline.size();
      for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t before = outline[(i + n - 1) % n], at = outline[i], after = outline[(i + 1) % n];
        if (is_middle(at) || (!is_middle(before) && !is_middle(after))) continue;
        pieces.push_back({before, at, after});
        outline.erase(outline.begin() + static_cast<std::ptrdiff_t>(i));
        break;
      }
    }
    pieces.push_back({outline[0], outline[1], outline[2]});
    mesh.triangles[t] = pieces[0];
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      mesh.triangles.push_back(pieces[i]);
      mesh.owner.push_back(owner);
    }
  }
}

}  // namespace

std::string Touching::told() const {
  if (edges + corners == 0) return "";
  std::string where = edges > 0 ? counted(edges, "# edge[s]") : "";
  if (corners > 0) where += (edges > 0 ? " and " : "") + counted(corners, "# corner[s]");
  return "the solid touches itself in " + where +
         counted(edges + corners,
                 "; [it is|they are] there twice, since many programs want each edge between two triangles; "
                 "the shape is the same");
}

template <typename Real>
void make_manifold(ManifoldMesh<Real>& mesh, Touching& touching) {
  const EdgePairs pairs = pair_edges(mesh.points, mesh.triangles);
  std::set<std::uint32_t> ends;
  for (const HalfEdge h : pairs.crowded) ends.insert(mesh.triangles[h / 3][h % 3]);
  const std::set<std::uint32_t> doubled = separate_rings(mesh, rings_of(pairs.partner));
  touching.edges += pairs.crowded_edges;
  touching.corners += static_cast<std::uint64_t>(std::count_if(
      doubled.begin(), doubled.end(), [&](std::uint32_t point) { return !ends.contains(point); }));
  if (!pairs.crowded.empty()) take_in(mesh, middles_of(mesh, pairs));
}

template void make_manifold(ManifoldMesh<float>&, Touching&);
template void make_manifold(ManifoldMesh<double>&, Touching&);

}  // namespace bsp2::io
