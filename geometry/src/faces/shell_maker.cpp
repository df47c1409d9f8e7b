#include "faces/shell_maker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "surface/no_index.hpp"

namespace bsp2::geometry {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

class ShellMaker {
 public:
  explicit ShellMaker(Brep& brep) : brep_(brep), classes_(2 * brep.faces.size()) {}

  void run() {
    connect();
    make_shells();
    make_solids();
  }

 private:
  struct Found {
    Brep::Shell shell;
    std::vector<Brep::Side> sides;
    Point low{}, high{};
    bool is_sure = true;  ///< whether the volume is more than corners are rounded by
  };

  Brep& brep_;
  DisjointSets classes_;
  std::vector<Found> found_;
  std::vector<std::uint32_t> first_triangle_;  // of each face, and the end

  /// The number of a side of a face: behind it, or in front.
  static std::uint32_t number(std::uint32_t face, bool is_front) { return 2 * face + (is_front ? 1 : 0); }
  [[nodiscard]] std::int32_t part(std::uint32_t side) const {
    const Brep::Face& face = brep_.faces[side / 2];
    return side % 2 == 1 ? face.other : face.part;
  }

  /// Between two faces that follow each other about an edge, the one's side that is counter-clockwise and the
  /// other's that is clockwise look into the same space.
  void connect() {
    for (const Brep::Edge& edge : brep_.edges) {
      const std::span uses(brep_.uses_of_edges.data() + edge.first, edge.count);
      for (std::size_t i = 0; i < uses.size(); ++i) {
        const Brep::Use &one = brep_.uses[uses[i]], &next = brep_.uses[uses[(i + 1) % uses.size()]];
        const std::uint32_t a = number(one.face, one.forward), b = number(next.face, !next.forward);
        if (part(a) != part(b)) brep_.is_closed = false;
        if (part(a) != Brep::outside && part(a) == part(b)) classes_.unite(a, b);
      }
    }
  }

  void make_shells() {
    first_triangle_.assign(brep_.faces.size() + 1, 0);
    for (const std::uint32_t face : brep_.face_of_triangle) ++first_triangle_[face + 1];
    std::partial_sum(first_triangle_.begin(), first_triangle_.end(), first_triangle_.begin());
    std::vector<std::uint32_t> shell_of(2 * brep_.faces.size(), none);
    for (std::uint32_t side = 0; side < shell_of.size(); ++side) {
      if (part(side) == Brep::outside) continue;
      std::uint32_t& shell = shell_of[classes_.find(side)];
      if (shell == none) {
        shell = static_cast<std::uint32_t>(found_.size());
        found_.push_back({{part(side), none, 0, 0, false, 0}, {}});
      }
      found_[shell].sides.push_back({side / 2, side % 2 == 1});
    }
    for (Found& found : found_) measure(found);
    for (Found& found : found_)
      if (!found.is_sure) found.shell.is_cavity = is_in_solid(found);
  }

  template <typename See>
  void for_each_triangle(const Found& found, const See& see) const {
    for (const Brep::Side& side : found.sides)
      for (std::uint32_t i = first_triangle_[side.face]; i < first_triangle_[side.face + 1]; ++i)
        see(brep_.triangles[i], side.is_front);
  }

  void measure(Found& found) const {
    using Sum = long double;
    const Point& o = brep_.points[brep_.triangles[first_triangle_[found.sides.front().face]][0]];
    found.low = found.high = o;
    Sum sum = 0;
    double area = 0, largest = 0;
    for_each_triangle(found, [&](const Triangle& triangle, bool is_front) {
      std::array<std::array<Sum, 3>, 3> p;
      for (std::size_t corner = 0; corner < 3; ++corner)
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = brep_.points[triangle[corner]][k];
          p[corner][k] = static_cast<Sum>(x) - o[k];
          found.low[k] = std::min(found.low[k], x);
          found.high[k] = std::max(found.high[k], x);
        }
      const Sum six = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                      p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                      p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
      sum += is_front ? -six : six;
      area += area_of(triangle);
    });
    for (std::size_t k = 0; k < 3; ++k)
      largest = std::max({largest, std::fabs(found.low[k]), std::fabs(found.high[k])});
    found.shell.volume = static_cast<double>(sum / 6);
    found.shell.is_cavity = found.shell.volume < 0;
    constexpr double rounded_by = 0x1p-45;  // of where a corner is: much more than it is
    found.is_sure = std::fabs(found.shell.volume) > area * largest * rounded_by;
  }
  [[nodiscard]] double area_of(const Triangle& triangle) const {
    const Point &a = brep_.points[triangle[0]], &b = brep_.points[triangle[1]],
                &c = brep_.points[triangle[2]];
    Point u, v;
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] = b[k] - a[k];
      v[k] = c[k] - a[k];
    }
    return std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }

  /// Where a shell bounds next to nothing: whether all others of its part say that this is in the solid.
  [[nodiscard]] bool is_in_solid(const Found& thin) const {
    const Point inside = centre_of_largest_triangle(thin);
    double sum = 0;
    for (const Found& found : found_)
      if (found.is_sure && found.shell.part == thin.shell.part) sum += winding(found, inside);
    return sum > 0.5;
  }

  /// How often a shell winds around a point. Source: van Oosterom, Strackee, "The solid angle of a plane
  /// triangle" (1983).
  [[nodiscard]] double winding(const Found& found, const Point& x) const {
    double sum = 0;
    for_each_triangle(found, [&](const Triangle& triangle, bool is_front) {
      std::array<Point, 3> p;
      std::array<double, 3> r;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (std::size_t k = 0; k < 3; ++k) p[corner][k] = brep_.points[triangle[corner]][k] - x[k];
        r[corner] = std::hypot(p[corner][0], p[corner][1], p[corner][2]);
      }
      const auto dot = [&](std::size_t a, std::size_t b) {
        return p[a][0] * p[b][0] + p[a][1] * p[b][1] + p[a][2] * p[b][2];
      };
      const double determinant = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                                 p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                                 p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
      const double angle = 2 * std::atan2(determinant, r[0] * r[1] * r[2] + dot(0, 1) * r[2] +
                                                           dot(1, 2) * r[0] + dot(2, 0) * r[1]);
      sum += is_front ? -angle : angle;
    });
    return sum / (4 * std::numbers::pi);
  }

  /// The outer shell around a cavity: of those that wind around it, the innermost one.
  /// @param outer shells of the same part.
  [[nodiscard]] std::optional<std::uint32_t> around(const Found& cavity,
                                                    const std::vector<std::uint32_t>& outer) const {
    const auto holds = [&](const Found& shell) {
      for (std::size_t k = 0; k < 3; ++k)
        if (shell.low[k] > cavity.low[k] || shell.high[k] < cavity.high[k]) return false;
      return shell.is_sure;
    };
    std::vector<std::uint32_t> candidates;
    for (const std::uint32_t shell : outer)
      if (holds(found_[shell])) candidates.push_back(shell);
    if (candidates.size() > 1) {
      const Point inside = centre_of_largest_triangle(cavity);
      std::erase_if(candidates, [&](std::uint32_t shell) { return winding(found_[shell], inside) < 0.5; });
    }
    const auto least = std::min_element(candidates.begin(), candidates.end(), [&](auto a, auto b) {
      return found_[a].shell.volume < found_[b].shell.volume;
    });
    return least == candidates.end() ? std::nullopt : std::optional(*least);
  }
  /// A point that is on no other shell.
  [[nodiscard]] Point centre_of_largest_triangle(const Found& found) const {
    Point centre{};
    double largest = -1;
    for_each_triangle(found, [&](const Triangle& triangle, bool) {
      const double area = area_of(triangle);
      if (area <= largest) return;
      largest = area;
      centre = {};
      for (const std::uint32_t corner : triangle)
        for (std::size_t k = 0; k < 3; ++k) centre[k] += brep_.points[corner][k] / 3;
    });
    return centre;
  }

  void make_solids() {
    std::vector<std::uint32_t> outer;
    std::map<std::int32_t, std::vector<std::uint32_t>> outer_of_part;
    for (std::uint32_t i = 0; i < found_.size(); ++i)
      if (!found_[i].shell.is_cavity) {
        outer.push_back(i);
        outer_of_part[found_[i].shell.part].push_back(i);
      }
    std::map<std::uint32_t, std::vector<std::uint32_t>> cavities;  // by outer shell
    for (std::uint32_t i = 0; i < found_.size(); ++i) {
      if (!found_[i].shell.is_cavity) continue;
      if (const auto shell = around(found_[i], outer_of_part[found_[i].shell.part]))
        cavities[*shell].push_back(i);
      else
        brep_.is_closed = false;
    }
    for (const std::uint32_t shell : outer) {
      Brep::Solid solid{found_[shell].shell.part, static_cast<std::uint32_t>(brep_.shells.size()), 1,
                        found_[shell].shell.volume};
      add(found_[shell]);
      for (const std::uint32_t cavity : cavities[shell]) {
        add(found_[cavity]);
        solid.volume += found_[cavity].shell.volume;
        ++solid.shells;
      }
      brep_.solids.push_back(solid);
    }
  }
  void add(Found& found) {
    found.shell.solid = static_cast<std::uint32_t>(brep_.solids.size());
    found.shell.first = static_cast<std::uint32_t>(brep_.faces_of_shells.size());
    found.shell.count = static_cast<std::uint32_t>(found.sides.size());
    brep_.shells.push_back(found.shell);
    brep_.faces_of_shells.insert(brep_.faces_of_shells.end(), found.sides.begin(), found.sides.end());
  }
};

}  // namespace

void make_shells(Brep& brep) { ShellMaker(brep).run(); }

}  // namespace bsp2::geometry
