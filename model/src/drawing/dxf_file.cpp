#include "drawing/dxf_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "bsp2/geometry/support/error.hpp"
#include "import/text_cursor.hpp"

// A DXF file is a list of pairs, a group code that says what it is and a value, each on a line of its own.
// Sections begin with SECTION and end with ENDSEC; what stands in others than BLOCKS and ENTITIES (OBJECTS,
// TABLES, ...) is drawn by nobody.

namespace bsp2::model::dxf {
namespace {

std::string trimmed(std::string text) {
  text.erase(0, std::min(text.find_first_not_of(" \t\r"), text.size()));
  text.erase(text.find_last_not_of(" \t\r") + 1);
  return text;
}

/// Names of blocks are the same in small letters and in capitals.
std::string in_capitals(std::string name) {
  for (char& c : name)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return name;
}

/// Whether a value with this group code is a number that some entity is drawn by.
bool is_number(long code) { return (code >= 10 && code <= 79) || (code >= 210 && code <= 239); }

/// Takes the pairs of a file one after the other.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {}

  File run() {
    std::ifstream input(path_);
    if (!input) fail(" cannot be read");
    std::string code_line, value;
    for (; !is_over_ && std::getline(input, code_line); line_ += 2) {
      std::string code = trimmed(std::move(code_line));
      if (line_ == 1 && code.starts_with("\xEF\xBB\xBF"))
        code = trimmed(code.substr(3));  // a byte order mark
      if (line_ == 1 && code.starts_with("AutoCAD Binary DXF"))
        fail(" is a binary DXF file; save it as a text (ASCII) DXF file");
      if (!std::getline(input, value)) {
        if (code.empty() || code == "\x1a") break;  // as old systems end a text
        fail(" is cut off: line " + std::to_string(line_) +
             " is its last one, and a group code without a value");
      }
      char* end = nullptr;
      const long number = std::strtol(code.c_str(), &end, 10);
      if (code.empty() || *end != '\0')
        fail(" is no DXF file: '" + code.substr(0, 40) + "' is no group code");
      take(number, trimmed(std::move(value)));
    }
    if (!ends_) fail(" is cut off: it has neither a section ENTITIES nor an end (EOF)");
    if (!section_.empty()) fail(" is cut off: its section " + section_.substr(0, 40) + " has no end");
    return std::move(file_);
  }

 private:
  const std::filesystem::path& path_;
  File file_;
  std::string section_, variable_;
  std::size_t line_ = 1;  // of the group code
  bool names_section_ = false, ends_ = false, is_over_ = false;
  bool takes_vertices_ = false;  // the last entity is a POLYLINE without its end
  Block* block_ = nullptr;       // that is being read
  std::optional<Entity> head_;   // of a block without a name so far
  Entity* entity_ = nullptr;     // that the pairs belong to; null: to nothing that counts

  [[noreturn]] void fail(const std::string& why) const { throw Error("import: " + path_.string() + why); }

  void take(long code, std::string value) {
    if (code == 0) {
      begin(std::move(value));
    } else if (code == 2 && names_section_) {
      names_section_ = false;
      section_ = std::move(value);
      ends_ = ends_ || section_ == "ENTITIES";  // all that is read has been there once it ends
    } else if (section_ == "HEADER") {
      if (code == 9) variable_ = value;
      if (code == 70 && variable_ == "$INSUNITS")
        file_.units = static_cast<int>(std::strtol(value.c_str(), nullptr, 10));
    } else if (entity_ != nullptr) {
      add(code, std::move(value));
    }
  }

  /// What begins ends what was before: an entity, and with a section all that is in it.
  void begin(std::string type) {
    entity_ = nullptr;
    names_section_ = type == "SECTION";
    is_over_ = type == "EOF";  // whatever follows
    ends_ = ends_ || is_over_;
    if (type == "SECTION" || type == "ENDSEC" || type == "EOF" || type == "BLOCK" || type == "ENDBLK") {
      block_ = nullptr;
      head_.reset();
      takes_vertices_ = false;
    }
    if (type == "ENDSEC") section_.clear();
    if (type == "SECTION" || type == "ENDSEC" || type == "EOF" || type == "ENDBLK") return;
    if (type == "BLOCK" && section_ == "BLOCKS") {
      entity_ = &head_.emplace();
      entity_->type = std::move(type);
    } else if (section_ == "ENTITIES") {
      begin_entity(file_.entities, std::move(type));
    } else if (section_ == "BLOCKS" && block_ != nullptr) {
      begin_entity(block_->entities, std::move(type));
    }
  }

  void begin_entity(std::vector<Entity>& entities, std::string type) {
    if (type == "SEQEND") {
      takes_vertices_ = false;
      return;
    }
    const bool is_vertex = type == "VERTEX" && takes_vertices_;
    if (!is_vertex) takes_vertices_ = type == "POLYLINE";
    entity_ = &(is_vertex ? entities.back().vertices : entities).emplace_back();
    entity_->type = std::move(type);
  }

  void add(long code, std::string value) {
    if (code == 2 && head_) {
      head_->name = value;
      block_ = &file_.blocks[in_capitals(std::move(value))];
      block_->head = std::move(*head_);
      head_.reset();
      entity_ = &block_->head;
    } else if (code == 2) {
      entity_->name = std::move(value);
    } else if (code == 8) {
      entity_->layer = std::move(value);
    } else if (is_number(code)) {
      const std::optional<double> number = to_number(value);
      if ((!number || !std::isfinite(*number)) && entity_->fault.empty())
        entity_->fault = std::to_string(line_ + 1) + ": '" + value.substr(0, 40) +
                         "' is no finite number, as the value of group code " + std::to_string(code);
      entity_->numbers.emplace_back(static_cast<std::int16_t>(code), number.value_or(0));
    }
  }
};

}  // namespace

double Entity::number(int code, double missing) const {
  for (const auto& [known, value] : numbers)
    if (known == code) return value;
  return missing;
}

bool Entity::has(int code) const {
  return std::any_of(numbers.begin(), numbers.end(), [&](const auto& pair) { return pair.first == code; });
}

bool Entity::flag(int code, std::int64_t bit) const {
  const double value = std::fabs(number(code));
  return value < 0x1p53 && (static_cast<std::int64_t>(value) & bit) != 0;
}

std::vector<double> Entity::all(int code) const {
  std::vector<double> values;
  for (const auto& [known, value] : numbers)
    if (known == code) values.push_back(value);
  return values;
}

const Block* File::find_block(const std::string& name) const {
  const auto found = blocks.find(in_capitals(name));
  return found == blocks.end() ? nullptr : &found->second;
}

File read_file(const std::filesystem::path& path) { return Reader(path).run(); }

}  // namespace bsp2::model::dxf
