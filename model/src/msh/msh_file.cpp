#include "bsp2/model/msh/msh_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "import/imports.hpp"
#include "import/part_names.hpp"
#include "import/text_cursor.hpp"

// Source: the gmsh reference manual, "MSH file format" (4.1) and "Legacy formats" (2.2).
namespace bsp2::model {
namespace {

/// Words of a text, and numbers as they lie in memory.
class MshInput {
 public:
  MshInput(std::string_view bytes, const std::filesystem::path& path) : bytes_(bytes), path_(path) {}

  bool is_binary = false;

  std::string_view word() {
    while (at_ < bytes_.size() && is_space(bytes_[at_])) ++at_;
    const std::size_t from = at_;
    while (at_ < bytes_.size() && !is_space(bytes_[at_])) ++at_;
    return bytes_.substr(from, at_ - from);
  }
  /// What is left of the line.
  std::string_view line() {
    const std::size_t from = at_, end = std::min(bytes_.find('\n', at_), bytes_.size());
    at_ = std::min(end + 1, bytes_.size());
    return bytes_.substr(from, end - from);
  }
  [[nodiscard]] bool is_at_end() const {
    return bytes_.find_first_not_of(" \t\r\n", at_) == std::string_view::npos;
  }

  /// Of a text, or of four bytes.
  std::int64_t integer() { return is_binary ? raw<std::int32_t>() : text_integer(); }
  /// Of a text, or of eight bytes.
  std::size_t size() {
    if (is_binary) return raw<std::uint64_t>();
    const std::int64_t value = text_integer();
    if (value < 0) fail("expected a number from 0, found " + std::to_string(value));
    return static_cast<std::size_t>(value);
  }
  double coordinate() {
    const double value = is_binary ? raw<double>() : text_number();
    if (!(std::fabs(value) <= largest_coordinate)) fail("a coordinate that is not finite or too large");
    return value;
  }
  /// Not more of them than there are bytes for.
  std::size_t count(std::size_t number, std::size_t least_bytes) {
    if (number > (bytes_.size() - at_) / least_bytes)
      fail("it tells of " + counted(number, "# element[s], and ends before; it is cut off"));
    return number;
  }
  /// A physical group; below 0 it means that an element is turned.
  std::int64_t group() {
    const std::int64_t number = integer();
    if (number < std::numeric_limits<std::int32_t>::min() ||
        number > std::numeric_limits<std::int32_t>::max())
      fail(std::to_string(number) + " is no number of a group");
    return std::abs(number);
  }
  template <typename T>
  T raw() {
    if (bytes_.size() - at_ < sizeof(T)) fail("the file ends here; it is cut off");
    T value{};
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof(T);
    return value;
  }
  void skip_to(const std::string& word) {
    const std::size_t found = bytes_.find(word, at_);
    if (found == std::string_view::npos)
      fail("expected " + word + ", found the end of the file; it is cut off");
    at_ = found + word.size();
  }
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(path_.string() + ":" +
                (is_binary ? " byte " + std::to_string(at_)
                           : std::to_string(1 + std::count(bytes_.begin(),
                                                           bytes_.begin() + static_cast<std::ptrdiff_t>(at_),
                                                           '\n'))) +
                ": " + text);
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  std::int64_t text_integer() {
    const std::string_view text = word();
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
      fail_at(text, "a whole number");
    return value;
  }
  double text_number() {
    const std::string_view text = word();
    const auto value = to_number(text);
    if (!value) fail_at(text, "a number");
    return *value;
  }
  [[noreturn]] void fail_at(std::string_view text, const std::string& expected) const {
    fail("expected " + expected + ", found " +
         (text.empty() ? "the end of the file; it is cut off"
                       : "'" + printable_name(text.substr(0, 40)) + "'"));
  }

  std::string_view bytes_;
  const std::filesystem::path& path_;
  std::size_t at_ = 0;
};

/// A type of elements: how many nodes it has, and how many of them are its corners.
struct ElementType {
  int nodes, dimension, corners;
};

/// By gmsh's number, from 1.
std::optional<ElementType> element_type(std::int64_t number) {
  static constexpr std::array<ElementType, 31> types{
      {{2, 1, 2},  {3, 2, 3},  {4, 2, 4},  {4, 3, 4},  {8, 3, 8},  {6, 3, 6},  {5, 3, 5},  {3, 1, 2},
       {6, 2, 3},  {9, 2, 4},  {10, 3, 4}, {27, 3, 8}, {18, 3, 6}, {14, 3, 5}, {1, 0, 1},  {8, 2, 4},
       {20, 3, 8}, {15, 3, 6}, {13, 3, 5}, {9, 2, 3},  {10, 2, 3}, {12, 2, 3}, {15, 2, 3}, {15, 2, 3},
       {21, 2, 3}, {4, 1, 2},  {5, 1, 2},  {6, 1, 2},  {20, 3, 4}, {35, 3, 4}, {56, 3, 4}}};
  if (number < 1 || number > static_cast<std::int64_t>(types.size())) return std::nullopt;
  return types[static_cast<std::size_t>(number - 1)];
}

class MshReader {
 public:
  MshReader(std::string_view bytes, const std::filesystem::path& path, bool with_data)
      : input_(bytes, path), with_data_(with_data) {}

  MshFile read() {
    read_format();
    while (!input_.is_at_end()) {
      const std::string section(input_.word());
      if (!section.starts_with('$') || section.size() > 60)
        input_.fail("expected a section, found '" + printable_name(section.substr(0, 40)) + "'");
      const bool is_read = read_section(section);
      const std::string end = "$End" + section.substr(1);
      if (!is_read)
        input_.skip_to(end);
      else if (const std::string_view word = input_.word(); word != end)
        input_.fail("expected " + end + ", found '" + printable_name(word.substr(0, 40)) + "'");
    }
    if (!has_nodes_ || !has_elements_) input_.fail("there are no nodes or no elements in it");
    return std::move(file_);
  }

 private:
  MshInput input_;
  const bool with_data_;
  bool is_version_4_ = false;
  MshFile file_;
  std::unordered_map<std::uint64_t, std::uint32_t> point_of_node_;
  std::map<std::pair<std::int64_t, std::int64_t>, std::string> physical_names_;    // by dimension and number
  std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> physical_groups_;  // of entities
  std::unordered_map<std::uint64_t, Point3> middle_of_element_;                    // with data
  bool has_nodes_ = false, has_elements_ = false;

  void read_format() {
    if (input_.word() != "$MeshFormat") input_.fail("is no mesh of gmsh: it does not begin with $MeshFormat");
    const std::string version(input_.word());
    is_version_4_ = version == "4.1";
    if (!is_version_4_ && version != "2.2" && version != "2.1" && version != "2")
      input_.fail("the version " + printable_name(version) +
                  " is not read; 2.2 and 4.1 are (gmsh -format msh41)");
    const std::int64_t kind = input_.integer(), bytes = input_.integer();
    if (kind != 0 && kind != 1) input_.fail("a file is of type 0 or 1, not " + std::to_string(kind));
    if (bytes != 8)
      input_.fail("numbers of " + counted(bytes, "# byte[s]") + " are not read; those of 8 are");
    input_.line();
    if (kind == 1) {
      input_.is_binary = true;
      if (input_.raw<std::int32_t>() != 1)
        input_.fail("its bytes are in the order of another machine, which is not read");
    }
    if (input_.word() != "$EndMeshFormat") input_.fail("expected $EndMeshFormat");
  }

  /// @return whether it was read.
  bool read_section(const std::string& name) {
    if (name == "$PhysicalNames") {
      read_names();
      return true;
    }
    if (name == "$NodeData" || name == "$ElementData") return read_data(name == "$NodeData");
    if (name != "$Nodes" && name != "$Elements" && !(name == "$Entities" && is_version_4_)) return false;
    if (is_version_4_) input_.line();  // in binary files numbers begin right after it
    if (name == "$Entities") {
      read_entities();
    } else if (name == "$Nodes") {
      has_nodes_ = true;
      is_version_4_ ? read_nodes_4() : read_nodes_2();
    } else {
      has_elements_ = true;
      is_version_4_ ? read_elements_4() : read_elements_2();
    }
    return true;
  }

  /// Text in binary files, too.
  void read_names() {
    const bool is_binary = std::exchange(input_.is_binary, false);
    for (std::size_t left = input_.count(input_.size(), 6); left > 0; --left) {
      const std::int64_t dimension = input_.integer(), number = input_.integer();
      std::string_view rest = input_.line();
      const std::size_t first = rest.find('"'), last = rest.rfind('"');
      if (first == std::string_view::npos || last == first) input_.fail("expected a name in quotation marks");
      physical_names_[{dimension, number}] = printable_name(rest.substr(first + 1, last - first - 1));
    }
    input_.is_binary = is_binary;
  }

  /// Numbers of nodes or elements. What stands before them is text in binary files, too.
  /// @return false if they are not wanted, or more than one each.
  bool read_data(bool of_nodes) {
    if (!with_data_ || !file_.data.empty()) return false;
    const bool is_binary = std::exchange(input_.is_binary, false);
    std::size_t texts = input_.count(input_.size(), 1);
    for (input_.line(); texts > 0; --texts) input_.line();
    for (std::size_t left = input_.count(input_.size(), 2); left > 0; --left) input_.coordinate();
    std::vector<std::size_t> tags(input_.count(input_.size(), 2));
    for (std::size_t& tag : tags) tag = input_.size();
    if (tags.size() < 3) input_.fail("expected a step, how many numbers there are each, and of how many");
    input_.is_binary = is_binary;
    if (tags[1] != 1) return false;
    if (is_binary) input_.line();
    for (std::size_t left = input_.count(tags[2], is_binary ? 12 : 4); left > 0; --left) {
      const auto number = static_cast<std::uint64_t>(input_.integer());
      const Point3 at = of_nodes ? node(number) : middle_of_element(number);
      file_.data.push_back({at[0], at[1], at[2], input_.coordinate()});
    }
    return true;
  }

  const Point3& node(std::uint64_t number) const {
    const auto found = point_of_node_.find(number);
    if (found == point_of_node_.end()) input_.fail("there is no node " + std::to_string(number));
    return file_.points[found->second];
  }

  const Point3& middle_of_element(std::uint64_t number) const {
    const auto found = middle_of_element_.find(number);
    if (found == middle_of_element_.end())
      input_.fail("there is no triangle, quadrangle or solid element " + std::to_string(number));
    return found->second;
  }

  void read_entities() {
    std::array<std::size_t, 4> counts{};
    for (std::size_t& count : counts) count = input_.size();
    for (std::int64_t dimension = 0; dimension < 4; ++dimension)
      for (std::size_t left = input_.count(counts[static_cast<std::size_t>(dimension)], 8); left > 0;
           --left) {
        const std::int64_t entity = input_.integer();
        for (int i = 0; i < (dimension == 0 ? 3 : 6); ++i) input_.coordinate();
        for (std::size_t i = input_.count(input_.size(), 2); i > 0; --i)
          physical_groups_.try_emplace({dimension, entity}, input_.group());
        if (dimension > 0)
          for (std::size_t i = input_.count(input_.size(), 2); i > 0; --i) input_.integer();
      }
  }

  void add_node(std::uint64_t number, const Point3& point) {
    if (!point_of_node_.try_emplace(number, static_cast<std::uint32_t>(file_.points.size())).second)
      input_.fail("there is a node " + std::to_string(number) + " already");
    file_.points.push_back(point);
  }

  Point3 point() {
    Point3 point{};
    for (double& x : point) x = input_.coordinate();
    return point;
  }

  /// The count is text in binary files, too.
  std::size_t count_2(std::size_t least_bytes) {
    const bool is_binary = std::exchange(input_.is_binary, false);
    const std::size_t count = input_.count(input_.size(), least_bytes);
    input_.is_binary = is_binary;
    if (is_binary) input_.line();
    return count;
  }

  void read_nodes_2() {
    for (std::size_t left = count_2(8); left > 0; --left) {
      const auto number = static_cast<std::uint64_t>(input_.integer());
      add_node(number, point());
    }
  }

  void read_elements_2() {
    if (input_.is_binary) return read_binary_elements_2();
    for (std::size_t left = count_2(8); left > 0; --left) {
      const auto number = static_cast<std::uint64_t>(input_.integer());
      const ElementType type = known_type(input_.integer());
      const std::size_t tags = input_.count(input_.size(), 2);
      read_element_2(number, type, tags);
    }
  }

  void read_binary_elements_2() {
    for (std::size_t left = count_2(8); left > 0;) {
      const ElementType type = known_type(input_.integer());
      const std::int64_t some = input_.integer(), tags = input_.integer();
      if (some < 1 || static_cast<std::size_t>(some) > left || tags < 0)
        input_.fail("a block of " + counted(some, "# element[s] with ") + counted(tags, "# tag[s], where ") +
                    counted(left, "# element[s] [is|are] left"));
      for (std::int64_t i = 0; i < some; ++i) {
        const auto number = static_cast<std::uint64_t>(input_.integer());
        read_element_2(number, type, input_.count(static_cast<std::size_t>(tags), 4));
      }
      left -= static_cast<std::size_t>(some);
    }
  }

  /// @param tags the first is the physical group, the second the entity.
  void read_element_2(std::uint64_t number, const ElementType& type, std::size_t tags) {
    std::array<std::int64_t, 2> first{};
    for (std::size_t i = 0; i < tags; ++i) {
      const std::int64_t tag = i < 2 ? input_.group() : input_.integer();
      if (i < 2) first[i] = tag;
    }
    read_corners(number, type,
                 group_of(type.dimension, first[0] != 0 ? std::optional(first[0]) : std::nullopt, first[1]),
                 [&] { return static_cast<std::uint64_t>(input_.integer()); });
  }

  void read_nodes_4() {
    const std::size_t blocks = input_.size();
    for (int i = 0; i < 3; ++i) input_.size();
    for (std::size_t left = input_.count(blocks, 8); left > 0; --left) {
      const std::int64_t dimension = input_.integer();
      input_.integer();
      const bool is_parametric = input_.integer() != 0;
      std::vector<std::uint64_t> numbers(input_.count(input_.size(), 8));
      for (std::uint64_t& number : numbers) number = input_.size();
      for (const std::uint64_t number : numbers) {
        add_node(number, point());
        for (std::int64_t i = 0; is_parametric && i < std::min<std::int64_t>(dimension, 3); ++i)
          input_.coordinate();
      }
    }
  }

  void read_elements_4() {
    const std::size_t blocks = input_.size();
    for (int i = 0; i < 3; ++i) input_.size();
    for (std::size_t left = input_.count(blocks, 8); left > 0; --left) {
      const std::int64_t dimension = input_.integer(), entity = input_.integer();
      const ElementType type = known_type(input_.integer());
      const auto found = physical_groups_.find({dimension, entity});
      MshFile::Group* group =
          group_of(type.dimension,
                   found != physical_groups_.end() ? std::optional(found->second) : std::nullopt, entity);
      for (std::size_t i = input_.count(input_.size(), 2); i > 0; --i) {
        const std::size_t number = input_.size();
        read_corners(number, type, group, [&] { return static_cast<std::uint64_t>(input_.size()); });
      }
    }
  }

  ElementType known_type(std::int64_t number) const {
    const auto type = element_type(number);
    if (!type) input_.fail("elements of type " + std::to_string(number) + " are not read");
    return *type;
  }

  MshFile::Group* group_of(int dimension, std::optional<std::int64_t> physical, std::int64_t entity) {
    if (dimension < 2) return nullptr;
    MshFile::Group& group =
        (dimension == 2 ? file_.surfaces
                        : file_.volumes)[physical ? std::pair(true, *physical) : std::pair(false, entity)];
    if (physical && group.name.empty())
      if (const auto name = physical_names_.find({dimension, *physical}); name != physical_names_.end())
        group.name = name->second;
    return &group;
  }

  template <typename Next>
  void read_corners(std::uint64_t number, const ElementType& type, MshFile::Group* group, Next next) {
    std::vector<std::uint32_t> corners;
    for (int i = 0; i < type.nodes; ++i) {
      const std::uint64_t node = next();
      if (group == nullptr) continue;
      const auto found = point_of_node_.find(node);
      if (found == point_of_node_.end())
        input_.fail("an element names node " + std::to_string(node) + ", which has not been told of");
      if (i < type.corners)
        corners.push_back(found->second);
      else
        file_.between.push_back(found->second);
    }
    if (group == nullptr) return;
    if (type.nodes > type.corners) ++file_.curved;
    if (with_data_) middle_of_element_[number] = middle_of(corners);
    group->elements.push_back(std::move(corners));
  }

  Point3 middle_of(const std::vector<std::uint32_t>& corners) const {
    Point3 middle{};
    for (const std::uint32_t corner : corners)
      for (std::size_t k = 0; k < 3; ++k)
        middle[k] += file_.points[corner][k] / static_cast<double>(corners.size());
    return middle;
  }
};

}  // namespace

MshFile read_msh(std::string_view bytes, const std::filesystem::path& path, bool with_data) {
  return MshReader(bytes, path, with_data).read();
}

MshFile read_msh(const std::filesystem::path& path, bool with_data) {
  return read_msh(read_text(path), path, with_data);
}

}  // namespace bsp2::model
