#include "render/inner_sides.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ranks/exchange.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::BspTree;
using geometry::Label;
using Piece = InnerSides::Piece;

/// A piece of a facet on its way down a tree.
struct Part {
  Piece points;
  std::int32_t at;
};

/// A facet that is cut up, and what its hyperplane is.
struct Facet {
  std::int64_t id = -1;  ///< of its hyperplane, where the tree has ids
  Vector normal{};       ///< outward, of unit length
};

/// A piece that comes to the region of another rank, and what becomes of it.
struct Travelling {
  std::uint64_t cell = 0;
  std::uint32_t region = 0;
  std::int64_t id = -1;
  std::vector<double> points, normal;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& cell& region& id& points& normal;
  }
};

std::vector<double> flat(const Piece& piece) {
  std::vector<double> numbers;
  for (const Vector& p : piece) numbers.insert(numbers.end(), p.begin(), p.end());
  return numbers;
}

Piece unflat(const std::vector<double>& numbers) {
  Piece piece(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); ++i) piece[i / 3][i % 3] = numbers[i];
  return piece;
}

/// Of a polygon, not normalized.
/// Divides pieces by the nodes of a tree.
class Divider {
 public:
  Divider(const BspTree& tree, double thickness) : tree_(tree), thickness_(thickness) {}

  /// Calls reach(leaf, piece) for each leaf that is reached.
  template <typename Reach>
  void divide(const Facet& facet, Piece piece, std::int32_t from, Reach reach) const {
    std::vector<Part> stack;
    stack.push_back({std::move(piece), from});
    while (!stack.empty()) {
      Part part = std::move(stack.back());
      stack.pop_back();
      if (part.at < 0) {
        reach(part.at, std::move(part.points));
        continue;
      }
      const BspTree::Node& node = tree_.nodes[static_cast<std::size_t>(part.at)];
      const auto [below, above] = sides_of(part.points, node.hyperplane);
      const bool is_known =
          facet.id >= 0 && node.hyperplane < tree_.ids.size() && tree_.ids[node.hyperplane] == facet.id;
      if (is_known || (below <= thickness_ &&
                       above <= thickness_)) {  // it lies on this one: on with what is behind the facet
        const double* h = coefficients(node.hyperplane);
        part.at = facet.normal[0] * h[1] + facet.normal[1] * h[2] + facet.normal[2] * h[3] > 0
                      ? node.positive
                      : node.negative;
        stack.push_back(std::move(part));
      } else if (above <= thickness_ || below <= thickness_) {
        part.at = below > above ? node.negative : node.positive;
        stack.push_back(std::move(part));
      } else {
        stack.push_back({half(part.points, node.hyperplane, 1), node.positive});
        stack.push_back({half(part.points, node.hyperplane, -1), node.negative});
      }
    }
  }

 private:
  const BspTree& tree_;
  double thickness_;  // what is nearer to a hyperplane lies on it

  [[nodiscard]] const double* coefficients(std::uint32_t hyperplane) const {
    return tree_.hyperplanes.data() + std::size_t{4} * hyperplane;
  }

  /// How far a piece reaches to the negative side, and to the positive one.
  [[nodiscard]] std::pair<double, double> sides_of(const Piece& piece, std::uint32_t hyperplane) const {
    std::pair<double, double> reach{0, 0};
    for (const Vector& p : piece) {
      const double x = tree_.distance(hyperplane, p);
      reach = {std::max(reach.first, -x), std::max(reach.second, x)};
    }
    return reach;
  }

  [[nodiscard]] Piece half(const Piece& piece, std::uint32_t hyperplane, double sign) const {
    Piece kept;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Vector &p = piece[i], &q = piece[(i + 1) % piece.size()];
      const double x = sign * tree_.distance(hyperplane, p), y = sign * tree_.distance(hyperplane, q);
      if (x >= 0) kept.push_back(p);
      if ((x < 0) == (y < 0) || x == 0 || y == 0) continue;
      const double t = x / (x - y);
      kept.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])});
    }
    return kept;
  }
};

std::size_t leaf_number(std::int32_t code) { return static_cast<std::size_t>(~code); }

std::vector<Label> labels_of(const SolidMesh& mesh) {
  std::vector<Label> labels{Label::out};  // of leaf 0
  for (const auto& batch : mesh.batches)
    labels.insert(labels.end(), batch->label.begin(), batch->label.end());
  return labels;
}

std::int32_t locate(const BspTree& tree, std::int32_t at, const Vector& point) {
  while (at >= 0) {
    const BspTree::Node& node = tree.nodes[static_cast<std::size_t>(at)];
    at = tree.distance(node.hyperplane, point) <= 0 ? node.negative : node.positive;
  }
  return at;
}

/// Lengths of the model, for what counts as nothing.
double size_of(const SolidMesh& mesh) {
  double size = 0;
  for (const auto& batch : mesh.batches)
    for (const double x : batch->points) size = std::max(size, std::fabs(x));
  return size;
}

/// Divides facets, by the partition and in the regions.
class FacetDivider {
 public:
  FacetDivider(const RunResult& result, const RegionsInSpace& regions, int rank)
      : result_(result),
        regions_(regions),
        rank_(rank),
        labels_(labels_of(result.mesh)),
        by_partition_(result.partition, thickness()),
        in_regions_(result.tree, thickness()) {}

  /// Calls exposed(piece) for what no IN cell covers, and foreign(region, piece) for what comes to others.
  template <typename Exposed, typename Foreign>
  void divide(const Facet& facet, const Piece& piece, std::uint32_t of_region, Exposed exposed,
              Foreign foreign) const {
    if (result_.partition.nodes.empty()) return divide_in(facet, piece, 0, exposed);
    by_partition_.divide(facet, piece, result_.partition.root, [&](std::int32_t leaf, Piece part) {
      const std::size_t region = leaf_number(leaf) - 1;
      if (regions_.are_apart && region != of_region)
        exposed(std::move(part));
      else if (drawer_of(result_, region) == rank_)
        divide_in(facet, std::move(part), region, exposed);
      else
        foreign(static_cast<std::uint32_t>(region), std::move(part));
    });
  }

  template <typename Exposed>
  void divide_in(const Facet& facet, Piece piece, std::size_t region, Exposed exposed) const {
    in_regions_.divide(facet, std::move(piece), regions_.roots[region], [&](std::int32_t leaf, Piece part) {
      if (part.size() > 2 && labels_[leaf_number(leaf)] != Label::in) exposed(std::move(part));
    });
  }

 private:
  const RunResult& result_;
  const RegionsInSpace& regions_;
  int rank_;
  std::vector<Label> labels_;
  Divider by_partition_, in_regions_;

  [[nodiscard]] double thickness() const { return 1e-10 * size_of(result_.mesh); }
};

/// Whether a cell has a point inside: the cells of a tree fill the root cell, but its leaves all of space.
bool contains(const geometry::CellBatch& batch, std::size_t cell, const Vector& point) {
  const auto points = batch.cell_points(cell);
  for (std::size_t f = batch.facet_offset[cell]; f < batch.facet_offset[cell + 1]; ++f) {
    Piece facet;
    for (const std::uint16_t v : batch.vertices_of_facet(f)) {
      const double* p = points.data() + std::size_t{3} * v;
      facet.push_back({p[0], p[1], p[2]});
    }
    if (dot(normal_of(facet), difference(point, facet[0])) > 0) return false;
  }
  return true;
}

}  // namespace

std::optional<Label> label_here(const RunResult& result, const RegionsInSpace& regions, const Vector& eye,
                                int rank) {
  const auto label_of = [&](std::int32_t leaf, const Vector& point) {
    std::size_t number = leaf_number(leaf);
    if (number-- == 0) return Label::out;
    for (const auto& batch : result.mesh.batches) {
      if (number < batch->size()) return contains(*batch, number, point) ? batch->label[number] : Label::out;
      number -= batch->size();
    }
    return Label::out;
  };
  std::optional<Label> found;
  for (std::size_t region = 0; region < regions.roots.size(); ++region) {
    const Vector before = difference(eye, regions.shifts[region]);  // the move
    const bool is_divided = !result.partition.nodes.empty();
    if (is_divided && (drawer_of(result, region) != rank ||
                       leaf_number(locate(result.partition, result.partition.root, before)) != region + 1))
      continue;
    const Label label = label_of(locate(result.tree, regions.roots[region], before), before);
    if (!found || label == Label::in) found = label;
  }
  return found;
}

InnerSides::InnerSides(Ranks& ranks, const RunResult& result, const RegionsInSpace& regions,
                       const Camera& camera) {
  std::optional<FacetDivider> divider;
  std::vector<std::vector<Travelling>> to(static_cast<std::size_t>(ranks.count()));
  ranks.agree([&] {
    divider.emplace(result, regions, ranks.rank());
    std::size_t number = 0;
    for (const auto& batch : result.mesh.batches)
      for (std::size_t cell = 0; cell < batch->size(); ++cell, ++number) {
        if (batch->label[cell] != Label::in) continue;
        const std::uint32_t region = result.partition.nodes.empty() ? 0 : batch->region[cell];
        for (std::size_t f = batch->facet_offset[cell]; f < batch->facet_offset[cell + 1]; ++f) {
          Piece piece, seen;
          for (const std::uint16_t v : batch->vertices_of_facet(f)) {
            const double* p = batch->cell_points(cell).data() + std::size_t{3} * v;
            piece.push_back({p[0], p[1], p[2]});
            seen.push_back(camera.see(sum(piece.back(), regions.shifts[region])));
          }
          const Vector normal = normal_of(piece);
          if (camera.shows_front(normal_of(seen), seen[0]) || !(dot(normal, normal) > 0)) continue;
          const std::int32_t id = batch->facet_hyperplane[f];
          const Facet facet{id < 0 ? ~id : id, normalized(normal)};
          divider->divide(
              facet, piece, region, [&](Piece part) { pieces_[number].push_back(std::move(part)); },
              [&](std::uint32_t of, const Piece& part) {
                to[static_cast<std::size_t>(drawer_of(result, of))].push_back(
                    {number, of, facet.id, flat(part), {facet.normal.begin(), facet.normal.end()}});
              });
        }
      }
  });
  if (ranks.count() == 1) return;
  // To those who know what is there, and back.
  for (int turn = 0; turn < 2; ++turn) {
    std::vector<std::string> bytes;
    ranks.agree([&] {
      for (const auto& pieces : to) bytes.push_back(dataflow::to_bytes(pieces));
    });
    for (int rank = 0; rank < ranks.count(); ++rank)
      ranks.send(rank, std::exchange(bytes[static_cast<std::size_t>(rank)], {}));
    ranks.sync();
    ranks.agree([&] {
      for (auto& pieces : to) pieces.clear();
      for (const auto& message : ranks.received()) {
        std::vector<Travelling> arrived;
        dataflow::from_bytes(message.bytes, arrived);
        for (const Travelling& piece : arrived) {
          if (turn == 1) {
            pieces_[piece.cell].push_back(unflat(piece.points));
            continue;
          }
          const Facet facet{piece.id, {piece.normal[0], piece.normal[1], piece.normal[2]}};
          divider->divide_in(facet, unflat(piece.points), piece.region, [&](const Piece& part) {
            to[static_cast<std::size_t>(message.source)].push_back(
                {piece.cell, piece.region, piece.id, flat(part), piece.normal});
          });
        }
      }
    });
  }
}

std::span<const Piece> InnerSides::of(std::size_t cell) const {
  const auto found = pieces_.find(cell);
  return found == pieces_.end() ? std::span<const Piece>() : std::span<const Piece>(found->second);
}

}  // namespace bsp2::supersteps
