#include <libxml/parser.h>
#include <libxml/tree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "drawing/svg_page.hpp"
#include "drawing/svg_shapes.hpp"
#include "drawing/svg_stroke.hpp"
#include "drawing/svg_style.hpp"
#include "drawing/unread.hpp"
#include "import/imports.hpp"

// Scalable Vector Graphics 1.1, as far as OpenSCAD 2021.01 reads it: the areas of shapes.

namespace bsp2::model {
namespace {

using svg::Affine;
using svg::Page;
using svg::Point;
using svg::Stroke;

using Document = std::unique_ptr<xmlDoc, void (*)(xmlDoc*)>;

/// @throws bsp2::Error with the line of the first fault.
Document read_document(const std::filesystem::path& path) {
  if (!std::ifstream(path))
    throw Error("import: " + path.string() + " cannot be read");  // libxml2 would print its own line as well
  const std::unique_ptr<xmlParserCtxt, void (*)(xmlParserCtxt*)> parser(xmlNewParserCtxt(),
                                                                        xmlFreeParserCtxt);
  Document document(parser ? xmlCtxtReadFile(parser.get(), path.c_str(), nullptr,
                                             XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING)
                           : nullptr,
                    xmlFreeDoc);
  if (document) return document;
  const xmlError* fault = parser ? xmlCtxtGetLastError(parser.get()) : nullptr;
  if (fault == nullptr || fault->domain == XML_FROM_IO)
    throw Error("import: " + path.string() + " cannot be read");
  std::string why = fault->message != nullptr ? fault->message : "";
  why.erase(why.find_last_not_of(" \t\r\n") + 1);
  throw Error("import: " + path.string() + ":" + std::to_string(fault->line) + ": this is no XML: " + why);
}

/// Whether a path is a line with a width rather than an area: OpenSCAD asks whether its ends are apart.
bool is_line(const std::vector<Point>& path) {
  return std::hypot(path.back()[0] - path[0][0], path.back()[1] - path[0][1]) > 0.1;
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
  [[nodiscard]] bool is_named(const xmlNode* node) const {
    return wanted_.id.empty() || svg::attribute(node, "id") == wanted_.id;
  }

 private:
  static bool is_group(const xmlNode* node) {
    return xmlStrEqual(node->name, reinterpret_cast<const xmlChar*>("g")) != 0;
  }
  /// Inkscape's layers.
  [[nodiscard]] bool is_labelled(const xmlNode* node) const {
    return is_group(node) && svg::attribute(node, "groupmode") == "layer" &&
           svg::attribute(node, "label") == wanted_.layer;
  }

  const SvgSelection& wanted_;
  bool has_layer_ = false;
};

bool is_finite(const PlaneDrawing& drawing) {
  return std::all_of(drawing.points.begin(), drawing.points.end(),
                     [](const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
}

constexpr std::array<std::string_view, 7> shapes{"path", "rect",     "circle", "ellipse",
                                                 "line", "polyline", "polygon"};
constexpr std::array<std::string_view, 4> groups{"svg", "g", "a", "switch"};
/// They draw nothing where they stand, or nothing at all.
constexpr std::array<std::string_view, 24> silent{
    "defs",           "symbol",       "clipPath",      "mask",   "pattern",  "marker", "linearGradient",
    "radialGradient", "filter",       "title",         "desc",   "metadata", "style",  "script",
    "view",           "font",         "color-profile", "cursor", "animate",  "set",    "animateTransform",
    "animateMotion",  "animateColor", "namedview"};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Goes through the elements of a drawing in the order in which they are drawn, and into those that are used.
class Walk {
 public:
  Walk(const xmlNode* root, std::string name, double dpi, const SvgSelection& wanted)
      : root_(root),
        name_(std::move(name)),
        dpi_(dpi),
        wanted_(wanted),
        selector_(wanted, root),
        styles_(root, name_) {
    const std::vector<double> box = svg::view_box(root);
    view_ = box.empty() ? Point{svg::user_units(svg::attribute(root, "width")),
                                svg::user_units(svg::attribute(root, "height"))}
                        : Point{box[2], box[3]};
  }

  std::optional<std::vector<PlaneDrawing>> run(bool center, const Remarks& remarks) {
    stack_.push_back({.node = root_, .viewport = {view_}});
    while (!stack_.empty()) {
      const Visit visit = stack_.back();
      stack_.pop_back();
      step(visit);
    }
    if (!is_there_) return std::nullopt;
    svg::place(drawings_, page_, center);
    std::erase_if(drawings_, [&](const PlaneDrawing& drawing) { return !is_finite(drawing); });
    for (const std::string& selector : styles_.unread_selectors())
      unread_.add(nullptr, "rule of a style sheet for '" + selector.substr(0, 40) + "'");
    if (remarks.warn && !unread_.empty()) remarks.warn(unread_.text(name_, "paths"));
    if (remarks.warn && !is_shown_)
      remarks.warn("this import is empty: the " + wanted_.text() + " is hidden in " + name_ +
                   "; make it visible in the program that made the file");
    return std::move(drawings_);
  }

 private:
  struct Visit {
    const xmlNode* node;
    Affine map{};
    svg::Viewport viewport{};
    bool is_in_layer = false, is_wanted = false;
    bool is_displayed = true;  ///< no element around it has display: none
    bool is_visible = true;    ///< as inherited
    std::int32_t use = -1;     ///< the innermost use that it is drawn by, an index into uses_
    bool is_used = false;      ///< it is itself what that use draws
  };
  struct Use {
    const xmlNode *node, *target;
    std::int32_t around;  // the use that it is in itself
    std::int32_t depth;
  };
  static constexpr std::size_t most_elements = 1'000'000, most_points = 20'000'000;
  static constexpr std::int32_t deepest_use = 100;
  /// Of what is drawn by <use>, again and again.
  static constexpr std::size_t most_letters = 200'000'000;
  /// Of the outlines of lines with a width.
  static constexpr double most_outline_points = 4e6, most_looks = 5e8, most_crossings = 5e5;

  const xmlNode* root_;
  std::string name_;
  double dpi_;
  const SvgSelection& wanted_;
  Selector selector_;
  svg::StyleSheet styles_;
  Point view_;  // width and height of the page in its own units
  std::vector<Visit> stack_;
  std::vector<Use> uses_;
  std::optional<std::unordered_map<std::string, const xmlNode*>>
      elements_;  // by their ids, once it is asked for
  std::vector<PlaneDrawing> drawings_;
  Page page_;
  Unread unread_;
  std::unordered_set<const xmlNode*> clipped_;  // those that are told of, or have no clip
  std::unordered_set<const xmlNode*> formed_;   // those whose styles have been looked at
  std::size_t used_elements_ = 0, used_letters_ = 0, points_ = 0;
  Stroke::Cost outlines_;  // of all lines
  bool is_there_ = false, is_shown_ = false;

  void step(Visit visit) {
    // Elements of others, such as those of the program that made the file.
    if (visit.node->ns != nullptr && root_->ns != nullptr &&
        !xmlStrEqual(visit.node->ns->href, root_->ns->href))
      return;
    if (visit.use >= 0 && ++used_elements_ > most_elements)
      throw Error("import: " + name_ + ": its <use> elements draw more than " +
                  std::to_string(most_elements) + " elements");
    if (visit.use >= 0) used_letters_ += letters_of(visit.node);
    if (used_letters_ > most_letters)
      throw Error("import: " + name_ + ": its <use> elements draw elements whose attributes have more than " +
                  std::to_string(most_letters) + " letters");
    const std::string name = reinterpret_cast<const char*>(visit.node->name);
    if (contains(silent, name) && !(visit.is_used && name == "symbol")) return;
    if (name == "svg" && visit.use < 0) page_.read(visit.node, dpi_);
    read_visibility(visit);
    if (!visit.is_displayed && wanted_.id.empty() && wanted_.layer.empty())
      return;  // else it is looked for, to say that it is hidden
    const Affine outer = visit.map;
    visit.map = outer.after(svg::map_of(svg::attribute(visit.node, "transform")));
    if (name == "svg" || name == "symbol") enter_viewport(visit);
    if (visit.use < 0) {
      visit.is_in_layer = visit.is_in_layer || selector_.is_layer(visit.node);
      visit.is_wanted = visit.is_wanted || (visit.is_in_layer && selector_.is_named(visit.node));
    }
    is_there_ |= visit.is_wanted;
    is_shown_ |= visit.is_wanted && visit.is_displayed;
    const bool is_drawn = visit.is_wanted && visit.is_displayed;
    if (is_drawn) tell_of_clips(visit);
    if (is_drawn) tell_of_form(visit, name);
    if (name == "use") {
      enter(visit, is_drawn && visit.is_visible);
    } else if (contains(shapes, name)) {
      if (is_drawn && visit.is_visible) draw(visit, name);
    } else if (contains(groups, name) || name == "symbol") {
      push_children(visit, name == "switch");
    } else if (is_drawn && visit.is_visible) {
      unread_.add(visit.node, name.substr(0, 40));
    }
  }

  static std::size_t letters_of(const xmlNode* node) {
    std::size_t letters = 0;
    for (const xmlAttr* attribute = node->properties; attribute != nullptr; attribute = attribute->next)
      for (const xmlNode* text = attribute->children; text != nullptr; text = text->next)
        letters += 1 + static_cast<std::size_t>(text->content != nullptr ? xmlStrlen(text->content) : 0);
    return letters;
  }

  void read_visibility(Visit& visit) const {
    if (styles_.property(visit.node, "display") == "none") visit.is_displayed = false;
    const std::string visibility = styles_.property(visit.node, "visibility");
    if (visibility == "visible") visit.is_visible = true;
    if (visibility == "hidden" || visibility == "collapse") visit.is_visible = false;
  }

  /// What they cut off is drawn all the same.
  void tell_of_clips(const Visit& visit) {
    if (!clipped_.insert(visit.node).second) return;
    for (const char* key : {"clip-path", "mask"}) {
      const std::string value = styles_.property(visit.node, key);
      if (!value.empty() && value != "none") unread_.add(nullptr, std::string(key) + " (nothing is cut off)");
    }
  }

  /// Styles that move or form an element, which is drawn as its attributes say.
  void tell_of_form(const Visit& visit, const std::string& name) {
    if (name == "svg" || !formed_.insert(visit.node).second) return;  // a page often has the size of a window
    std::string key = styles_.property_of_form(visit.node);
    if (key.empty() && !svg::attribute(visit.node, "transform-origin").empty()) key = "transform-origin";
    if (!key.empty()) unread_.add(nullptr, key + " of " + name.substr(0, 40) + " by a style");
  }

  void push_children(const Visit& visit, bool first_only) {
    const auto push = [&](const xmlNode* child) {
      Visit inner = visit;
      inner.node = child;
      inner.is_used = false;
      stack_.push_back(inner);
    };
    if (first_only) {  // that asks for nothing which is not there
      for (const xmlNode* child = visit.node->children; child != nullptr; child = child->next)
        if (child->type == XML_ELEMENT_NODE && svg::attribute(child, "requiredExtensions").empty() &&
            svg::attribute(child, "systemLanguage").empty())
          return push(child);
      return;
    }
    for (const xmlNode* child = visit.node->last; child != nullptr; child = child->prev)
      if (child->type == XML_ELEMENT_NODE) push(child);
  }

  /// Goes on with what a use draws.
  void enter(const Visit& visit, bool is_drawn) {
    std::string reference = svg::attribute(visit.node, "href");
    if (reference.empty())
      reference = svg::attribute(visit.node, "xlink:href");  // its prefix is declared nowhere
    const xmlNode* target = reference.starts_with('#') ? element_of(reference.substr(1)) : nullptr;
    if (target == nullptr) {
      if (is_drawn)
        unread_.add(visit.node, reference.starts_with('#') ? "use of an element that is not there"
                                                           : "use of another file");
      return;
    }
    std::int32_t depth = 0;
    for (std::int32_t around = visit.use; around >= 0;
         around = uses_[static_cast<std::size_t>(around)].around, ++depth)
      if (uses_[static_cast<std::size_t>(around)].target == target) refuse_cycle(reference);
    for (const xmlNode* around = visit.node; around != nullptr; around = around->parent)
      if (around == target) refuse_cycle(reference);
    if (depth >= deepest_use)
      throw Error("import: " + name_ + ": <use> elements use each other more than " +
                  std::to_string(deepest_use) + " deep");
    uses_.push_back({visit.node, target, visit.use, depth});
    Visit inner = visit;
    inner.node = target;
    inner.map = visit.map.after({1, 0, 0, 1, length(visit, visit.node, "x", 'x').value_or(0),
                                 length(visit, visit.node, "y", 'y').value_or(0)});
    inner.use = static_cast<std::int32_t>(uses_.size() - 1);
    inner.is_used = true;
    stack_.push_back(inner);
  }

  [[noreturn]] void refuse_cycle(const std::string& reference) const {
    throw Error("import: " + name_ + ": a <use> of '" + reference.substr(0, 60) + "' is in what it uses");
  }

  const xmlNode* element_of(const std::string& id) {
    if (!elements_) {
      elements_.emplace();
      std::vector<const xmlNode*> stack{root_};
      while (!stack.empty()) {
        const xmlNode* node = stack.back();
        stack.pop_back();
        if (const std::string own = svg::attribute(node, "id"); !own.empty())
          elements_->try_emplace(own, node);
        for (const xmlNode* child = node->last; child != nullptr; child = child->prev)
          if (child->type == XML_ELEMENT_NODE) stack.push_back(child);
      }
    }
    const auto found = elements_->find(id);
    return found == elements_->end() ? nullptr : found->second;
  }

  /// A length of an element, in units around it; nothing if it says none, or none that can be read (which is
  /// told).
  std::optional<double> length(const Visit& visit, const xmlNode* node, const char* key, char axis) {
    std::string fault;
    const std::optional<double> length =
        svg::length_of(svg::attribute(node, key), axis, visit.viewport, fault);
    if (!fault.empty()) unread_.add(node, reinterpret_cast<const char*>(node->name) + (" " + fault));
    return length;
  }

  /// From the coordinates around a `symbol` or an `svg` to those in it. What uses it may say how large it is;
  /// one that is not used moves nothing, as in OpenSCAD.
  void enter_viewport(Visit& visit) {
    const bool is_root = visit.node == root_;
    if (is_root) return;
    const xmlNode* use = visit.is_used ? uses_[static_cast<std::size_t>(visit.use)].node : visit.node;
    const auto size = [&](const char* key, std::size_t axis) {
      const char name = axis == 0 ? 'x' : 'y';
      const std::optional<double> said = length(visit, use, key, name);
      return said ? *said : length(visit, visit.node, key, name).value_or(visit.viewport.size[axis]);
    };
    const std::vector<double> box = svg::view_box(visit.node);
    const Point whole{size("width", 0), size("height", 1)};
    if (visit.use >= 0) {
      visit.map = visit.map.after({1, 0, 0, 1, length(visit, visit.node, "x", 'x').value_or(0),
                                   length(visit, visit.node, "y", 'y').value_or(0)});
      if (!box.empty()) {
        const svg::Fit fit(visit.node, box, whole[0], whole[1]);
        visit.map = visit.map.after(
            {fit.sx, 0, 0, fit.sy, fit.align[0] - fit.sx * box[0], fit.align[1] - fit.sy * box[1]});
      }
    }
    visit.viewport.size = box.empty() ? whole : Point{box[2], box[3]};
  }

  /// The area of a line of an element. @param fault gets what is wrong with its width.
  std::vector<std::vector<Point>> stroke_of(const Visit& visit, const std::vector<Point>& line,
                                            std::string& fault) {
    std::string length_fault;
    const double given =
        svg::length_of(styles_.property(visit.node, "stroke-width"), 'r', visit.viewport, length_fault)
            .value_or(1);
    if (!length_fault.empty()) fault = "with a stroke-width that is not read (drawn 1 wide)";
    const double width = given >= 0.01 && given < Stroke::largest ? given : 1;
    Stroke stroke(width, styles_.property(visit.node, "stroke-linecap"),
                  styles_.property(visit.node, "stroke-linejoin"));
    if (!stroke.set_line(line)) {
      fault = "with a coordinate beyond 1e12";
      return {};
    }
    const Stroke::Cost cost = stroke.cost(most_looks, most_crossings);
    outlines_.points += cost.points, outlines_.looks += cost.looks, outlines_.crossings += cost.crossings;
    const char* why = outlines_.points > most_outline_points ? "too many points"
                      : outlines_.looks > most_looks         ? "too many points at the heights of others"
                      : outlines_.crossings > most_crossings ? "too many crossings"
                                                             : nullptr;
    if (why != nullptr)
      throw Error("import: " + name_ + ": the outlines of its lines with a width have " + why +
                  "; convert them to areas (\"stroke to path\") in the " +
                  "program that made the file, or make them fewer");
    return stroke.outline();
  }

  void draw(const Visit& visit, const std::string& name) {
    PlaneDrawing drawing;
    const auto add = [&](const std::vector<Point>& points) {
      for (const Point& p : points) {
        drawing.paths.corners.push_back(static_cast<std::uint32_t>(drawing.points.size()));
        drawing.points.push_back(visit.map(p));
      }
      drawing.paths.end_face();
    };
    bool is_stroke = false;
    svg::Shape shape = svg::shape_of(visit.node, name, visit.viewport);
    for (const auto& points : shape.paths) {
      spend_points(points.size());
      if (points.size() >= 2 && (name == "polyline" || is_line(points))) {
        is_stroke = true;
        for (const auto& area : stroke_of(visit, points, shape.fault)) add(area);
      } else if (points.size() >= 3) {
        add(points);
      }
    }
    if (!shape.fault.empty()) unread_.add(visit.node, name + " " + shape.fault);
    if (is_stroke)
      for (const char* key : {"marker", "marker-start", "marker-mid", "marker-end"})
        if (const std::string value = styles_.property(visit.node, key); !value.empty() && value != "none") {
          unread_.add(visit.node, "marker of a line");
          break;
        }
    if (!is_finite(drawing))
      unread_.add(visit.node, name + " that is not finite");
    else if (!drawing.points.empty())
      drawings_.push_back(std::move(drawing));
  }

  void spend_points(std::size_t points) {
    points_ += points;
    if (points_ > most_points)
      throw Error("import: " + name_ + " has more than " + std::to_string(most_points) + " points");
  }
};

}  // namespace

std::string SvgSelection::text() const {
  const std::string element = "element with the id '" + id + "'", group = "layer '" + layer + "'";
  return id.empty() ? group : layer.empty() ? element : element + " in a " + group;
}

std::optional<std::vector<PlaneDrawing>> import_svg(const std::filesystem::path& path, double dpi,
                                                    bool center, const SvgSelection& selection,
                                                    const Remarks& remarks) {
  const Document document = read_document(path);
  const xmlNode* root = xmlDocGetRootElement(document.get());
  if (root == nullptr || !xmlStrEqual(root->name, reinterpret_cast<const xmlChar*>("svg")))
    throw Error("import: " + path.string() + " is no SVG file: its outermost element is not 'svg'");
  return Walk(root, path.string(), dpi >= 0.001 ? dpi : 72, selection).run(center, remarks);
}

}  // namespace bsp2::model
