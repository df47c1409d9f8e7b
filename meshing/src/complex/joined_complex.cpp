#include <algorithm>
#include <numeric>
#include <queue>
#include <tuple>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "bsp2/meshing/complex/complex_share.hpp"

namespace bsp2::meshing {
namespace {

/// Of one of several lists.
struct Item {
  std::uint32_t list, index;
};

/// The items of lists that are in their order, in one order. @param is_before of items of different lists.
template <typename IsBefore, typename Take>
void merge(std::span<const std::size_t> sizes, const IsBefore& is_before, const Take& take) {
  const auto is_later = [&](const Item& a, const Item& b) {
    return is_before(b, a) || (!is_before(a, b) && b.list < a.list);
  };
  std::priority_queue<Item, std::vector<Item>, decltype(is_later)> heads(is_later);
  for (std::uint32_t list = 0; list < sizes.size(); ++list)
    if (sizes[list] > 0) heads.push({list, 0});
  while (!heads.empty()) {
    Item item = heads.top();
    heads.pop();
    take(item);
    if (++item.index < sizes[item.list]) heads.push(item);
  }
}

class PieceJoiner {
 public:
  PieceJoiner(const geometry::HyperplaneTable<3>& table, const std::vector<ComplexPiece>& pieces)
      : table_(table), pieces_(pieces) {}

  Complex run() {
    order_points();
    order_cells();
    order_faces();
    write();
    return std::move(complex_);
  }

 private:
  struct Face {
    std::uint32_t owner, neighbour;  // places; the outside is the last of all
    std::uint32_t plane;
    Item source;
    bool is_reversed;  // the owner is on the positive side
  };
  static constexpr std::uint32_t none = ~0U;

  const geometry::HyperplaneTable<3>& table_;
  const std::vector<ComplexPiece>& pieces_;
  std::vector<std::vector<std::uint32_t>> rank_;  // of each piece's points
  std::vector<Item> at_rank_;                     // one of those that are one point
  std::vector<std::uint32_t> place_;              // of each cell, by number
  std::vector<Face> faces_;
  Complex complex_;

  [[nodiscard]] const Point& point(const Item& item) const { return pieces_[item.list].points[item.index]; }

  void order_points() {
    // Shares may have points in one place: then each of them has told its name.
    std::vector<std::vector<double>> along(pieces_.size());
    std::vector<std::vector<std::uint32_t>> name(pieces_.size());
    std::vector<std::size_t> sizes;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const ComplexPiece& piece = pieces_[i];
      for (const Point& x : piece.points) along[i].push_back(geometry::place_along(x));
      name[i].assign(piece.points.size(), none);
      for (std::uint32_t k = 0; k < piece.shared.size(); ++k) name[i][piece.shared[k]] = k;
      rank_.emplace_back(piece.points.size());
      sizes.push_back(piece.points.size());
    }
    const auto name_of = [&](const Item& item) {
      const std::uint32_t k = name[item.list][item.index];
      return k == none ? std::array<geometry::HyperplaneId, 3>{} : pieces_[item.list].names[k];
    };
    const auto is_before = [&](const Item& a, const Item& b) {
      const double p = along[a.list][a.index], q = along[b.list][b.index];
      if (p != q) return p < q;
      return point(a) != point(b) ? point(a) < point(b) : name_of(a) < name_of(b);
    };
    merge(sizes, is_before, [&](const Item& item) {
      const bool is_known = !at_rank_.empty() && at_rank_.back().list != item.list &&
                            name[item.list][item.index] != none && !is_before(at_rank_.back(), item);
      if (!is_known) at_rank_.push_back(item);
      rank_[item.list][item.index] = static_cast<std::uint32_t>(at_rank_.size() - 1);
    });
  }

  void order_cells() {
    std::vector<std::vector<std::uint32_t>> corners(pieces_.size());
    std::vector<std::size_t> sizes;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      for (const std::uint32_t corner : pieces_[i].corners) corners[i].push_back(rank_[i][corner]);
      sizes.push_back(pieces_[i].cells.size());
    }
    const auto corners_of = [&](const Item& cell) {
      const auto& offset = pieces_[cell.list].corner_offset;
      return std::span(corners[cell.list])
          .subspan(offset[cell.index], offset[cell.index + std::size_t{1}] - offset[cell.index]);
    };
    place_.resize(std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}));
    merge(
        sizes,
        [&](const Item& a, const Item& b) {
          return std::ranges::lexicographical_compare(corners_of(a), corners_of(b));
        },
        [&](const Item& cell) {
          place_[pieces_[cell.list].cells[cell.index]] = static_cast<std::uint32_t>(complex_.part.size());
          complex_.part.push_back(pieces_[cell.list].part[cell.index]);
        });
  }

  /// By owner, neighbour and plane. Where that is the same one share has given them, in their order.
  void order_faces() {
    const auto place = [&](std::uint32_t cell) {
      return cell == ComplexPiece::outside ? none : place_[cell];
    };
    std::vector<std::size_t> begin(place_.size() + 1);
    for (const ComplexPiece& piece : pieces_)
      for (std::size_t face = 0; face < piece.plane.size(); ++face)
        ++begin[std::min(place(piece.negative[face]), place(piece.positive[face])) + std::size_t{1}];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    faces_.resize(begin.back());
    for (std::uint32_t i = 0; i < pieces_.size(); ++i)
      for (std::uint32_t face = 0; face < pieces_[i].plane.size(); ++face) {
        const std::uint32_t negative = place(pieces_[i].negative[face]),
                            positive = place(pieces_[i].positive[face]);
        const auto [owner, neighbour] = std::minmax(negative, positive);
        faces_[begin[owner]++] = {owner, neighbour, pieces_[i].plane[face], {i, face}, positive < negative};
      }
    std::size_t first = 0;
    for (const std::size_t end : begin) {
      std::stable_sort(faces_.begin() + static_cast<std::ptrdiff_t>(first),
                       faces_.begin() + static_cast<std::ptrdiff_t>(end), [](const Face& a, const Face& b) {
                         return std::pair(a.neighbour, a.plane) < std::pair(b.neighbour, b.plane);
                       });
      first = end;
    }
  }

  void write() {
    std::size_t corners = 0;
    for (const ComplexPiece& piece : pieces_) corners += piece.face_points.size();
    complex_.face_points.reserve(corners);
    complex_.face_offset.reserve(faces_.size() + 1);
    complex_.owner.reserve(faces_.size());
    complex_.neighbour.reserve(faces_.size());
    complex_.plane.reserve(faces_.size());
    complex_.outward.reserve(faces_.size());
    complex_.points.reserve(at_rank_.size());
    std::vector<std::uint32_t> number(at_rank_.size(), none), cycle;
    for (const Face& face : faces_) {
      geometry::Interruption::check();
      const ComplexPiece& piece = pieces_[face.source.list];
      const std::uint32_t begin = piece.face_offset[face.source.index],
                          end = piece.face_offset[face.source.index + std::size_t{1}];
      cycle.assign(piece.face_points.begin() + begin, piece.face_points.begin() + end);
      if (face.is_reversed) std::reverse(cycle.begin(), cycle.end());
      for (const std::uint32_t local : cycle) {
        const std::uint32_t rank = rank_[face.source.list][local];
        if (number[rank] == none) {
          number[rank] = static_cast<std::uint32_t>(complex_.points.size());
          complex_.points.push_back(point(at_rank_[rank]));
        }
        complex_.face_points.push_back(number[rank]);
      }
      complex_.face_offset.push_back(static_cast<std::uint32_t>(complex_.face_points.size()));
      complex_.owner.push_back(static_cast<std::int32_t>(face.owner));
      complex_.neighbour.push_back(static_cast<std::int32_t>(face.neighbour));
      complex_.plane.push_back(face.plane);
      Point normal = table_.rounded(face.plane).normal;
      if (face.is_reversed)
        for (double& x : normal) x = -x;
      complex_.outward.push_back(normal);
    }
  }
};

}  // namespace

Complex joined(const geometry::HyperplaneTable<3>& table, const std::vector<ComplexPiece>& pieces) {
  return PieceJoiner(table, pieces).run();
}

}  // namespace bsp2::meshing
