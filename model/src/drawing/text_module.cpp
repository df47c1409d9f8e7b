#include "drawing/text_module.hpp"

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_GLYPH_H
#include FT_OUTLINE_H
#include <hb-ft.h>
#include <hb.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/module.hpp"

namespace bsp2::model {
namespace {

constexpr double char_size = 1e5;  // 64ths of a point for a text of size 1
constexpr double outline_unit = 1e5,
                 advance_unit = 102400;  // both are found in the results of OpenSCAD 2021.01
constexpr int dots_per_inch = 100;

template <typename T, auto Release>
struct Releaser {
  void operator()(T* object) const { Release(object); }
};
template <typename T, auto Release>
using Owned = std::unique_ptr<T, Releaser<T, Release>>;

using Pattern = Owned<FcPattern, FcPatternDestroy>;
using Configuration = Owned<FcConfig, FcConfigDestroy>;
using Library = Owned<FT_LibraryRec_, FT_Done_FreeType>;
using Face = Owned<FT_FaceRec_, FT_Done_Face>;
using Glyph = Owned<FT_GlyphRec_, FT_Done_Glyph>;
using Font = Owned<hb_font_t, hb_font_destroy>;
using Buffer = Owned<hb_buffer_t, hb_buffer_destroy>;

std::string text_of(const FcPattern& pattern, const char* property) {
  FcChar8* value = nullptr;
  return FcPatternGetString(&pattern, property, 0, &value) == FcResultMatch
             ? reinterpret_cast<const char*>(value)
             : "";
}

Face find_face(FT_Library library, const std::string& name, const std::function<void(std::string)>& warn) {
  static const Configuration configuration(FcInitLoadConfigAndFonts());
  const std::string wanted =
      name.find_first_not_of(" \t") == std::string::npos ? "Liberation Sans:style=Regular" : name;
  const Pattern pattern(FcNameParse(reinterpret_cast<const FcChar8*>(wanted.c_str())));
  if (!configuration) throw Error("text: there are no fonts; install some, such as fonts-liberation");
  if (!pattern)
    throw Error("text: the font '" + wanted +
                "' is none that fontconfig understands; write it as in 'Liberation Sans:style=Bold'");
  const std::string family = text_of(*pattern, FC_FAMILY);
  FcPatternAddBool(pattern.get(), FC_OUTLINE, FcTrue);
  FcPatternAddBool(pattern.get(), FC_SCALABLE, FcTrue);
  FcConfigSubstitute(configuration.get(), pattern.get(), FcMatchPattern);
  FcDefaultSubstitute(pattern.get());
  FcResult result{};
  const Pattern match(FcFontMatch(configuration.get(), pattern.get(), &result));
  FT_Face face = nullptr;
  int index = 0;
  if (match) FcPatternGetInteger(match.get(), FC_INDEX, 0, &index);
  if (!match || FT_New_Face(library, text_of(*match, FC_FILE).c_str(), index, &face) != 0)
    throw Error("text: there is no font for '" + wanted + "'; install one, such as fonts-liberation");
  const std::string found = text_of(*match, FC_FAMILY);
  if (!family.empty() && FcStrCmpIgnoreCase(reinterpret_cast<const FcChar8*>(family.c_str()),
                                            reinterpret_cast<const FcChar8*>(found.c_str())) != 0)
    warn("there is no font '" + family + "' here; '" + found + "' is taken");
  FT_Select_Charmap(face, FT_ENCODING_UNICODE);
  return Face(face);
}

/// Collects the paths that FreeType walks, curves as chords.
struct Pen {
  GlyphOutline* glyph;
  std::uint32_t segments;
  double size;
  FT_Vector at{};
  std::uint32_t length = 0;

  void add(double x, double y) {
    glyph->points.push_back({size * (x / outline_unit), size * (y / outline_unit)});
    ++length;
  }
  void end_path() {
    if (length > 0) glyph->path_lengths.push_back(length);
    length = 0;
  }
  static Pen& of(void* user) { return *static_cast<Pen*>(user); }
  static int move_to(const FT_Vector* to, void* user) {
    of(user).end_path();
    return line_to(to, user);
  }
  static int line_to(const FT_Vector* to, void* user) {
    Pen& pen = of(user);
    pen.add(static_cast<double>(to->x), static_cast<double>(to->y));
    pen.at = *to;
    return 0;
  }
  static int conic_to(const FT_Vector* c, const FT_Vector* to, void* user) {
    Pen& pen = of(user);
    for (std::uint32_t i = 1; i <= pen.segments; ++i) {
      const double t = static_cast<double>(i) / pen.segments, s = 1 - t;
      const auto mix = [&](auto a, auto b, auto d) {
        return s * s * static_cast<double>(a) + 2 * s * t * static_cast<double>(b) +
               t * t * static_cast<double>(d);
      };
      pen.add(mix(pen.at.x, c->x, to->x), mix(pen.at.y, c->y, to->y));
    }
    pen.at = *to;
    return 0;
  }
  static int cubic_to(const FT_Vector* c, const FT_Vector* d, const FT_Vector* to, void* user) {
    Pen& pen = of(user);
    for (std::uint32_t i = 1; i <= pen.segments; ++i) {
      const double t = static_cast<double>(i) / pen.segments, s = 1 - t;
      const auto mix = [&](auto p, auto q, auto r, auto u) {
        return s * s * s * static_cast<double>(p) + 3 * s * s * t * static_cast<double>(q) +
               3 * s * t * t * static_cast<double>(r) + t * t * t * static_cast<double>(u);
      };
      pen.add(mix(pen.at.x, c->x, d->x, to->x), mix(pen.at.y, c->y, d->y, to->y));
    }
    pen.at = *to;
    return 0;
  }
};

struct Extent {
  double width = 0, ascent = 0, descent = 0;
};

/// No points for a glyph without an outline.
GlyphOutline outline_of(FT_GlyphRec_& glyph, const TextStyle& style) {
  GlyphOutline outline;
  if (glyph.format != FT_GLYPH_FORMAT_OUTLINE) return outline;
  Pen pen{&outline, style.segments, style.size};
  const FT_Outline_Funcs functions{Pen::move_to, Pen::line_to, Pen::conic_to, Pen::cubic_to, 0, 0};
  FT_Outline_Decompose(&reinterpret_cast<FT_OutlineGlyphRec_&>(glyph).outline, &functions, &pen);
  pen.end_path();
  return outline;
}

std::array<double, 2> aligned(const TextStyle& style, const Extent& extent) {
  std::array<double, 2> origin{};
  if (style.horizontal == "right") origin[0] = -extent.width;
  if (style.horizontal == "center") origin[0] = -extent.width / 2;
  if (style.vertical == "top") origin[1] = -extent.ascent;
  if (style.vertical == "center") origin[1] = extent.descent / 2 - extent.ascent / 2;
  if (style.vertical == "bottom") origin[1] = extent.descent;
  return origin;
}

/// Letters without a glyph of their own are drawn as the font's box for them. @param info what the text was
/// shaped to.
void warn_of_missing(const std::string& text, std::span<const hb_glyph_info_t> info, const char* font,
                     const std::function<void(std::string)>& warn) {
  std::set<std::string> missing;
  for (const hb_glyph_info_t& glyph : info) {
    if (glyph.codepoint != 0 || static_cast<unsigned char>(text[glyph.cluster]) < ' ') continue;
    std::size_t end = glyph.cluster + 1;
    while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80)
      ++end;  // the rest of the letter in UTF-8
    missing.insert(text.substr(glyph.cluster, end - glyph.cluster));
  }
  if (missing.empty()) return;
  std::string letters;
  for (const std::string& letter : missing) letters += letter;
  warn(std::string("the font '") + font + "' has no glyph for: " + letters);
}

TextOutlines find_outlines(const std::string& text, const TextStyle& style,
                           const std::function<void(std::string)>& warn) {
  FT_Library raw_library = nullptr;
  if (FT_Init_FreeType(&raw_library) != 0) throw Error("text: FreeType does not start");
  const Library library(raw_library);
  const Face face = find_face(library.get(), style.font, warn);
  if (style.size == 0 ||
      FT_Set_Char_Size(face.get(), 0, static_cast<FT_F26Dot6>(char_size), dots_per_inch, dots_per_inch) != 0)
    return {};

  const Font font(hb_ft_font_create(face.get(), nullptr));
  const Buffer buffer(hb_buffer_create());
  hb_buffer_add_utf8(buffer.get(), text.c_str(), -1, 0, -1);
  const hb_script_t script = hb_script_from_string(style.script.c_str(), -1);
  if (script != HB_SCRIPT_INVALID) hb_buffer_set_script(buffer.get(), script);
  hb_buffer_set_language(buffer.get(), hb_language_from_string(style.language.c_str(), -1));
  const hb_direction_t direction = hb_direction_from_string(style.direction.c_str(), -1);
  if (direction != HB_DIRECTION_INVALID) hb_buffer_set_direction(buffer.get(), direction);
  hb_buffer_guess_segment_properties(buffer.get());  // only what is not set
  hb_shape(font.get(), buffer.get(), nullptr, 0);
  const bool is_horizontal = HB_DIRECTION_IS_HORIZONTAL(hb_buffer_get_direction(buffer.get()));

  unsigned count = 0;
  const hb_glyph_info_t* info = hb_buffer_get_glyph_infos(buffer.get(), &count);
  const hb_glyph_position_t* place = hb_buffer_get_glyph_positions(buffer.get(), &count);
  std::vector<std::pair<Glyph, unsigned>> glyphs;
  Extent extent;
  for (unsigned i = 0; i < count; ++i) {
    FT_Glyph glyph = nullptr;
    if (FT_Load_Glyph(face.get(), info[i].codepoint, FT_LOAD_DEFAULT) != 0 ||
        FT_Get_Glyph(face->glyph, &glyph) != 0)
      continue;
    glyphs.emplace_back(Glyph(glyph), i);
    FT_BBox box;
    FT_Glyph_Get_CBox(glyph, FT_GLYPH_BBOX_GRIDFIT, &box);
    if (is_horizontal) {
      extent.width += place[i].x_advance / advance_unit * style.spacing;
      extent.ascent = std::max(extent.ascent, static_cast<double>(box.yMax) / advance_unit);
      extent.descent = std::max(extent.descent, static_cast<double>(-box.yMin) / advance_unit);
    } else {
      extent.width = std::max(extent.width, static_cast<double>(box.xMax - box.xMin) / advance_unit);
      extent.ascent += place[i].y_advance / advance_unit * style.spacing;
    }
  }

  warn_of_missing(text, {info, count}, face->family_name, warn);

  const std::array<double, 2> origin = aligned(style, extent);
  std::array<double, 2> pen_at{};
  TextOutlines outlines;
  std::map<hb_codepoint_t, std::uint32_t> known;
  for (const auto& [glyph, i] : glyphs) {
    const auto [seen, is_new] =
        known.try_emplace(info[i].codepoint, static_cast<std::uint32_t>(outlines.glyphs.size()));
    if (is_new) outlines.glyphs.push_back(outline_of(*glyph, style));
    const std::array<double, 2> at{origin[0] + pen_at[0] + place[i].x_offset / advance_unit,
                                   origin[1] + pen_at[1] + place[i].y_offset / advance_unit};
    if (!outlines.glyphs[seen->second].points.empty())
      outlines.placed.push_back({seen->second, {style.size * at[0], style.size * at[1]}});
    pen_at[0] += place[i].x_advance / advance_unit * style.spacing;
    pen_at[1] += place[i].y_advance / advance_unit * style.spacing;
  }
  return outlines;
}

}  // namespace
}  // namespace bsp2::model

BSP2_DEFINE_MODULE(bsp2::model::TextModule, bsp2::model::find_outlines)
