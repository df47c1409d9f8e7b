#include "bsp2/geometry/cells/clipper.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "cells/space_cell.hpp"
#include "exact/filter.hpp"

namespace bsp2::geometry {

// --- any dimension ---

template <int D>
Position Clipper<D>::cut(OrientedHyperplane plane, Cell<D>* rest) {
  const Position where = splitter_->classify(cell_, plane.id());
  if (where != Position::crossing)
    return (where == Position::negative) != plane.flipped() ? Position::negative : Position::positive;
  Cell<D> kept;
  if (plane.flipped())
    splitter_->split(cell_, plane.id(), rest, &kept);
  else
    splitter_->split(cell_, plane.id(), &kept, rest);
  cell_ = std::move(kept);
  return Position::crossing;
}

template <int D>
std::array<double, D> Clipper<D>::centre() const {
  std::array<double, D> sum{};
  for (const Vertex<D>& vertex : cell_.vertices())
    for (int i = 0; i < D; ++i) sum[i] += vertex.x[i];
  for (double& x : sum) x /= static_cast<double>(cell_.vertices().size());
  return sum;
}

// --- three dimensions: faces in place ---

void Clipper<3>::load(const Cell<3>& cell) {
  const auto vertices = cell.vertices();
  vertices_.clear();
  for (auto& column : x_) column.clear();
  vertex_lives_.clear();
  living_vertices_ = 0;
  witness_ = none;
  error_ = 0;
  for (const Vertex<3>& vertex : vertices) add_vertex(vertex);
  const std::size_t edges = cell.face_count(1);
  edges_.resize(edges);
  edge_lives_.resize(edges);
  for (std::size_t e = 0; e < edges; ++e) {
    const auto ends = cell.subfaces(1, e);
    const auto hyperplanes = cell.hyperplanes(1, e);
    edges_[e] = {{ends[0], ends[1]}, {0xffff, 0xffff}, {hyperplanes[0], hyperplanes[1]}};
    edge_lives_[e] = 0xff;
  }
  const std::size_t facets = cell.facet_count();
  facets_.resize(facets);
  lists_.clear();
  for (std::size_t f = 0; f < facets; ++f) {
    const auto list = cell.subfaces(2, f);
    facets_[f] = {cell.facet_hyperplane(f).code, static_cast<std::uint32_t>(lists_.size()),
                  static_cast<std::uint32_t>(list.size()), true};
    for (const Index e : list) {
      lists_.push(e);
      edges_[e].facets[edges_[e].facets[0] == 0xffff ? 0 : 1] = static_cast<Index>(f);
    }
  }
}

void Clipper<3>::add_vertex(const Vertex<3>& vertex) {
  vertices_.push(vertex);
  enter_vertex(vertex);
}

/// One that is in `vertices_` already.
void Clipper<3>::enter_vertex(const Vertex<3>& vertex) {
  for (int i = 0; i < 3; ++i) x_[i].push(vertex.x[i]);
  vertex_lives_.push(0xff);
  ++living_vertices_;
  error_ = std::max(error_, vertex.error);
}

std::array<double, 3> Clipper<3>::centre() const {
  std::array<double, 3> sum{};
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    for (int i = 0; i < 3; ++i) sum[i] += vertex_lives_[v] != 0 ? x_[i][v] : 0.0;
  for (double& x : sum) x /= static_cast<double>(living_vertices_);
  return sum;
}

Position Clipper<3>::cut(OrientedHyperplane plane, Cell<3>* rest) {
  const HyperplaneId id = plane.id();
  const std::uint8_t kept = plane.flipped() ? has_positive : has_negative;
  const std::uint8_t sides = find_sides(id);
  if (sides != crosses) {  // a cell with no vertex strictly on one side is on the other one
    const std::uint8_t side = sides == has_positive ? has_positive : has_negative;
    return side == kept ? Position::negative : Position::positive;
  }
  ++splitter_->counts_.splits;
  const std::uint8_t going = crosses ^ kept;
  mark(going);
  cut_edges(id);
  find_common_edges(id);
  if (is_touched_) find_common_facet(going);
  const auto code_for = [&](std::uint8_t side) { return oriented(id, side == has_positive).code; };
  if (rest != nullptr) *rest = pack_going(going, code_for(going));
  drop_going(going, code_for(kept));
  return Position::crossing;
}

/// The side of every vertex. @return on which sides there are vertices.
std::uint8_t Clipper<3>::find_sides(HyperplaneId id) {
  const Hyperplane<3> h = splitter_->table().rounded(id);
  const std::size_t count = vertices_.size();
  const std::size_t padded = (count + 3) / 4 * 4, marked = (count + wide - 1) / wide * wide;
  values_.resize(marked);
  for (auto& column : x_) {  // the last one again
    column.resize(padded);
    for (std::size_t v = count; v < padded; ++v) column[v] = column[count - 1];
    column.resize(count);
  }
  const auto [least, largest] =
      filter::evaluate({x_[0].data(), x_[1].data(), x_[2].data(), count}, h, &values_[0]);
  const double bound = h.error + error_ * (1 + 0x1p-40);
  splitter_->counts_.predicates += living_vertices_;
  if (largest < -bound) return has_negative;
  if (least > bound) return has_positive;
  vertex_mask_.resize(marked);
  std::uint8_t* const mask = vertex_mask_.data();
  const std::uint8_t* const lives = vertex_lives_.data();
  filter::mark(values_.data(), count, bound, mask);
  std::uint8_t all = 0, doubtful = 0;
  for (std::size_t v = 0; v < count; ++v) {
    doubtful |= static_cast<std::uint8_t>(mask[v] == 0 ? 0xff : 0) & lives[v];
    mask[v] &= lives[v];
    all |= mask[v];
  }
  is_touched_ = false;
  if (doubtful == 0) return all;
  for (std::size_t v = 0; v < count; ++v) {
    if (vertex_mask_[v] != 0 || vertex_lives_[v] == 0) continue;
    const int side = splitter_->side(vertices_[v], id, h);
    vertex_mask_[v] = side < 0 ? has_negative : side > 0 ? has_positive : 0;
    all |= vertex_mask_[v];
    is_touched_ = is_touched_ || side == 0;
  }
  return all;
}

/// What has vertices on the side that goes, which of a large cell is little: of the rest nothing is looked at
/// again.
void Clipper<3>::mark(std::uint8_t going) {
  mark_vertices_and_edges(going);
  facet_mask_.resize(facets_.size());
  std::memset(&facet_mask_[0], 0, facets_.size());
  for (std::size_t i = 0; i < going_edges_.size(); ++i) {
    const Edge& edge = edges_[going_edges_[i]];
    const std::uint8_t mask = edge_mask_[going_edges_[i]];
    facet_mask_[edge.facets[0]] |= mask;
    facet_mask_[edge.facets[1]] |= mask;
  }
  if (is_touched_) mark_touched_facets(going);
}

/// Where the plane goes through vertices, a facet may cross it of which no edge does.
void Clipper<3>::mark_touched_facets(std::uint8_t going) {
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    if (facet_mask_[f] != going) continue;
    for (std::uint32_t i = 0; i < facets_[f].count; ++i)
      facet_mask_[f] |= edge_mask_[lists_[facets_[f].begin + i]];
  }
}

void Clipper<3>::mark_vertices_and_edges(std::uint8_t going) {
  const std::uint8_t *const lives = edge_lives_.data(), *const of_vertex = vertex_mask_.data();
  const std::size_t vertices = vertices_.size(), edges = edges_.size();
  going_vertices_.resize(vertices);
  std::size_t found = 0;
  for (std::size_t v = 0; v < vertices; ++v) {  // without branches: there is no telling which ones go
    going_vertices_[found] = static_cast<Index>(v);
    found += of_vertex[v] == going ? 1 : 0;
  }
  going_vertices_.resize(found);
  going_edges_.resize(edges);
  edge_mask_.resize(edges);
  std::uint8_t* const of_edge = &edge_mask_[0];
  const Edge* const all = edges_.data();
  found = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    const std::uint8_t mask = (of_vertex[all[e].ends[0]] | of_vertex[all[e].ends[1]]) & lives[e];
    of_edge[e] = mask;
    going_edges_[found] = static_cast<Index>(e);
    found += (mask & going) != 0 ? 1 : 0;
  }
  going_edges_.resize(found);
}

/// A new vertex, on neither side, for each crossing edge.
void Clipper<3>::cut_edges(HyperplaneId id) {
  cut_vertex_.resize(edges_.size());
  crossing_.resize(going_edges_.size());
  const std::size_t before = vertices_.size();
  std::size_t found = 0;
  for (std::size_t i = 0; i < going_edges_.size(); ++i) {  // without branches
    const std::size_t e = going_edges_[i];
    cut_vertex_[e] = static_cast<Index>(before + found);
    crossing_[found] = edges_[e].hyperplanes;
    found += edge_mask_[e] == crosses ? 1 : 0;
  }
  crossing_.resize(found);
  const std::size_t after = before + found;
  if (after > 0xffff) CellScratch<3>::throw_too_many_faces();
  vertices_.resize(after);
  make_vertices<3>(splitter_->table(), crossing_, id, &vertices_[before], splitter_->counts_.exact_vertices);
  for (std::size_t v = before; v < after; ++v) enter_vertex(vertices_[v]);
  splitter_->counts_.vertices += after - before;
  vertex_mask_.resize(after);
  std::memset(&vertex_mask_[0] + before, 0, after - before);
}

/// The two points in which the plane meets the outline of each crossing facet, where it goes through no
/// vertex: what its two crossing edges are cut in.
void Clipper<3>::find_common_ends() {
  common_ends_.resize(facets_.size());
  ends_found_.resize(facets_.size());
  std::memset(&ends_found_[0], 0, facets_.size());
  for (std::size_t i = 0; i < going_edges_.size(); ++i) {
    const Index e = going_edges_[i];
    if (edge_mask_[e] != crosses) continue;
    for (const Index f : edges_[e].facets)
      common_ends_[f][ends_found_[f]++ & 1] = cut_vertex_[e];  // in ascending order
  }
}

/// The ends of what one facet has in common with the cut, where that goes through vertices.
std::array<std::uint16_t, 2> Clipper<3>::touched_ends(const Facet& facet) const {
  std::array<Index, 2> ends{};
  std::size_t found = 0;
  const auto add = [&](Index vertex) {
    if (found < 2) ends[found] = vertex;
    ++found;
  };
  for (std::uint32_t i = 0; i < facet.count; ++i) {
    const Index e = lists_[facet.begin + i];
    if (edge_mask_[e] == crosses) {
      add(cut_vertex_[e]);
    } else if (edge_mask_[e] == has_negative) {
      for (const Index v : edges_[e].ends)
        if (vertex_mask_[v] == 0) add(v);
    }
  }
  if (found != 2) throw_no_two_points();
  return {std::min(ends[0], ends[1]), std::max(ends[0], ends[1])};
}

/// A new edge for each crossing facet, between the points in which the plane meets the facet's outline. Where
/// no vertex lies on the plane these are the outline of the common facet.
void Clipper<3>::find_common_edges(HyperplaneId id) {
  const std::size_t facets = facets_.size(), before = edges_.size();
  crossing_facets_.resize(facets);
  std::size_t found = 0;
  for (std::size_t f = 0; f < facets; ++f) {  // without branches: there is no telling which ones cross
    crossing_facets_[found] = static_cast<Index>(f);
    found += facet_mask_[f] == crosses ? 1 : 0;
  }
  crossing_facets_.resize(found);
  if (before + found > 0xffff) CellScratch<3>::throw_too_many_faces();
  if (!is_touched_) find_common_ends();
  edges_.resize(before + found);
  edge_lives_.resize(before + found);
  edge_mask_.resize(before + found);
  common_edge_.resize(facets);
  common_list_.resize(found);
  for (std::size_t i = 0; i < found; ++i) {
    const Index f = crossing_facets_[i];
    if (!is_touched_ && ends_found_[f] != 2) throw_no_two_points();
    const auto e = static_cast<Index>(before + i);
    edges_[e] = {is_touched_ ? touched_ends(facets_[f]) : common_ends_[f],
                 {f, static_cast<Index>(facets)},
                 {facets_[f].code >> 1, id}};
    edge_lives_[e] = 0xff;
    edge_mask_[e] = 0;
    common_edge_[f] = common_list_[i] = e;
  }
}

/// The outline of the common facet where vertices lie on the plane: the new edges, and those that lie on the
/// plane already. Each of these belongs to two facets, one a side, and is taken from the negative one.
void Clipper<3>::find_common_facet(std::uint8_t going) {
  common_list_.clear();
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const Facet& facet = facets_[f];
    if (!facet.alive) continue;
    if (facet_mask_[f] == crosses) {
      common_list_.push(common_edge_[f]);
    } else if (facet_mask_[f] == (going == has_negative ? has_negative : 0)) {
      for (std::uint32_t i = 0; i < facet.count; ++i)
        if (edge_mask_[lists_[facet.begin + i]] == 0) common_list_.push(lists_[facet.begin + i]);
    }
  }
  std::size_t corners = 0;
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    corners += vertex_lives_[v] != 0 && vertex_mask_[v] == 0 ? 1 : 0;
  if (common_list_.size() != corners)
    throw std::logic_error("the common facet of two halves has not as many edges as corners");
}

/// What goes, as a cell of its own. Nothing of the cell at hand changes.
Cell<3> Clipper<3>::pack_going(std::uint8_t going, std::uint32_t common_code) {
  const std::uint8_t other = crosses ^ going;
  const std::size_t all_vertices = vertices_.size(), all_edges = edges_.size();
  renumbered_.resize(all_vertices + all_edges);
  Index* const vertex_number = &renumbered_[0];
  Index* const edge_number = vertex_number + all_vertices;
  packed_.resize(all_vertices + all_edges);
  Index* const packed_vertices = &packed_[0];
  Index* const packed_edges = packed_vertices + all_vertices;
  std::size_t vertices = 0, edges = 0, facets = 1;
  for (std::size_t v = 0; v < all_vertices; ++v) {
    vertex_number[v] = static_cast<Index>(vertices);
    packed_vertices[vertices] = static_cast<Index>(v);
    vertices += ((vertex_lives_[v] != 0) & (vertex_mask_[v] != other)) ? 1 : 0;
  }
  const auto add_edge = [&](Index e) {
    edge_number[e] = static_cast<Index>(edges);
    packed_edges[edges++] = e;
  };
  if (is_touched_) {
    for (std::size_t e = 0; e < all_edges; ++e)
      if (edge_lives_[e] != 0 && edge_mask_[e] != other) add_edge(static_cast<Index>(e));
  } else {  // those that go, and the common ones, which are the newest
    for (std::size_t i = 0; i < going_edges_.size(); ++i) add_edge(going_edges_[i]);
    for (std::size_t i = 0; i < common_list_.size(); ++i) add_edge(common_list_[i]);
  }
  for (std::size_t f = 0; f < facets_.size(); ++f) facets += facet_mask_[f] != 0 ? 1 : 0;

  SpaceCell packed(vertices, edges, facets);
  for (std::size_t i = 0; i < vertices; ++i) packed.vertices[i] = vertices_[packed_vertices[i]];
  for (std::size_t i = 0; i < edges; ++i) {
    const Index e = packed_edges[i];
    for (std::size_t k = 0; k < 2; ++k) {
      const Index v = edges_[e].ends[k];
      packed.edge_ends[2 * i + k] = vertex_number[vertex_mask_[v] == other ? cut_vertex_[e] : v];
      packed.edge_hyperplanes[2 * i + k] = edges_[e].hyperplanes[k];
    }
  }
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    if (facet_mask_[f] == 0) continue;
    const Facet& facet = facets_[f];
    for (std::uint32_t i = 0; i < facet.count; ++i) {
      const Index e = lists_[facet.begin + i];
      packed.add_facet_edge_if(edge_mask_[e] != other, edge_number[e]);
    }
    if (facet_mask_[f] == crosses) packed.add_facet_edge(edge_number[common_edge_[f]]);
    packed.close_facet(facet.code);
  }
  for (const Index e : common_list_) packed.add_facet_edge(edge_number[e]);
  packed.close_facet(common_code);
  return packed.take();
}

/// Takes away what goes.
void Clipper<3>::drop_going(std::uint8_t going, std::uint32_t common_code) {
  const auto common = static_cast<Index>(facets_.size());
  for (std::size_t f = 0; f < facets_.size(); ++f)
    if (facet_mask_[f] == going) facets_[f].alive = false;
  for (std::size_t i = 0; i < crossing_facets_.size(); ++i)
    shorten(facets_[crossing_facets_[i]], going, common_edge_[crossing_facets_[i]]);
  facets_.push({common_code, static_cast<std::uint32_t>(lists_.size()),
                static_cast<std::uint32_t>(common_list_.size()), true});
  for (const Index e : common_list_) {
    lists_.push(e);
    for (Index& facet : edges_[e].facets)  // of an edge that lay on the plane already
      if (facet != common && !facets_[facet].alive) facet = common;
  }
  bury_edges(going);
  bury_vertices();
  if (vertices_.size() > 2 * living_vertices_ + 16) close_up();
}

/// Takes the edges that go from a crossing facet's outline, and adds the new one.
void Clipper<3>::shorten(Facet& facet, std::uint8_t going, Index new_edge) {
  const std::uint32_t before = facet.begin + facet.count;
  std::uint32_t end = facet.begin;
  for (std::uint32_t i = facet.begin; i < before; ++i) {  // without branches
    const Index e = lists_[i];
    lists_[end] = e;
    end += edge_mask_[e] != going ? 1 : 0;
  }
  if (end == before) {  // moves to the end, where it may grow
    const auto begin = static_cast<std::uint32_t>(lists_.size());
    for (std::uint32_t i = facet.begin; i < end; ++i) lists_.push(Index{lists_[i]});
    lists_.push(new_edge);
    facet.begin = begin;
    ++facet.count;
  } else {
    lists_[end++] = new_edge;
    facet.count = end - facet.begin;
  }
}

void Clipper<3>::bury_edges(std::uint8_t side) {
  for (std::size_t i = 0; i < going_edges_.size(); ++i) {
    const std::size_t e = going_edges_[i];
    if (edge_mask_[e] == side)
      edge_lives_[e] = 0;
    else
      edges_[e].ends[vertex_mask_[edges_[e].ends[0]] == side ? 0 : 1] = cut_vertex_[e];
  }
}

/// The dead go where one lives on, so that they do not widen what is left.
void Clipper<3>::bury_vertices() {
  for (std::size_t i = 0; i < going_vertices_.size(); ++i) vertex_lives_[going_vertices_[i]] = 0;
  living_vertices_ -= going_vertices_.size();
  const auto bury = [&](std::size_t v) {
    for (auto& column : x_) column[v] = column[witness_];
  };
  if (witness_ != none && vertex_lives_[witness_] != 0) {
    for (std::size_t i = 0; i < going_vertices_.size(); ++i) bury(going_vertices_[i]);
    return;
  }
  witness_ = edges_[common_list_[0]].ends[0];
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    if (vertex_lives_[v] == 0) bury(v);
}

/// Fills the holes; the order stays.
void Clipper<3>::close_up() {
  renumbered_.resize(std::max(vertices_.size(), edges_.size()));
  std::size_t vertices = 0;
  witness_ = none;
  error_ = 0;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {  // without branches
    const bool lives = vertex_lives_[v] != 0;
    renumbered_[v] = static_cast<Index>(vertices);
    error_ = std::max(error_, lives ? vertices_[v].error : 0.0);
    for (auto& column : x_) column[vertices] = column[v];
    vertices_[vertices] = Vertex<3>(vertices_[v]);
    vertices += lives ? 1 : 0;
  }
  vertices_.resize(vertices);
  for (auto& column : x_) column.resize(vertices);
  vertex_lives_.resize(vertices);
  if (vertices != 0) std::memset(&vertex_lives_[0], 0xff, vertices);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (edge_lives_[e] != 0)
      for (Index& v : edges_[e].ends) v = renumbered_[v];

  std::size_t edges = 0;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    renumbered_[e] = static_cast<Index>(edges);
    edges_[edges] = Edge(edges_[e]);
    edges += edge_lives_[e] != 0 ? 1 : 0;
  }
  edges_.resize(edges);
  edge_lives_.resize(edges);
  if (edges != 0) std::memset(&edge_lives_[0], 0xff, edges);

  std::size_t facets = 0;
  lists_copy_.clear();
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    if (!facets_[f].alive) continue;
    Facet facet = facets_[f];
    const auto begin = static_cast<std::uint32_t>(lists_copy_.size());
    for (std::uint32_t i = 0; i < facet.count; ++i) {
      const Index e = renumbered_[lists_[facet.begin + i]];
      lists_copy_.push(e);
      for (Index& own : edges_[e].facets)
        if (own == f)
          own = static_cast<Index>(facets);  // facets <= f: no number is met twice in a wrong sense
    }
    facet.begin = begin;
    facets_[facets++] = facet;
  }
  facets_.resize(facets);
  std::swap(lists_, lists_copy_);
}

Cell<3> Clipper<3>::cell() {
  close_up();
  SpaceCell packed(vertices_.size(), edges_.size(), facets_.size());
  std::copy(vertices_.begin(), vertices_.end(), packed.vertices);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    for (std::size_t k = 0; k < 2; ++k) {
      packed.edge_ends[2 * e + k] = edges_[e].ends[k];
      packed.edge_hyperplanes[2 * e + k] = edges_[e].hyperplanes[k];
    }
  for (const Facet& facet : facets_) {
    for (std::uint32_t i = 0; i < facet.count; ++i) packed.add_facet_edge(lists_[facet.begin + i]);
    packed.close_facet(facet.code);
  }
  return packed.take();
}

#define BSP2_INSTANTIATE(D) template class Clipper<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
