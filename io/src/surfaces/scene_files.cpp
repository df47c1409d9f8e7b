// Scenes of indexed face sets: VRML97 and X3D.
#include <cmath>
#include <numbers>

#include "files/xml.hpp"
#include "surfaces/division.hpp"
#include "surfaces/shading.hpp"
#include "surfaces/text.hpp"
#include "surfaces/writers.hpp"

namespace bsp2::io {
namespace {

/// Neighbours in a smaller angle look as if they were round.
float crease_angle() { return static_cast<float>(sharp_angle * std::numbers::pi / 180); }

/// A text of VRML, in which quotation marks and backslashes are marked.
std::string vrml_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

void write_indices(Text& text, const PartPiece& piece) {
  for (const CornerIndices& t : piece.triangles) text.list(t, " ") << " -1\n";
}

void write_points(Text& text, const PartPiece& piece, const SingleSurface& surface) {
  for (const std::uint32_t point : piece.points) text.list(surface.points[point], " ") << '\n';
}

std::array<float, 3> share_of(const SurfaceParts::Colour& colour) {
  return {static_cast<float>(colour[0]) / 255, static_cast<float>(colour[1]) / 255,
          static_cast<float>(colour[2]) / 255};
}

float transparency(const SurfaceParts::Colour& colour) { return 1 - static_cast<float>(colour[3]) / 255; }

}  // namespace

std::string to_vrml(const SingleSurface& surface, const PartLabels& labels) {
  Text text(64 + 60 * surface.points.size() + 30 * surface.triangles.size());
  text << "#VRML V2.0 utf8\nWorldInfo { title " << vrml_string(one_line(labels.whole()))
       << " info \"written by bsp2\" }\n";
  Words words(Words::Kind::identifier);
  for (const PartPiece& piece : pieces_by_part(surface.points.size(), surface.triangles, surface.owner)) {
    const std::int32_t owner = piece.owner;
    const auto colour = labels.shown_colour(owner);
    text << "# " << labels.name(owner) << "\nDEF " << words.word(labels.name(owner), owner)
         << " Shape {\n appearance Appearance { material Material { diffuseColor ";
    text.list(share_of(colour), " ");
    if (colour[3] < 255) text << " transparency " << transparency(colour);
    text << " } }\n geometry IndexedFaceSet {\n  creaseAngle " << crease_angle()
         << "\n  coord Coordinate { point [\n";
    write_points(text, piece, surface);
    text << "  ] }\n  coordIndex [\n";
    write_indices(text, piece);
    text << "  ]\n }\n}\n";
  }
  return text.take();
}

std::string to_x3d(const SingleSurface& surface, const PartLabels& labels) {
  Text text(512 + 60 * surface.points.size() + 30 * surface.triangles.size());
  text << R"(<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 3.3//EN" "http://www.web3d.org/specifications/x3d-3.3.dtd">
<X3D profile="Interchange" version="3.3">
<head>
<meta name="title" content=")"
       << quoted(one_line(labels.whole())) << R"("/>
<meta name="generator" content="bsp2"/>
</head>
<Scene>
)";
  Words words(Words::Kind::identifier);
  for (const PartPiece& piece : pieces_by_part(surface.points.size(), surface.triangles, surface.owner)) {
    const std::int32_t owner = piece.owner;
    const auto colour = labels.shown_colour(owner);
    text << "<Group DEF=\"" << words.word(labels.name(owner), owner) << "\">\n<WorldInfo title=\""
         << quoted(labels.name(owner)) << "\"/>\n<Shape>\n<Appearance><Material diffuseColor=\"";
    text.list(share_of(colour), " ") << '"';
    if (colour[3] < 255) text << " transparency=\"" << transparency(colour) << '"';
    text << "/></Appearance>\n<IndexedFaceSet creaseAngle=\"" << crease_angle() << "\" coordIndex=\"";
    write_indices(text, piece);
    text << "\"><Coordinate point=\"";
    write_points(text, piece, surface);
    text << "\"/></IndexedFaceSet>\n</Shape>\n</Group>\n";
  }
  text << "</Scene>\n</X3D>\n";
  return text.take();
}

}  // namespace bsp2::io
