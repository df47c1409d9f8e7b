#include "drawing/plane_spline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"

namespace bsp2::model {
namespace {

using Point = PlaneSpline::Point;

constexpr double full_turn = 2 * std::numbers::pi;

/// Evaluates by de Boor's algorithm, in homogeneous coordinates.
class Evaluation {
 public:
  explicit Evaluation(const PlaneSpline& spline) : spline_(spline) {}

  /// @param span knots[span] <= u <= knots[span + 1], which differ.
  [[nodiscard]] Point at(std::size_t span, double u) const {
    const auto p = static_cast<std::size_t>(spline_.degree);
    std::array<std::array<double, 3>, PlaneSpline::max_degree + 1> d;
    for (std::size_t i = 0; i <= p; ++i) {
      const std::size_t j = span - p + i;
      const double w = spline_.weights[j];
      d[i] = {spline_.points[j][0] * w, spline_.points[j][1] * w, w};
    }
    for (std::size_t r = 1; r <= p; ++r)
      for (std::size_t i = p; i >= r; --i) {
        const double low = spline_.knots[span - p + i], high = spline_.knots[span + 1 + i - r],
                     t = (u - low) / (high - low);
        for (std::size_t k = 0; k < 3; ++k) d[i][k] = (1 - t) * d[i - 1][k] + t * d[i][k];
      }
    return {d[p][0] / d[p][2], d[p][1] / d[p][2]};
  }

 private:
  const PlaneSpline& spline_;
};

/// A smooth stretch, looked at closely: how far it turns, and how many sides that takes.
class Stretch {
 public:
  Stretch(const PlaneSpline& spline, std::size_t first, std::size_t last, const Resolution& resolution,
          const std::function<void(std::size_t)>& spend)
      : spline_(spline), evaluation_(spline) {
    const std::size_t steps =
        spline.degree == 1 ? 1 : std::clamp(most_looks / (last - first), fewest_in_span, most_in_span);
    for (std::size_t span = first; span < last; ++span) {
      const double low = spline.knots[span], high = spline.knots[span + 1];
      if (!(low < high)) continue;
      spend(cost() * steps);
      for (std::size_t i = 0; i < steps; ++i)
        add(span, low + (high - low) * (static_cast<double>(i) / static_cast<double>(steps)));
      last_span_ = span;
    }
    add(last_span_, spline.knots[last]);
    measure(resolution);
  }

  /// Its points but the last one.
  void append(std::vector<Point>& out, const std::function<void(std::size_t)>& spend) const {
    const double total = sides_.back();
    if (total > max_sides)
      throw Error("import: a spline of a drawing gets more than " + std::to_string(max_sides) +
                  " sides ($fn, $fa, $fs)");
    constexpr double rounding = 0.01;  // of what is measured along chords
    const double count = std::isfinite(total) ? std::max(std::ceil(total - rounding), 1.0) : 1;
    spend(cost() * static_cast<std::size_t>(count));
    out.push_back(looks_[0].point);
    std::size_t at = 0;
    for (double k = 1; k < count; ++k) {
      const double wanted = total * k / count;
      while (at + 2 < looks_.size() && sides_[at + 1] <= wanted) ++at;
      const double width = sides_[at + 1] - sides_[at], share = width > 0 ? (wanted - sides_[at]) / width : 0;
      const Look &a = looks_[at], &b = looks_[at + 1];
      out.push_back(evaluation_.at(a.span, a.u + std::min(share, 1.0) * (b.u - a.u)));
    }
  }
  [[nodiscard]] const Point& end() const { return looks_.back().point; }

 private:
  static constexpr std::size_t most_looks = 4096, fewest_in_span = 8, most_in_span = 64;
  struct Look {
    std::size_t span;
    double u;
    Point point;
  };
  const PlaneSpline& spline_;
  Evaluation evaluation_;
  std::vector<Look> looks_;
  std::vector<double> sides_;  // that are wanted up to each look
  std::size_t last_span_ = 0;

  [[nodiscard]] std::size_t cost() const {
    return static_cast<std::size_t>(spline_.degree * spline_.degree) / 8 + 1;
  }

  void add(std::size_t span, double u) { looks_.push_back({span, u, evaluation_.at(span, u)}); }

  void measure(const Resolution& resolution) {
    const std::size_t chords = looks_.size() - 1;
    std::vector<Point> chord(chords);
    for (std::size_t i = 0; i < chords; ++i)
      chord[i] = {looks_[i + 1].point[0] - looks_[i].point[0], looks_[i + 1].point[1] - looks_[i].point[1]};
    std::vector<double> turns(chords + 1);  // at the end of the chord before
    for (std::size_t i = 1; i < chords; ++i) {
      const Point &a = chord[i - 1], &b = chord[i];
      turns[i] = std::fabs(std::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]));
    }
    if (chords > 1) turns[0] = turns[1], turns[chords] = turns[chords - 1];
    sides_.assign(1, 0);
    for (std::size_t i = 0; i < chords; ++i) {
      const double turn = (turns[i] + turns[i + 1]) / 2, length = std::hypot(chord[i][0], chord[i][1]);
      sides_.push_back(sides_.back() +
                       (turn > 0 ? side_count(length / turn, resolution) * turn / full_turn : 0));
    }
  }
};

/// Solves for the derivatives in a row of points: below x[i-1] + middle x[i] + above x[i+1] = right, from
/// both ends inwards.
std::vector<Point> solve(const std::vector<double>& below, std::vector<double> middle,
                         const std::vector<double>& above, std::vector<Point> right) {
  const std::size_t n = middle.size();
  for (std::size_t i = 1; i < n; ++i) {
    const double share = below[i] / middle[i - 1];
    middle[i] -= share * above[i - 1];
    for (std::size_t k = 0; k < 2; ++k) right[i][k] -= share * right[i - 1][k];
  }
  for (std::size_t i = n; i-- > 0;)
    for (std::size_t k = 0; k < 2; ++k)
      right[i][k] = (right[i][k] - (i + 1 < n ? above[i] * right[i + 1][k] : 0)) / middle[i];
  return right;
}

/// The derivatives of the spline through n points with n - 1 distances between them.
std::vector<Point> open_derivatives(const std::vector<Point>& points, const std::vector<double>& steps,
                                    const std::array<Point, 2>& tangents) {
  const std::size_t n = points.size();
  std::vector<double> below(n), middle(n), above(n);
  std::vector<Point> right(n);
  const auto slope = [&](std::size_t i, std::size_t k) {
    return (points[i + 1][k] - points[i][k]) / steps[i];
  };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    below[i] = 1 / steps[i - 1], above[i] = 1 / steps[i], middle[i] = 2 * (below[i] + above[i]);
    for (std::size_t k = 0; k < 2; ++k)
      right[i][k] = 3 * (slope(i - 1, k) / steps[i - 1] + slope(i, k) / steps[i]);
  }
  for (const std::size_t end : {std::size_t{0}, n - 1}) {
    const Point& tangent = tangents[end == 0 ? 0 : 1];
    const double length = std::hypot(tangent[0], tangent[1]);
    if (length > 0) {  // the parameter is a length, or nearly so
      middle[end] = 1;
      right[end] = {tangent[0] / length, tangent[1] / length};
    } else {
      middle[end] = 2;
      (end == 0 ? above : below)[end] = 1;
      for (std::size_t k = 0; k < 2; ++k) right[end][k] = 3 * slope(end == 0 ? 0 : n - 2, k);
    }
  }
  return solve(below, middle, above, std::move(right));
}

/// The derivatives of a closed spline at its points, of whose n + 1 points the last is the first: as a row,
/// and what the two ends have in common (Sherman and Morrison).
std::vector<Point> closed_derivatives(const std::vector<Point>& points, const std::vector<double>& steps) {
  const std::size_t n = points.size() - 1;
  std::vector<double> below(n), middle(n), above(n);
  std::vector<Point> right(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n;
    below[i] = 1 / steps[before], above[i] = 1 / steps[i], middle[i] = 2 * (below[i] + above[i]);
    for (std::size_t k = 0; k < 2; ++k)
      right[i][k] = 3 * ((points[i][k] - points[before][k]) / (steps[before] * steps[before]) +
                         (points[i + 1][k] - points[i][k]) / (steps[i] * steps[i]));
  }
  const double corner = below[0], gamma = -middle[0];
  middle[0] -= gamma;
  middle[n - 1] -= corner * corner / gamma;
  std::vector<Point> common(n);
  common[0] = {gamma, 0};
  common[n - 1] = {corner, 0};
  std::vector<Point> x = solve(below, middle, above, std::move(right));
  const std::vector<Point> z = solve(below, middle, above, std::move(common));
  const double weight = 1 + z[0][0] + corner / gamma * z[n - 1][0];
  Point share;
  for (std::size_t k = 0; k < 2; ++k) share[k] = (x[0][k] + corner / gamma * x[n - 1][k]) / weight;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 2; ++k) x[i][k] -= share[k] * z[i][0];
  x.push_back(x[0]);
  return x;
}

}  // namespace

std::string PlaneSpline::fault() const {
  const std::size_t n = points.size();
  if (degree < 1 || degree > max_degree)
    return "has the degree " + std::to_string(degree) + "; 1 to " + std::to_string(max_degree) + " are read";
  const auto p = static_cast<std::size_t>(degree);
  if (n <= p)
    return "has " + counted(n, "# control point[s], and a degree of ") + std::to_string(degree) + " takes " +
           std::to_string(p + 1);
  if (knots.size() != n + p + 1)
    return "has " + counted(knots.size(), "# knot[s] where it takes ") + std::to_string(n + p + 1);
  if (weights.size() != n)
    return "has " + counted(weights.size(), "# weight[s] for ") + counted(n, "# control point[s]");
  if (!std::is_sorted(knots.begin(), knots.end())) return "has a knot that is less than the one before";
  if (!(knots[p] < knots[n])) return "has no knots that differ";
  if (!std::all_of(weights.begin(), weights.end(), [](double w) { return w > 0; }))
    return "has a weight that is not positive";
  return "";
}

PlaneSpline spline_through(std::vector<Point> points, const std::array<Point, 2>& tangents, bool closed) {
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (closed && points.size() > 1 && points.front() != points.back()) points.push_back(points.front());
  PlaneSpline spline;
  const std::size_t n = points.size();
  if (n < 2) return spline;
  std::vector<double> steps(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i)
    steps[i] = std::hypot(points[i + 1][0] - points[i][0], points[i + 1][1] - points[i][1]);
  const std::vector<Point> slopes =
      closed && n > 3 ? closed_derivatives(points, steps) : open_derivatives(points, steps, tangents);
  double u = 0;
  spline.points.push_back(points[0]);
  spline.knots.assign(4, u);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    Point first, second;
    for (std::size_t k = 0; k < 2; ++k) {
      first[k] = points[i][k] + slopes[i][k] * steps[i] / 3;
      second[k] = points[i + 1][k] - slopes[i + 1][k] * steps[i] / 3;
    }
    spline.points.insert(spline.points.end(), {first, second, points[i + 1]});
    u += steps[i];
    spline.knots.insert(spline.knots.end(), 3, u);
  }
  spline.knots.push_back(u);
  spline.weights.assign(spline.points.size(), 1);
  return spline;
}

std::vector<Point> sampled(const PlaneSpline& spline, const Resolution& resolution,
                           const std::function<void(std::size_t)>& spend) {
  const auto p = static_cast<std::size_t>(spline.degree);
  const std::size_t end = spline.points.size();  // its knot is the last one that counts
  std::vector<Point> out;
  for (std::size_t first = p; first < end;) {
    while (first < end && spline.knots[first + 1] == spline.knots[first]) ++first;
    if (first == end) break;
    // A smooth stretch ends at a knot that is there `degree` times.
    std::size_t last = first + 1;
    while (last < end &&
           !(last + p - 1 < spline.knots.size() && spline.knots[last] == spline.knots[last + p - 1]))
      ++last;
    const Stretch stretch(spline, first, last, resolution, spend);
    stretch.append(out, spend);
    if (last >= end || spline.knots[last] == spline.knots[end]) {
      out.push_back(stretch.end());
      break;
    }
    first = last;
  }
  return out;
}

}  // namespace bsp2::model
