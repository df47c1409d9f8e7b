#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"
#include "faces/edge_order.hpp"
#include "faces/joined_pieces.hpp"
#include "faces/shell_maker.hpp"
#include "support/counted_order.hpp"
#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

using Order = BrepPiece::Edge::Order;

/// Puts pieces of a complex together: numbers what they have, and decides what none of them could alone.
class BrepJoiner {
 public:
  BrepJoiner(const HyperplaneTable<3>& table, const std::vector<BrepPiece>& pieces,
             const JoinedPieces& joined, Brep& brep)
      : exact_(table), order_(exact_), pieces_(pieces), joined_(joined), brep_(brep) {}

  void run() {
    add_faces();
    find_edges();
    add_edges();
  }

 private:
  /// A piece that is read from its beginning to its end.
  struct Reading {
    std::size_t plane = 0, face = 0, triangle = 0, loop = 0, use = 0;  // the next ones
    std::vector<std::uint32_t> place;                                  // of each use in the complex
  };
  /// An edge as a piece has it.
  struct Found {
    std::array<std::uint32_t, 2> ends;  // the lower one first
    std::uint32_t piece, count;
    Order order;
    std::size_t first_use;  // among the piece's uses_of_edges
    std::size_t detail;     // the first of its angles, or apexes
  };

  ExactPoints exact_;
  EdgeOrder order_;
  const std::vector<BrepPiece>& pieces_;
  const JoinedPieces& joined_;
  Brep& brep_;
  std::vector<Reading> readings_;
  std::vector<const Skin::Face*> plane_of_;         // of each face
  std::vector<std::array<std::uint32_t, 2>> ends_;  // of each use, in the order of the loop
  std::vector<Found> found_;
  // Of the edge at hand.
  struct Open {
    std::uint32_t use;
    SkinShare::Name apex;
  };
  std::vector<Open> open_;
  std::vector<Vertex<3>> apexes_;
  std::vector<FaceAtEdge> faces_;

  void add_faces() {
    for (const BrepPiece& piece : pieces_) readings_.emplace_back().place.resize(piece.uses.size());
    std::size_t uses = 0;
    for (const BrepPiece& piece : pieces_) uses += piece.uses.size();
    brep_.uses.reserve(uses);
    ends_.reserve(uses);
    brep_.triangles.reserve(joined_.surface.triangles.size());
    brep_.face_of_triangle.reserve(joined_.surface.triangles.size());
    std::size_t first_triangle = 0;  // of the plane, in the surface
    for (const std::uint32_t i : joined_.piece_of_face) {
      const BrepPiece& piece = pieces_[i];
      Reading& reading = readings_[i];
      const auto& [face, triangles] = piece.surface.faces[reading.plane];
      const std::size_t in_piece = reading.triangle;  // where those of the plane begin
      for (std::uint32_t n = piece.connected[reading.plane++]; n > 0; --n) {
        const BrepPiece::Face& connected = piece.faces[reading.face++];
        const auto number = static_cast<std::uint32_t>(brep_.faces.size());
        for (std::uint32_t k = 0; k < connected.triangles; ++k) {
          brep_.triangles.push_back(
              joined_.surface.triangles[first_triangle + (piece.triangles[reading.triangle++] - in_piece)]);
          brep_.face_of_triangle.push_back(number);
        }
        add_face(face, i, connected.loops);
      }
      first_triangle += triangles;
    }
  }

  void add_face(const Skin::Face& face, std::uint32_t piece, std::uint32_t loops) {
    auto plane = exact_.table().rounded(face.outward.id());
    if (face.outward.flipped()) plane = plane.opposite();
    brep_.faces.push_back({plane.normal, plane.offset, face.owner, face.other,
                           static_cast<std::uint32_t>(brep_.loops.size()), loops});
    plane_of_.push_back(&face);
    for (; loops > 0; --loops) add_loop(piece);
  }

  /// From its lowest vertex on.
  void add_loop(std::uint32_t number) {
    const BrepPiece& piece = pieces_[number];
    Reading& reading = readings_[number];
    const std::uint32_t count = piece.loops[reading.loop++];
    const auto from = [&](std::size_t k) {
      return joined_.numbers[number][piece.uses[reading.use + k % count]];
    };
    std::size_t lowest = 0;
    for (std::size_t k = 1; k < count; ++k)
      if (from(k) < from(lowest)) lowest = k;
    brep_.loops.push_back({static_cast<std::uint32_t>(brep_.uses.size()), count});
    for (std::size_t k = lowest; k < lowest + count; ++k) {
      reading.place[reading.use + k % count] = static_cast<std::uint32_t>(brep_.uses.size());
      const std::array ends{from(k), from(k + 1)};
      brep_.uses.push_back({none, static_cast<std::uint32_t>(brep_.faces.size() - 1), ends[0] < ends[1], 0});
      ends_.push_back(ends);
    }
    reading.use += count;
  }

  void find_edges() {
    std::size_t edges = 0;
    for (const BrepPiece& piece : pieces_) edges += piece.edges.size();
    found_.reserve(edges);
    for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
      std::size_t use = 0, angle = 0, apex = 0;
      for (const auto& [count, order] : pieces_[i].edges) {
        const auto& ends = ends_[readings_[i].place[pieces_[i].uses_of_edges[use]]];
        std::size_t& detail = order == Order::open ? apex : angle;
        found_.push_back(
            {{std::min(ends[0], ends[1]), std::max(ends[0], ends[1])}, i, count, order, use, detail});
        use += count;
        detail += count;
      }
    }
  }

  void add_edges() {
    const auto by_ends = counted_order(
        found_.size(), [&](std::size_t i) { return found_[i].ends[0]; },
        [&](std::uint32_t a, std::uint32_t b) {
          return std::tie(found_[a].ends, a) < std::tie(found_[b].ends, b);
        });
    brep_.edges.reserve(found_.size());
    brep_.uses_of_edges.reserve(brep_.uses.size());
    for (std::size_t begin = 0, end = 0; begin < by_ends.size(); begin = end) {
      while (end < by_ends.size() && found_[by_ends[end]].ends == found_[by_ends[begin]].ends) ++end;
      const Found& first = found_[by_ends[begin]];
      if (first.order != Order::open) {
        if (end - begin > 1) throw std::logic_error("an edge of one piece is in another one, too");
        add_decided(first);
      } else {
        decide(std::span(by_ends).subspan(begin, end - begin));
      }
    }
  }

  /// @param count of its uses, which are added then.
  std::uint32_t add_edge(const std::array<std::uint32_t, 2>& ends, std::uint32_t count) {
    brep_.edges.push_back({ends, static_cast<std::uint32_t>(brep_.uses_of_edges.size()), count});
    return static_cast<std::uint32_t>(brep_.edges.size() - 1);
  }
  void add_use(std::uint32_t edge, std::uint32_t use, double angle) {
    brep_.uses[use].edge = edge;
    brep_.uses[use].angle = angle;
    brep_.uses_of_edges.push_back(use);
  }

  /// As the piece has it, or the other way round where numbers say that the other end is the higher one.
  void add_decided(const Found& found) {
    const BrepPiece& piece = pieces_[found.piece];
    const std::span uses(piece.uses_of_edges.data() + found.first_use, found.count);
    const std::span angles(piece.angles.data() + found.detail, found.count);
    const auto& place = readings_[found.piece].place;
    const bool is_same = brep_.uses[place[uses[0]]].forward == (found.order == Order::forward);
    const std::uint32_t edge = add_edge(found.ends, found.count);
    for (std::size_t k = 0; k < found.count; ++k) {
      if (is_same) {
        add_use(edge, place[uses[k]], angles[k]);
      } else {
        const std::size_t back = (found.count - k) % found.count;
        add_use(edge, place[uses[back]], angles[(back + found.count - 1) % found.count]);
      }
    }
  }

  /// An edge that several pieces have, or that are several.
  void decide(std::span<const std::uint32_t> numbers) {
    open_.clear();
    apexes_.clear();
    faces_.clear();
    for (const std::uint32_t number : numbers) {
      const Found& found = found_[number];
      const BrepPiece& piece = pieces_[found.piece];
      for (std::size_t k = 0; k < found.count; ++k)
        open_.push_back({readings_[found.piece].place[piece.uses_of_edges[found.first_use + k]],
                         piece.apexes[found.detail + k]});
    }
    std::ranges::sort(open_, {}, &Open::use);
    for (const Open& open : open_) apexes_.push_back(canonical_vertex(exact_.table(), open.apex));
    for (std::size_t k = 0; k < open_.size(); ++k) {
      const Brep::Use& use = brep_.uses[open_[k].use];
      faces_.push_back({open_[k].use, use.forward, plane_of_[use.face], &apexes_[k]});
    }
    order_.sort(faces_);
    const bool is_one = EdgeOrder::are_about_one_edge(faces_) || !EdgeOrder::make_pairs(faces_);
    const std::size_t count = is_one ? faces_.size() : 2;
    for (std::size_t first = 0; first < faces_.size(); first += count) {
      const std::uint32_t edge = add_edge(found_[numbers.front()].ends, static_cast<std::uint32_t>(count));
      for (std::size_t k = 0; k < count; ++k)
        add_use(edge, faces_[first + k].use,
                order_.angle(faces_[first + k], faces_[first + (k + 1) % count]));
    }
  }
};

}  // namespace

Brep joined(const HyperplaneTable<3>& table, const std::vector<BrepPiece>& pieces, TriangleSurface* surface) {
  std::vector<const SurfacePiece*> surfaces;
  for (const BrepPiece& piece : pieces) surfaces.push_back(&piece.surface);
  JoinedPieces all = join(surfaces);
  Brep brep;
  BrepJoiner(table, pieces, all, brep).run();
  if (surface != nullptr) {
    brep.points = all.surface.points;
    *surface = std::move(all.surface);
  } else {
    brep.points = std::move(all.surface.points);
  }
  make_shells(brep);
  return brep;
}

}  // namespace bsp2::geometry
