#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

// A DXF file is a list of pairs, a number that says what it is and a value, each on a line of its own.

namespace bsp2::model {
namespace {

using Point = std::array<double, 2>;

constexpr double join_distance = 0.001;

constexpr std::size_t most_lines = 10'000'000;

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
  bool names_section = false;
  while (std::getline(file, code_line) && std::getline(file, value)) {
    char* end = nullptr;
    const std::string code_text = trimmed(code_line);
    const long code = std::strtol(code_text.c_str(), &end, 10);
    if (code_text.empty() || *end != '\0') throw Error("import: " + path.string() + " is no DXF file: '" + code_text.substr(0, 40) + "' is no group code");
    value = trimmed(value);
    if (code == 0) {
      names_section = value == "SECTION";
      if (value == "ENDSEC") section.clear();
      if (value == "ENDBLK" || value == "ENDSEC") block.clear();
      if (section == "ENTITIES" || section == "BLOCKS") entities.push_back({value, "", "", block, {}});
    } else if (code == 2 && names_section) {
      section = value;
      names_section = false;
    } else if (section != "" && !entities.empty()) {
      if (code == 2) entities.back().name = value;
      if (code == 2 && entities.back().type == "BLOCK") block = value;
      if (code == 8) entities.back().layer = value;
      if ((code >= 10 && code <= 59) || code == 70) entities.back().numbers[static_cast<int>(code)].push_back(std::strtod(value.c_str(), nullptr));
    }
  }
  return entities;
}

/// Joins lines to paths.
class Joiner {
 public:
  explicit Joiner(const Resolution& resolution) : resolution_(resolution) {}

  void add(const Entity& e) {
    const auto values = [&](int code) {
      const auto found = e.numbers.find(code);
      return found == e.numbers.end() ? std::vector<double>() : found->second;
    };
    block_ = e.block.empty() ? nullptr : &blocks_[e.block];
    if (e.type == "LINE") {
      line({e.number(10), e.number(20)}, {e.number(11), e.number(21)});
    } else if (e.type == "CIRCLE") {
      arc({e.number(10), e.number(20)}, e.number(40), 0, 360);
    } else if (e.type == "ARC") {
      const double start = e.number(50);
      double end = e.number(51);
      if (start > end) end += 360 * std::ceil((start - end) / 360);
      arc({e.number(10), e.number(20)}, e.number(40), start, end - start);
    } else if (e.type == "ELLIPSE") {
      ellipse(e);
    } else if (e.type == "INSERT") {
      insert(e);
    } else if (e.type == "LWPOLYLINE") {
      const auto x = values(10), y = values(20);
      const std::size_t n = std::min(x.size(), y.size());
      for (std::size_t i = 1; i < n; ++i) line({x[i - 1], y[i - 1]}, {x[i], y[i]});
      if (n > 1 && std::fmod(std::trunc(std::fabs(e.number(70))), 2) == 1) line({x[n - 1], y[n - 1]}, {x[0], y[0]});
    }
  }

  PlaneDrawing run() {
    PlaneDrawing drawing;
    std::vector<std::vector<std::uint32_t>> at(points_.size());
    for (std::uint32_t i = 0; i < lines_.size(); ++i)
      for (const std::uint32_t end : lines_[i]) at[end].push_back(i);
    std::vector<bool> used(lines_.size());
    const auto trace = [&](std::uint32_t first, std::uint32_t start) {
      used[first] = true;
      std::vector<std::uint32_t> path{start};
      std::uint32_t end = other_end(first, start);
      while (end != start) {
        path.push_back(end);
        const auto next = std::find_if(at[end].begin(), at[end].end(), [&](std::uint32_t l) { return !used[l]; });
        if (next == at[end].end()) break;
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
  Resolution resolution_;
  std::map<std::string, std::vector<Line>> blocks_;
  std::vector<Line>* block_ = nullptr;  // where lines go instead of into the drawing
  std::size_t lines_made_ = 0;
  std::vector<Point> points_;
  std::vector<std::array<std::uint32_t, 2>> lines_;
  std::map<std::array<std::int64_t, 2>, std::vector<std::uint32_t>> squares_;  // points by squares of the join distance

  std::uint32_t other_end(std::uint32_t line, std::uint32_t end) const { return lines_[line][lines_[line][0] == end ? 1 : 0]; }

  std::uint32_t point(const Point& p) {
    const auto column = static_cast<std::int64_t>(std::floor(p[0] / join_distance)), row = static_cast<std::int64_t>(std::floor(p[1] / join_distance));
    for (std::int64_t i = column - 1; i <= column + 1; ++i)
      for (std::int64_t j = row - 1; j <= row + 1; ++j)
        if (const auto found = squares_.find({i, j}); found != squares_.end())
          for (const std::uint32_t n : found->second)
            if (std::hypot(points_[n][0] - p[0], points_[n][1] - p[1]) <= join_distance) return n;
    points_.push_back(p);
    squares_[{column, row}].push_back(static_cast<std::uint32_t>(points_.size() - 1));
    return static_cast<std::uint32_t>(points_.size() - 1);
  }

  void line(const Point& p, const Point& q) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(q[0]) || !std::isfinite(q[1])) return;
    if (std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(q[0]), std::fabs(q[1])}) > 1e12) return;
    if (++lines_made_ > most_lines) throw Error("import: a DXF drawing of more than 10 million lines");
    if (block_ != nullptr) {
      block_->push_back({p, q});
      return;
    }
    const std::uint32_t a = point(p), b = point(q);
    if (a != b) lines_.push_back({a, b});
  }

  /// Codes 41 and 42: the first and the last angle, in radians from the major axis; 40: the minor axis as a share of it.
  void ellipse(const Entity& e) {
    const double x = e.number(11), y = e.number(21), start = e.number(41), full = 2 * std::numbers::pi;
    double sweep = e.number(42) - start;
    if (sweep < 0) sweep += full * std::ceil(-sweep / full);
    const double sides = std::ceil(side_count(std::hypot(x, y), resolution_) * sweep / full);
    if (!(sides >= 1 && sides <= max_sides)) return;
    const auto at = [&](double i) {
      const double angle = start + sweep * i / sides, c = std::cos(angle), s = e.number(40) * std::sin(angle);
      return Point{e.number(10) + c * x - s * y, e.number(20) + c * y + s * x};
    };
    for (double i = 0; i < sides; ++i) line(at(i), at(i + 1));
  }

  /// A block, scaled by codes 41 and 42, turned by 50 degrees, and moved.
  void insert(const Entity& e) {
    const auto found = blocks_.find(e.name);
    if (found == blocks_.end()) return;
    const double c = cosine(e.number(50)), s = sine(e.number(50));
    const auto placed = [&](const Point& p) {
      const double x = p[0] * e.number(41, 1), y = p[1] * e.number(42, 1);
      return Point{e.number(10) + c * x - s * y, e.number(20) + s * x + c * y};
    };
    for (const Line& copied : std::vector(found->second)) line(placed(copied[0]), placed(copied[1]));  // a copy: a block may insert itself
  }

  void arc(const Point& centre, double radius, double start, double angle) {
    const double sides = std::ceil(side_count(radius, resolution_) * angle / 360);
    if (!(sides >= 1 && sides <= max_sides)) return;
    const auto count = static_cast<std::uint32_t>(sides);
    const auto at = [&](std::uint32_t i) {
      const double degrees = start + angle * (i == count && angle == 360 ? 0 : i) / count;
      return Point{centre[0] + radius * cosine(degrees), centre[1] + radius * sine(degrees)};
    };
    for (std::uint32_t i = 0; i < count; ++i) line(at(i), at(i + 1));
  }
};

}  // namespace

PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer, const Resolution& resolution) {
  Joiner joiner(resolution);
  for (const Entity& entity : read_entities(path))
    if (layer.empty() || entity.layer == layer || !entity.block.empty()) joiner.add(entity);
  return joiner.run();
}

}  // namespace bsp2::model
