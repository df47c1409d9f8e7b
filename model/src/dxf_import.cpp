#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

// A DXF file is a list of pairs, a number that says what it is and a value, each on a line of its own.

namespace bsp2::model {
namespace {

using Point = std::array<double, 2>;

/// All points lie on a grid, and what is next to a point of the grid that is taken moves there: so OpenSCAD joins lines.
constexpr double grid = 0x1p-10;

constexpr std::size_t most_lines = 1'000'000;

/// One entity of the drawing: its type, layer, the block that it names or belongs to, and the numbers that matter, in their
/// order. The entities of a block are in no drawing until an INSERT puts the block there.
struct Entity {
  std::string type, layer, name, block;
  std::map<int, std::vector<double>> numbers;
  [[nodiscard]] double number(int code, double missing = 0) const {
    const auto found = numbers.find(code);
    return found == numbers.end() ? missing : found->second[0];
  }
};

std::string trimmed(std::string text) {
  text.erase(0, std::min(text.find_first_not_of(" \t\r"), text.size()));
  text.erase(text.find_last_not_of(" \t\r") + 1);
  return text;
}

std::vector<Entity> read_entities(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error("import: " + path.string() + " cannot be read");
  std::vector<Entity> entities;
  std::string code_line, value, section, block;
  std::size_t line = 1;  // of the group code
  bool names_section = false, ends = false;
  for (; std::getline(file, code_line); line += 2) {
    char* end = nullptr;
    const std::string code_text = trimmed(code_line);
    if (!std::getline(file, value)) {
      if (code_text.empty() || code_text == "\x1a") break;  // as old systems end a text
      throw Error("import: " + path.string() + " is cut off: line " + std::to_string(line) + " is its last one, and a group code without a value");
    }
    const long code = std::strtol(code_text.c_str(), &end, 10);
    if (code_text.empty() || *end != '\0') throw Error("import: " + path.string() + " is no DXF file: '" + code_text.substr(0, 40) + "' is no group code");
    value = trimmed(value);
    if (code == 0) {
      names_section = value == "SECTION";
      if (value == "ENDSEC") section.clear();
      if (value == "ENDBLK" || value == "ENDSEC") block.clear();
      ends = ends || value == "EOF";
      if (section == "ENTITIES" || section == "BLOCKS") entities.push_back({value, "", "", block, {}});
    } else if (code == 2 && names_section) {
      section = value;
      names_section = false;
      ends = ends || value == "ENTITIES";  // all that is read has been there once it ends
    } else if (section != "" && !entities.empty()) {
      if (code == 2) entities.back().name = value;
      if (code == 2 && entities.back().type == "BLOCK") block = value;
      if (code == 8) entities.back().layer = value;
      if ((code >= 10 && code <= 59) || code == 70) entities.back().numbers[static_cast<int>(code)].push_back(std::strtod(value.c_str(), nullptr));
    }
  }
  if (!ends) throw Error("import: " + path.string() + " is cut off: it has neither a section ENTITIES nor an end (EOF)");
  if (!section.empty()) throw Error("import: " + path.string() + " is cut off: its section " + section.substr(0, 40) + " has no end");
  return entities;
}

/// Joins lines to paths.
class Joiner {
 public:
  explicit Joiner(const DrawingFrame& frame, const Resolution& resolution) : frame_(frame), resolution_(resolution) {}

  void add(const Entity& e) {
    const auto values = [&](int code) {
      const auto found = e.numbers.find(code);
      return found == e.numbers.end() ? std::vector<double>() : found->second;
    };
    block_ = e.block.empty() ? nullptr : &blocks_[e.block];
    // A block has its own frame, until it is inserted.
    const double scale = block_ == nullptr ? frame_.scale : 1;
    const auto placed = [&](double x, double y) {
      return block_ == nullptr ? Point{(x - frame_.origin[0]) * scale, (y - frame_.origin[1]) * scale} : Point{x, y};
    };
    const auto centre = [&] { return placed(e.number(10), e.number(20)); };
    if (e.type == "LINE") {
      line(centre(), placed(e.number(11), e.number(21)));
    } else if (e.type == "CIRCLE") {
      arc(centre(), e.number(40) * scale, 0, 360);
    } else if (e.type == "ARC") {
      const double start = e.number(50);
      double end = e.number(51);
      if (start > end) end += 360 * std::ceil((start - end) / 360);
      arc(centre(), e.number(40) * scale, start, std::min(end - start, 360.0));
    } else if (e.type == "ELLIPSE") {
      ellipse(e, centre(), scale);
    } else if (e.type == "INSERT") {
      insert(e, centre(), scale);
    } else if (e.type == "LWPOLYLINE") {
      const auto x = values(10), y = values(20);
      const std::size_t n = std::min(x.size(), y.size());
      const auto at = [&](std::size_t i) { return placed(x[i], y[i]); };
      for (std::size_t i = 1; i < n; ++i) line(at(i - 1), at(i));
      if (n > 1 && std::fmod(std::trunc(std::fabs(e.number(70))), 2) == 1) line(at(n - 1), at(0));
    }
  }

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
      if (path.size() < 3) return;
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

 private:
  using Line = std::array<Point, 2>;
  static constexpr std::uint32_t no_point = ~std::uint32_t{0};
  DrawingFrame frame_;
  Resolution resolution_;
  std::map<std::string, std::vector<Line>> blocks_;
  std::vector<Line>* block_ = nullptr;  // where lines go instead of into the drawing
  std::size_t lines_made_ = 0;
  std::vector<Point> points_;
  std::vector<std::array<std::uint32_t, 2>> lines_;
  std::map<std::array<std::int64_t, 2>, std::uint32_t> taken_;  // points by their place on the grid; those of blocks stand for none

  std::uint32_t other_end(std::uint32_t line, std::uint32_t end) const { return lines_[line][lines_[line][0] == end ? 1 : 0]; }

  /// The place on the grid of a point: its own, or one next to it that is taken, the nearest first.
  std::array<std::int64_t, 2> place(const Point& p) {
    constexpr std::array<std::array<int, 2>, 9> near{{{0, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}}};
    const auto column = static_cast<std::int64_t>(std::round(p[0] / grid)), row = static_cast<std::int64_t>(std::round(p[1] / grid));
    for (const auto& [i, j] : near)
      if (taken_.contains({column + i, row + j})) return {column + i, row + j};
    taken_.emplace(std::array{column, row}, no_point);
    return {column, row};
  }

  static Point position(const std::array<std::int64_t, 2>& place) { return {static_cast<double>(place[0]) * grid, static_cast<double>(place[1]) * grid}; }

  std::uint32_t point(const std::array<std::int64_t, 2>& place) {
    std::uint32_t& index = taken_[place];
    if (index != no_point) return index;
    points_.push_back(position(place));
    return index = static_cast<std::uint32_t>(points_.size() - 1);
  }

  void line(const Point& p, const Point& q) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(q[0]) || !std::isfinite(q[1])) return;
    if (std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(q[0]), std::fabs(q[1])}) > 1e12) return;
    if (++lines_made_ > most_lines) throw Error("import: a DXF drawing of more than a million lines");
    const auto p_place = place(p), q_place = place(q);
    if (block_ != nullptr) {
      block_->push_back({position(p_place), position(q_place)});
      return;
    }
    const std::uint32_t a = point(p_place), b = point(q_place);
    if (a != b) lines_.push_back({a, b});
  }

  static void refuse_many(double sides) {
    if (sides > max_sides)
      throw Error("import: a circle, an arc or an ellipse of a DXF drawing gets more than " + std::to_string(max_sides) +
                  " sides ($fn, $fa, $fs)");
  }

  /// Codes 41 and 42: the first and the last angle, in radians from the major axis; 40: the minor axis as a share of it.
  void ellipse(const Entity& e, const Point& centre, double scale) {
    const double x = e.number(11) * scale, y = e.number(21) * scale, start = e.number(41), full = 2 * std::numbers::pi;
    double sweep = e.number(42) - start;
    if (sweep < 0) sweep += full * std::ceil(-sweep / full);
    sweep = std::min(sweep, full);
    const double sides = std::ceil(side_count(std::hypot(x, y), resolution_) * sweep / full);
    if (!(sides >= 1)) return;
    refuse_many(sides);
    const auto at = [&](double i) {
      const double angle = start + sweep * i / sides, c = std::cos(angle), s = e.number(40) * std::sin(angle);
      return Point{centre[0] + c * x - s * y, centre[1] + c * y + s * x};
    };
    for (double i = 0; i < sides; ++i) line(at(i), at(i + 1));
  }

  /// A block, scaled by codes 41 and 42, turned by 50 degrees, and moved.
  void insert(const Entity& e, const Point& at, double scale) {
    const auto found = blocks_.find(e.name);
    if (found == blocks_.end()) return;
    const double c = cosine(e.number(50)), s = sine(e.number(50));
    const auto placed = [&](const Point& p) {
      const double x = p[0] * e.number(41, 1) * scale, y = p[1] * e.number(42, 1) * scale;
      return Point{at[0] + c * x - s * y, at[1] + s * x + c * y};
    };
    for (const Line& copied : std::vector(found->second)) line(placed(copied[0]), placed(copied[1]));  // a copy: a block may insert itself
  }

  void arc(const Point& centre, double radius, double start, double angle) {
    const double sides = std::ceil(side_count(radius, resolution_) * angle / 360);
    if (!(sides >= 1)) return;
    refuse_many(sides);
    const auto count = static_cast<std::uint32_t>(sides);
    const auto at = [&](std::uint32_t i) {
      const double degrees = start + angle * (i == count && angle == 360 ? 0 : i) / count;
      return Point{centre[0] + radius * cosine(degrees), centre[1] + radius * sine(degrees)};
    };
    for (std::uint32_t i = 0; i < count; ++i) line(at(i), at(i + 1));
  }
};

}  // namespace

PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer, const DrawingFrame& frame, const Resolution& resolution) {
  Joiner joiner(frame, resolution);
  for (const Entity& entity : read_entities(path))
    if (layer.empty() || entity.layer == layer || !entity.block.empty()) joiner.add(entity);
  return joiner.run();
}

}  // namespace bsp2::model
