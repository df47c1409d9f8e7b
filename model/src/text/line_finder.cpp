#include "bsp2/model/expression/line_finder.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t block = 4096;

}  // namespace

std::string LineFinder::at(std::size_t offset) {
  while (marks_.size() <= offset / block)
    marks_.push_back(walk(marks_.back(), (marks_.size() - 1) * block, marks_.size() * block));
  const Mark found = walk(marks_[offset / block], offset / block * block, offset);
  return std::to_string(found.line) + ":" + std::to_string(found.column);
}

LineFinder::Mark LineFinder::walk(Mark mark, std::size_t begin, std::size_t end) const {
  for (const char c : text_.substr(begin, end - begin)) {
    if (c == '\n')
      ++mark.line, mark.column = 1;
    else
      mark.column += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }
  return mark;
}

}  // namespace bsp2::model
