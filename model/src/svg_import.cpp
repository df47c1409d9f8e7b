#include <libxml/parser.h>
#include <libxml/tree.h>

#include <algorithm>
#include <clipper.hpp>
#include <cmath>
#include <sstream>
#include <cstdlib>
#include <memory>
#include <numbers>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

// Scalable Vector Graphics 1.1, as far as OpenSCAD 2021.01 reads it: the areas of shapes; curves have 20 chords.

namespace bsp2::model {
namespace {

using Point = std::array<double, 2>;
constexpr int chords = 20;

/// The affine map (x, y) -> (a x + c y + e, b x + d y + f), as SVG writes it.
struct Map {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  [[nodiscard]] Point operator()(const Point& p) const { return {a * p[0] + c * p[1] + e, b * p[0] + d * p[1] + f}; }
  [[nodiscard]] Map after(const Map& m) const {
    return {a * m.a + c * m.b, b * m.a + d * m.b, a * m.c + c * m.d, b * m.c + d * m.d, a * m.e + c * m.f + e, b * m.e + d * m.f + f};
  }
};

std::string attribute(const xmlNode* node, const char* name) {
  const std::unique_ptr<xmlChar, void (*)(void*)> value(xmlGetProp(node, reinterpret_cast<const xmlChar*>(name)), [](void* p) { xmlFree(p); });
  return value ? reinterpret_cast<const char*>(value.get()) : "";
}

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

 private:
  const char* at_;
};

std::vector<double> numbers_of(const std::string& text) {
  Numbers numbers(text);
  std::vector<double> all;
  for (double x = 0; numbers.next(x);) all.push_back(x);
  return all;
}

/// A length in millimetres, those without unit at `dpi`; 0 for percentages and what is no length.
double length_of(const std::string& text, double dpi) {
  Numbers numbers(text);
  double x = 0;
  if (!numbers.next(x)) return 0;
  const std::string unit = numbers.rest();
  if (unit.starts_with("mm")) return x;
  if (unit.starts_with("cm")) return 10 * x;
  if (unit.starts_with("in")) return 25.4 * x;
  if (unit.starts_with("pt")) return 25.4 / 72 * x;
  if (unit.starts_with("pc")) return 25.4 / 6 * x;
  return unit.starts_with("%") ? 0 : 25.4 / dpi * x;
}

Map map_of(std::string text) {
  Map map;
  for (std::size_t open = 0; (open = text.find('(')) != std::string::npos;) {
    const std::size_t close = std::min(text.find(')', open), text.size());
    const auto v = numbers_of(text.substr(open + 1, close - open - 1));
    const auto at = [&](std::size_t i, double missing) { return i < v.size() ? v[i] : missing; };
    const std::string name = text.substr(0, open);
    const auto is = [&](const char* what) { return name.find(what) != std::string::npos; };
    Map next;
    if (is("matrix") && v.size() == 6) next = {v[0], v[1], v[2], v[3], v[4], v[5]};
    if (is("translate")) next = {1, 0, 0, 1, at(0, 0), at(1, 0)};
    if (is("scale")) next = {at(0, 1), 0, 0, at(1, at(0, 1)), 0, 0};
    if (is("skewX")) next.c = std::tan(at(0, 0) * std::numbers::pi / 180);
    if (is("skewY")) next.b = std::tan(at(0, 0) * std::numbers::pi / 180);
    if (is("rotate")) {
      const double c = cosine(at(0, 0)), s = sine(at(0, 0)), x = at(1, 0), y = at(2, 0);
      next = {c, s, -s, c, x - c * x + s * y, y - s * x - c * y};
    }
    map = map.after(next);
    text.erase(0, std::min(close + 1, text.size()));
  }
  return map;
}

/// The paths of one shape, in its own frame.
class Pen {
 public:
  std::vector<std::vector<Point>> paths;

  void draw(const std::string& data) {
    Numbers numbers(data);
    char command = '\0';
    for (;;) {
      if (const char c = numbers.command(); c != '\0')
        command = c;
      else if (command == '\0' || command == 'z' || command == 'Z')
        return;
      if (!step(numbers, command)) return;
      if (command == 'm') command = 'l';
      if (command == 'M') command = 'L';
    }
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
  [[nodiscard]] Point reflected(char kind) const { return last_ == kind ? Point{2 * at_[0] - control_[0], 2 * at_[1] - control_[1]} : at_; }

  void cubic(const Point& c1, const Point& c2, const Point& end) {
    const Point from = at_;
    for (int i = 1; i <= chords; ++i) {
      const double t = static_cast<double>(i) / chords, s = 1 - t;
      Point p;
      for (int k = 0; k < 2; ++k) p[k] = s * s * s * from[k] + 3 * s * s * t * c1[k] + 3 * s * t * t * c2[k] + t * t * t * end[k];
      to(p);
    }
    control_ = c2;
  }
  void quadratic(const Point& c, const Point& end) {
    const Point from = at_;
    for (int i = 1; i <= chords; ++i) {
      const double t = static_cast<double>(i) / chords, s = 1 - t;
      to({s * s * from[0] + 2 * s * t * c[0] + t * t * end[0], s * s * from[1] + 2 * s * t * c[1] + t * t * end[1]});
    }
    control_ = c;
  }

  /// An arc of an ellipse between two points: SVG 1.1, appendix F.6.5.
  void arc(double rx, double ry, double turn, bool large, bool sweep, const Point& end) {
    rx = std::fabs(rx), ry = std::fabs(ry);
    if (rx == 0 || ry == 0 || end == at_) return to(end);
    const double c = cosine(turn), s = sine(turn), dx = (at_[0] - end[0]) / 2, dy = (at_[1] - end[1]) / 2;
    const double x = c * dx + s * dy, y = c * dy - s * dx, d = x * x / (rx * rx) + y * y / (ry * ry);
    if (d > 1) rx *= std::sqrt(d), ry *= std::sqrt(d);
    const double across = rx * rx * y * y + ry * ry * x * x;
    double t = std::sqrt(std::max(0.0, rx * rx * ry * ry - across) / across);
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
        paths.push_back({p});
        at_ = p;
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
        if (!point(numbers, relative, p) || !point(numbers, relative, q) || !point(numbers, relative, r)) return false;
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
        if (!numbers.next(rx) || !numbers.next(ry) || !numbers.next(turn) || !numbers.flag(large) || !numbers.flag(sweep) || !point(numbers, relative, p)) return false;
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

std::vector<Point> ellipse(double x, double y, double rx, double ry, const Resolution& resolution) {
  std::vector<Point> path;
  const double sides = side_count(std::max(rx, ry), resolution);
  if (!(rx > 0 && ry > 0) || !(sides <= max_sides)) return path;
  for (int i = 0; i < static_cast<int>(sides); ++i) path.push_back({x + rx * cosine(360.0 * i / sides), y + ry * sine(360.0 * i / sides)});
  return path;
}

std::vector<Point> points_of(const xmlNode* node) {
  const auto v = numbers_of(attribute(node, "points"));
  std::vector<Point> path;
  for (std::size_t i = 0; i + 1 < v.size(); i += 2) path.push_back({v[i], v[i + 1]});
  return path;
}

std::vector<Point> closed(std::vector<Point> path) {
  if (!path.empty()) path.push_back(path[0]);
  return path;
}

/// The paths of an element that is a shape.
std::vector<std::vector<Point>> shape_of(const xmlNode* node, const std::string& name, const Resolution& resolution) {
  const auto number = [&](const char* key) { return std::strtod(attribute(node, key).c_str(), nullptr); };
  if (name == "path") {
    Pen pen;
    pen.draw(attribute(node, "d"));
    return pen.paths;
  }
  if (name == "line") return {{{number("x1"), number("y1")}, {number("x2"), number("y2")}}};
  if (name == "polyline") return {points_of(node)};
  if (name == "rect") {
    const double x = number("x"), y = number("y"), w = number("width"), h = number("height");
    if (!(w > 0 && h > 0)) return {};
    return {closed({{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}})};
  }
  if (name == "circle") return {closed(ellipse(number("cx"), number("cy"), number("r"), number("r"), resolution))};
  if (name == "ellipse") return {closed(ellipse(number("cx"), number("cy"), number("rx"), number("ry"), resolution))};
  if (name == "polygon") return {closed(points_of(node))};
  return {};
}

/// Whether a path is a line with a width rather than an area: OpenSCAD asks whether its ends are apart.
bool is_line(const std::vector<Point>& path) {
  return std::hypot(path.back()[0] - path[0][0], path.back()[1] - path[0][1]) > 0.1;
}

/// What an element says about its strokes, itself or in its style; it inherits nothing, as in OpenSCAD.
std::string stroke_property(const xmlNode* node, const std::string& key) {
  std::istringstream style(attribute(node, "style"));
  for (std::string property; std::getline(style, property, ';');) {
    const auto colon = property.find(':');
    const auto first = property.find_first_not_of(" \t\r\n");
    if (colon == std::string::npos || property.substr(first, colon - first) != key) continue;
    const auto value = property.find_first_not_of(" \t", colon + 1);
    return value == std::string::npos ? "" : property.substr(value);
  }
  return attribute(node, key.c_str());
}

/// The area of a line with a width, on OpenSCAD's grid of 1e-4 units: its joins are mitres and its caps squares, if nothing else
/// is said.
std::vector<std::vector<Point>> stroke_of(const xmlNode* node, const std::vector<Point>& line) {
  constexpr double grid = 1e4, largest = 1e12;
  const double given = std::strtod(stroke_property(node, "stroke-width").c_str(), nullptr), width = given >= 0.01 && given < largest ? given : 1;
  const std::string cap = stroke_property(node, "stroke-linecap"), join = stroke_property(node, "stroke-linejoin");
  ClipperLib::Path scaled;
  for (const Point& p : line) {
    if (!(std::fabs(p[0]) < largest && std::fabs(p[1]) < largest)) return {};
    scaled.emplace_back(static_cast<ClipperLib::cInt>(p[0] * grid), static_cast<ClipperLib::cInt>(p[1] * grid));
  }
  ClipperLib::ClipperOffset clipper;
  clipper.AddPath(scaled, join == "round" ? ClipperLib::jtRound : join == "bevel" ? ClipperLib::jtSquare : ClipperLib::jtMiter,
                  cap == "round" ? ClipperLib::etOpenRound : cap == "butt" ? ClipperLib::etOpenButt : ClipperLib::etOpenSquare);
  ClipperLib::Paths area;
  clipper.Execute(area, width * grid / 2);
  std::vector<std::vector<Point>> paths;
  for (const auto& path : area) {
    auto& points = paths.emplace_back();
    for (const auto& p : path) points.push_back({static_cast<double>(p.X) / grid, static_cast<double>(p.Y) / grid});
  }
  return paths;
}

/// From the drawing's units to millimetres, y upwards from the lower edge of the page.
Map page_of(const xmlNode* root, double dpi) {
  const auto box = numbers_of(attribute(root, "viewBox"));
  double width = length_of(attribute(root, "width"), dpi), height = length_of(attribute(root, "height"), dpi);
  const bool has_box = box.size() == 4 && box[2] > 0 && box[3] > 0;
  const double unit = 25.4 / dpi;
  if (width == 0) width = has_box ? box[2] * unit : 0;
  if (height == 0) height = has_box ? box[3] * unit : 0;
  const double sx = has_box ? width / box[2] : unit, sy = has_box ? height / box[3] : unit;
  return {sx, 0, 0, -sy, has_box ? -box[0] * sx : 0, height + (has_box ? box[1] * sy : 0)};
}

}  // namespace

std::vector<PlaneDrawing> import_svg(const std::filesystem::path& path, double dpi, const Resolution& resolution) {
  const std::unique_ptr<xmlDoc, void (*)(xmlDoc*)> document(
      xmlReadFile(path.c_str(), nullptr, XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING), xmlFreeDoc);
  const xmlNode* root = document ? xmlDocGetRootElement(document.get()) : nullptr;
  if (root == nullptr || !xmlStrEqual(root->name, reinterpret_cast<const xmlChar*>("svg"))) throw Error("import: " + path.string() + " is no SVG file that can be read");
  struct Visit {
    const xmlNode* node;
    Map map;
  };
  std::vector<PlaneDrawing> shapes;
  std::vector<Visit> stack{{root, page_of(root, dpi)}};
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const std::string name = reinterpret_cast<const char*>(visit.node->name);
    if (name == "defs" || name == "symbol" || name == "clipPath" || name == "mask") continue;
    const Map map = visit.map.after(map_of(attribute(visit.node, "transform")));
    PlaneDrawing drawing;
    const auto add = [&](const std::vector<Point>& points) {
      for (const Point& p : points) {
        drawing.paths.corners.push_back(static_cast<std::uint32_t>(drawing.points.size()));
        drawing.points.push_back(map(p));
      }
      drawing.paths.end_face();
    };
    for (const auto& points : shape_of(visit.node, name, resolution)) {
      if (points.size() >= 2 && (name == "polyline" || is_line(points))) {
        for (const auto& area : stroke_of(visit.node, points)) add(area);
      } else if (points.size() >= 3) {
        add(points);
      }
    }
    const bool is_finite = std::all_of(drawing.points.begin(), drawing.points.end(), [](const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
    if (!drawing.points.empty() && is_finite) shapes.push_back(std::move(drawing));
    for (const xmlNode* child = visit.node->last; child != nullptr; child = child->prev)
      if (child->type == XML_ELEMENT_NODE) stack.push_back({child, map});
  }
  return shapes;
}

}  // namespace bsp2::model
