// Formats for programs that print: 3MF and AMF.
#include <map>

#include "files/xml.hpp"
#include "surfaces/division.hpp"
#include "surfaces/text.hpp"
#include "surfaces/thumbnail.hpp"
#include "surfaces/writers.hpp"
#include "surfaces/zip.hpp"

namespace bsp2::io {
namespace {

/// The colours of the parts that have one, numbered from 0.
class Materials {
 public:
  Materials(const std::vector<PrintedObject>& objects, const PartLabels& labels) {
    for (const PrintedObject& object : objects)
      if (labels.colour(object.owner) && number_.try_emplace(object.owner, owners_.size()).second)
        owners_.push_back(object.owner);
  }
  [[nodiscard]] const std::vector<std::int32_t>& owners() const { return owners_; }
  [[nodiscard]] bool have(std::int32_t owner) const { return number_.contains(owner); }
  [[nodiscard]] std::size_t operator[](std::int32_t owner) const { return number_.at(owner); }

 private:
  std::map<std::int32_t, std::size_t> number_;
  std::vector<std::int32_t> owners_;
};

constexpr std::string_view content_types =
                               R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
 <Default Extension="png" ContentType="image/png"/>
</Types>
)",
                           relationships =
                               R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Id="model" Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
 <Relationship Id="thumbnail" Target="/Metadata/thumbnail.png" Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>
</Relationships>
)";

constexpr std::size_t materials_id = 1, first_object_id = 2;

void write_3mf_materials(Text& text, const Materials& materials, const PartLabels& labels) {
  if (materials.owners().empty()) return;
  text << "  <basematerials id=\"" << materials_id << "\">\n";
  for (const std::int32_t owner : materials.owners())
    text << "   <base name=\"" << quoted(labels.name(owner)) << "\" displaycolor=\""
         << hexadecimal(*labels.colour(owner)) << "\"/>\n";
  text << "  </basematerials>\n";
}

void write_3mf_object(Text& text, const PrintedObject& object, std::size_t id, const Materials& materials) {
  text << "  <object id=\"" << id << "\" type=\"model\" name=\"" << quoted(object.name) << '"';
  if (materials.have(object.owner))
    text << " pid=\"" << materials_id << "\" pindex=\"" << materials[object.owner] << '"';
  text << ">\n   <mesh>\n    <vertices>\n";
  for (const auto& [x, y, z] : object.mesh.points)
    text << "     <vertex x=\"" << x << "\" y=\"" << y << "\" z=\"" << z << "\"/>\n";
  text << "    </vertices>\n    <triangles>\n";
  for (const auto& [a, b, c] : object.mesh.triangles)
    text << "     <triangle v1=\"" << a << "\" v2=\"" << b << "\" v3=\"" << c << "\"/>\n";
  text << "    </triangles>\n   </mesh>\n  </object>\n";
}

/// Several objects are components of one, so that programs leave them where they are.
void write_3mf_assembly(Text& text, std::size_t objects, const PartLabels& labels) {
  text << "  <object id=\"" << first_object_id + objects << "\" type=\"model\" name=\""
       << quoted(one_line(labels.whole())) << "\">\n   <components>\n";
  for (std::size_t i = 0; i < objects; ++i)
    text << "    <component objectid=\"" << first_object_id + i << "\"/>\n";
  text << "   </components>\n  </object>\n";
}

void write_amf_colour(Text& text, const SurfaceParts::Colour& colour) {
  text << "<color>";
  for (std::size_t k = 0; k < 4; ++k)
    text << '<' << "rgba"[k] << '>' << static_cast<float>(colour[k]) / 255 << "</"
         << "rgba"[k] << '>';
  text << "</color>";
}

void write_amf_object(Text& text, const PrintedObject& object, std::size_t id, const Materials& materials) {
  text << " <object id=\"" << id << "\">\n  <metadata type=\"name\">" << quoted(object.name)
       << "</metadata>\n  <mesh>\n   <vertices>\n";
  for (const auto& [x, y, z] : object.mesh.points)
    text << "    <vertex><coordinates><x>" << x << "</x><y>" << y << "</y><z>" << z
         << "</z></coordinates></vertex>\n";
  text << "   </vertices>\n   <volume";
  if (materials.have(object.owner)) text << " materialid=\"" << materials[object.owner] + 1 << '"';
  text << ">\n";
  for (const auto& [a, b, c] : object.mesh.triangles)
    text << "    <triangle><v1>" << a << "</v1><v2>" << b << "</v2><v3>" << c << "</v3></triangle>\n";
  text << "   </volume>\n  </mesh>\n </object>\n";
}

std::size_t expected_size(const geometry::TriangleSurface& surface) {
  return 4096 + 110 * surface.points.size() + 75 * surface.triangles.size();
}

}  // namespace

std::string to_3mf(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   std::vector<std::string>& notes) {
  const std::vector<PrintedObject> objects = printed_objects(surface, labels, notes);
  const Materials materials(objects, labels);
  Text text(expected_size(surface));
  text << R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
 <metadata name="Title">)"
       << quoted(one_line(labels.whole())) << R"(</metadata>
 <metadata name="Application">bsp2</metadata>
 <resources>
)";
  write_3mf_materials(text, materials, labels);
  for (std::size_t i = 0; i < objects.size(); ++i)
    write_3mf_object(text, objects[i], first_object_id + i, materials);
  if (objects.size() > 1) write_3mf_assembly(text, objects.size(), labels);
  text << " </resources>\n <build>\n";
  if (!objects.empty())
    text << "  <item objectid=\""
         << (objects.size() == 1 ? first_object_id : first_object_id + objects.size()) << "\"/>\n";
  text << " </build>\n</model>\n";
  Zip zip;
  zip.add("[Content_Types].xml", content_types);
  zip.add("_rels/.rels", relationships);
  zip.add("Metadata/thumbnail.png", thumbnail(objects, labels), Zip::Packing::store);
  zip.add("3D/3dmodel.model", text.take());
  return zip.take();
}

std::string to_amf(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   std::vector<std::string>& notes) {
  const std::vector<PrintedObject> objects = printed_objects(surface, labels, notes);
  const Materials materials(objects, labels);
  Text text(expected_size(surface));
  text << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<amf unit=\"millimeter\">\n"
          " <metadata type=\"producer\">bsp2</metadata>\n";
  for (const std::int32_t owner : materials.owners()) {
    text << " <material id=\"" << materials[owner] + 1 << "\"><metadata type=\"name\">"
         << quoted(labels.name(owner)) << "</metadata>";
    write_amf_colour(text, *labels.colour(owner));
    text << "</material>\n";
  }
  for (std::size_t i = 0; i < objects.size(); ++i) write_amf_object(text, objects[i], i, materials);
  text << "</amf>\n";
  return text.take();
}

}  // namespace bsp2::io
