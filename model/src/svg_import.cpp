#include <libxml/parser.h>
#include <libxml/tree.h>

#include <algorithm>
#include <clipper.hpp>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"
#include "svg_shapes.hpp"

// Scalable Vector Graphics 1.1, as far as OpenSCAD 2021.01 reads it: the areas of shapes.

namespace bsp2::model {
namespace {

using svg::Point;

using Document = std::unique_ptr<xmlDoc, void (*)(xmlDoc*)>;

/// @throws bsp2::Error with the line of the first fault.
Document read_document(const std::filesystem::path& path) {
  if (!std::ifstream(path)) throw Error("import: " + path.string() + " cannot be read");  // libxml2 would print its own line as well
  const std::unique_ptr<xmlParserCtxt, void (*)(xmlParserCtxt*)> parser(xmlNewParserCtxt(), xmlFreeParserCtxt);
  Document document(
      parser ? xmlCtxtReadFile(parser.get(), path.c_str(), nullptr, XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING) : nullptr,
      xmlFreeDoc);
  if (document) return document;
  const xmlError* fault = parser ? xmlCtxtGetLastError(parser.get()) : nullptr;
  if (fault == nullptr || fault->domain == XML_FROM_IO) throw Error("import: " + path.string() + " cannot be read");
  std::string why = fault->message != nullptr ? fault->message : "";
  why.erase(why.find_last_not_of(" \t\r\n") + 1);
  throw Error("import: " + path.string() + ":" + std::to_string(fault->line) + ": this is no XML: " + why);
}

/// The affine map (x, y) -> (a x + c y + e, b x + d y + f), as SVG writes it.
struct Map {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  [[nodiscard]] Point operator()(const Point& p) const { return {a * p[0] + c * p[1] + e, b * p[0] + d * p[1] + f}; }
  [[nodiscard]] Map after(const Map& m) const {
    return {a * m.a + c * m.b, b * m.a + d * m.b, a * m.c + c * m.d, b * m.c + d * m.d, a * m.e + c * m.f + e, b * m.e + d * m.f + f};
  }
};

Map map_of(std::string text) {
  Map map;
  for (std::size_t open = 0; (open = text.find('(')) != std::string::npos;) {
    const std::size_t close = std::min(text.find(')', open), text.size());
    const auto v = svg::numbers_of(text.substr(open + 1, close - open - 1));
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

/// Whether a path is a line with a width rather than an area: OpenSCAD asks whether its ends are apart.
bool is_line(const std::vector<Point>& path) {
  return std::hypot(path.back()[0] - path[0][0], path.back()[1] - path[0][1]) > 0.1;
}

/// What an element says about its strokes, itself or in its style; it inherits nothing, as in OpenSCAD.
std::string stroke_property(const xmlNode* node, const std::string& key) {
  std::istringstream style(svg::attribute(node, "style"));
  for (std::string property; std::getline(style, property, ';');) {
    const auto colon = property.find(':');
    const auto first = property.find_first_not_of(" \t\r\n");
    if (colon == std::string::npos || property.substr(first, colon - first) != key) continue;
    const auto value = property.find_first_not_of(" \t", colon + 1);
    return value == std::string::npos ? "" : property.substr(value);
  }
  return svg::attribute(node, key.c_str());
}

/// The area of a line with a width, on OpenSCAD's grid of 1e-4 units: its joins are mitres and its caps squares, if nothing else
/// is said.
std::vector<std::vector<Point>> stroke_of(const xmlNode* node, const std::vector<Point>& line) {
  constexpr double grid = 1e4, largest = 1e12;
  const double given = svg::user_units(stroke_property(node, "stroke-width")), width = given >= 0.01 && given < largest ? given : 1;
  const std::string cap = stroke_property(node, "stroke-linecap"), join = stroke_property(node, "stroke-linejoin");
  ClipperLib::Path scaled;
  for (const Point& p : line) {
    if (!(std::fabs(p[0]) < largest && std::fabs(p[1]) < largest)) return {};
    scaled.emplace_back(static_cast<ClipperLib::cInt>(p[0] * grid), static_cast<ClipperLib::cInt>(p[1] * grid));
  }
  ClipperLib::ClipperOffset clipper(2.0, std::max(0.25, width * grid / 2 * 1e-9));  // arcs of any width have a bounded number of chords
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

/// Width or height of the page in millimetres. Percentages and what is missing take it from the view box.
double page_length(const xmlNode* svg, const char* name, double box, bool has_box, double dpi) {
  const std::optional<svg::Length> length = svg::read_length(svg::attribute(svg, name));
  if (!length || length->number < 0) return has_box ? box * 25.4 / dpi : 0;
  const double unit = svg::millimetres_in(length->unit, dpi);
  if (unit == 0) return has_box ? box : 0;
  return length->number * unit;
}

/// How the drawing lies on its page, y upwards. As in OpenSCAD the last `svg` element counts, without a view box a unit is a
/// millimetre, and the lower edge of the view box moves the drawing the wrong way.
struct Page {
  double sx = 1, sy = 1;
  Point box{}, align{};
  double height = 0;

  void read(const xmlNode* svg, double dpi) {
    const auto v = svg::numbers_of(svg::attribute(svg, "viewBox"));
    const bool has_box = v.size() == 4 && v[2] > 0 && v[3] > 0;
    const double width = page_length(svg, "width", has_box ? v[2] : 0, has_box, dpi);
    height = page_length(svg, "height", has_box ? v[3] : 0, has_box, dpi);
    if (!has_box) return;
    box = {v[0], v[1]};
    sx = width / v[2], sy = height / v[3];
    const std::string aspect = svg::attribute(svg, "preserveAspectRatio");
    if (aspect.find("none") != std::string::npos) return;
    sx = sy = aspect.find("slice") != std::string::npos ? std::max(sx, sy) : std::min(sx, sy);
    const auto aligned = [&](char axis, double room) {
      const auto at = aspect.find(axis);
      const std::string where = at == std::string::npos ? "" : aspect.substr(at + 1, 3);
      return where == "Min" ? 0 : where == "Max" ? room : room / 2;
    };
    align = {aligned('x', width - sx * v[2]), aligned('Y', height - sy * v[3])};
  }

  /// @param centre of what is drawn, if it is to lie at the origin.
  [[nodiscard]] Map map(const std::optional<Point>& centre) const {
    if (centre) return {sx, 0, 0, -sy, -sx * (box[0] + (*centre)[0]), -sy * (box[1] - (*centre)[1])};
    return {sx, 0, 0, -sy, align[0] - sx * box[0], height - align[1] - sy * box[1]};
  }
};

/// Moves all drawings from their own units to the page.
void place(std::vector<PlaneDrawing>& drawings, const Page& page, bool center) {
  std::optional<Point> centre;
  if (center && !drawings.empty()) {
    Point low = drawings[0].points[0], high = low;
    for (const PlaneDrawing& drawing : drawings)
      for (const Point& p : drawing.points)
        for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    centre = Point{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
  }
  const Map map = page.map(centre);
  for (PlaneDrawing& drawing : drawings)
    for (Point& p : drawing.points) p = map(p);
}

/// Which elements are wanted, with what is in them.
class Selector {
 public:
  Selector(const SvgSelection& wanted, const xmlNode* root) : wanted_(wanted) {
    if (wanted.layer.empty()) return;
    std::vector<const xmlNode*> stack{root};
    while (!stack.empty() && !has_layer_) {
      const xmlNode* node = stack.back();
      stack.pop_back();
      has_layer_ = is_labelled(node);
      for (const xmlNode* child = node->children; child != nullptr; child = child->next)
        if (child->type == XML_ELEMENT_NODE) stack.push_back(child);
    }
  }

  [[nodiscard]] bool is_layer(const xmlNode* node) const {
    if (wanted_.layer.empty()) return true;
    return has_layer_ ? is_labelled(node) : is_group(node) && svg::attribute(node, "id") == wanted_.layer;
  }
  [[nodiscard]] bool is_named(const xmlNode* node) const { return wanted_.id.empty() || svg::attribute(node, "id") == wanted_.id; }

 private:
  static bool is_group(const xmlNode* node) { return xmlStrEqual(node->name, reinterpret_cast<const xmlChar*>("g")) != 0; }
  /// Inkscape's layers.
  [[nodiscard]] bool is_labelled(const xmlNode* node) const {
    return is_group(node) && svg::attribute(node, "groupmode") == "layer" && svg::attribute(node, "label") == wanted_.layer;
  }

  const SvgSelection& wanted_;
  bool has_layer_ = false;
};

}  // namespace

std::string SvgSelection::text() const {
  const std::string element = "element with the id '" + id + "'", group = "layer '" + layer + "'";
  return id.empty() ? group : layer.empty() ? element : element + " in a " + group;
}

std::optional<std::vector<PlaneDrawing>> import_svg(const std::filesystem::path& path, double dpi, bool center, const SvgSelection& selection) {
  if (!(dpi >= 0.001)) dpi = 72;
  const Document document = read_document(path);
  const xmlNode* root = xmlDocGetRootElement(document.get());
  if (root == nullptr || !xmlStrEqual(root->name, reinterpret_cast<const xmlChar*>("svg")))
    throw Error("import: " + path.string() + " is no SVG file: its outermost element is not 'svg'");
  struct Visit {
    const xmlNode* node;
    Map map;
    bool is_in_layer = false, is_wanted = false;
  };
  const Selector selector(selection, root);
  bool is_there = false;
  std::vector<PlaneDrawing> shapes;
  std::vector<Visit> stack{{root, {}}};
  Page page;
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const std::string name = reinterpret_cast<const char*>(visit.node->name);
    if (name == "defs") continue;
    if (name == "svg") page.read(visit.node, dpi);
    const Map map = visit.map.after(map_of(svg::attribute(visit.node, "transform")));
    const bool is_in_layer = visit.is_in_layer || selector.is_layer(visit.node);
    const bool is_wanted = visit.is_wanted || (is_in_layer && selector.is_named(visit.node));
    is_there |= is_wanted;
    PlaneDrawing drawing;
    const auto add = [&](const std::vector<Point>& points) {
      for (const Point& p : points) {
        drawing.paths.corners.push_back(static_cast<std::uint32_t>(drawing.points.size()));
        drawing.points.push_back(map(p));
      }
      drawing.paths.end_face();
    };
    for (const auto& points : is_wanted ? svg::shape_of(visit.node, name) : std::vector<std::vector<Point>>{}) {
      if (points.size() >= 2 && (name == "polyline" || is_line(points))) {
        for (const auto& area : stroke_of(visit.node, points)) add(area);
      } else if (points.size() >= 3) {
        add(points);
      }
    }
    const bool is_finite = std::all_of(drawing.points.begin(), drawing.points.end(), [](const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
    if (!drawing.points.empty() && is_finite) shapes.push_back(std::move(drawing));
    for (const xmlNode* child = visit.node->last; child != nullptr; child = child->prev)
      if (child->type == XML_ELEMENT_NODE) stack.push_back({child, map, is_in_layer, is_wanted});
  }
  if (!is_there) return std::nullopt;
  place(shapes, page, center);
  const auto is_lost = [](const PlaneDrawing& drawing) {
    return !std::all_of(drawing.points.begin(), drawing.points.end(), [](const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
  };
  std::erase_if(shapes, is_lost);
  return shapes;
}

}  // namespace bsp2::model
