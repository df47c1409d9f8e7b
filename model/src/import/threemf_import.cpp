#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/colour.hpp"
#include "import/imports.hpp"
#include "import/part_names.hpp"
#include "import/text_cursor.hpp"
#include "import/xml_stream.hpp"
#include "import/zip_file.hpp"

// Source: 3MF Consortium, "3D Manufacturing Format, Core Specification" and "Production Extension", whose
// parts in other files of the package are read as well. Units make no difference, as in OpenSCAD.
namespace bsp2::model {
namespace {

/// Limits on what copies of one object may grow to.
constexpr std::size_t most_instances = 1'000'000, most_copied = 20'000'000;

/// (x y z 1) times these four rows.
using Placement = std::array<double, 12>;
constexpr Placement identity{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};

Placement operator*(const Placement& first, const Placement& then) {
  Placement result{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = row == 3 ? then[9 + i] : 0;
      for (std::size_t k = 0; k < 3; ++k) sum += first[3 * row + k] * then[3 * k + i];
      result[3 * row + i] = sum;
    }
  return result;
}

/// The name of an object: the part that it stands in, and its number there.
using ObjectName = std::pair<std::string, std::uint32_t>;

struct Instance {
  ObjectName object;
  Placement placement = identity;
  std::string name{};  // of what it is a component of, if that has one
};

/// A group of colours in a part of the package, and which of them.
struct ColourIndex {
  std::optional<std::uint32_t> group, index;
  friend bool operator==(const ColourIndex&, const ColourIndex&) = default;
};

struct Object {
  std::vector<Point3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Instance> components;
  std::string name;
  ColourIndex own_colour;                       // of triangles that have none
  std::optional<ColourIndex> triangles_colour;  // of the first triangle
  bool is_of_one_colour = true;
};

std::string without_slash(std::string_view name) {
  return std::string(name.substr(name.starts_with('/') ? 1 : 0));
}

class PackageReader {
 public:
  PackageReader(std::string_view bytes, const std::filesystem::path& path)
      : zip_(open_zip(bytes, path)), path_(path), unpacking_(bytes.size(), path.string()) {}

  ImportedParts read() {
    const std::string root = root_part();
    parts_.emplace_back(root);
    for (std::size_t i = 0; i < parts_.size(); ++i)
      read_part(std::string(parts_[i]));  // a copy: there may be more of them after it
    std::vector<Instance> open = std::move(build_);
    std::reverse(open.begin(), open.end());
    for (std::size_t count = 0; !open.empty(); ++count) {
      if (count + open.size() > most_instances)
        throw Error(path_.string() + ": its objects are put together from more than " +
                    std::to_string(most_instances) + " components");
      Instance instance = std::move(open.back());
      open.pop_back();
      const auto found = objects_.find(instance.object);
      if (found == objects_.end())
        throw Error(path_.string() + ": there is no object " + std::to_string(instance.object.second) +
                    " in " + instance.object.first);
      if (!found->second.name.empty()) instance.name = found->second.name;
      add(found->second, instance);
      const std::vector<Instance>& components = found->second.components;
      for (auto component = components.rbegin(); component != components.rend(); ++component)
        open.push_back({component->object, component->placement * instance.placement, instance.name});
    }
    return finished();
  }

 private:
  /// The part that the package's relations name, else the usual one.
  std::string root_part() const {
    constexpr std::size_t most_bytes = 1 << 20;
    const std::string usual = "3D/3dmodel.model";
    const auto relations = zip_->text("_rels/.rels", most_bytes);
    if (!relations) return usual;
    std::string_view left = *relations;
    XmlStream xml(
        [left](char* buffer, int size) mutable {
          const std::size_t count = left.copy(buffer, static_cast<std::size_t>(size));
          left.remove_prefix(count);
          return static_cast<int>(count);
        },
        path_.string() + ": _rels/.rels");
    while (xml.next()) {
      if (xml.event() != XmlStream::Event::begin || xml.name() != "Relationship") continue;
      std::string target;
      bool is_model = false;
      xml.visit_attributes([&](std::string_view name, std::string_view value) {
        if (name == "Target") target = without_slash(value);
        if (name == "Type") is_model = value.ends_with("/3dmodel");
      });
      if (is_model && !target.empty()) return target;
    }
    return usual;
  }

  void read_part(const std::string& part) {
    const std::unique_ptr<ZipFile::Entry> entry = zip_->open(part);
    if (!entry) throw Error(path_.string() + ": there is no " + part + " in this 3MF file");
    XmlStream xml([&](char* buffer, int size) { return unpacking_.read(*entry, buffer, size); },
                  path_.string() + ": " + part);
    if (!xml.next() || xml.name() != "model") xml.fail("expected the element 'model'");
    if (part == parts_.front())
      xml.visit_attributes([&](std::string_view name, std::string_view value) {
        if (name == "unit") unit_ = value;
      });
    Object* object = nullptr;
    colours_ = nullptr;
    while (xml.next()) {
      if (xml.event() == XmlStream::Event::begin)
        begin(xml, part, object);
      else if (xml.event() == XmlStream::Event::end && xml.name() == "object")
        object = nullptr;
    }
  }

  void begin(XmlStream& xml, const std::string& part, Object*& object) {
    const std::string_view name = xml.name();
    if (name == "object") {
      object = &begin_object(xml, part);
    } else if (name == "basematerials" || name == "colorgroup") {
      begin_colours(xml, part);
    } else if ((name == "base" || name == "color") && colours_ != nullptr) {
      xml.visit_attributes([&](std::string_view attribute, std::string_view value) {
        if (attribute == "displaycolor" || attribute == "color") colours_->push_back(colour_named(value));
      });
    } else if (name == "vertex" && object != nullptr) {
      read_vertex(xml, *object);
    } else if (name == "triangle" && object != nullptr) {
      read_triangle(xml, *object);
    } else if (name == "component" && object != nullptr) {
      Instance component = read_instance(xml, part);
      // What is named has to stand before, so nothing is a component of itself. Other parts have no
      // components elsewhere.
      const bool is_elsewhere = component.object.first != part;
      if (is_elsewhere ? part != parts_.front()
                       : !objects_.contains(component.object) || object == &objects_.at(component.object))
        xml.fail("a component names object " + std::to_string(component.object.second) +
                 ", which has not been told of");
      object->components.push_back(std::move(component));
    } else if (name == "item" && part == parts_.front()) {
      build_.push_back(read_instance(xml, part));
    }
  }

  Object& begin_object(XmlStream& xml, const std::string& part) {
    std::uint32_t id = 0;
    Object read;
    xml.visit_attributes([&](std::string_view attribute, std::string_view value) {
      if (attribute == "id") id = xml.index(value);
      if (attribute == "name") read.name = printable_name(value);
      if (attribute == "pid") read.own_colour.group = xml.index(value);
      if (attribute == "pindex") read.own_colour.index = xml.index(value);
    });
    const auto [found, is_new] = objects_.try_emplace({part, id}, std::move(read));
    if (!is_new) xml.fail("there is an object " + std::to_string(id) + " already");
    return found->second;
  }

  void begin_colours(XmlStream& xml, const std::string& part) {
    std::uint32_t id = 0;
    xml.visit_attributes([&](std::string_view attribute, std::string_view value) {
      if (attribute == "id") id = xml.index(value);
    });
    colours_ = &groups_[{part, id}];
  }

  static void read_vertex(XmlStream& xml, Object& object) {
    Point3 point{};
    int given = 0;
    xml.visit_attributes([&](std::string_view name, std::string_view value) {
      if (name != "x" && name != "y" && name != "z") return;
      point[static_cast<std::size_t>(name[0] - 'x')] = xml.coordinate(value);
      ++given;
    });
    if (given != 3) xml.fail("a vertex without all of its coordinates");
    object.points.push_back(point);
  }

  static void read_triangle(XmlStream& xml, Object& object) {
    std::array<std::uint32_t, 3> corners{};
    int given = 0;
    ColourIndex colour = object.own_colour;
    std::array<std::optional<std::uint32_t>, 2> others;  // of the second and the third corner
    xml.visit_attributes([&](std::string_view name, std::string_view value) {
      if (name == "pid") colour.group = xml.index(value);
      if (name == "p1") colour.index = xml.index(value);
      if (name == "p2" || name == "p3") others[name == "p2" ? 0 : 1] = xml.index(value);
      if (name != "v1" && name != "v2" && name != "v3") return;
      const std::uint32_t index = xml.index(value);
      if (index >= object.points.size())
        xml.fail("a triangle names vertex " + std::to_string(index) + ", but there are " +
                 std::to_string(object.points.size()) + ", the first being 0");
      corners[static_cast<std::size_t>(name[1] - '1')] = index;
      ++given;
    });
    if (given != 3) xml.fail("a triangle without all of its corners");
    object.triangles.push_back(corners);
    if (!object.triangles_colour) object.triangles_colour = colour;
    for (const auto& other : others)
      if (other && other != colour.index) object.is_of_one_colour = false;
    if (colour != *object.triangles_colour) object.is_of_one_colour = false;
  }

  Instance read_instance(XmlStream& xml, const std::string& part) {
    Instance instance{{part, 0}};
    bool has_object = false;
    xml.visit_attributes([&](std::string_view name, std::string_view value) {
      if (name == "objectid") {
        instance.object.second = xml.index(value);
        has_object = true;
      } else if (name == "path") {
        instance.object.first = without_slash(value);
      } else if (name == "transform") {
        TextCursor words(value, path_);
        for (double& entry : instance.placement) entry = xml.coordinate(words.word());
        if (!words.word().empty()) xml.fail("a transform of more than twelve numbers");
      }
    });
    if (!has_object) xml.fail("expected the number of an object");
    if (std::find(parts_.begin(), parts_.end(), instance.object.first) == parts_.end())
      parts_.push_back(instance.object.first);
    return instance;
  }

  static double determinant(const Placement& m) {
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
  }

  /// A mirror image has its outside outside.
  void add(const Object& object, const Instance& instance) {
    if (object.points.empty() && object.triangles.empty()) return;
    triangles_ += object.triangles.size();
    points_ += object.points.size();
    if (!parts_read_.empty() && std::max(triangles_, points_) > most_copied)
      throw Error(path_.string() + ": its objects have more than " + std::to_string(most_copied) +
                  " triangles or points together");
    ImportedPart part{instance.name, colour_of(object, instance.object.first), {}};
    if (!object.is_of_one_colour) ++many_coloured_;
    const Placement& placement = instance.placement;
    for (const Point3& point : object.points) {
      Point3 placed;
      for (std::size_t i = 0; i < 3; ++i) {
        placed[i] = placement[9 + i];
        for (std::size_t k = 0; k < 3; ++k) placed[i] += point[k] * placement[3 * k + i];
      }
      part.mesh.add_point(placed);
    }
    const bool is_mirrored = determinant(placement) < 0;
    for (const auto& [a, b, c] : object.triangles)
      part.mesh.add_face(is_mirrored ? std::array{a, c, b} : std::array{a, b, c});
    parts_read_.push_back(std::move(part));
  }

  std::optional<Colour> colour_of(const Object& object, const std::string& part) const {
    const ColourIndex colour = object.triangles_colour.value_or(object.own_colour);
    if (!object.is_of_one_colour || !colour.group) return std::nullopt;
    const auto group = groups_.find({part, *colour.group});
    const std::uint32_t index = colour.index.value_or(0);
    return group != groups_.end() && index < group->second.size() ? group->second[index] : std::nullopt;
  }

  /// Objects without names and colours are one mesh, as ever.
  ImportedParts finished() {
    ImportedParts result;
    result.notes = notes_of_unit(unit_);
    const bool has_parts = std::any_of(parts_read_.begin(), parts_read_.end(), [](const ImportedPart& part) {
      return !part.name.empty() || part.colour.has_value();
    });
    if (has_parts) {
      PartNames names;
      for (ImportedPart& part : parts_read_) part.name = names.once(part.name);
      result.parts = std::move(parts_read_);
    } else {
      result.parts.push_back({{}, {}, joined(parts_read_)});
    }
    if (many_coloured_ > 0)
      result.notes.push_back(counted(many_coloured_,
                                     "# object[s] [has|have] triangles of several colours; a part has one "
                                     "colour, so [it comes|they come] without"));
    return result;
  }

  std::unique_ptr<ZipFile> zip_;
  const std::filesystem::path& path_;
  Unpacking unpacking_;
  std::vector<std::string> parts_;  // the first is the root; read in this order
  std::string unit_ = "millimeter";
  std::map<ObjectName, Object> objects_;
  std::map<ObjectName, std::vector<std::optional<Colour>>> groups_;
  std::vector<std::optional<Colour>>* colours_ = nullptr;  // of the group that was begun last
  std::vector<Instance> build_;
  std::vector<ImportedPart> parts_read_;
  std::size_t points_ = 0, triangles_ = 0, many_coloured_ = 0;
};

}  // namespace

ImportedParts import_3mf(std::string_view bytes, const std::filesystem::path& path) {
  return PackageReader(bytes, path).read();
}

}  // namespace bsp2::model
