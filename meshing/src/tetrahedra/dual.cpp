#include "bsp2/meshing/tetrahedra/dual.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <utility>

namespace bsp2::meshing {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// What is beyond a face of a tetrahedron: another one of the same part, or a triangle of the mesh.
struct Beyond {
  std::uint32_t tetrahedron = Dual::no_triangle, triangle = Dual::no_triangle;
};

Triangle in_order(Triangle corners) {
  std::ranges::sort(corners);
  return corners;
}

/// Corners of the face that is opposite to one.
Triangle face_opposite(const std::array<std::uint32_t, 4>& corners, std::size_t k) {
  return {corners[(k + 1) % 4], corners[(k + 2) % 4], corners[(k + 3) % 4]};
}

std::size_t place_of(const std::array<std::uint32_t, 4>& corners, std::uint32_t point) {
  return static_cast<std::size_t>(std::ranges::find(corners, point) - corners.begin());
}

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// The edges of a tetrahedron by their two corners, then the other two: turned so that who goes around the
/// edge from its first to its second corner comes from the third to the fourth.
constexpr std::array<std::array<std::size_t, 4>, 6> edges{
    {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};

class DualMaker {
 public:
  DualMaker(const Tetrahedra& mesh, std::span<const std::int32_t> group)
      : mesh_(mesh),
        group_(group),
        seen_(mesh.tetrahedra.size()),
        fanned_(mesh.triangles.size()),
        middle_of_tetrahedron_(mesh.tetrahedra.size(), none),
        middle_of_triangle_(mesh.triangles.size(), none),
        at_point_(mesh.points.size(), none) {}

  Dual run() {
    find_neighbours();
    number_cells();
    find_smooth_edges();
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::size_t edge = 0; edge < 6; ++edge)
        if ((seen_[t] >> edge & 1U) == 0) add_face_across(t, edge);
    for (std::uint32_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle)
      for (std::size_t k = 0; k < 3; ++k)
        if ((fanned_[triangle] >> k & 1U) == 0) add_face_of_fan(triangle, k);
    return ordered();
  }

 private:
  const Tetrahedra& mesh_;
  std::span<const std::int32_t> group_;
  std::vector<std::array<Beyond, 4>> beyond_;  // of each tetrahedron, opposite to each corner
  std::vector<std::array<std::uint32_t, 2>>
      behind_;                       // of each triangle: its tetrahedra, that of `part` first
  std::vector<std::uint32_t> cell_;  // of each corner of each tetrahedron
  std::unordered_map<std::uint64_t, std::array<std::uint32_t, 2>>
      smooth_;                               // triangles at edges within one face
  std::vector<std::uint8_t> seen_, fanned_;  // edges of tetrahedra; corners of triangles
  static constexpr std::uint32_t none = ~0U;
  std::vector<std::uint32_t> middle_of_tetrahedron_, middle_of_triangle_, at_point_;  // points of the dual
  std::unordered_map<std::uint64_t, std::uint32_t> middle_of_edge_;
  Dual dual_;

  /// A face before its place in the order is known.
  struct Face {
    std::uint32_t owner, neighbour, triangle, first, count;
  };
  static constexpr std::uint32_t outside = ~0U;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> corners_;  // of all faces

  void find_neighbours() {
    struct Use {
      Triangle corners;
      std::uint32_t tetrahedron;
      std::uint8_t opposite;
    };
    std::vector<Use> uses;
    uses.reserve(4 * mesh_.tetrahedra.size());
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::uint8_t k = 0; k < 4; ++k)
        uses.push_back({in_order(face_opposite(mesh_.tetrahedra[t], k)), t, k});
    std::ranges::sort(uses, {}, [](const Use& use) { return std::pair(use.corners, use.tetrahedron); });
    std::vector<std::pair<Triangle, std::uint32_t>> triangles;
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i)
      triangles.emplace_back(in_order(mesh_.triangles[i]), i);
    std::ranges::sort(triangles);
    beyond_.resize(mesh_.tetrahedra.size());
    behind_.assign(mesh_.triangles.size(), {Dual::no_triangle, Dual::no_triangle});
    auto triangle = triangles.begin();
    for (std::size_t i = 0; i < uses.size();) {
      const bool is_pair = i + 1 < uses.size() && uses[i + 1].corners == uses[i].corners;
      while (triangle != triangles.end() && triangle->first < uses[i].corners) ++triangle;
      const bool is_listed = triangle != triangles.end() && triangle->first == uses[i].corners;
      for (std::size_t k = i; k < i + (is_pair ? 2 : 1); ++k) {
        Beyond& beyond = beyond_[uses[k].tetrahedron][uses[k].opposite];
        if (!is_listed && !is_pair) throw std::logic_error("a face of one tetrahedron is no triangle");
        if (!is_listed) {
          beyond.tetrahedron = uses[k == i ? i + 1 : i].tetrahedron;
          continue;
        }
        beyond.triangle = triangle->second;
        const bool is_first = mesh_.part[uses[k].tetrahedron] == side_of(triangle->second).part;
        behind_[triangle->second][is_first ? 0 : 1] = uses[k].tetrahedron;
      }
      i += is_pair ? 2 : 1;
    }
  }
  [[nodiscard]] const PlaneSide& side_of(std::uint32_t triangle) const {
    return mesh_.sides[mesh_.side[triangle]];
  }

  /// Corners at one point that come together in faces within a part are of one cell.
  void number_cells() {
    cell_.resize(4 * mesh_.tetrahedra.size());
    std::iota(cell_.begin(), cell_.end(), 0U);
    const auto root = [this](std::uint32_t corner) {
      while (cell_[corner] != corner) corner = cell_[corner] = cell_[cell_[corner]];
      return corner;
    };
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t other = beyond_[t][k].tetrahedron;
        if (other == Dual::no_triangle || other < t) continue;
        for (const std::uint32_t point : face_opposite(mesh_.tetrahedra[t], k)) {
          const auto a = root(static_cast<std::uint32_t>(4 * t + place_of(mesh_.tetrahedra[t], point)));
          const auto b =
              root(static_cast<std::uint32_t>(4 * other + place_of(mesh_.tetrahedra[other], point)));
          cell_[std::max(a, b)] = std::min(a, b);
        }
      }
    std::uint32_t cells = 0;  // the root of a corner is before it
    for (std::uint32_t corner = 0; corner < cell_.size(); ++corner) {
      const bool is_root = cell_[corner] == corner;
      cell_[corner] = is_root ? cells++ : cell_[cell_[corner]];
      if (is_root) dual_.complex.part.push_back(mesh_.part[corner / 4]);
    }
  }
  [[nodiscard]] std::uint32_t cell_at(std::uint32_t tetrahedron, std::uint32_t point) const {
    return cell_[4 * std::size_t{tetrahedron} + place_of(mesh_.tetrahedra[tetrahedron], point)];
  }

  /// Edges with two triangles, of one side and one group: faces go on across them.
  void find_smooth_edges() {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> uses;
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        uses.emplace_back(key_of(mesh_.triangles[i][k], mesh_.triangles[i][(k + 1) % 3]), i);
    std::ranges::sort(uses);
    for (std::size_t i = 0; i < uses.size();) {
      std::size_t end = i + 1;
      while (end < uses.size() && uses[end].first == uses[i].first) ++end;
      const std::uint32_t a = uses[i].second, b = uses[end - 1].second;
      if (end - i == 2 && mesh_.side[a] == mesh_.side[b] && group_[a] == group_[b])
        smooth_[uses[i].first] = {a, b};
      i = end;
    }
  }

  // --- points: each once ---

  std::uint32_t add_middle(std::span<const std::uint32_t> corners) {
    Point middle{};
    for (const std::uint32_t corner : corners)
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] += mesh_.points[corner][axis] / static_cast<double>(corners.size());
    dual_.complex.points.push_back(middle);
    return static_cast<std::uint32_t>(dual_.complex.points.size() - 1);
  }
  std::uint32_t once(std::uint32_t& known, std::span<const std::uint32_t> corners) {
    return known != none ? known : known = add_middle(corners);
  }
  std::uint32_t middle_of_tetrahedron(std::uint32_t t) {
    return once(middle_of_tetrahedron_[t], mesh_.tetrahedra[t]);
  }
  std::uint32_t middle_of_triangle(std::uint32_t t) {
    return once(middle_of_triangle_[t], mesh_.triangles[t]);
  }
  std::uint32_t at_point(std::uint32_t p) { return once(at_point_[p], {&p, 1}); }
  std::uint32_t middle_of_edge(std::uint32_t a, std::uint32_t b) {
    return once(middle_of_edge_.try_emplace(key_of(a, b), none).first->second, std::array{a, b});
  }

  // --- faces ---

  /// Between two cells, or a cell and the outside. The corners of it are the last ones, counter-clockwise
  /// seen from outside of the first.
  void add_face(std::size_t first, std::uint32_t owner, std::uint32_t neighbour, std::uint32_t triangle) {
    if (neighbour != outside && neighbour < owner) {
      std::swap(owner, neighbour);
      std::reverse(corners_.begin() + static_cast<std::ptrdiff_t>(first), corners_.end());
    }
    faces_.push_back({owner, neighbour, triangle, static_cast<std::uint32_t>(first),
                      static_cast<std::uint32_t>(corners_.size() - first)});
  }

  /// The face between the cells about both ends of an edge: through the middles of the tetrahedra around it.
  void add_face_across(std::uint32_t first, std::size_t edge) {
    const auto& corners = mesh_.tetrahedra[first];
    const auto& [i, j, k, l] = edges[edge];
    const std::uint32_t a = corners[i], b = corners[j];
    std::vector<std::uint32_t> around{first};
    // Forwards out of the face with the fourth corner, which is opposite to the third; then backwards.
    const std::uint32_t last_triangle = walk(first, a, b, corners[k], corners[l], around);
    const std::size_t begin = corners_.size();
    if (last_triangle == Dual::no_triangle) {
      for (const std::uint32_t t : around) corners_.push_back(middle_of_tetrahedron(t));
      return add_face(begin, cell_at(first, a), cell_at(first, b), Dual::no_triangle);
    }
    std::vector<std::uint32_t> before{first};
    const std::uint32_t first_triangle = walk(first, a, b, corners[l], corners[k], before);
    corners_.push_back(middle_of_triangle(first_triangle));
    for (std::size_t n = before.size(); n > 1; --n) corners_.push_back(middle_of_tetrahedron(before[n - 1]));
    for (const std::uint32_t t : around) corners_.push_back(middle_of_tetrahedron(t));
    corners_.push_back(middle_of_triangle(last_triangle));
    if (!smooth_.contains(key_of(a, b))) corners_.push_back(middle_of_edge(a, b));
    add_face(begin, cell_at(first, a), cell_at(first, b), Dual::no_triangle);
  }

  /// Goes around the edge a b, out of the face that is opposite to `from`, and marks the edge.
  /// @return the triangle at which that ends; none if it comes back.
  std::uint32_t walk(std::uint32_t first, std::uint32_t a, std::uint32_t b, std::uint32_t from,
                     std::uint32_t to, std::vector<std::uint32_t>& around) {
    for (std::uint32_t t = first;;) {
      mark(t, a, b);
      const Beyond beyond = beyond_[t][place_of(mesh_.tetrahedra[t], from)];
      if (beyond.triangle != Dual::no_triangle) return beyond.triangle;
      t = beyond.tetrahedron;
      if (t == first) return Dual::no_triangle;
      around.push_back(t);
      from = to;
      for (const std::uint32_t corner : mesh_.tetrahedra[t])
        if (corner != a && corner != b && corner != from) to = corner;
    }
  }
  void mark(std::uint32_t t, std::uint32_t a, std::uint32_t b) {
    const std::size_t i = place_of(mesh_.tetrahedra[t], a), j = place_of(mesh_.tetrahedra[t], b);
    for (std::size_t edge = 0; edge < 6; ++edge)
      if ((edges[edge][0] == i && edges[edge][1] == j) || (edges[edge][0] == j && edges[edge][1] == i))
        seen_[t] = static_cast<std::uint8_t>(seen_[t] | 1U << edge);
  }

  /// The face of the cell about a point on what bounds its part: all triangles about the point that go on
  /// from each other within one face.
  void add_face_of_fan(std::uint32_t triangle, std::size_t k) {
    const std::uint32_t centre = mesh_.triangles[triangle][k];
    std::vector<std::uint32_t> fan{triangle};
    std::uint32_t last = mesh_.triangles[triangle][(k + 2) % 3];
    const bool is_closed = fan_out(centre, 2, fan, last);
    const std::size_t begin = corners_.size();
    if (!is_closed) {
      std::vector<std::uint32_t> before{triangle};
      std::uint32_t first = mesh_.triangles[triangle][(k + 1) % 3];
      fan_out(centre, 1, before, first);
      corners_.push_back(at_point(centre));
      corners_.push_back(middle_of_edge(centre, first));
      for (std::size_t n = before.size(); n > 1; --n) corners_.push_back(middle_of_triangle(before[n - 1]));
      for (const std::uint32_t t : fan) corners_.push_back(middle_of_triangle(t));
      corners_.push_back(middle_of_edge(centre, last));
    } else {
      for (const std::uint32_t t : fan) corners_.push_back(middle_of_triangle(t));
    }
    const auto [behind, before] = behind_[triangle];
    add_face(begin, cell_at(behind, centre), before == Dual::no_triangle ? outside : cell_at(before, centre),
             triangle);
  }

  /// Goes on from triangle to triangle about a point, as far as edges are smooth, and marks corners.
  /// @param turn 2: counter-clockwise, 1: clockwise. @param rim gets the other end of the last edge.
  /// @return whether that comes back.
  bool fan_out(std::uint32_t centre, std::size_t turn, std::vector<std::uint32_t>& fan, std::uint32_t& rim) {
    for (std::uint32_t t = fan.front();;) {
      const auto& corners = mesh_.triangles[t];
      const auto k = static_cast<std::size_t>(std::ranges::find(corners, centre) - corners.begin());
      fanned_[t] = static_cast<std::uint8_t>(fanned_[t] | 1U << k);
      rim = corners[(k + turn) % 3];
      const auto found = smooth_.find(key_of(centre, rim));
      if (found == smooth_.end()) return false;
      t = found->second[found->second[0] == t ? 1 : 0];
      if (t == fan.front()) return true;
      fan.push_back(t);
    }
  }

  Dual ordered() {
    std::ranges::stable_sort(faces_, {},
                             [](const Face& face) { return std::pair(face.owner, face.neighbour); });
    Complex& complex = dual_.complex;
    for (const Face& face : faces_) {
      complex.owner.push_back(static_cast<std::int32_t>(face.owner));
      complex.neighbour.push_back(face.neighbour == outside ? Complex::outside
                                                            : static_cast<std::int32_t>(face.neighbour));
      complex.face_points.insert(complex.face_points.end(), corners_.begin() + face.first,
                                 corners_.begin() + face.first + face.count);
      complex.face_offset.push_back(static_cast<std::uint32_t>(complex.face_points.size()));
      const PlaneSide* const side = face.triangle == Dual::no_triangle ? nullptr : &side_of(face.triangle);
      complex.plane.push_back(side != nullptr ? side->plane : Dual::no_triangle);
      Point outward = side != nullptr ? side->outward : Point{};
      if (side != nullptr && complex.part[face.owner] != side->part)
        for (double& x : outward) x = -x;
      complex.outward.push_back(outward);
      dual_.triangle_of_face.push_back(face.triangle);
    }
    return std::move(dual_);
  }
};

}  // namespace

Dual dual_of(const Tetrahedra& mesh, std::span<const std::int32_t> group) {
  return DualMaker(mesh, group).run();
}

}  // namespace bsp2::meshing
