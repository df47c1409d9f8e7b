#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

// A DXF file is a list of pairs, a number that says what it is and a value, each on a line of its own.

namespace bsp2::model {
namespace {

using Point = std::array<double, 2>;

constexpr double join_distance = 0.001;

/// One entity of the drawing: its type, layer, and the numbers that matter, in their order.
struct Entity {
  std::string type, layer;
  std::map<int, std::vector<double>> numbers;
  [[nodiscard]] double number(int code) const {
    const auto found = numbers.find(code);
    return found == numbers.end() ? 0 : found->second[0];
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
  std::string code_line, value, section;
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
      if (section == "ENTITIES") entities.push_back({value, "", {}});
    } else if (code == 2 && names_section) {
      section = value;
      names_section = false;
    } else if (section == "ENTITIES" && !entities.empty()) {
      if (code == 8) entities.back().layer = value;
      if ((code >= 10 && code <= 59) || code == 70) entities.back().numbers[static_cast<int>(code)].push_back(std::strtod(value.c_str(), nullptr));
    }
  }
  return entities;
}

/// Joins lines to closed paths.
class Joiner {
 public:
  explicit Joiner(const Resolution& resolution) : resolution_(resolution) {}

  void add(const Entity& e) {
    const auto values = [&](int code) {
      const auto found = e.numbers.find(code);
      return found == e.numbers.end() ? std::vector<double>() : found->second;
    };
    if (e.type == "LINE") {
      line({e.number(10), e.number(20)}, {e.number(11), e.number(21)});
    } else if (e.type == "CIRCLE") {
      arc({e.number(10), e.number(20)}, e.number(40), 0, 360);
    } else if (e.type == "ARC") {
      const double start = e.number(50);
      double end = e.number(51);
      while (start > end) end += 360;
      arc({e.number(10), e.number(20)}, e.number(40), start, end - start);
    } else if (e.type == "LWPOLYLINE") {
      const auto x = values(10), y = values(20);
      const std::size_t n = std::min(x.size(), y.size());
      for (std::size_t i = 1; i < n; ++i) line({x[i - 1], y[i - 1]}, {x[i], y[i]});
      if (n > 1 && (static_cast<int>(e.number(70)) & 1) != 0) line({x[n - 1], y[n - 1]}, {x[0], y[0]});
    }
  }

  PlaneDrawing run() {
    PlaneDrawing drawing;
    std::vector<std::vector<std::uint32_t>> at(points_.size());
    for (std::uint32_t i = 0; i < lines_.size(); ++i)
      for (const std::uint32_t end : lines_[i]) at[end].push_back(i);
    std::vector<bool> used(lines_.size());
    for (std::uint32_t i = 0; i < lines_.size(); ++i) {
      if (used[i]) continue;
      used[i] = true;
      std::vector<std::uint32_t> path{lines_[i][0]};
      std::uint32_t end = lines_[i][1];
      while (end != path[0]) {
        const auto next = std::find_if(at[end].begin(), at[end].end(), [&](std::uint32_t l) { return !used[l]; });
        if (next == at[end].end()) break;
        used[*next] = true;
        path.push_back(end);
        end = lines_[*next][0] == end ? lines_[*next][1] : lines_[*next][0];
      }
      if (end != path[0] || path.size() < 3) continue;
      drawing.paths.corners.insert(drawing.paths.corners.end(), path.begin(), path.end());
      drawing.paths.end_face();
    }
    drawing.points = std::move(points_);
    return drawing;
  }

 private:
  Resolution resolution_;
  std::vector<Point> points_;
  std::vector<std::array<std::uint32_t, 2>> lines_;
  std::map<std::array<std::int64_t, 2>, std::vector<std::uint32_t>> squares_;  // points by squares of the join distance

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
    const std::uint32_t a = point(p), b = point(q);
    if (a != b) lines_.push_back({a, b});
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
    if (layer.empty() || entity.layer == layer) joiner.add(entity);
  return joiner.run();
}

}  // namespace bsp2::model
