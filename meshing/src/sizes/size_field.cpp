#include "bsp2/meshing/sizes/size_field.hpp"

#include <algorithm>
#include <limits>

#include "simplices/shape.hpp"

namespace bsp2::meshing {

struct SizeField::Nearest {
  const Point& place;
  double squared = std::numeric_limits<double>::infinity();
  double size = std::numeric_limits<double>::infinity();
};

SizeField::SizeField(std::vector<Entry> entries) : entries_(std::move(entries)) {
  for (const Entry& entry : entries_) largest_ = std::max(largest_, entry.size);
  order(entries_, 0);
}

void SizeField::order(std::span<Entry> entries, std::size_t axis) {
  if (entries.size() < 2) return;
  const std::size_t middle = entries.size() / 2;
  std::nth_element(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(middle), entries.end(),
                   [axis](const Entry& a, const Entry& b) { return a.at[axis] < b.at[axis]; });
  order(entries.first(middle), (axis + 1) % 3);
  order(entries.subspan(middle + 1), (axis + 1) % 3);
}

double SizeField::at(const Point& place) const {
  Nearest nearest{place};
  search(entries_, 0, nearest);
  return nearest.size;
}

void SizeField::search(std::span<const Entry> entries, std::size_t axis, Nearest& nearest) {
  if (entries.empty()) return;
  const std::size_t middle = entries.size() / 2;
  const Entry& entry = entries[middle];
  const double squared = squared_distance(entry.at, nearest.place);
  if (squared < nearest.squared || (squared == nearest.squared && entry.size < nearest.size)) {
    nearest.squared = squared;
    nearest.size = entry.size;
  }
  const double across = nearest.place[axis] - entry.at[axis];
  auto near = entries.first(middle), far = entries.subspan(middle + 1);
  if (across > 0) std::swap(near, far);
  search(near, (axis + 1) % 3, nearest);
  if (across * across <= nearest.squared) search(far, (axis + 1) % 3, nearest);
}

}  // namespace bsp2::meshing
