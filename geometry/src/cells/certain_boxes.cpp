#include "bsp2/geometry/cells/certain_boxes.hpp"

#include <algorithm>
#include <limits>

namespace bsp2::geometry {

CertainBox CertainBox::empty() {
  CertainBox box;
  box.low.fill(std::numeric_limits<double>::infinity());
  box.high.fill(-std::numeric_limits<double>::infinity());
  return box;
}

void CertainBox::add(const Vertex<3>& vertex) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], vertex.x[k] - vertex.error);
    high[k] = std::max(high[k], vertex.x[k] + vertex.error);
  }
}

void CertainBox::add(const CertainBox& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

bool are_apart(const CertainBox& a, const CertainBox& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return true;
  return false;
}

void BoxGroups::make(std::size_t count, const BoxOf& box_of) {
  std::vector<Item> items(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const CertainBox box = box_of(i);
    items[i].number = i;
    for (std::size_t k = 0; k < 3; ++k) items[i].centre[k] = box.low[k] + box.high[k];
  }
  boxes_.clear();
  ends_.clear();
  order_.clear();
  part(items, box_of);
}

void BoxGroups::part(std::span<Item> items, const BoxOf& box_of) {
  if (items.empty()) return;
  if (items.size() <= most) {
    CertainBox box = CertainBox::empty();
    for (const Item& item : items) {
      box.add(box_of(item.number));
      order_.push_back(item.number);
    }
    boxes_.push_back(box);
    ends_.push_back(order_.size());
    return;
  }
  CertainBox centres = CertainBox::empty();
  for (const Item& item : items) centres.add(CertainBox{item.centre, item.centre});
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (centres.high[k] - centres.low[k] > centres.high[axis] - centres.low[axis]) axis = k;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
  part(items.first(half), box_of);
  part(items.subspan(half), box_of);
}

std::vector<std::uint32_t> BoxGroups::touching(std::span<const CertainBox> others,
                                               const BoxOf& box_of) const {
  std::vector<std::uint32_t> found;
  if (!boxes_.empty()) look(0, boxes_.size(), others, box_of, found);
  std::sort(found.begin(), found.end());
  return found;
}

/// Groups stand near those that they are near to: by halves, with what is near to all of a half.
void BoxGroups::look(std::size_t first, std::size_t end, std::span<const CertainBox> others,
                     const BoxOf& box_of, std::vector<std::uint32_t>& found) const {
  CertainBox all = CertainBox::empty();
  for (std::size_t group = first; group < end; ++group) all.add(boxes_[group]);
  std::vector<CertainBox> near;
  for (const CertainBox& box : others)
    if (!are_apart(box, all)) near.push_back(box);
  if (near.empty()) return;
  if (end - first > 1) {
    const std::size_t middle = first + (end - first) / 2;
    look(first, middle, near, box_of, found);
    look(middle, end, near, box_of, found);
    return;
  }
  for (std::size_t i = first == 0 ? 0 : ends_[first - 1]; i < ends_[first]; ++i) {
    const CertainBox box = box_of(order_[i]);
    if (std::any_of(near.begin(), near.end(),
                    [&](const CertainBox& other) { return !are_apart(box, other); }))
      found.push_back(order_[i]);
  }
}

}  // namespace bsp2::geometry
