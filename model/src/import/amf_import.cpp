#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "import/xml_stream.hpp"
#include "import/zip_file.hpp"

namespace bsp2::model {
namespace {

/// Reads the objects of an AMF text as they stand: OpenSCAD knows no units and no constellations either, of
/// which notes tell.
class AmfReader {
 public:
  explicit AmfReader(XmlStream& xml) : xml_(xml) {}

  ImportedParts read() {
    if (!xml_.next() || xml_.name() != "amf") xml_.fail("expected the element 'amf'");
    std::string unit = "millimeter";
    xml_.visit_attributes([&](std::string_view name, std::string_view value) {
      if (name == "unit") unit = value;
    });
    while (xml_.next()) {
      if (xml_.event() == XmlStream::Event::text) {
        text_ += xml_.value();
        continue;
      }
      if (xml_.event() == XmlStream::Event::begin)
        begin(xml_.name());
      else
        end(xml_.name());
      text_.clear();
    }
    ImportedParts result;
    result.notes = notes_of_unit(unit);
    if (constellations_ > 0)
      result.notes.push_back(
          counted(constellations_,
                  "# constellation[s] [is|are] not read: each object is where it is modelled, once"));
    result.parts.push_back({{}, {}, std::move(mesh_)});
    return result;
  }

 private:
  void begin(std::string_view name) {
    if (name == "object") first_ = mesh_.points.size();
    if (name == "constellation") ++constellations_;
    if (name == "coordinates") coordinates_ = {};
    if (name == "triangle") corners_ = {};
  }

  void end(std::string_view name) {
    if (name == "x" || name == "y" || name == "z") {
      coordinates_[static_cast<std::size_t>(name[0] - 'x')] = xml_.coordinate(text_);
    } else if (name == "v1" || name == "v2" || name == "v3") {
      corners_[static_cast<std::size_t>(name[1] - '1')] = xml_.index(text_);
    } else if (name == "coordinates") {
      Point3 point;
      for (std::size_t i = 0; i < 3; ++i) {
        if (!coordinates_[i]) xml_.fail("a vertex without all of its coordinates");
        point[i] = *coordinates_[i];
      }
      mesh_.add_point(point);
    } else if (name == "triangle") {
      std::array<std::uint32_t, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        if (!corners_[i]) xml_.fail("a triangle without all of its corners");
        if (*corners_[i] >= mesh_.points.size() - first_)
          xml_.fail("a triangle names vertex " + std::to_string(*corners_[i]) + ", but there are " +
                    std::to_string(mesh_.points.size() - first_) + " in its object, the first being 0");
        corners[i] = static_cast<std::uint32_t>(first_) + *corners_[i];
      }
      mesh_.add_face(corners);
    }
  }

  XmlStream& xml_;
  ImportedMesh mesh_;
  std::string text_;
  std::size_t first_ = 0;  // of the object's points
  std::size_t constellations_ = 0;
  std::array<std::optional<double>, 3> coordinates_;
  std::array<std::optional<std::uint32_t>, 3> corners_;
};

}  // namespace

ImportedParts import_amf(std::string_view bytes, const std::filesystem::path& path) {
  std::unique_ptr<ZipFile> zip;
  std::unique_ptr<ZipFile::Entry> entry;
  XmlStream::Read read = [bytes](char* buffer, int size) mutable {
    const std::size_t count = std::min(bytes.size(), static_cast<std::size_t>(size));
    std::memcpy(buffer, bytes.data(), count);
    bytes.remove_prefix(count);
    return static_cast<int>(count);
  };
  if (is_zip(bytes)) {
    zip = open_zip(bytes, path);
    entry = zip->open_first(".amf");
    if (!entry) throw Error(path.string() + ": there is nothing to read in this zip file");
    read = [&entry, unpacking = Unpacking(bytes.size(), path.string())](char* buffer, int size) mutable {
      return unpacking.read(*entry, buffer, size);
    };
  }
  XmlStream xml(std::move(read), path.string());
  return AmfReader(xml).read();
}

}  // namespace bsp2::model
