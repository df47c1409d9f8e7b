#include "viewer/sections.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>

#include "viewer/levels.hpp"
#include "viewer/message.hpp"
#include "viewer/received.hpp"

namespace bsp2::api {
namespace {

using Point = Gaze::Point;

/// An edge as lines along u meet it, upwards.
struct Side {
  std::array<double, 2> low, high;
  int winding;  ///< of what is beyond it, along u
  double between = 0;
  std::size_t partner = none;  ///< where what is filled ends that begins at it
  double since = 0;
  static constexpr std::size_t none = ~std::size_t{0};
  [[nodiscard]] double at(double v) const {
    if (v <= low[1]) return low[0];
    if (v >= high[1]) return high[0];
    const double share = (v - low[1]) / (high[1] - low[1]);
    return std::lerp(low[0], high[0], share <= 1 ? share : 0.5);  // where differences are infinite
  }
};

std::vector<Side> sides_of(std::span<const FigureEdge> edges, double step) {
  const auto place = [step](std::array<double, 2> point) {
    if (step > 0)
      for (double& x : point) x = std::round(x / step) * step;
    return point;
  };
  std::vector<Side> sides;
  for (const FigureEdge& edge : edges) {
    const auto from = place(edge.from), to = place(edge.to);
    if (from[1] < to[1]) sides.push_back({from, to, -1});
    if (from[1] > to[1]) sides.push_back({to, from, 1});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low[1], a.low[0], a.high, a.winding) < std::tie(b.low[1], b.low[0], b.high, b.winding);
  });
  return sides;
}

/// A line along u that goes up.
class Sweep {
 public:
  explicit Sweep(std::vector<Side> sides) : sides_(std::move(sides)) {}

  std::vector<Trapezoid> trapezoids() {
    std::vector<double> ends;
    for (const Side& side : sides_) ends.insert(ends.end(), {side.low[1], side.high[1]});
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) fill(ends[i], ends[i + 1]);
    if (!ends.empty()) close({}, ends.back());
    return std::move(made_);
  }

 private:
  std::vector<Side> sides_;
  std::size_t next_ = 0;            ///< of the sides
  std::vector<std::size_t> met_;    ///< sides between the two lines, along u
  std::vector<std::size_t> begun_;  ///< sides at which something filled begins
  std::vector<Trapezoid> made_;

  void fill(double low, double high) {
    std::erase_if(met_, [&](std::size_t i) { return sides_[i].high[1] <= low; });
    for (; next_ < sides_.size() && sides_[next_].low[1] <= low; ++next_) met_.push_back(next_);
    for (const std::size_t i : met_) sides_[i].between = sides_[i].at(std::midpoint(low, high));
    const auto is_before = [&](std::size_t a, std::size_t b) {
      return std::tie(sides_[a].between, sides_[a].winding, a) <
             std::tie(sides_[b].between, sides_[b].winding, b);
    };
    if (!std::is_sorted(met_.begin(), met_.end(), is_before)) std::sort(met_.begin(), met_.end(), is_before);
    std::vector<std::pair<std::size_t, std::size_t>> now;
    int winding = 0;
    for (std::size_t at = 0, left = 0; at < met_.size(); ++at) {
      const int before = std::exchange(winding, winding + sides_[met_[at]].winding);
      if (before <= 0 && winding > 0) left = met_[at];
      if (before > 0 && winding <= 0 && sides_[left].between < sides_[met_[at]].between)
        now.emplace_back(left, met_[at]);
    }
    close(now, low);
    for (const auto& [left, right] : now) {
      begun_.push_back(left);
      if (sides_[left].partner == right) continue;
      sides_[left].partner = right;
      sides_[left].since = low;
    }
  }

  /// Ends what does not go on between the same two sides.
  void close(const std::vector<std::pair<std::size_t, std::size_t>>& now, double at) {
    std::map<std::size_t, std::size_t> goes_on(now.begin(), now.end());
    for (const std::size_t left : begun_) {
      Side& side = sides_[left];
      const auto found = goes_on.find(left);
      if (found != goes_on.end() && found->second == side.partner) continue;
      const Side& other = sides_[side.partner];
      made_.push_back(
          {side.since, at, {side.at(side.since), side.at(at)}, {other.at(side.since), other.at(at)}});
      side.partner = Side::none;
    }
    begun_.clear();
  }
};

/// What is closed by itself, and moved as a whole.
struct Unit {
  Point shift{}, lower{}, upper{};     ///< of what the plane meets, where it is moved to
  std::vector<std::uint64_t> numbers;  ///< of the messages that the plane meets
};

std::uint64_t mixed_with(std::uint64_t state, std::uint64_t word) {
  state = (state ^ word) * 0xd6e8feb86659fd93U;
  return state ^ (state >> 29);
}

/// A plane, and what it meets.
class Section {
 public:
  Section(const Scene& scene, const Gaze& gaze, std::size_t plane)
      : scene_(scene), gaze_(gaze), plane_(gaze.planes[plane]) {
    const auto all = scene.detailed();
    const std::uint64_t run = scene.run_of_surface();
    const Shifts shifts(gaze, all);
    for (const auto& [number, detail] : all) {
      if (!gaze.shows(*detail, run) || gaze.hidden.contains(detail->part)) continue;
      add(number, *detail, shifts.of(*detail).value_or(Point{}));
    }
    std::erase_if(units_, [&](const auto& unit) { return unit.first.first != run_; });  // of an older surface
  }

  /// Another one where another message would be made.
  [[nodiscard]] std::uint64_t state() const {
    std::uint64_t state = plane_.axis + 1;
    for (const double x : {plane_.at, gaze_.explode})
      state = mixed_with(state, std::bit_cast<std::uint64_t>(x));
    for (const double x : gaze_.middle) state = mixed_with(state, std::bit_cast<std::uint64_t>(x));
    state = mixed_with(mixed_with(state, run_), is_of_surface() ? 1 : 0);
    if (!is_of_surface())
      for (const std::int32_t part : gaze_.hidden)
        state = mixed_with(state, static_cast<std::uint32_t>(part));
    for (const auto& [name, unit] : units_) {
      double pixels = 0;
      const auto step = step_of(unit, pixels);
      state = mixed_with(state, static_cast<std::uint32_t>(step ? std::ilogb(*step) : 1 << 20));
      state = mixed_with(state, static_cast<std::uint32_t>(std::ilogb(std::max(1.0, pixels))));
      for (const std::uint64_t number : unit.numbers) state = mixed_with(state, number);
    }
    return std::max<std::uint64_t>(1, state);
  }

  [[nodiscard]] std::string bytes() const {
    Message message("section", run_);
    message["axis"] = plane_.axis;
    message["at"] = plane_.at;
    message["explode"] = gaze_.explode;
    message["surface"] = is_of_surface();
    message["middle"] = gaze_.middle;
    std::vector<float> corners;
    std::vector<std::uint32_t> counts, numbers;
    std::vector<std::int32_t> parts;
    for (const auto& [name, unit] : units_)
      for (const auto& [part, edges] : edges_of(unit)) {
        const auto all = filled_to_be_seen(edges, unit);
        for (const Trapezoid& each : all) add_corners(corners, each);
        counts.push_back(static_cast<std::uint32_t>(all.size()));
        numbers.push_back(name.second);
        parts.push_back(part);
      }
    message.add("corners", corners);
    message.add_small("counts", counts);
    message.add_small("regions", is_of_surface() ? std::vector<std::uint32_t>{} : numbers);
    message.add("parts", parts);
    return message.bytes();
  }

 private:
  const Scene& scene_;
  const Gaze& gaze_;
  const Gaze::Plane plane_;
  std::uint64_t run_ = 0;
  Detail::Kind kind_ = Detail::Kind::cells;
  std::map<std::pair<std::uint64_t, std::uint32_t>, Unit> units_;  ///< by run, and by part or region

  [[nodiscard]] bool is_of_surface() const { return kind_ == Detail::Kind::surface; }
  [[nodiscard]] std::size_t u() const { return (plane_.axis + 1) % 3; }
  [[nodiscard]] std::size_t v() const { return (plane_.axis + 2) % 3; }

  void add(std::uint64_t number, const Detail& detail, const Point& shift) {
    if (detail.run >= run_) {
      run_ = detail.run;
      kind_ = detail.kind;
    }
    Point lower = detail.lower, upper = detail.upper;
    for (std::size_t i = 0; i < 3; ++i) {
      lower[i] += shift[i];
      upper[i] += shift[i];
    }
    if (lower[plane_.axis] > plane_.at || upper[plane_.axis] < plane_.at) return;
    for (const auto& [axis, at, keeps_above] : gaze_.planes)
      if (axis != plane_.axis && (keeps_above ? upper[axis] < at : lower[axis] > at)) return;
    const auto part = static_cast<std::uint32_t>(detail.part);
    const auto [found, is_new] =
        units_.try_emplace({detail.run, detail.kind == Detail::Kind::surface ? part : detail.number});
    Unit& unit = found->second;
    if (is_new) std::tie(unit.shift, unit.lower, unit.upper) = std::tie(shift, lower, upper);
    for (std::size_t i = 0; i < 3; ++i) {
      unit.lower[i] = std::min(unit.lower[i], lower[i]);
      unit.upper[i] = std::max(unit.upper[i], upper[i]);
    }
    unit.numbers.push_back(number);
  }

  /// Half a pixel, see Gaze.
  [[nodiscard]] std::optional<double> step_of(const Unit& unit, double& pixels) const {
    Point lower = unit.lower, upper = unit.upper;
    lower[plane_.axis] = upper[plane_.axis] = plane_.at;
    for (const auto& [axis, at, keeps_above] : gaze_.planes) {
      double& end = keeps_above ? lower[axis] : upper[axis];
      end = keeps_above ? std::max(end, at) : std::min(end, at);
    }
    return gaze_.half_pixel(lower, upper, pixels);
  }

  [[nodiscard]] std::vector<Trapezoid> filled_to_be_seen(std::span<const FigureEdge> edges,
                                                         const Unit& unit) const {
    constexpr double least = 12, edges_of_each = 4;
    double pixels = 0;
    const auto half_pixel = step_of(unit, pixels);
    if (!half_pixel) return filled(edges);
    const double most = std::max(least, pixels);  // of two triangles each
    if (static_cast<double>(edges.size()) <= std::min<double>(edges_of_each * most, many_edges)) {
      auto all = filled(edges);
      if (static_cast<double>(all.size()) <= most) return all;
    }
    for (double step = std::exp2(std::ilogb(least_step(edges, *half_pixel)));; step *= 2) {
      auto all = filled(edges, step);
      if (static_cast<double>(all.size()) <= most) return all;
    }
  }

  static constexpr std::size_t many_edges = 50000;
  /// A lattice that leaves so little of many edges that sweeping them does not keep the thread for long.
  static double least_step(std::span<const FigureEdge> edges, double half_pixel) {
    constexpr double most_steps = 0x1p13;
    if (edges.size() <= many_edges) return half_pixel;
    std::array<double, 2> low = edges.front().from, high = low;
    for (const FigureEdge& edge : edges)
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min({low[k], edge.from[k], edge.to[k]});
        high[k] = std::max({high[k], edge.from[k], edge.to[k]});
      }
    return std::max(half_pixel, std::max(high[0] - low[0], high[1] - low[1]) / most_steps);
  }

  /// Part by part, where what is cut is to be seen.
  [[nodiscard]] std::map<std::int32_t, std::vector<FigureEdge>> edges_of(const Unit& unit) const {
    std::map<std::int32_t, std::vector<FigureEdge>> edges;
    for (const std::uint64_t number : unit.numbers)
      if (const auto entry = scene_.find(number)) add_edges(edges, Received(*entry->bytes), unit);
    return edges;
  }

  void add_edges(std::map<std::int32_t, std::vector<FigureEdge>>& edges, const Received& from,
                 const Unit& unit) const {
    const Numbers places = from.whole("positions"), corners = from.whole("triangles");
    const bool is_piece = from.is_piece();
    const Numbers parts = is_piece ? Numbers{} : from.whole("parts");
    const std::size_t end = is_piece ? corners.size() : 3 * from.header()["opaque"].get<std::size_t>();
    const std::int32_t part_of_piece = is_piece ? from.header()["part"].get<std::int32_t>() : 0;
    const double step = from.header()["step"], at = plane_.at - unit.shift[plane_.axis];
    const Point origin = from.header()["origin"];
    const auto point = [&](std::uint32_t vertex) {
      Point point{};
      for (std::size_t i = 0; i < 3; ++i) point[i] = origin[i] + step * places[3 * vertex + i];
      return point;
    };
    for (std::size_t i = 0; i < end; i += 3) {
      const std::array<Point, 3> triangle{point(corners[i]), point(corners[i + 1]), point(corners[i + 2])};
      const auto is_above = [&](std::size_t k) { return triangle[k % 3][plane_.axis] >= at; };
      if (is_above(0) == is_above(1) && is_above(1) == is_above(2)) continue;
      const std::int32_t part = is_piece ? part_of_piece : part_named(parts[corners[i]]);
      if (!is_piece && gaze_.hidden.contains(part)) continue;
      FigureEdge edge{};
      for (std::size_t k = 0; k < 3; ++k) {
        if (is_above(k) == is_above(k + 1)) continue;
        const bool goes_up = is_above(k + 1);
        (goes_up ? edge.to : edge.from) = goes_up ? crossing(triangle[k], triangle[(k + 1) % 3], at)
                                                  : crossing(triangle[(k + 1) % 3], triangle[k], at);
      }
      edges[part].push_back(edge);
    }
  }

  /// Where an edge crosses the plane: one point for all triangles at the edge.
  [[nodiscard]] std::array<double, 2> crossing(const Point& below, const Point& above, double at) const {
    const double share = (at - below[plane_.axis]) / (above[plane_.axis] - below[plane_.axis]);
    return {below[u()] + share * (above[u()] - below[u()]), below[v()] + share * (above[v()] - below[v()])};
  }

  void add_corners(std::vector<float>& corners, const Trapezoid& each) const {
    const auto add = [&](double along_u, double along_v) {
      corners.push_back(static_cast<float>(along_u - gaze_.middle[u()]));
      corners.push_back(static_cast<float>(along_v - gaze_.middle[v()]));
    };
    add(each.left[0], each.low);
    add(each.right[0], each.low);
    add(each.right[1], each.high);
    add(each.left[1], each.high);
  }
};

}  // namespace

std::vector<Trapezoid> filled(std::span<const FigureEdge> edges, double step) {
  return Sweep(sides_of(edges, step)).trapezoids();
}

Scene::Bytes section_of(const Scene& scene, const Gaze& gaze, std::size_t plane, std::uint64_t& state) {
  const Section section(scene, gaze, plane);
  const std::uint64_t now = section.state();
  if (std::exchange(state, now) == now) return nullptr;
  return std::make_shared<const std::string>(section.bytes());
}

}  // namespace bsp2::api
