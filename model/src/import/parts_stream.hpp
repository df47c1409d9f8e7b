#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// What a program that reads a file for the model tells it, through a pipe (reader_process.hpp): both run on
/// one machine and are of one build, so numbers are as they lie in memory.
namespace bsp2::model {

struct PartsStream {
  /// What comes next: the layout that both must have in common (a text), a remark (a text), an error (a text,
  /// and nothing after it), a part (its name, a flag and four numbers for its colour, points, triangles),
  /// sizes by place, the end.
  enum class Record : char {
    layout = 'L',
    warning = 'W',
    note = 'N',
    error = 'E',
    part = 'P',
    sizes = 'S',
    end = '.'
  };
  static constexpr std::size_t most_text = std::size_t{1} << 20;
};

/// Writes it. Any failure to write ends the program: nobody listens any more.
class PartsWriter {
 public:
  using Record = PartsStream::Record;
  explicit PartsWriter(std::FILE* to) : to_(to) {}

  void text(Record record, std::string_view text) {
    record_of(record);
    string(text);
  }
  /// @param colour none, or red, green, blue and opacity. @param triangles counter-clockwise from outside.
  void part(std::string_view name, const std::array<double, 4>* colour,
            std::span<const std::array<double, 3>> points,
            std::span<const std::array<std::uint32_t, 3>> triangles) {
    record_of(Record::part);
    string(name);
    const char has_colour = colour != nullptr ? 1 : 0;
    const std::array<double, 4> channels = colour != nullptr ? *colour : std::array<double, 4>{};
    bytes(&has_colour, 1);
    bytes(channels.data(), sizeof channels);
    count(points.size());
    bytes(points.data(), points.size_bytes());
    count(triangles.size());
    bytes(triangles.data(), triangles.size_bytes());
  }
  /// @param rows x, y, z and a length.
  void sizes(std::span<const std::array<double, 4>> rows) {
    record_of(Record::sizes);
    count(rows.size());
    bytes(rows.data(), rows.size_bytes());
  }
  void end() {
    record_of(Record::end);
    if (std::fflush(to_) != 0) throw std::runtime_error("the pipe is closed");
  }

 private:
  void record_of(Record record) { bytes(&record, 1); }
  void count(std::uint64_t number) { bytes(&number, sizeof number); }
  void string(std::string_view text) {
    text = text.substr(0, PartsStream::most_text);
    count(text.size());
    bytes(text.data(), text.size());
  }
  void bytes(const void* from, std::size_t size) {
    if (size > 0 && std::fwrite(from, 1, size, to_) != size) throw std::runtime_error("the pipe is closed");
  }

  std::FILE* to_;
};

}  // namespace bsp2::model
