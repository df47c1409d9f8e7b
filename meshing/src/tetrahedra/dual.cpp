#include "bsp2/meshing/tetrahedra/dual.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "tetrahedra/face_checks.hpp"

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

/// Points whose corners of tetrahedra are each a cell of its own, which is convex.
using Divided = std::vector<bool>;

class DualMaker {
 public:
  DualMaker(const Tetrahedra& mesh, std::span<const std::int32_t> group, const Divided& divided)
      : mesh_(mesh),
        group_(group),
        divided_(divided),
        seen_(mesh.tetrahedra.size()),
        fanned_(mesh.triangles.size()),
        middle_of_tetrahedron_(mesh.tetrahedra.size(), none),
        middle_of_triangle_(mesh.triangles.size(), none),
        at_point_(mesh.points.size(), none) {}

  Dual run() {
    find_neighbours();
    number_cells();
    add_faces_within();
    find_smooth_edges();
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::size_t edge = 0; edge < 6; ++edge)
        if ((seen_[t] >> edge & 1U) == 0) add_faces_across(t, edge);
    for (std::uint32_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle)
      for (std::size_t k = 0; k < 3; ++k)
        if ((fanned_[triangle] >> k & 1U) == 0) add_face_of_fan(triangle, k);
    return ordered();
  }
  /// Of each cell. @pre it has been run
  [[nodiscard]] const std::vector<std::uint32_t>& points_of_cells() const { return point_of_cell_; }

 private:
  const Tetrahedra& mesh_;
  std::span<const std::int32_t> group_;
  const Divided& divided_;
  std::vector<std::array<Beyond, 4>> beyond_;  // of each tetrahedron, opposite to each corner
  std::vector<std::array<std::uint32_t, 2>>
      behind_;                       // of each triangle: its tetrahedra, that of `part` first
  std::vector<std::uint32_t> cell_;  // of each corner of each tetrahedron
  std::vector<std::uint32_t> point_of_cell_;
  std::unordered_set<std::uint64_t> parted_;  // edges around which there are several cells at an end
  std::unordered_map<std::uint64_t, std::array<std::uint32_t, 2>>
      smooth_;                               // triangles at edges within one face
  std::vector<std::uint8_t> seen_, fanned_;  // edges of tetrahedra; corners of triangles
  static constexpr std::uint32_t none = ~0U;
  std::vector<std::uint32_t> middle_of_tetrahedron_, middle_of_triangle_, at_point_;  // points of the dual
  std::unordered_map<std::uint64_t, std::uint32_t> middle_of_edge_;
  std::map<Triangle, std::uint32_t> middle_of_face_;  // of those between cells at one of their corners
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

  /// Corners at one point that come together in faces within a part are of one cell, unless it is divided.
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
          if (divided_[point]) continue;
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
      if (!is_root) continue;
      dual_.complex.part.push_back(mesh_.part[corner / 4]);
      point_of_cell_.push_back(mesh_.tetrahedra[corner / 4][corner % 4]);
    }
  }
  [[nodiscard]] std::uint32_t cell_at(std::uint32_t tetrahedron, std::uint32_t point) const {
    return cell_[4 * std::size_t{tetrahedron} + place_of(mesh_.tetrahedra[tetrahedron], point)];
  }

  /// Edges with two triangles, of one side and one group, and one cell at each end: faces go on across them.
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
      if (end - i == 2 && mesh_.side[a] == mesh_.side[b] && group_[a] == group_[b] &&
          !parted_.contains(uses[i].first))
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

  /// The faces of tetrahedra between cells at one of their corners: a third of each belongs to a corner.
  void add_faces_within() {
    if (std::ranges::find(divided_, true) == divided_.end()) return;
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t other = beyond_[t][k].tetrahedron;
        if (other == Dual::no_triangle || other < t) continue;
        Triangle face = face_opposite(mesh_.tetrahedra[t], k);
        if (k % 2 == 1) std::swap(face[1], face[2]);  // counter-clockwise from outside of t
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const std::uint32_t p = face[corner], q = face[(corner + 1) % 3], r = face[(corner + 2) % 3];
          const std::uint32_t from = cell_at(t, p), to = cell_at(other, p);
          if (from == to) continue;
          parted_.insert({key_of(p, q), key_of(p, r)});
          const std::size_t begin = corners_.size();
          corners_.insert(corners_.end(),
                          {at_point(p), middle_of_edge(p, q), middle_of_face(face), middle_of_edge(p, r)});
          add_face(begin, from, to, Dual::no_triangle);
        }
      }
  }
  std::uint32_t middle_of_face(const Triangle& corners) {
    return once(middle_of_face_.try_emplace(in_order(corners), none).first->second, corners);
  }

  /// The faces between the cells about both ends of an edge: one through the middles of the tetrahedra around
  /// it, which is divided where other cells begin at one of the ends.
  void add_faces_across(std::uint32_t first, std::size_t edge) {
    const auto& corners = mesh_.tetrahedra[first];
    const auto& [i, j, k, l] = edges[edge];
    const std::uint32_t a = corners[i], b = corners[j];
    std::vector<std::uint32_t> around{first};
    // Forwards out of the face with the fourth corner, which is opposite to the third; then backwards.
    const std::uint32_t last_triangle = walk(first, a, b, corners[k], corners[l], around);
    if (last_triangle == Dual::no_triangle) return add_faces_of_ring(around, a, b);
    std::vector<std::uint32_t> before{first};
    const std::uint32_t first_triangle = walk(first, a, b, corners[l], corners[k], before);
    std::reverse(before.begin(), before.end());
    before.insert(before.end(), around.begin() + 1, around.end());
    std::size_t begin = corners_.size();
    corners_.push_back(middle_of_triangle(first_triangle));
    bool is_whole = true;
    for (std::size_t n = 0; n < before.size(); ++n) {
      corners_.push_back(middle_of_tetrahedron(before[n]));
      if (n + 1 == before.size() || !add_middle_between(before[n], before[n + 1])) continue;
      if (!is_parted(before[n], before[n + 1], a, b)) continue;
      if (is_whole) corners_.push_back(middle_of_edge(a, b));
      is_whole = false;
      begin = part_face(begin, before[n], before[n + 1], a, b);
    }
    corners_.push_back(middle_of_triangle(last_triangle));
    if (is_whole && !smooth_.contains(key_of(a, b))) corners_.push_back(middle_of_edge(a, b));
    add_face(begin, cell_at(before.back(), a), cell_at(before.back(), b), Dual::no_triangle);
  }
  /// Of tetrahedra all around an edge.
  void add_faces_of_ring(std::vector<std::uint32_t>& ring, std::uint32_t a, std::uint32_t b) {
    auto anew = ring.begin();
    for (std::uint32_t last = ring.back(); anew != ring.end() && !is_parted(last, *anew, a, b); ++anew)
      last = *anew;
    const bool is_whole = anew == ring.end();
    if (!is_whole) std::rotate(ring.begin(), anew, ring.end());
    std::size_t begin = corners_.size();
    if (!is_whole) {
      corners_.push_back(middle_of_edge(a, b));
      add_middle_between(ring.back(), ring.front());
    }
    for (std::size_t n = 0; n < ring.size(); ++n) {
      const std::uint32_t next = ring[(n + 1) % ring.size()];
      corners_.push_back(middle_of_tetrahedron(ring[n]));
      if (!add_middle_between(ring[n], next) || n + 1 == ring.size()) continue;
      if (is_parted(ring[n], next, a, b)) begin = part_face(begin, ring[n], next, a, b);
    }
    add_face(begin, cell_at(ring.back(), a), cell_at(ring.back(), b), Dual::no_triangle);
  }
  /// Ends a face whose last corner is in the middle of the face between two tetrahedra, and begins the next
  /// one. @return where that begins.
  std::size_t part_face(std::size_t begin, std::uint32_t t, std::uint32_t next, std::uint32_t a,
                        std::uint32_t b) {
    add_face(begin, cell_at(t, a), cell_at(t, b), Dual::no_triangle);
    begin = corners_.size();
    corners_.push_back(middle_of_edge(a, b));
    add_middle_between(t, next);
    return begin;
  }
  /// Whether other cells begin at one end of an edge, between two tetrahedra around it.
  [[nodiscard]] bool is_parted(std::uint32_t t, std::uint32_t next, std::uint32_t a, std::uint32_t b) const {
    return cell_at(t, a) != cell_at(next, a) || cell_at(t, b) != cell_at(next, b);
  }
  /// The middle of the face between two tetrahedra, if other cells begin there at one of its corners.
  bool add_middle_between(std::uint32_t t, std::uint32_t next) {
    if (middle_of_face_.empty()) return false;
    const auto& corners = mesh_.tetrahedra[t];
    std::size_t k = 0;
    while (beyond_[t][k].tetrahedron != next) ++k;
    const auto found = middle_of_face_.find(in_order(face_opposite(corners, k)));
    if (found == middle_of_face_.end()) return false;
    corners_.push_back(found->second);
    return true;
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
      const bool is_all_around =
          first == last;  // but for one edge, around which the cells beyond are several
      if (!is_all_around) corners_.push_back(at_point(centre));
      corners_.push_back(middle_of_edge(centre, first));
      for (std::size_t n = before.size(); n > 1; --n) corners_.push_back(middle_of_triangle(before[n - 1]));
      for (const std::uint32_t t : fan) corners_.push_back(middle_of_triangle(t));
      if (!is_all_around) corners_.push_back(middle_of_edge(centre, last));
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

/// Of dividing: what is divided may leave its neighbours wrong.
constexpr int most_rounds = 8;

/// Where a cell has a wrong face its point is divided. @return whether any is that was not.
bool divide(Divided& divided, const Complex& complex, const std::vector<std::uint32_t>& wrong,
            const std::vector<std::uint32_t>& point_of_cell) {
  bool is_new = false;
  for (const std::uint32_t face : wrong)
    for (const std::int32_t cell : {complex.owner[face], complex.neighbour[face]}) {
      if (cell == Complex::outside) continue;
      const std::uint32_t point = point_of_cell[static_cast<std::size_t>(cell)];
      is_new = is_new || !divided[point];
      divided[point] = true;
    }
  return is_new;
}

}  // namespace

Dual dual_of(const Tetrahedra& mesh, std::span<const std::int32_t> group) {
  Divided divided(mesh.points.size());
  for (int round = 0;; ++round) {
    geometry::Interruption::check();
    DualMaker maker(mesh, group, divided);
    Dual dual = maker.run();
    const auto wrong = wrong_faces(dual.complex);
    dual.wrong_faces = wrong.size();
    if (round == most_rounds || !divide(divided, dual.complex, wrong, maker.points_of_cells())) return dual;
  }
}

}  // namespace bsp2::meshing
