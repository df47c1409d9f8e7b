#include "complex/complex_maker.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/parallel.hpp"

// 1. Corners of cells are named by three hyperplanes, as resolution has them (docs/resolution.md), and those
//    that are one point are made one.
// 2. Hyperplane by hyperplane the facets of the cells on its two sides are laid over each other.
// 3. Each edge of what comes of that is divided at every point that lies on it.
//
// Points, cells and corners are used in the order in which the cells come, in which what is near in space is
// near in memory. What the result depends on is asked of `PointRegister::rank`.

namespace bsp2::meshing {

using geometry::ExactPoints;
using geometry::HyperplaneId;

ComplexMaker::ComplexMaker(const geometry::HyperplaneTable<3>& table, std::vector<HyperplaneId> families,
                           unsigned threads)
    : table_(table),
      threads_(threads),
      exact_(table),
      points_(exact_),
      loader_(exact_, points_, std::move(families)) {}

geometry::CertainBox ComplexMaker::box_of(std::uint32_t cell) const {
  geometry::CertainBox box = geometry::CertainBox::empty();
  const CellFacets& facets = loader_.facets();
  for (std::uint32_t k = facets.cell_offset[cell]; k < facets.cell_offset[cell + std::size_t{1}]; ++k)
    box.add(points_.points().vertices[facets.cell_points[k]]);
  return box;
}

Complex ComplexMaker::run() {
  make_pieces();
  facets_.cell_points = decltype(facets_.cell_points)();  // its memory, too
  divide_faces();
  reserve();
  write_faces([this](const Face& face, std::vector<std::uint32_t>& cycle) { add_face(face, cycle); });
  drop_unused_points();
  return std::move(complex_);
}

ComplexPiece ComplexMaker::run(const Shares& shares) {
  make_pieces();
  // Corners of what touches own cells divide these cells' edges, too.
  std::erase_if(pieces_, [&](const PlanePiece& piece) {
    return !shares.is_near(piece.negative) && !shares.is_near(piece.positive);
  });
  std::vector<std::int32_t> at_place(place_.size());
  for (std::size_t cell = 0; cell < place_.size(); ++cell)
    at_place[place_[cell]] = static_cast<std::int32_t>(cell);
  divide_faces();
  ComplexPiece result;
  std::vector<std::uint8_t> use(points_.points().size());  // by rank
  write_cells(shares, use, result);
  write_faces([&](const Face& face, const std::vector<std::uint32_t>& cycle) {
    std::uint8_t bits = used;
    const auto cell_at = [&](std::uint32_t place) {
      return place == none ? Complex::outside : at_place[place];
    };
    const std::int32_t negative = cell_at(face.is_reversed ? face.neighbour : face.owner),
                       positive = cell_at(face.is_reversed ? face.owner : face.neighbour);
    if (!shares.gives(negative, positive)) return;
    for (const std::int32_t cell : {negative, positive})
      if (cell != Complex::outside && static_cast<std::uint32_t>(cell) < shares.count &&
          shares.is_shared[static_cast<std::size_t>(cell)])
        bits |= shared;
    result.negative.push_back(shares.number(negative));
    result.positive.push_back(shares.number(positive));
    result.plane.push_back(face.plane);
    for (const std::uint32_t point : cycle) {
      const std::uint32_t rank = points_.rank(point);
      use[rank] |= bits;
      result.face_points.push_back(rank);
    }
    result.face_offset.push_back(static_cast<std::uint32_t>(result.face_points.size()));
  });
  write_points(use, result);
  return result;
}

/// What cells have in common, and the order of cells.
void ComplexMaker::make_pieces() {
  facets_ = loader_.take();
  renumber(points_.unify());
  lay_over();
  renumber(points_.unify());
  order_cells();
}

void ComplexMaker::divide_faces() {
  order_faces();
  find_sides();
  divide_sides();
}

/// Corners get ranks for numbers, until it is known which are in use.
void ComplexMaker::write_cells(const Shares& shares, std::vector<std::uint8_t>& use,
                               ComplexPiece& piece) const {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(shares.count);
  for (std::uint32_t cell = 0; cell < shares.count; ++cell) order[cell] = {place_[cell], cell};
  std::sort(order.begin(), order.end());
  for (const auto& [place, cell] : order) {
    piece.cells.push_back(shares.first + cell);
    piece.part.push_back(facets_.part[cell]);
    for (std::uint32_t k = facets_.cell_offset[cell]; k < facets_.cell_offset[cell + std::size_t{1}]; ++k) {
      const std::uint32_t rank = facets_.cell_points[k];
      use[rank] |= shares.is_shared[cell] ? used | shared : used;
      piece.corners.push_back(rank);
    }
    piece.corner_offset.push_back(static_cast<std::uint32_t>(piece.corners.size()));
  }
}

void ComplexMaker::write_points(const std::vector<std::uint8_t>& use, ComplexPiece& piece) const {
  const auto& vertices = points_.points().vertices;
  std::vector<std::uint32_t> at_rank(use.size()), number(use.size(), none);
  for (std::uint32_t point = 0; point < use.size(); ++point) at_rank[points_.rank(point)] = point;
  for (std::uint32_t rank = 0; rank < use.size(); ++rank) {
    if (use[rank] == 0) continue;
    number[rank] = static_cast<std::uint32_t>(piece.points.size());
    const geometry::Vertex<3>& vertex = vertices[at_rank[rank]];
    if ((use[rank] & shared) != 0) {
      piece.shared.push_back(number[rank]);
      piece.names.push_back(vertex.hyperplanes);
    }
    piece.points.push_back(vertex.x);
    for (double& x : piece.points.back()) x += 0.0;  // no -0
  }
  for (std::uint32_t& corner : piece.corners) corner = number[corner];
  for (std::uint32_t& point : piece.face_points) point = number[point];
}

void ComplexMaker::renumber(const std::vector<std::uint32_t>& map) {
  for (PolygonCorner& corner : facets_.corners) corner.point = map[corner.point];
  for (std::uint32_t& point : facets_.cell_points) point = map[point];
}

/// Cells by their points: batches come in an order that depends on who computed what.
void ComplexMaker::order_cells() {
  const std::size_t cells = facets_.cells();
  std::vector<std::uint32_t>& ranks = facets_.cell_points;  // nobody asks for the points any more
  const auto ranks_of = [&](std::uint32_t cell) {
    return std::span(ranks).subspan(facets_.cell_offset[cell],
                                    facets_.cell_offset[cell + 1] - facets_.cell_offset[cell]);
  };
  for (std::uint32_t& rank : ranks) rank = points_.rank(rank);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(cells);  // lowest rank, cell
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const auto own = ranks_of(cell);
    std::sort(own.begin(), own.end());
    order[cell] = {own[0], cell};
  }
  std::sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first
                              : std::ranges::lexicographical_compare(ranks_of(a.second), ranks_of(b.second));
  });
  place_.resize(cells);
  complex_.part.resize(cells);
  for (std::uint32_t i = 0; i < cells; ++i) {
    place_[order[i].second] = i;
    complex_.part[i] = facets_.part[order[i].second];
  }
}

void ComplexMaker::lay_over() {
  // Facets by planes, by counting.
  const std::size_t facets = facets_.size();
  std::vector<std::uint32_t> begin(facets_.planes.size() + 1), order(facets);
  for (std::size_t i = 0; i < facets; ++i) ++begin[facets_.facets[i].plane + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::uint32_t i = 0; i < facets; ++i) order[begin[facets_.facets[i].plane]++] = i;
  std::vector<std::uint32_t> ends;  // of the facets of each plane that has some
  std::uint32_t first = 0;
  for (const std::uint32_t end : begin)
    if (end != first) ends.push_back(first = end);
  // By ranges of planes with as many facets each.
  const std::size_t grain = threads_ <= 1 ? facets : std::max<std::size_t>(1024, facets / (16 * threads_));
  std::vector<std::size_t> ranges{0};
  for (std::size_t plane = 0; plane < ends.size(); ++plane)
    if (ends[plane] - (ranges.back() > 0 ? ends[ranges.back() - 1] : 0) >= grain || plane + 1 == ends.size())
      ranges.push_back(plane + 1);
  std::vector<PlaneOverlay::Result> results(ranges.size() - 1);
  geometry::for_each_range(results.size(), 1, threads_, [&](std::size_t range, std::size_t) {
    ExactPoints exact(table_);
    PlaneOverlay overlay(exact, points_, facets_);
    for (std::size_t plane = ranges[range]; plane < ranges[range + 1]; ++plane) {
      geometry::Interruption::check();
      const std::uint32_t from = plane > 0 ? ends[plane - 1] : 0;
      overlay.run(std::span(order).subspan(from, ends[plane] - from), results[range]);
    }
  });
  put_together(results);
}

/// What ranges of planes have numbered for themselves.
void ComplexMaker::put_together(std::vector<PlaneOverlay::Result>& results) {
  const std::size_t points = points_.points().size(), corners = facets_.corners.size();
  std::size_t pieces = 0, more = 0;
  for (const PlaneOverlay::Result& result : results) {
    pieces += result.pieces.size();
    more += result.corners.size();
  }
  facets_.corners.reserve(corners + more);
  pieces_.reserve(pieces);
  for (PlaneOverlay::Result& result : results) {
    const auto shift = static_cast<std::uint32_t>(facets_.corners.size() - corners);
    for (PlanePiece& piece : result.pieces) {
      if (piece.begin >= corners) piece.begin += shift;
      pieces_.push_back(piece);
    }
    const auto moved = static_cast<std::uint32_t>(points_.append(result.points) - points);
    for (PolygonCorner corner : result.corners) {
      if (corner.point >= points) corner.point += moved;
      facets_.corners.push_back(corner);
    }
    result = {};
  }
}

std::span<const PolygonCorner> ComplexMaker::polygon(const Face& face) const {
  return std::span(facets_.corners).subspan(face.begin, face.count);
}

/// The corner of a face whose point comes first: where a cycle begins depends on who wrote the cell.
std::size_t ComplexMaker::first_corner(const Face& face) const {
  const auto corners = polygon(face);
  std::size_t first = 0;
  for (std::size_t k = 1; k < corners.size(); ++k)
    if (points_.rank(corners[k].point) < points_.rank(corners[first].point)) first = k;
  return first;
}

/// By owner, then neighbour; a total order: several faces may be between a cell and the outside.
void ComplexMaker::order_faces() {
  std::vector<std::uint32_t> begin(facets_.cells() + 1);
  const auto place = [&](std::int32_t cell) {
    return cell == Complex::outside ? none : place_[static_cast<std::size_t>(cell)];
  };
  for (const PlanePiece& piece : pieces_) ++begin[std::min(place(piece.negative), place(piece.positive)) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  faces_.resize(pieces_.size());
  for (const PlanePiece& piece : pieces_) {
    const std::uint32_t negative = place(piece.negative), positive = place(piece.positive);
    const auto [owner, neighbour] = std::minmax(negative, positive);
    faces_[begin[owner]++] = {owner, neighbour, piece.plane, piece.begin, piece.count, positive < negative};
  }
  pieces_ = decltype(pieces_)();  // its memory, too
  const auto corners = [&](const Face& face) {
    const auto points = polygon(face);
    const std::size_t first = first_corner(face), n = points.size();
    return std::tuple(points_.rank(points[first].point), points_.rank(points[(first + 1) % n].point),
                      points_.rank(points[(first + 2) % n].point));
  };
  std::size_t first = 0;
  for (const std::uint32_t end : begin) {
    std::sort(faces_.begin() + static_cast<std::ptrdiff_t>(first),
              faces_.begin() + static_cast<std::ptrdiff_t>(end), [&](const Face& a, const Face& b) {
                const std::pair p(a.neighbour, a.plane), q(b.neighbour, b.plane);
                return p != q ? p < q : corners(a) < corners(b);
              });
    first = end;
  }
}

/// Each edge of the faces once, by its ends.
void ComplexMaker::find_sides() {
  std::size_t count = 0;
  std::vector<std::uint32_t> begin(points_.points().size() + 1, 0);  // of those with each lower end
  for (const Face& face : faces_) {
    const auto corners = polygon(face);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const auto [low, high] =
          std::minmax(corners[k].point, corners[k + 1 < corners.size() ? k + 1 : 0].point);
      if (low == high) throw std::logic_error("an edge of a face has one end only");
      ++begin[low + 1];
    }
    count += corners.size();
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Use> uses(count);
  std::uint32_t at = 0;
  for (std::uint32_t face = 0; face < faces_.size(); ++face) {
    const auto corners = polygon(faces_[face]);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const auto [low, high] =
          std::minmax(corners[k].point, corners[k + 1 < corners.size() ? k + 1 : 0].point);
      uses[begin[low]++] = {high, at++, face};
    }
  }
  segment_of_.resize(count);
  std::uint32_t first = 0, low = 0;
  for (const std::uint32_t end : begin) {
    std::sort(uses.begin() + first, uses.begin() + end);
    for (std::uint32_t i = first, next = first; i < end; i = next) {
      while (next < end && uses[next].high == uses[i].high) ++next;
      add_side(low, std::span(uses).subspan(i, next - i));
    }
    first = end;
    ++low;
  }
}

void ComplexMaker::add_side(std::uint32_t low, std::span<const Use> uses) {
  const Face& face = faces_[uses[0].face];
  const auto corners = polygon(face);
  std::size_t k = 0;
  while (std::minmax(corners[k].point, corners[k + 1 < corners.size() ? k + 1 : 0].point) !=
         std::pair<const std::uint32_t&, const std::uint32_t&>(low, uses[0].high))
    ++k;
  for (const Use& use : uses) segment_of_[use.corner] = static_cast<std::uint32_t>(segments_.size());
  segments_.push_back({low, uses[0].high, face.plane, corners[k].across.id()});
}

/// Finds all points that lie on segments, from the lower end of each on.
void ComplexMaker::divide_sides() {
  geometry::EdgeSplitter splitter(exact_, threads_);
  first_inner_.assign(segments_.size() + 1, 0);
  for (const auto& [segment, point] : splitter.inner_ends(points_.points(), segments_)) {
    inner_.push_back(point);
    ++first_inner_[segment + 1];
  }
  std::partial_sum(first_inner_.begin(), first_inner_.end(), first_inner_.begin());
}

/// @param add takes each face, and its points as seen from the positive side of its plane.
template <typename Add>
void ComplexMaker::write_faces(const Add& add) {
  std::vector<std::uint32_t> cycle;
  const std::uint32_t* segment = segment_of_.data();
  for (const Face& face : faces_) {
    geometry::Interruption::check();
    cycle.clear();
    const auto corners = polygon(face);
    const std::size_t n = corners.size(), first = first_corner(face);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = first + i < n ? first + i : first + i - n;
      const std::uint32_t point = corners[k].point;
      cycle.push_back(point);
      const auto inner = std::span(inner_).subspan(first_inner_[segment[k]],
                                                   first_inner_[segment[k] + 1] - first_inner_[segment[k]]);
      if (point == segments_[segment[k]].from)
        cycle.insert(cycle.end(), inner.begin(), inner.end());
      else
        cycle.insert(cycle.end(), inner.rbegin(), inner.rend());
    }
    segment += n;
    add(face, cycle);
  }
}

void ComplexMaker::reserve() {
  std::size_t corners = segment_of_.size();
  for (const std::uint32_t segment : segment_of_)
    corners += first_inner_[segment + 1] - first_inner_[segment];
  complex_.face_points.reserve(corners);
  complex_.face_offset.reserve(faces_.size() + 1);
  complex_.owner.reserve(faces_.size());
  complex_.neighbour.reserve(faces_.size());
  complex_.plane.reserve(faces_.size());
  complex_.outward.reserve(faces_.size());
}

void ComplexMaker::add_face(const Face& face, std::vector<std::uint32_t>& cycle) {
  if (face.is_reversed) std::reverse(cycle.begin(), cycle.end());
  complex_.face_points.insert(complex_.face_points.end(), cycle.begin(), cycle.end());
  complex_.face_offset.push_back(static_cast<std::uint32_t>(complex_.face_points.size()));
  complex_.owner.push_back(static_cast<std::int32_t>(face.owner));
  complex_.neighbour.push_back(static_cast<std::int32_t>(face.neighbour));
  complex_.plane.push_back(face.plane);
  Point normal = table_.rounded(face.plane).normal;
  if (face.is_reversed)
    for (double& x : normal) x = -x;
  complex_.outward.push_back(normal);
}

void ComplexMaker::drop_unused_points() {
  const auto& vertices = points_.points().vertices;
  std::vector<std::uint32_t> map(vertices.size(), none);
  complex_.points.reserve(vertices.size());
  for (std::uint32_t& point : complex_.face_points) {
    if (map[point] == none) {
      map[point] = static_cast<std::uint32_t>(complex_.points.size());
      complex_.points.push_back(vertices[point].x);
      for (double& x : complex_.points.back()) x += 0.0;  // no -0
    }
    point = map[point];
  }
}

}  // namespace bsp2::meshing
