#include "builder/mesh_shells.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "bsp2/geometry/support/box_tree.hpp"
#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "builder/polyhedron.hpp"
#include "mesh/mesh_line.hpp"

namespace bsp2::model {
namespace {

/// A triangle at an edge.
struct Use {
  std::uint32_t high;  ///< the edge's larger end
  std::uint32_t triangle;
  int direction;  ///< 1 = from the smaller end to the larger one
};

/// Calls visit(uses) for each edge.
template <typename Visit>
void for_each_edge(const TriangleMesh& mesh, Visit&& visit) {
  // Sorted by the smaller end, by counting; then the few edges of each of these ends.
  std::vector<std::uint32_t> ends(mesh.points.size() + 1);
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++ends[std::min(t[k], t[(k + 1) % 3]) + std::size_t{1}];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<Use> uses(ends.back());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto from = mesh.triangles[i][k], to = mesh.triangles[i][(k + 1) % 3];
      uses[ends[std::min(from, to)]++] = {std::max(from, to), i, from < to ? 1 : -1};
    }
  for (std::size_t low = 0, begin = 0; low < mesh.points.size(); begin = ends[low++]) {
    const std::span<Use> own(uses.data() + begin, ends[low] - begin);
    std::sort(own.begin(), own.end(), [](const Use& x, const Use& y) {
      return std::pair(x.high, x.triangle) < std::pair(y.high, y.triangle);
    });
    for (std::size_t first = 0, last = 0; first < own.size(); first = last) {
      while (last < own.size() && own[last].high == own[first].high) ++last;
      visit(own.subspan(first, last - first));
    }
  }
}

/// The line along an axis through a point seen along it.
geometry::Box3 line_along(int axis, const Point2& at) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  geometry::Box3 line{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
  const auto u = static_cast<std::size_t>(axis + 1) % 3, v = static_cast<std::size_t>(axis + 2) % 3;
  line.low[u] = line.high[u] = at.u;
  line.low[v] = line.high[v] = at.v;
  return line;
}

/// The shells beside a triangle, on the inner side of its own shell.
struct Beside {
  int own = 0;                                            ///< how often the shell winds around what is there
  std::vector<std::pair<std::uint32_t, int>> containers;  ///< other shells, ascending, and how often they do
};

class ShellTurner {
 public:
  explicit ShellTurner(TriangleMesh& mesh, Shells shells)
      : mesh_(mesh), shells_(std::move(shells)), tree_(triangle_boxes(mesh)) {
    group();
    slots_.resize(shells_.count);
    find_containers();
  }

  ShellFaults run() {
    std::vector<std::uint32_t> order(shells_.count);  // those around a shell come before it
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return beside_[a].containers.size() < beside_[b].containers.size();
    });
    std::vector<bool> turned(shells_.count), nested(shells_.count);
    for (const std::uint32_t shell : order) {
      const Beside& beside = beside_[shell];
      int around = 0;
      std::uint32_t parent = shell;  // the innermost one around it
      for (const auto& [other, winding] : beside.containers) {
        around += turned[other] ? -winding : winding;
        if (parent == shell || beside_[other].containers.size() > beside_[parent].containers.size())
          parent = other;
      }
      if (around == 0) turned[shell] = beside.own < 0;
      if (around >= 1 && beside.own > 0) (around == 1 && turned[parent] ? turned : nested)[shell] = true;
    }
    return apply(turned, nested);
  }

 private:
  /// The triangles and the box of each shell.
  void group() {
    ends_.resize(shells_.count + std::size_t{1});
    for (const std::uint32_t shell : shells_.of) ++ends_[shell + std::size_t{1}];
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
    triangles_.resize(shells_.of.size());
    std::vector<std::size_t> at(ends_.begin(), ends_.end() - 1);
    for (std::uint32_t i = 0; i < shells_.of.size(); ++i) triangles_[at[shells_.of[i]]++] = i;
    for (std::uint32_t shell = 0; shell < shells_.count; ++shell) {
      geometry::Box3 box = tree_[triangles_[ends_[shell]]];
      for (const std::uint32_t i : triangles_of(shell)) box.unite(tree_[i]);
      shell_boxes_.push_back(box);
    }
  }

  [[nodiscard]] std::span<const std::uint32_t> triangles_of(std::uint32_t shell) const {
    return {triangles_.data() + ends_[shell], ends_[shell + std::size_t{1}] - ends_[shell]};
  }

  void find_containers() {
    // Near all corners of a small shell, so that one that reaches out of another is not taken to lie in it;
    // near some of a large one. Where shells lie in each other in their thousands a line meets them all.
    constexpr std::size_t all_lines = 100'000, fewest = 3, most = 36, most_work = 10'000'000;
    const std::size_t samples = std::clamp(all_lines / shells_.count, fewest, most);
    beside_.resize(shells_.count);
    for (std::uint32_t shell = 0; shell < shells_.count; ++shell) {
      const auto own = triangles_of(shell);
      const std::size_t corners = 3 * own.size(), attempts = std::min(corners, 2 * most);
      std::vector<Beside> seen;
      for (std::size_t i = 0; i < attempts && seen.size() < samples; ++i) {
        const std::size_t corner = i * corners / attempts;
        Beside beside = beside_of(own[corner / 3], corner % 3);
        if (beside.own == 0) continue;
        seen.push_back(std::move(beside));
        if (seen.back().containers.empty()) break;  // it lies in no other one
        if (seen.size() >= fewest && work_ > most_work) break;
      }
      if (!seen.empty()) beside_[shell] = agreed(seen);
    }
  }

  /// What all samples say.
  static Beside agreed(const std::vector<Beside>& seen) {
    Beside result = seen.front();
    for (const Beside& other : seen) {
      if (other.own != result.own) result.own = 0;
      std::erase_if(result.containers, [&](const auto& container) {
        return !std::binary_search(other.containers.begin(), other.containers.end(), container);
      });
    }
    return result;
  }

  /// By the line through the triangle near this corner; own = 0 if that does not tell.
  [[nodiscard]] Beside beside_of(std::uint32_t triangle, std::size_t corner) {
    const int axis = axis_across(mesh_, mesh_.triangles[triangle]);
    const auto at = point_near(mesh_, triangle, corner, axis);
    if (!at) return {};
    const std::uint32_t shell = shells_.of[triangle];
    struct Winding {
      std::uint32_t shell;
      int above, below;  ///< of what the triangle parts
    };
    std::vector<Winding> windings{{shell, 0, 0}};
    slots_[shell] = 0;
    tree_.visit_meeting(line_along(axis, *at), [&](std::uint32_t i) {
      ++work_;
      const std::uint32_t other = shells_.of[i];
      if (other != shell && !shell_boxes_[other].contains(shell_boxes_[shell])) return false;
      const int direction = meets(mesh_, i, axis, *at);
      const int place = direction == 0  ? -1
                        : i == triangle ? 0
                                        : compare_heights(mesh_, i, triangle, axis, *at);
      if (place < 0) return false;
      std::uint32_t& slot = slots_[other];
      if (slot >= windings.size() || windings[slot].shell != other) {
        slot = static_cast<std::uint32_t>(windings.size());
        windings.push_back({other, 0, 0});
      }
      windings[slot].below += direction;
      if (place > 0) windings[slot].above += direction;
      return false;
    });
    const Winding own = windings.front();
    const bool is_above = std::abs(own.above) > std::abs(own.below);
    if (std::abs(own.above) == std::abs(own.below)) return {};
    Beside result{is_above ? own.above : own.below, {}};
    for (const Winding& winding : windings) {
      const int times = is_above ? winding.above : winding.below;
      if (times != 0 && winding.shell != shell) result.containers.emplace_back(winding.shell, times);
    }
    std::sort(result.containers.begin(), result.containers.end());
    return result;
  }

  ShellFaults apply(const std::vector<bool>& turned, const std::vector<bool>& nested) {
    ShellFaults faults{shells_.count};
    for (std::uint32_t shell = 0; shell < shells_.count; ++shell) {
      const Point3& corner = mesh_.points[mesh_.triangles[triangles_of(shell).front()][0]];
      if (nested[shell] && faults.nested++ == 0) faults.nested_at = corner;
      if (!turned[shell]) continue;
      if (faults.turned++ == 0) faults.turned_at = corner;
      for (const std::uint32_t i : triangles_of(shell))
        std::swap(mesh_.triangles[i][1], mesh_.triangles[i][2]);
    }
    return faults;
  }

  TriangleMesh& mesh_;
  const Shells shells_;
  const geometry::BoxTree tree_;
  std::vector<std::size_t> ends_;
  std::vector<std::uint32_t> triangles_;
  std::vector<geometry::Box3> shell_boxes_;
  std::vector<Beside> beside_;
  std::vector<std::uint32_t> slots_;  ///< where each shell stands among those of a line, if it is there
  std::size_t work_ = 0;              ///< triangles that lines were tried on
};

/// How often a mesh whose shells do not cross winds around what is on either side of a triangle.
struct Sides {
  int above, below;
};

class SideFinder {
 public:
  SideFinder(const TriangleMesh& mesh, const Shells& shells)
      : mesh_(mesh), shells_(shells), tree_(triangle_boxes(mesh)), shell_tree_(boxes_of_shells()) {}

  /// By the line through the triangle near this corner; nothing if that does not tell.
  [[nodiscard]] std::optional<Sides> sides_of(std::uint32_t triangle, std::size_t corner) const {
    const int axis = axis_across(mesh_, mesh_.triangles[triangle]);
    const auto at = point_near(mesh_, triangle, corner, axis);
    if (!at) return std::nullopt;
    // A shell that winds around it reaches around all of its shell. Others need not be looked at, be there a
    // lot of them on the line.
    const geometry::Box3& own = shell_tree_[shells_.of[triangle]];
    geometry::Box3 reach = own;
    shell_tree_.visit_meeting(own, [&](std::uint32_t shell) {
      if (shell_tree_[shell].contains(own)) reach.unite(shell_tree_[shell]);
      return false;
    });
    geometry::Box3 line = line_along(axis, *at);
    const auto k = static_cast<std::size_t>(axis);
    line.low[k] = reach.low[k];
    line.high[k] = reach.high[k];
    Sides sides{0, 0};
    tree_.visit_meeting(line, [&](std::uint32_t other) {
      if (!shell_tree_[shells_.of[other]].contains(own)) return false;
      const int direction = meets(mesh_, other, axis, *at);
      const int place = direction == 0      ? -1
                        : other == triangle ? 0
                                            : compare_heights(mesh_, other, triangle, axis, *at);
      if (place >= 0) sides.below += direction;
      if (place > 0) sides.above += direction;
      return false;
    });
    return sides;
  }

 private:
  [[nodiscard]] std::vector<geometry::Box3> boxes_of_shells() const {
    std::vector<std::optional<geometry::Box3>> united(shells_.count);
    for (std::uint32_t i = 0; i < shells_.of.size(); ++i)
      if (auto& box = united[shells_.of[i]])
        box->unite(tree_[i]);
      else
        box = tree_[i];
    std::vector<geometry::Box3> boxes;
    for (const auto& box : united) boxes.push_back(*box);
    return boxes;
  }

  const TriangleMesh& mesh_;
  const Shells& shells_;
  const geometry::BoxTree tree_, shell_tree_;
};

}  // namespace

Shells shells_of(const TriangleMesh& mesh) {
  geometry::DisjointSets sets(mesh.triangles.size());
  for_each_edge(mesh, [&](std::span<const Use> uses) {
    if (uses.size() == 2) sets.unite(uses[0].triangle, uses[1].triangle);
  });
  // Where more than two triangles meet: what is closed there already stays by itself.
  for_each_edge(mesh, [&](std::span<Use> uses) {
    if (uses.size() <= 2) return;
    std::sort(uses.begin(), uses.end(),
              [&](const Use& x, const Use& y) { return sets.find(x.triangle) < sets.find(y.triangle); });
    std::vector<std::uint32_t> open;
    for (std::size_t first = 0, last = 0; first < uses.size(); first = last) {
      int excess = 0;
      for (; last < uses.size() && sets.find(uses[last].triangle) == sets.find(uses[first].triangle); ++last)
        excess += uses[last].direction;
      if (excess != 0) open.push_back(uses[first].triangle);
    }
    for (const std::uint32_t triangle : open) sets.unite(open.front(), triangle);
  });
  Shells shells;
  shells.of.resize(mesh.triangles.size());
  for (std::uint32_t i = 0; i < shells.of.size(); ++i)
    shells.of[i] = sets.find(i) == i ? shells.count++ : shells.of[sets.find(i)];
  return shells;
}

ShellFaults turn_shells(TriangleMesh& mesh) {
  Shells shells = shells_of(mesh);
  if (shells.count > 1) return ShellTurner(mesh, std::move(shells)).run();
  ShellFaults faults{shells.count};
  if (signed_volume(mesh.points, mesh.triangles) < 0) {
    faults.turned = 1;
    faults.turned_at = mesh.points[mesh.triangles[0][0]];
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  return faults;
}

namespace {

std::vector<std::vector<std::uint32_t>> triangles_of_shells(const Shells& shells) {
  std::vector<std::vector<std::uint32_t>> triangles(shells.count);
  for (std::uint32_t i = 0; i < shells.of.size(); ++i) triangles[shells.of[i]].push_back(i);
  return triangles;
}

/// All over a shell, since a part of one may reach into another one by rounding alone: all samples that tell
/// anything must agree.
std::optional<OddWinding> odd_winding_of_shell(const TriangleMesh& mesh, const SideFinder& finder,
                                               std::span<const std::uint32_t> triangles) {
  constexpr std::size_t samples = 5, most_tries = 36;
  const std::size_t step = std::max<std::size_t>(1, triangles.size() / samples);
  std::optional<OddWinding> odd;
  std::size_t found = 0, tries = 0;
  for (std::size_t first = 0; first < step && found < samples && tries < most_tries; ++first)
    for (std::size_t i = first; i < triangles.size() && found < samples && tries < most_tries;
         i += step, ++tries) {
      const std::size_t corner = tries % 3;
      const auto sides = finder.sides_of(triangles[i], corner);
      if (!sides) continue;
      ++found;
      const auto is_usual = [](int times) { return times == 0 || times == 1; };
      if (is_usual(sides->above) && is_usual(sides->below)) return std::nullopt;
      odd = OddWinding{is_usual(sides->above) ? sides->below : sides->above,
                       mesh.points[mesh.triangles[triangles[i]][corner]]};
    }
  return odd;
}

}  // namespace

std::optional<OddWinding> odd_winding(const TriangleMesh& mesh) {
  const Shells shells = shells_of(mesh);
  const SideFinder finder(mesh, shells);
  for (const auto& triangles : triangles_of_shells(shells))
    if (const auto odd = odd_winding_of_shell(mesh, finder, triangles)) return odd;
  return std::nullopt;
}

}  // namespace bsp2::model
