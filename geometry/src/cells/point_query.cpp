#include "bsp2/geometry/cells/point_query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::geometry {
namespace {

template <int D>
using Vector = std::array<double, D>;

template <std::size_t D>
void add_scaled(std::array<double, D>& a, double factor, const std::array<double, D>& b) {
  for (std::size_t i = 0; i < D; ++i) a[i] += factor * b[i];
}

/// Half-spaces that the point lies on, as an orthonormal basis: normal_j = sum over i <= j of r[i][j]
/// basis_i.
template <int D>
class ActiveSet {
 public:
  int size = 0;
  std::array<std::size_t, D> member;
  std::array<double, D> multiplier;

  /// @return what of the normal is orthogonal to all members; `coefficients` of the members in the rest.
  Vector<D> orthogonal_part(const Vector<D>& normal, std::array<double, D>& coefficients) const {
    Vector<D> rest = normal;
    std::array<double, D> inner{};
    for (int pass = 0; pass < 2; ++pass)  // the second one removes what rounding has left
      for (int i = 0; i < size; ++i) {
        const double share = dot(basis_[i], rest);
        inner[i] += share;
        add_scaled(rest, -share, basis_[i]);
      }
    for (int i = size; i-- > 0;) {
      double sum = inner[i];
      for (int j = i + 1; j < size; ++j) sum -= r_[i][j] * coefficients[j];
      coefficients[i] = sum / r_[i][i];
    }
    return rest;
  }

  void add(std::size_t half_space, double its_multiplier, const Vector<D>& normal) {
    std::array<double, D> coefficients;
    Vector<D> rest = orthogonal_part(normal, coefficients);
    const double length = std::sqrt(dot(rest, rest));
    for (int i = 0; i < size; ++i) r_[i][size] = dot(basis_[i], normal);
    r_[size][size] = length;
    for (double& x : rest) x /= length;
    basis_[size] = rest;
    member[size] = half_space;
    multiplier[size] = its_multiplier;
    ++size;
  }

  void remove(int which, std::span<const HalfSpace<D>> half_spaces) {
    ActiveSet fewer;
    for (int i = 0; i < size; ++i)
      if (i != which) fewer.add(member[i], multiplier[i], half_spaces[member[i]].normal);
    *this = fewer;
  }

  /// The point nearest to the origin in which all members' hyperplanes meet.
  [[nodiscard]] Vector<D> meeting_point(std::span<const HalfSpace<D>> half_spaces) const {
    Vector<D> point{};
    std::array<double, D> c{};
    for (int j = 0; j < size; ++j) {
      double sum = -half_spaces[member[j]].offset;
      for (int i = 0; i < j; ++i) sum -= r_[i][j] * c[i];
      c[j] = sum / r_[j][j];
      add_scaled(point, c[j], basis_[j]);
    }
    return point;
  }

 private:
  std::array<Vector<D>, D> basis_;
  std::array<std::array<double, D>, D> r_;
};

/// A node or leaf that is still to be visited, with the hyperplanes on its path.
struct Visit {
  double bound;  // no point of it is nearer
  std::int32_t at;
  std::int32_t path;
  friend bool operator<(const Visit& a, const Visit& b) { return a.bound > b.bound; }  // the nearest on top
};

template <int D>
struct Step {
  HalfSpace<D> half_space;
  std::int32_t parent;
};

}  // namespace

template <int D>
std::array<double, D> nearest_to_origin(std::span<const HalfSpace<D>> half_spaces, double limit) {
  constexpr double independent = 1e-12;  // of unit normals
  Vector<D> point{};
  ActiveSet<D> active;
  double scale = 0;
  for (const auto& half_space : half_spaces) scale = std::max(scale, half_space.offset);
  for (std::size_t round = 0; round < 4 * half_spaces.size() + 16; ++round) {
    std::size_t worst = 0;
    double violation = 1e-14 * scale;
    bool found = false;
    for (std::size_t i = 0; i < half_spaces.size(); ++i) {
      const double value = half_spaces[i].offset + dot(half_spaces[i].normal, point);
      if (value > violation) violation = value, worst = i, found = true;
    }
    if (!found || dot(point, point) >= limit * limit) return point;
    const Vector<D>& normal = half_spaces[worst].normal;
    double multiplier = 0;
    while (true) {
      std::array<double, D> coefficients{};
      const Vector<D> rest = active.orthogonal_part(normal, coefficients);
      const double length = dot(rest, rest);
      const double infinite = std::numeric_limits<double>::infinity();
      const double full =
          active.size < D && length > independent * independent ? violation / length : infinite;
      double partial = infinite;
      int leaving = -1;
      for (int i = 0; i < active.size; ++i)
        if (coefficients[i] > 0 && active.multiplier[i] / coefficients[i] < partial)
          partial = active.multiplier[i] / coefficients[i], leaving = i;
      const double step = std::min(full, partial);
      if (step == infinite)
        return point;  // no common point but for rounding: what there is bounds the distance
      for (int i = 0; i < active.size; ++i) active.multiplier[i] -= step * coefficients[i];
      multiplier += step;
      if (full <= partial) {
        active.add(worst, multiplier, normal);
        point = active.meeting_point(half_spaces);
        break;
      }
      active.remove(leaving, half_spaces);
      if (full == infinite) continue;
      add_scaled(point, -step, rest);
      violation = half_spaces[worst].offset + dot(normal, point);
    }
  }
  return point;
}

template <int D>
PointQuery<D>::PointQuery(const HyperplaneTable<D>& table, const BspTree& tree, std::vector<Label> labels)
    : table_(table), tree_(tree), labels_(std::move(labels)) {
  for (int axis = 0; axis < D; ++axis) {
    lower_[axis] = table.axis_value(axis, table.root_lower());
    upper_[axis] = table.axis_value(axis, table.root_upper());
  }
}

template <int D>
PointAnswer<D> PointQuery<D>::ask(const std::array<double, D>& point) const {
  PointAnswer<D> answer;
  bool outside = false;
  for (int axis = 0; axis < D; ++axis)
    outside = outside || point[axis] < lower_[axis] || point[axis] > upper_[axis];
  if (!outside) answer.leaf = tree_.template locate<D>(table_, point);
  answer.label = label_of(answer.leaf);
  answer.nearest = point;
  if (answer.label != Label::fuzzy) search(point, answer);
  return answer;
}

template <int D>
void PointQuery<D>::search(const std::array<double, D>& point, PointAnswer<D>& answer) const {
  answer.distance = std::numeric_limits<double>::infinity();
  answer.nearest.fill(std::numeric_limits<double>::quiet_NaN());
  const auto improve = [&](const Vector<D>& way) {
    const double distance = std::sqrt(dot(way, way));
    if (distance >= answer.distance) return;
    answer.distance = distance;
    for (int i = 0; i < D; ++i) answer.nearest[i] = point[i] + way[i];
  };
  std::vector<Step<D>> steps;
  std::int32_t root_path = -1;
  const auto add_step = [&](const HalfSpace<D>& half_space, std::int32_t parent) {
    steps.push_back({half_space, parent});
    return static_cast<std::int32_t>(steps.size()) - 1;
  };
  for (int axis = 0; axis < D; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const double face = sign < 0 ? lower_[axis] : upper_[axis];
      Vector<D> normal{};
      normal[axis] = sign;
      root_path = add_step({normal, sign * (point[axis] - face)}, root_path);
      Vector<D> way{};
      way[axis] = face - point[axis];
      if (answer.label == Label::in) improve(way);  // all is OUT beyond
    }
  std::priority_queue<Visit> visits;
  visits.push({0, tree_.root, root_path});
  std::vector<HalfSpace<D>> half_spaces;
  while (!visits.empty() && visits.top().bound < answer.distance) {
    const Visit visit = visits.top();
    visits.pop();
    if (visit.at < 0) {
      if (label_of(~visit.at) == answer.label) continue;
      half_spaces.clear();
      for (std::int32_t step = visit.path; step >= 0; step = steps[step].parent)
        half_spaces.push_back(steps[step].half_space);
      improve(nearest_to_origin<D>(half_spaces, answer.distance));
      continue;
    }
    const BspTree::Node& node = tree_.nodes[visit.at];
    const double distance = tree_.distance(node.hyperplane, point);
    const double* h = tree_.hyperplanes.data() + std::size_t{node.hyperplane} * (D + 1);
    for (const double sign : {1.0, -1.0}) {  // the negative side first
      HalfSpace<D> half_space;
      for (int i = 0; i < D; ++i) half_space.normal[i] = sign * h[i + 1];
      half_space.offset = sign * distance;
      const double bound = std::max(visit.bound, half_space.offset);
      if (bound < answer.distance)
        visits.push({bound, sign > 0 ? node.negative : node.positive, add_step(half_space, visit.path)});
    }
  }
}

#define BSP2_INSTANTIATE(D)                                                                   \
  template std::array<double, D> nearest_to_origin<D>(std::span<const HalfSpace<D>>, double); \
  template class PointQuery<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
