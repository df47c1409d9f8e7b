#include <algorithm>
#include <cmath>
#include <set>

#include "sheets/writers.hpp"
#include "surfaces/text.hpp"

// DXF of AutoCAD 2007 (AC1021): the first version in UTF-8, and with true colours. It wants handles, owners
// and the tables and objects below, whether they hold anything or not. Source: Autodesk, "DXF Reference"
// (2007).

namespace bsp2::io {
namespace {

/// Objects that others name, as hexadecimal handles.
enum Handle : int {
  block_records = 1,
  layers_table,
  styles,
  line_types,
  views,
  coordinate_systems,
  viewports,
  applications,
  dimension_styles,
  root_dictionary,
  group_dictionary,
  model_record,
  paper_record,
  first_free
};

/// The colour of the standard palette that is nearest: for programs without true colours.
int palette_colour(const Sheet::Rgb& rgb) {
  const int most = std::max({rgb[0], rgb[1], rgb[2]}), least = std::min({rgb[0], rgb[1], rgb[2]});
  if (most < 32 || least > 240) return 7;  // black or white, what shows
  if (most - least < 16) return most < 96 ? 250 : most < 176 ? 252 : 254;
  const double span = most - least;
  double hue = most == rgb[0]   ? (rgb[1] - rgb[2]) / span
               : most == rgb[1] ? 2 + (rgb[2] - rgb[0]) / span
                                : 4 + (rgb[0] - rgb[1]) / span;
  if (hue < 0) hue += 6;
  const int tint = static_cast<int>(std::lround(hue * 4)) % 24;  // 15 degrees each
  const int shade = most > 210 ? 0 : most > 175 ? 2 : most > 140 ? 4 : most > 90 ? 6 : 8;
  return 10 + 10 * tint + shade + (2 * span < most ? 1 : 0);
}

class DxfWriter {
 public:
  explicit DxfWriter(const Sheet& sheet) : sheet_(sheet), next_(first_free) {
    std::set<std::string> taken{"0"};
    for (const Sheet::Layer& layer : sheet_.layers) names_.push_back(unique_name(layer.name, taken));
  }

  std::string file() {
    write_header();
    write_tables();
    write_blocks();
    tag(0, "SECTION").tag(2, "ENTITIES");
    for (const Sheet::Area& area : sheet_.areas)
      for (const auto& loop : area.loops) write_loop(area.layer, loop);
    for (const Sheet::Path& path : sheet_.paths) write_path(path.layer, path.points, path.is_closed);
    for (const Sheet::Label& label : sheet_.labels) write_label(label);
    tag(0, "ENDSEC");
    write_objects();
    tag(0, "EOF");
    // The first handle that is free is known at the end.
    std::string bytes = text_.take();
    const std::string seed = hexadecimal(next_);
    bytes.replace(bytes.find(seed_place), seed_place.size(), seed);
    return bytes;
  }

 private:
  static constexpr std::string_view seed_place = "FFFFFFFFFFFF";

  const Sheet& sheet_;
  Text text_;
  int next_;
  std::vector<std::string> names_;

  static std::string hexadecimal(int number) {
    std::string digits;
    for (; number > 0; number /= 16) digits.insert(digits.begin(), "0123456789ABCDEF"[number % 16]);
    return digits;
  }

  template <typename Value>
  DxfWriter& tag(int code, const Value& value) {
    text_ << code << '\n' << value << '\n';
    return *this;
  }
  DxfWriter& coordinate(int code, double x) {
    if (sheet_.decimals) {
      const double unit = std::pow(10, *sheet_.decimals);
      x = std::round(x * unit) / unit;
    }
    return tag(code, x + 0.0);
  }
  DxfWriter& point(int code, const Sheet::Point& p) {
    return coordinate(code, p[0]).coordinate(code + 10, p[1]);
  }
  DxfWriter& handle(int number, int owner) {
    return tag(5, hexadecimal(number)).tag(330, hexadecimal(owner));
  }

  /// DXF forbids some characters in names.
  static std::string unique_name(const std::string& name, std::set<std::string>& taken) {
    std::string word;
    for (const char c : name)
      word += std::string_view("<>/\\\":;?*|=`,").find(c) == std::string_view::npos ? c : '_';
    word = in_one_line(word);
    while (word.empty() || !taken.insert(lower(word)).second) word += "_";
    return word;
  }

  /// Names that differ in this alone are one name.
  static std::string lower(std::string text) {
    for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return text;
  }

  /// Without what readers take for a sign of its own: %%c is a diameter, ^I a tab, \U+00D8 a letter.
  static std::string plain(const std::string& text) {
    std::string line;
    for (const char c : text) {
      if (c == '%' && line.ends_with('%')) line += ' ';
      if (c == 'U' && line.ends_with('\\')) line += ' ';
      line += c;
      if (c == '^') line += ' ';
    }
    return line;
  }

  /// Without control characters: a value is a line.
  static std::string in_one_line(const std::string& text) {
    std::string line;
    for (const char c : text)
      if (static_cast<unsigned char>(c) >= ' ') line += c;
    return line;
  }

  void write_header() {
    tag(999, "written by bsp2").tag(0, "SECTION").tag(2, "HEADER");
    tag(9, "$ACADVER").tag(1, "AC1021");
    tag(9, "$DWGCODEPAGE").tag(3, "ANSI_1252");
    tag(9, "$HANDSEED").tag(5, seed_place);
    tag(9, "$INSUNITS").tag(70, 4);  // millimetres
    tag(9, "$MEASUREMENT").tag(70, 1);
    tag(9, "$LTSCALE").tag(40, 1);
    tag(9, "$EXTMIN").point(10, sheet_.lower).tag(30, 0);
    tag(9, "$EXTMAX").point(10, sheet_.upper).tag(30, 0);
    tag(9, "$LIMMIN").point(10, sheet_.lower);
    tag(9, "$LIMMAX").point(10, sheet_.upper);
    tag(0, "ENDSEC");
    tag(0, "SECTION").tag(2, "CLASSES").tag(0, "ENDSEC");
  }

  void begin_table(const char* name, Handle table, std::size_t entries) {
    tag(0, "TABLE").tag(2, name).tag(5, hexadecimal(table)).tag(330, 0).tag(100, "AcDbSymbolTable");
    tag(70, entries);
  }
  void begin_entry(const char* kind, const char* record, Handle table) {
    tag(0, kind).handle(next_++, table).tag(100, "AcDbSymbolTableRecord").tag(100, record);
  }
  void empty_table(const char* name, Handle table) {
    begin_table(name, table, 0);
    tag(0, "ENDTAB");
  }

  void write_tables() {
    tag(0, "SECTION").tag(2, "TABLES");
    begin_table("VPORT", viewports, 1);
    begin_entry("VPORT", "AcDbViewportTableRecord", viewports);
    const double height = sheet_.upper[1] - sheet_.lower[1];
    tag(2, "*Active").tag(70, 0).point(10, {0, 0}).point(11, {1, 1});
    point(12, {(sheet_.lower[0] + sheet_.upper[0]) / 2, (sheet_.lower[1] + sheet_.upper[1]) / 2});
    point(13, {0, 0}).point(14, {10, 10}).point(15, {10, 10}).point(16, {0, 0}).tag(36, 1).point(17, {0, 0});
    tag(37, 0).tag(40, height > 0 ? height : 1);
    tag(41, height > 0 ? (sheet_.upper[0] - sheet_.lower[0]) / height : 1).tag(42, 50).tag(43, 0).tag(44, 0);
    tag(50, 0).tag(51, 0).tag(71, 0).tag(72, 1000).tag(73, 1).tag(74, 3).tag(75, 0).tag(76, 0).tag(77, 0);
    tag(78, 0).tag(0, "ENDTAB");
    write_line_types();
    write_layers();
    begin_table("STYLE", styles, 1);
    begin_entry("STYLE", "AcDbTextStyleTableRecord", styles);
    tag(2, "Standard")
        .tag(70, 0)
        .tag(40, 0)
        .tag(41, 1)
        .tag(50, 0)
        .tag(71, 0)
        .tag(42, 2.5)
        .tag(3, "txt")
        .tag(4, "");
    tag(0, "ENDTAB");
    empty_table("VIEW", views);
    empty_table("UCS", coordinate_systems);
    begin_table("APPID", applications, 1);
    begin_entry("APPID", "AcDbRegAppTableRecord", applications);
    tag(2, "ACAD").tag(70, 0).tag(0, "ENDTAB");
    begin_table("DIMSTYLE", dimension_styles, 1);
    tag(100, "AcDbDimStyleTable").tag(71, 1);
    tag(0, "DIMSTYLE").tag(105, hexadecimal(next_++)).tag(330, hexadecimal(dimension_styles));
    tag(100, "AcDbSymbolTableRecord").tag(100, "AcDbDimStyleTableRecord").tag(2, "Standard").tag(70, 0);
    tag(0, "ENDTAB");
    begin_table("BLOCK_RECORD", block_records, 2);
    for (const Handle record : {model_record, paper_record}) {
      tag(0, "BLOCK_RECORD").handle(record, block_records).tag(100, "AcDbSymbolTableRecord");
      tag(100, "AcDbBlockTableRecord").tag(2, record == model_record ? "*Model_Space" : "*Paper_Space");
      tag(340, 0);
    }
    tag(0, "ENDTAB").tag(0, "ENDSEC");
  }

  /// LibreCAD goes by the usual names, and not by the lengths.
  [[nodiscard]] std::string line_type(std::uint32_t layer) const {
    const auto& dashes = sheet_.layers[layer].dashes;
    if (dashes.empty()) return "Continuous";
    std::string name = dashes.size() == 2 ? "DASHED" : dashes.size() == 4 ? "CENTER" : "DASHES";
    const bool is_taken =
        std::any_of(sheet_.layers.begin(), sheet_.layers.begin() + layer,
                    [&](const Sheet::Layer& other) { return other.dashes.size() == dashes.size(); });
    return is_taken ? name + "_" + std::to_string(layer) : name;
  }

  void write_line_types() {
    begin_table("LTYPE", line_types, 3 + sheet_.layers.size());
    for (const char* name : {"ByBlock", "ByLayer", "Continuous"}) {
      begin_entry("LTYPE", "AcDbLinetypeTableRecord", line_types);
      tag(2, name).tag(70, 0).tag(3, "").tag(72, 65).tag(73, 0).tag(40, 0);
    }
    for (std::uint32_t layer = 0; layer < sheet_.layers.size(); ++layer) {
      const auto& dashes = sheet_.layers[layer].dashes;
      if (dashes.empty()) continue;
      double length = 0;
      for (const double dash : dashes) length += dash;
      begin_entry("LTYPE", "AcDbLinetypeTableRecord", line_types);
      tag(2, line_type(layer)).tag(70, 0).tag(3, "").tag(72, 65).tag(73, dashes.size()).tag(40, length);
      for (std::size_t i = 0; i < dashes.size(); ++i) tag(49, i % 2 == 0 ? dashes[i] : -dashes[i]).tag(74, 0);
    }
    tag(0, "ENDTAB");
  }

  void write_layers() {
    begin_table("LAYER", layers_table, 1 + sheet_.layers.size());
    begin_entry("LAYER", "AcDbLayerTableRecord", layers_table);
    tag(2, "0").tag(70, 0).tag(62, 7).tag(6, "Continuous");
    for (std::uint32_t i = 0; i < sheet_.layers.size(); ++i) {
      const Sheet::Layer& layer = sheet_.layers[i];
      begin_entry("LAYER", "AcDbLayerTableRecord", layers_table);
      tag(2, names_[i]).tag(70, 0).tag(62, palette_colour(layer.colour));
      if (const auto& c = layer.colour; c[0] + c[1] + c[2] > 0)  // true black would not show on black
        tag(420, c[0] * 65536 + c[1] * 256 + c[2]);
      tag(6, line_type(i)).tag(370, line_weight(layer.width));
    }
    tag(0, "ENDTAB");
  }

  /// Hundredths of a millimetre, of those that there are.
  static int line_weight(double width) {
    constexpr std::array all{0,  5,  9,  13, 15, 18,  20,  25,  30,  35,  40,  50,
                             53, 60, 70, 80, 90, 100, 106, 120, 140, 158, 200, 211};
    return *std::min_element(all.begin(), all.end(), [&](int a, int b) {
      return std::fabs(a - 100 * width) < std::fabs(b - 100 * width);
    });
  }

  void write_blocks() {
    tag(0, "SECTION").tag(2, "BLOCKS");
    for (const Handle record : {model_record, paper_record}) {
      const char* name = record == model_record ? "*Model_Space" : "*Paper_Space";
      tag(0, "BLOCK").handle(next_++, record).tag(100, "AcDbEntity").tag(8, "0").tag(100, "AcDbBlockBegin");
      tag(2, name).tag(70, 0).point(10, {0, 0}).tag(30, 0).tag(3, name).tag(1, "");
      tag(0, "ENDBLK").handle(next_++, record).tag(100, "AcDbEntity").tag(8, "0").tag(100, "AcDbBlockEnd");
    }
    tag(0, "ENDSEC");
  }

  void begin_entity(const char* kind, std::uint32_t layer) {
    tag(0, kind).tag(5, hexadecimal(next_++)).tag(100, "AcDbEntity").tag(8, names_[layer]);
  }

  void write_path(std::uint32_t layer, const std::vector<Sheet::Point>& points, bool is_closed) {
    if (points.size() == 2) {
      begin_entity("LINE", layer);
      tag(100, "AcDbLine").point(10, points[0]).point(11, points[1]);
      return;
    }
    begin_entity("LWPOLYLINE", layer);
    tag(100, "AcDbPolyline").tag(90, points.size()).tag(70, is_closed ? 1 : 0);
    for (const auto& p : points) point(10, p);
  }

  /// A closed path with its arcs; one of two halves of a circle is a circle.
  void write_loop(std::uint32_t layer, const geometry::OutlinePath& loop) {
    if (loop.bulges.empty()) return write_path(layer, loop.corners, true);
    const auto& corners = loop.corners;
    if (corners.size() == 2 && std::fabs(loop.bulges[0] + loop.bulges[1]) == 2) {
      const geometry::OutlineArc circle(corners[0], corners[1], 1);
      begin_entity("CIRCLE", layer);
      tag(100, "AcDbCircle").point(10, circle.centre).coordinate(40, circle.radius);
      return;
    }
    begin_entity("LWPOLYLINE", layer);
    tag(100, "AcDbPolyline").tag(90, corners.size()).tag(70, 1);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      point(10, corners[i]);
      if (loop.bulges[i] != 0) tag(42, loop.bulges[i]);
    }
  }

  void write_label(const Sheet::Label& label) {
    begin_entity("TEXT", label.layer);
    tag(100, "AcDbText")
        .point(10, label.at)
        .tag(40, label.height)
        .tag(1, plain(in_one_line(label.text)))
        .tag(50, label.turn);
    if (label.anchor != Sheet::Anchor::start)
      tag(72, label.anchor == Sheet::Anchor::middle ? 1 : 2).point(11, label.at);
    tag(100, "AcDbText");
  }

  void write_objects() {
    tag(0, "SECTION").tag(2, "OBJECTS");
    tag(0, "DICTIONARY")
        .tag(5, hexadecimal(root_dictionary))
        .tag(330, 0)
        .tag(100, "AcDbDictionary")
        .tag(281, 1);
    tag(3, "ACAD_GROUP").tag(350, hexadecimal(group_dictionary));
    tag(0, "DICTIONARY").handle(group_dictionary, root_dictionary).tag(100, "AcDbDictionary").tag(281, 1);
    tag(0, "ENDSEC");
  }
};

}  // namespace

std::string to_dxf(const Sheet& sheet) { return DxfWriter(sheet).file(); }

}  // namespace bsp2::io
