#include "drawing/svg_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

#include "bsp2/model/expression/tessellation.hpp"

namespace bsp2::model::svg {
namespace {

constexpr int chords = 20;

/// Reads numbers that are separated by spaces, commas, or nothing but a sign.
class Numbers {
 public:
  explicit Numbers(const std::string& text) : at_(text.c_str()) {}
  void skip() {
    while (*at_ == ' ' || *at_ == ',' || *at_ == '\t' || *at_ == '\n' || *at_ == '\r') ++at_;
  }
  bool next(double& x) {
    skip();
    const bool starts = (*at_ >= '0' && *at_ <= '9') || *at_ == '-' || *at_ == '+' || *at_ == '.';
    char* end = nullptr;
    x = starts ? std::strtod(at_, &end) : 0;
    if (end == nullptr || end == at_ || !std::isfinite(x)) return false;
    at_ = end;
    return true;
  }
  /// The flag of an arc: one digit, which the next number may follow at once.
  bool flag(double& x) {
    skip();
    if (*at_ != '0' && *at_ != '1') return false;
    x = *at_++ - '0';
    return true;
  }
  char command() {
    skip();
    return (*at_ >= 'a' && *at_ <= 'z') || (*at_ >= 'A' && *at_ <= 'Z') ? *at_++ : '\0';
  }
  [[nodiscard]] std::string rest() const { return at_; }
  [[nodiscard]] bool at_end() {
    skip();
    return *at_ == '\0';
  }

 private:
  const char* at_;
};

/// The paths of one shape, in its own frame.
class Pen {
 public:
  std::vector<std::vector<Point>> paths;

  void move(const Point& p) {
    paths.push_back({p});
    at_ = p;
  }
  void line(const Point& p) { to(p); }
  /// A quarter of an ellipse, clockwise as the drawing is seen.
  void quarter(double rx, double ry, const Point& end) { arc(rx, ry, 0, false, true, end); }

  /// @return false if the data are damaged: what stands before is drawn.
  bool draw(const std::string& data) {
    Numbers numbers(data);
    char command = '\0';
    while (!numbers.at_end()) {
      if (const char c = numbers.command(); c != '\0')
        command = c;
      else if (command == '\0' || command == 'z' || command == 'Z')
        return false;
      if (!step(numbers, command)) return false;
      if (command == 'm') command = 'l';
      if (command == 'M') command = 'L';
    }
    return true;
  }

 private:
  Point at_{}, control_{};
  char last_ = '\0';  // kind of the last command: c, q, or another

  void to(const Point& p) {
    if (paths.empty()) paths.push_back({at_});
    paths.back().push_back(p);
    at_ = p;
  }

  bool point(Numbers& numbers, bool relative, Point& p) const {
    if (!numbers.next(p[0]) || !numbers.next(p[1])) return false;
    if (relative) p = {p[0] + at_[0], p[1] + at_[1]};
    return true;
  }
  [[nodiscard]] Point reflected(char kind) const {
    return last_ == kind ? Point{2 * at_[0] - control_[0], 2 * at_[1] - control_[1]} : at_;
  }

  void cubic(const Point& c1, const Point& c2, const Point& end) {
    const Point from = at_;
    for (int i = 1; i <= chords; ++i) {
      const double t = static_cast<double>(i) / chords, s = 1 - t;
      Point p;
      for (int k = 0; k < 2; ++k)
        p[k] = s * s * s * from[k] + 3 * s * s * t * c1[k] + 3 * s * t * t * c2[k] + t * t * t * end[k];
      to(p);
    }
    control_ = c2;
  }
  void quadratic(const Point& c, const Point& end) {
    const Point from = at_;
    for (int i = 1; i <= chords; ++i) {
      const double t = static_cast<double>(i) / chords, s = 1 - t;
      to({s * s * from[0] + 2 * s * t * c[0] + t * t * end[0],
          s * s * from[1] + 2 * s * t * c[1] + t * t * end[1]});
    }
    control_ = c;
  }

  /// An arc of an ellipse between two points: SVG 1.1, appendix F.6.5.
  void arc(double rx, double ry, double turn, bool large, bool sweep, const Point& end) {
    rx = std::fabs(rx), ry = std::fabs(ry);
    if (rx == 0 || ry == 0 || end == at_) return to(end);
    const double c = cosine(turn), s = sine(turn), dx = (at_[0] - end[0]) / 2, dy = (at_[1] - end[1]) / 2;
    const double x = c * dx + s * dy, y = c * dy - s * dx, d = x * x / (rx * rx) + y * y / (ry * ry);
    constexpr double flat = 1e-16;  // half of the chord's length in radii, squared: less round than the
                                    // rounding of points so far from the centre
    if (!std::isfinite(d) || (d < flat && !large)) return to(end);
    if (d > 1) rx *= std::sqrt(d), ry *= std::sqrt(d);
    double t = d > 1 ? 0 : std::sqrt(1 / d - 1);
    if (large == sweep) t = -t;
    const double u = t * rx * y / ry, v = -t * ry * x / rx;
    const Point centre{c * u - s * v + (at_[0] + end[0]) / 2, s * u + c * v + (at_[1] + end[1]) / 2};
    const double start = std::atan2((y - v) / ry, (x - u) / rx);
    double angle = std::atan2((-y - v) / ry, (-x - u) / rx) - start;
    if (sweep && angle < 0) angle += 2 * std::numbers::pi;
    if (!sweep && angle > 0) angle -= 2 * std::numbers::pi;
    const int steps = static_cast<int>(std::fabs(angle) * 10 / std::numbers::pi + 4);
    for (int i = 1; i < steps; ++i) {
      const double phi = start + angle * i / steps, p = rx * std::cos(phi), q = ry * std::sin(phi);
      to({c * p - s * q + centre[0], s * p + c * q + centre[1]});
    }
    to(end);
  }

  bool step(Numbers& numbers, char command) {
    const bool relative = command >= 'a';
    const char kind = static_cast<char>(relative ? command : command - 'A' + 'a');
    Point p, q, r;
    double x = 0;
    switch (kind) {
      case 'm':
        if (!point(numbers, relative, p)) return false;
        move(p);
        break;
      case 'l':
        if (!point(numbers, relative, p)) return false;
        to(p);
        break;
      case 'h':
        if (!numbers.next(x)) return false;
        to({relative ? at_[0] + x : x, at_[1]});
        break;
      case 'v':
        if (!numbers.next(x)) return false;
        to({at_[0], relative ? at_[1] + x : x});
        break;
      case 'c':
        if (!point(numbers, relative, p) || !point(numbers, relative, q) || !point(numbers, relative, r))
          return false;
        cubic(p, q, r);
        break;
      case 's':
        if (!point(numbers, relative, q) || !point(numbers, relative, r)) return false;
        cubic(reflected('c'), q, r);
        break;
      case 'q':
        if (!point(numbers, relative, p) || !point(numbers, relative, q)) return false;
        quadratic(p, q);
        break;
      case 't':
        if (!point(numbers, relative, q)) return false;
        quadratic(reflected('q'), q);
        break;
      case 'a': {
        double rx = 0, ry = 0, turn = 0, large = 0, sweep = 0;
        if (!numbers.next(rx) || !numbers.next(ry) || !numbers.next(turn) || !numbers.flag(large) ||
            !numbers.flag(sweep) || !point(numbers, relative, p))
          return false;
        arc(rx, ry, turn, large != 0, sweep != 0, p);
        break;
      }
      case 'z':
        if (!paths.empty()) {
          at_ = paths.back().front();
          paths.back().push_back(at_);
          paths.push_back({at_});
        }
        break;
      default:
        return false;
    }
    last_ = kind == 's' ? 'c' : kind == 't' ? 'q' : kind;
    return true;
  }
};

std::vector<Point> ellipse(double x, double y, double rx, double ry) {
  constexpr int sides = 40;
  std::vector<Point> path;
  if (!(rx > 0 && ry > 0)) return path;
  for (int i = 0; i < sides; ++i)
    path.push_back({x + rx * cosine(360.0 * i / sides), y + ry * sine(360.0 * i / sides)});
  return path;
}

/// @param fault is told if there is something else than pairs of numbers.
std::vector<Point> points_of(const xmlNode* node, std::string& fault) {
  const std::string text = attribute(node, "points");
  Numbers numbers(text);
  std::vector<Point> path;
  Point p;
  while (!numbers.at_end()) {
    if (!numbers.next(p[0]) || !numbers.next(p[1])) {
      fault = "with damaged points (drawn up to there)";
      break;
    }
    path.push_back(p);
  }
  return path;
}

std::vector<Point> closed(std::vector<Point> path) {
  if (!path.empty()) path.push_back(path[0]);
  return path;
}

/// A rectangle whose corners may be quarters of an ellipse; of two radii one may be missing.
std::vector<Point> rectangle(double x, double y, double w, double h, double rx, double ry) {
  if (!(rx > 0)) rx = ry;
  if (!(ry > 0)) ry = rx;
  if (!(rx > 0)) return closed({{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}});
  rx = std::min(rx, w / 2), ry = std::min(ry, h / 2);
  Pen pen;
  pen.move({x + rx, y});
  pen.line({x + w - rx, y});
  pen.quarter(rx, ry, {x + w, y + ry});
  pen.line({x + w, y + h - ry});
  pen.quarter(rx, ry, {x + w - rx, y + h});
  pen.line({x + rx, y + h});
  pen.quarter(rx, ry, {x, y + h - ry});
  pen.line({x, y + ry});
  pen.quarter(rx, ry, {x + rx, y});
  return std::move(pen.paths[0]);
}

}  // namespace

std::string attribute(const xmlNode* node, const char* name) {
  const std::unique_ptr<xmlChar, void (*)(void*)> value(
      xmlGetProp(node, reinterpret_cast<const xmlChar*>(name)), [](void* p) { xmlFree(p); });
  return value ? reinterpret_cast<const char*>(value.get()) : "";
}

std::vector<double> numbers_of(const std::string& text) {
  Numbers numbers(text);
  std::vector<double> all;
  for (double x = 0; numbers.next(x);) all.push_back(x);
  return all;
}

std::optional<Length> read_length(const std::string& text) {
  Numbers numbers(text);
  Length length;
  if (!numbers.next(length.number)) return std::nullopt;
  length.unit = numbers.rest();
  length.unit.erase(length.unit.find_last_not_of(" \t\r\n") + 1);
  return length;
}

double millimetres_in(const std::string& unit, double dpi) {
  if (unit.empty()) return 25.4 / dpi;
  if (unit == "px") return 25.4 / 96;
  if (unit == "mm") return 1;
  if (unit == "cm") return 10;
  if (unit == "in") return 25.4;
  if (unit == "pt") return 25.4 / 72;
  return unit == "pc" ? 25.4 / 6 : 0;
}

double user_units(const std::string& text) {
  const std::optional<Length> length = read_length(text);
  if (!length) return 0;
  return length->unit.empty() ? length->number
                              : length->number * millimetres_in(length->unit, 96) * 96 / 25.4;
}

double Viewport::share(char axis) const {
  if (axis == 'x') return size[0];
  return axis == 'y' ? size[1] : std::hypot(size[0], size[1]) / std::numbers::sqrt2;
}

std::optional<double> length_of(const std::string& text, char axis, const Viewport& viewport,
                                std::string& fault) {
  if (text.empty() || text == "auto") return std::nullopt;
  const std::optional<Length> length = read_length(text);
  if (!length) {
    fault = "with a length that is none";
    return std::nullopt;
  }
  if (length->unit == "%") return length->number / 100 * viewport.share(axis);
  if (millimetres_in(length->unit, 96) != 0) return user_units(text);
  fault = "with a length in '" + length->unit.substr(0, 10) + "'";
  return std::nullopt;
}

Shape shape_of(const xmlNode* node, const std::string& name, const Viewport& viewport) {
  Shape shape;
  const auto number = [&](const char* key, char axis) {
    return length_of(attribute(node, key), axis, viewport, shape.fault).value_or(0);
  };
  const auto size = [&](const char* key, char axis) {
    const double value = number(key, axis);
    if (value < 0) shape.fault = "with a negative length";
    return value;
  };
  const auto finish = [&](std::vector<Point> path) {
    if (shape.fault.empty()) shape.paths.push_back(std::move(path));
  };
  if (name == "path") {
    Pen pen;
    const std::string data = attribute(node, "d");
    if (!pen.draw(data) && data != "none") shape.fault = "with damaged data 'd' (drawn up to there)";
    shape.paths = std::move(pen.paths);
  } else if (name == "polyline") {
    shape.paths.push_back(points_of(node, shape.fault));
  } else if (name == "polygon") {
    shape.paths.push_back(closed(points_of(node, shape.fault)));
  } else if (name == "line") {
    const Point from{number("x1", 'x'), number("y1", 'y')}, to{number("x2", 'x'), number("y2", 'y')};
    finish({from, to});
  } else if (name == "rect") {
    const double x = number("x", 'x'), y = number("y", 'y'), w = size("width", 'x'), h = size("height", 'y');
    const double rx = size("rx", 'x'), ry = size("ry", 'y');
    if (w > 0 && h > 0) finish(rectangle(x, y, w, h, rx, ry));
  } else if (name == "circle") {
    const double x = number("cx", 'x'), y = number("cy", 'y'), r = size("r", 'r');
    finish(closed(ellipse(x, y, r, r)));
  } else if (name == "ellipse") {
    const double x = number("cx", 'x'), y = number("cy", 'y'), rx = size("rx", 'x'), ry = size("ry", 'y');
    finish(closed(ellipse(x, y, rx, ry)));
  }
  return shape;
}

}  // namespace bsp2::model::svg
