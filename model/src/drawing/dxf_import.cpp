#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <unordered_map>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "drawing/dxf_file.hpp"
#include "drawing/dxf_frames.hpp"
#include "drawing/plane_spline.hpp"
#include "drawing/unread.hpp"
#include "import/imports.hpp"

// What a DXF file holds is drawn as lines, and these are joined to paths.

namespace bsp2::model {
namespace {

using dxf::Block;
using dxf::Entity;
using dxf::Map;
using Point = std::array<double, 2>;

/// All points lie on a grid, and what is next to a point of the grid that is taken moves there: so OpenSCAD
/// joins lines.
constexpr double grid = 0x1p-10;

constexpr std::size_t most_lines = 1'000'000;
/// Of the work on a drawing: an entity that is looked at, a number in it, a point of a spline. Blocks in
/// blocks multiply.
constexpr std::size_t most_steps = 20'000'000, steps_of_entity = 5, steps_of_insertion = 20;
constexpr std::size_t deepest_block = 100;
constexpr double largest_coordinate_drawn = 1e12;

/// Joins lines to paths.
class Joiner {
 public:
  void line(const Point& p, const Point& q) {
    const std::uint32_t a = point(place(p)), b = point(place(q));
    if (a != b) lines_.push_back({a, b});
  }

  /// Of those whose ends are apart on the grid.
  [[nodiscard]] std::size_t lines() const { return lines_.size(); }

  PlaneDrawing run() {
    PlaneDrawing drawing;
    std::vector<std::vector<std::uint32_t>> at(points_.size());
    for (std::uint32_t i = 0; i < lines_.size(); ++i)
      for (const std::uint32_t end : lines_[i]) at[end].push_back(i);
    std::vector<bool> used(lines_.size());
    std::vector<std::size_t> passed(points_.size());  // of the lines at a point: those before it are used
    const auto unused_at = [&](std::uint32_t end) {
      const auto& all = at[end];
      std::size_t& i = passed[end];
      while (i < all.size() && used[all[i]]) ++i;
      return i < all.size() ? std::optional(all[i]) : std::nullopt;
    };
    const auto trace = [&](std::uint32_t first, std::uint32_t start) {
      used[first] = true;
      std::vector<std::uint32_t> path{start};
      std::uint32_t end = other_end(first, start);
      while (end != start) {
        path.push_back(end);
        const auto next = unused_at(end);
        if (!next) break;
        used[*next] = true;
        end = other_end(*next, end);
      }
      if (path.size() < 3) {
        ++lone_lines_;
        return;
      }
      if (end != start && open_paths_++ == 0) first_open_ = points_[start];
      drawing.paths.corners.insert(drawing.paths.corners.end(), path.begin(), path.end());
      drawing.paths.end_face();
    };
    for (std::uint32_t i = 0; i < lines_.size(); ++i)  // open paths first, from their ends
      for (const std::uint32_t end : lines_[i])
        if (!used[i] && at[end].size() == 1) trace(i, end);
    for (std::uint32_t i = 0; i < lines_.size(); ++i)
      if (!used[i]) trace(i, lines_[i][0]);
    drawing.points = std::move(points_);
    return drawing;
  }

  /// What has bounded nothing as it was drawn, once all has run; empty if there is none.
  [[nodiscard]] std::string text_of_open(const std::string& name) const {
    std::ostringstream text;
    if (open_paths_ > 0)
      text << counted(open_paths_, "# path[s] of ") << name
           << counted(open_paths_, " [is|are] open, and closed by a straight line; ")
           << (open_paths_ > 1 ? "the first one" : "it") << " begins at (" << first_open_[0] << ", "
           << first_open_[1] << ")";
    if (open_paths_ > 0 && lone_lines_ > 0) text << "; ";
    if (lone_lines_ > 0)
      text << counted(lone_lines_, "# line[s]") << (open_paths_ > 0 ? "" : " of " + name)
           << counted(lone_lines_, " [bounds|bound] nothing");
    return text.str();
  }

 private:
  static constexpr std::uint32_t no_point = ~std::uint32_t{0};
  using Place = std::array<std::int64_t, 2>;
  struct Mixed {  // so that no drawing that is regular, or made to be slow, has many places with one value
    std::size_t operator()(const Place& place) const {
      const auto mix = [](std::uint64_t x) {
        x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
        x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
        return x ^ (x >> 31);
      };
      return mix(mix(static_cast<std::uint64_t>(place[0]) + 0x9E3779B97F4A7C15U) +
                 static_cast<std::uint64_t>(place[1]));
    }
  };
  std::vector<Point> points_;
  std::vector<std::array<std::uint32_t, 2>> lines_;
  std::unordered_map<Place, std::uint32_t, Mixed> taken_;  // points by their place on the grid
  std::size_t open_paths_ = 0, lone_lines_ = 0;            // these are a line from one point to another
  Point first_open_{};

  std::uint32_t other_end(std::uint32_t line, std::uint32_t end) const {
    return lines_[line][lines_[line][0] == end ? 1 : 0];
  }

  /// The place on the grid of a point: its own, or one next to it that is taken, the nearest first.
  Place place(const Point& p) {
    constexpr std::array<std::array<int, 2>, 9> near{
        {{0, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}}};
    const auto column = static_cast<std::int64_t>(std::round(p[0] / grid)),
               row = static_cast<std::int64_t>(std::round(p[1] / grid));
    for (const auto& [i, j] : near)
      if (taken_.contains({column + i, row + j})) return {column + i, row + j};
    taken_.emplace(Place{column, row}, no_point);
    return {column, row};
  }

  static Point position(const Place& place) {
    return {static_cast<double>(place[0]) * grid, static_cast<double>(place[1]) * grid};
  }

  std::uint32_t point(const Place& place) {
    std::uint32_t& index = taken_[place];
    if (index != no_point) return index;
    points_.push_back(position(place));
    return index = static_cast<std::uint32_t>(points_.size() - 1);
  }
};

/// Draws entities as lines.
class Drawer {
 public:
  Drawer(const dxf::File& file, const std::string& name, const std::string& layer, const DrawingFrame& frame,
         const Resolution& resolution)
      : file_(file), name_(name), layer_(layer), frame_(frame), resolution_(resolution) {}

  PlaneDrawing run(const Remarks& remarks) {
    for (const Entity& entity : file_.entities) {
      if (!layer_.empty() && entity.layer != layer_) continue;
      if (entity.flag(67, 1))
        count_of_paper(entity);
      else
        draw(entity, Map());
    }
    PlaneDrawing drawing = joiner_.run();
    if (remarks.warn && !unread_.empty()) remarks.warn(unread_.text(name_, "lines, arcs or splines"));
    if (const std::string open = joiner_.text_of_open(name_); remarks.note && !open.empty())
      remarks.note(open);
    return drawing;
  }

 private:
  const dxf::File& file_;
  const std::string& name_;
  const std::string& layer_;
  const DrawingFrame& frame_;
  const Resolution& resolution_;
  Joiner joiner_;
  std::size_t steps_ = 0;
  std::size_t lines_ = 0;                  // that were drawn, wherever
  std::size_t small_lines_ = 0;            // of these: whose ends differ, and lie on one point of the grid
  std::vector<const Block*> open_blocks_;  // those that are being inserted, each in the one before
  std::vector<std::string> block_names_;   // theirs
  Unread unread_;

  void spend(std::size_t steps) {
    if (steps > most_steps - steps_)
      throw Error("import: " + name_ +
                  " is too large: blocks inserted again and again, or splines, take more than " +
                  std::to_string(most_steps) + " steps to draw");
    steps_ += steps;
  }

  [[noreturn]] void fail(const Entity& e, const std::string& why) const {
    throw Error("import: " + name_ + ": " + e.type + " " + why);
  }

  void pass_over(const Entity& e, const std::string& kind) { unread_.add(&e, kind); }

  /// A layout is drawn on paper around what the drawing is about, in other units. Its windows show nothing of
  /// their own.
  void count_of_paper(const Entity& e) {
    if (e.type != "VIEWPORT") pass_over(e, e.type + " in paper space");
  }

  /// @param map from the coordinates that the entity stands in to those of the drawing.
  void draw(const Entity& e, const Map& map) {
    spend(cost_of(e));
    if (e.flag(60, 1) || (e.type == "ATTRIB" && e.flag(70, 1))) return;  // invisible
    const auto draw_by = kinds().find(e.type);
    if (draw_by == kinds().end()) {
      // A window of the paper, and the name of a text that an INSERT asks for: both draw nothing.
      if (e.type != "VIEWPORT" && !(e.type == "ATTDEF" && !open_blocks_.empty())) pass_over(e, e.type);
      return;
    }
    if (!e.fault.empty()) throw Error("import: " + name_ + ":" + e.fault + " of " + e.type);
    const std::size_t small_before = small_lines_, kept_before = joiner_.lines();
    (this->*draw_by->second)(e, map);
    const bool is_lost = small_lines_ > small_before && joiner_.lines() == kept_before;
    if (is_lost && e.type != "INSERT")
      pass_over(e, e.type + " too small for the grid of 1/1024 on which drawings lie");
  }

  /// What looking at an entity takes: each of its numbers is looked for in all of them.
  static std::size_t cost_of(const Entity& e) {
    constexpr std::size_t letters_in_step = 16;
    return steps_of_entity + e.numbers.size() +
           (e.type.size() + e.name.size() + e.layer.size()) / letters_in_step;
  }

  using Draw = void (Drawer::*)(const Entity&, const Map&);
  static const std::map<std::string, Draw>& kinds() {
    static const std::map<std::string, Draw> all{{"LINE", &Drawer::draw_line},
                                                 {"ARC", &Drawer::draw_arc},
                                                 {"CIRCLE", &Drawer::draw_circle},
                                                 {"ELLIPSE", &Drawer::draw_ellipse},
                                                 {"LWPOLYLINE", &Drawer::draw_light_polyline},
                                                 {"POLYLINE", &Drawer::draw_polyline},
                                                 {"SPLINE", &Drawer::draw_spline},
                                                 {"SOLID", &Drawer::draw_solid},
                                                 {"TRACE", &Drawer::draw_solid},
                                                 {"INSERT", &Drawer::draw_insert}};
    return all;
  }

  [[nodiscard]] Point placed(const Map& map, double x, double y, double z) const {
    const auto p = map(x, y, z);
    return {(p[0] - frame_.origin[0]) * frame_.scale, (p[1] - frame_.origin[1]) * frame_.scale};
  }

  void line(const Point& p, const Point& q) {
    if (++lines_ > most_lines) throw Error("import: a DXF drawing of more than a million lines");
    const double largest = std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(q[0]), std::fabs(q[1])});
    if (!(largest <= largest_coordinate_drawn) || std::isnan(p[0] + p[1] + q[0] + q[1]))
      unread_.add(nullptr, "line with a coordinate beyond 1e12");
    else
      join(p, q);
  }

  void join(const Point& p, const Point& q) {
    const std::size_t before = joiner_.lines();
    joiner_.line(p, q);
    if (joiner_.lines() == before && p != q) ++small_lines_;
  }

  static std::size_t checked_sides(double sides) {
    if (sides > max_sides)
      throw Error("import: a circle, an arc or an ellipse of a DXF drawing gets more than " +
                  std::to_string(max_sides) + " sides ($fn, $fa, $fs)");
    return sides >= 1 ? static_cast<std::size_t>(sides) : 0;
  }

  /// The sides of an arc, not rounded up. @param map from the plane that it lies in.
  [[nodiscard]] double sides_of(double radius, double angle, double full, const Map& map) const {
    return side_count(radius * map.stretch() * frame_.scale, resolution_) * angle / full;
  }

  void draw_line(const Entity& e, const Map& map) {
    line(placed(map, e.number(10), e.number(20), e.number(30)),
         placed(map, e.number(11), e.number(21), e.number(31)));
  }

  void draw_circle(const Entity& e, const Map& map) { draw_turn(e, map, 0, 360); }

  void draw_arc(const Entity& e, const Map& map) {
    const double start = e.number(50);
    double end = e.number(51);
    if (start > end) end += 360 * std::ceil((start - end) / 360);
    if (start == end) return pass_over(e, "ARC of angle 0");
    draw_turn(e, map, start, std::min(end - start, 360.0));
  }

  void draw_turn(const Entity& e, const Map& map, double start, double angle) {
    const Map plane = map.after(dxf::plane_of(e));
    const double radius = e.number(40);
    const std::size_t count = checked_sides(std::ceil(sides_of(radius, angle, 360, plane)));
    const auto at = [&](std::size_t i) {
      const double degrees = start + angle * static_cast<double>(i == count && angle == 360 ? 0 : i) /
                                         static_cast<double>(count);
      return placed(plane, e.number(10) + radius * cosine(degrees), e.number(20) + radius * sine(degrees),
                    e.number(30));
    };
    for (std::size_t i = 0; i < count; ++i) line(at(i), at(i + 1));
  }

  /// Codes 41 and 42: the first and the last angle, in radians from the major axis; 40: the minor axis as a
  /// share of it.
  void draw_ellipse(const Entity& e, const Map& map) {
    const std::array<double, 3> major{e.number(11), e.number(21), e.number(31)},
        minor = dxf::across(dxf::normal_of(e), major);
    const double start = e.number(41), full = 2 * std::numbers::pi;
    double sweep = e.number(42, full) - start;
    if (sweep < 0) sweep += full * std::ceil(-sweep / full);
    sweep = std::min(sweep, full);
    if (sweep == 0) return pass_over(e, "ELLIPSE of angle 0");
    const double radius =
        std::hypot(major[0], major[1], major[2]) * std::max(std::fabs(e.number(40, 1)), 1.0);
    const std::size_t sides = checked_sides(std::ceil(sides_of(radius, sweep, full, map)));
    const auto at = [&](std::size_t i) {
      const double angle = start + sweep * static_cast<double>(i) / static_cast<double>(sides),
                   c = std::cos(angle), s = e.number(40, 1) * std::sin(angle);
      return placed(map, e.number(10) + c * major[0] + s * minor[0],
                    e.number(20) + c * major[1] + s * minor[1], e.number(30) + c * major[2] + s * minor[2]);
    };
    for (std::size_t i = 0; i < sides; ++i) line(at(i), at(i + 1));
  }

  struct Corner {
    double x, y, z, bulge;
  };

  void draw_path(const std::vector<Corner>& corners, bool is_closed, const Map& plane) {
    const std::size_t n = corners.size();
    for (std::size_t i = 0; i + 1 < n; ++i) draw_bulge(corners[i], corners[i + 1], plane);
    if (n > 1 && is_closed) draw_bulge(corners[n - 1], corners[0], plane);
  }

  /// A line, or an arc that turns by four times the angle whose tangent its bulge is, to the left if that is
  /// positive.
  void draw_bulge(const Corner& from, const Corner& to, const Map& plane) {
    const Point p = placed(plane, from.x, from.y, from.z), q = placed(plane, to.x, to.y, to.z);
    const double x = to.x - from.x, y = to.y - from.y, angle = 4 * std::atan(std::fabs(from.bulge));
    const double chords =
        (1 + from.bulge * from.bulge) / (2 * std::fabs(from.bulge));  // the diameter, in chords
    const double radius = std::hypot(x, y) * chords / 2;
    if (from.bulge == 0 || !std::isfinite(radius) || radius == 0) return line(p, q);
    constexpr double rounding = 1e-3;  // of sides: a quarter of a circle has a bulge of 0.414214
    const std::size_t count =
        checked_sides(std::ceil(sides_of(radius, angle, 2 * std::numbers::pi, plane) - rounding));
    Point last = p;
    for (std::size_t i = 1; i < count; ++i) {
      // The chord from the first corner to a point of the arc: how long it is, and how far it turns from the
      // chord to the last one.
      const double turned = angle * static_cast<double>(i) / static_cast<double>(count),
                   length = chords * std::sin(turned / 2);
      const double off = (turned - angle) / 2, c = length * std::cos(off),
                   s = length * (from.bulge > 0 ? std::sin(off) : -std::sin(off));
      const Point next = placed(plane, from.x + c * x - s * y, from.y + s * x + c * y, from.z);
      line(last, next);
      last = next;
    }
    line(last, q);
  }

  void draw_light_polyline(const Entity& e, const Map& map) {
    std::vector<Corner> corners;
    bool is_wide = e.number(43) > 0;
    const double elevation = e.number(38);
    for (const auto& [code, value] : e.numbers) {
      if (code == 10) corners.push_back({value, 0, elevation, 0});
      if (corners.empty()) continue;
      if (code == 20) corners.back().y = value;
      if (code == 42) corners.back().bulge = value;
      is_wide = is_wide || ((code == 40 || code == 41) && value > 0);
    }
    if (is_wide) pass_over(e, "LWPOLYLINE (its width only)");
    draw_path(corners, e.flag(70, 1), map.after(dxf::plane_of(e)));
  }

  /// The kind that older programs write.
  void draw_polyline(const Entity& e, const Map& map) {
    constexpr std::int64_t closed = 1, fitted = 4, in_space = 8, mesh = 16, many_faces = 64,
                           control_point = 16;
    if (e.flag(70, mesh | many_faces)) return pass_over(e, "POLYLINE that is a mesh");
    std::vector<Corner> corners;
    bool is_wide = e.number(40) > 0 || e.number(41) > 0;
    for (const Entity& vertex : e.vertices) {
      spend(1 + vertex.numbers.size());
      if (!vertex.fault.empty()) throw Error("import: " + name_ + ":" + vertex.fault + " of VERTEX");
      if (e.flag(70, fitted) && vertex.flag(70, control_point)) continue;
      corners.push_back({vertex.number(10), vertex.number(20),
                         e.flag(70, in_space) ? vertex.number(30) : e.number(30), vertex.number(42)});
      is_wide = is_wide || vertex.number(40) > 0 || vertex.number(41) > 0;
    }
    if (is_wide) pass_over(e, "POLYLINE (its width only)");
    draw_path(corners, e.flag(70, closed), e.flag(70, in_space) ? map : map.after(dxf::plane_of(e)));
  }

  [[nodiscard]] std::vector<Point> points_of(const Entity& e, int code, const Map& map) const {
    const std::vector<double> x = e.all(code), y = e.all(code + 10), z = e.all(code + 20);
    if (x.size() != y.size())
      fail(e, "has " + counted(x.size(), "# value[s] of group code ") + std::to_string(code) + " and " +
                  std::to_string(y.size()) + " of " + std::to_string(code + 10));
    std::vector<Point> points;
    for (std::size_t i = 0; i < x.size(); ++i)
      points.push_back(placed(map, x[i], y[i], z.size() == x.size() ? z[i] : 0));
    return points;
  }

  /// By its control points, or if it has none through its fit points.
  void draw_spline(const Entity& e, const Map& map) {
    constexpr std::int64_t closed = 1;
    PlaneSpline spline;
    spline.points = points_of(e, 10, map);
    if (spline.points.empty()) {
      const auto direction = [&](int code) {
        const Point from = placed(map, 0, 0, 0),
                    to = placed(map, e.number(code), e.number(code + 10), e.number(code + 20));
        return Point{to[0] - from[0], to[1] - from[1]};
      };
      std::vector<Point> through = points_of(e, 11, map);
      spend(through.size());
      spline = spline_through(std::move(through), {direction(12), direction(13)}, e.flag(70, closed));
      if (spline.points.empty()) return pass_over(e, "SPLINE without points");
    } else {
      spline.degree = static_cast<int>(std::clamp(e.number(71, 3), -1.0, 1000.0));
      spline.knots = e.all(40);
      spline.weights = e.all(41);
      if (spline.weights.empty()) spline.weights.assign(spline.points.size(), 1);
    }
    if (const std::string fault = spline.fault(); !fault.empty()) fail(e, fault);
    const std::vector<Point> path = sampled(spline, resolution_, [this](std::size_t steps) { spend(steps); });
    for (std::size_t i = 1; i < path.size(); ++i) line(path[i - 1], path[i]);
  }

  /// Its corners stand in the order of a Z.
  void draw_solid(const Entity& e, const Map& map) {
    const Map plane = map.after(dxf::plane_of(e));
    const int last = e.has(13) ? 13 : 12;
    std::vector<Corner> corners;
    for (const int code : {10, 11, last, 12})
      corners.push_back({e.number(code), e.number(code + 10), e.number(code + 20), 0});
    draw_path(corners, true, plane);
  }

  /// A block, scaled by codes 41 to 43, turned by 50 degrees, moved, and put there again in 70 columns and 71
  /// rows.
  void draw_insert(const Entity& e, const Map& map) {
    const Block* block = file_.find_block(e.name);
    if (block == nullptr)
      return pass_over(e, "INSERT of a block '" + e.name.substr(0, 60) + "' that is not there");
    constexpr std::int64_t other_file = 4;
    if (block->head.flag(70, other_file) && block->entities.empty())
      return pass_over(e, "INSERT of another file");
    spend(block->head.numbers.size());
    if (!block->head.fault.empty()) throw Error("import: " + name_ + ":" + block->head.fault + " of BLOCK");
    if (block->entities.empty()) return;
    open(*block, e.name);
    const Map plane = map.after(dxf::plane_of(e));
    const double columns = std::max(std::trunc(e.number(70, 1)), 1.0),
                 rows = std::max(std::trunc(e.number(71, 1)), 1.0);
    const double c = cosine(e.number(50)), s = sine(e.number(50)), across = e.number(44),
                 along = e.number(45);
    const double x0 = e.number(10), y0 = e.number(20), z0 = e.number(30);
    const Map scaled = Map::scaled({e.number(41, 1), e.number(42, 1), e.number(43, 1)},
                                   {block->head.number(10), block->head.number(20), block->head.number(30)});
    for (double row = 0; row < rows; ++row)
      for (double column = 0; column < columns; ++column) {
        spend(steps_of_insertion);
        const double x = column * across, y = row * along;
        const Map turned = Map::turned(c, s, {x0 + c * x - s * y, y0 + s * x + c * y, z0});
        const Map inner = plane.after(turned.after(scaled));
        for (const Entity& entity : block->entities) draw(entity, inner);
      }
    open_blocks_.pop_back();
    block_names_.pop_back();
  }

  void open(const Block& block, const std::string& name) {
    const bool is_cycle = std::find(open_blocks_.begin(), open_blocks_.end(), &block) != open_blocks_.end();
    open_blocks_.push_back(&block);
    block_names_.push_back(name.substr(0, 60));
    if (is_cycle) {
      std::string chain;
      for (const std::string& each : block_names_)
        chain += (chain.empty() ? "'" : ", which inserts '") + each + "'";
      throw Error("import: " + name_ + ": a block inserts itself: " + chain.substr(0, 400));
    }
    if (open_blocks_.size() > deepest_block)
      throw Error("import: " + name_ + ": blocks are inserted in each other more than " +
                  std::to_string(deepest_block) + " deep");
  }
};

/// How $INSUNITS says what a length is in, and how many millimetres that is; 0: more than anybody draws.
struct Unit {
  const char* name;
  const char* millimetres;
};
constexpr std::array<Unit, 17> units{{{"", ""},
                                      {"inches", "25.4"},
                                      {"feet", "304.8"},
                                      {"miles", ""},
                                      {"millimetres", "1"},
                                      {"centimetres", "10"},
                                      {"metres", "1000"},
                                      {"kilometres", "1000000"},
                                      {"microinches", "0.0000254"},
                                      {"thousandths of an inch", "0.0254"},
                                      {"yards", "914.4"},
                                      {"angstroms", ""},
                                      {"nanometres", "0.000001"},
                                      {"micrometres", "0.001"},
                                      {"decimetres", "100"},
                                      {"decametres", "10000"},
                                      {"hectometres", "100000"}}};

std::string text_of_units(const std::string& name, int code, double scale) {
  const Unit unit = code > 0 && static_cast<std::size_t>(code) < units.size()
                        ? units[static_cast<std::size_t>(code)]
                        : Unit{"", ""};
  const std::string begin = name + " is drawn in " +
                            (*unit.name != 0 ? unit.name : "the units number " + std::to_string(code)) +
                            " ($INSUNITS)";
  if (scale != 1) return begin + "; its lengths are multiplied by the scale of the import alone";
  const std::string is_millimetre = unit.millimetres;
  return begin + "; nothing is scaled, one of them is one unit of the model" +
         (is_millimetre.empty() || is_millimetre == "1"
              ? ""
              : "; scale = " + is_millimetre + " in the import makes millimetres of them");
}

}  // namespace

PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer,
                        const DrawingFrame& frame, const Resolution& resolution, const Remarks& remarks) {
  const dxf::File file = dxf::read_file(path);
  const std::string name = path.string();
  if (remarks.note && file.units != 0) remarks.note(text_of_units(name, file.units, frame.scale));
  return Drawer(file, name, layer, frame, resolution).run(remarks);
}

}  // namespace bsp2::model
