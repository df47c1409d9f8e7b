#include "bsp2/geometry/cells/bsp_tree.hpp"

namespace bsp2::geometry {

void BspTree::append(const BspTree& more) {
  const auto first =
      static_cast<std::uint32_t>(hyperplanes.size() / (static_cast<std::size_t>(dimension) + 1));
  ids.insert(ids.end(), more.ids.begin(), more.ids.end());
  hyperplanes.insert(hyperplanes.end(), more.hyperplanes.begin(), more.hyperplanes.end());
  nodes.reserve(nodes.size() + more.nodes.size());
  for (const Node& node : more.nodes)
    nodes.push_back({first + node.hyperplane, node.negative, node.positive});
}

double BspTree::distance(std::uint32_t hyperplane, std::span<const double> point) const {
  const double* c = hyperplanes.data() + std::size_t{hyperplane} * (dimension + 1);
  double sum = c[0];
  for (int i = 0; i < dimension; ++i) sum += c[i + 1] * point[i];
  return sum;
}

std::int32_t BspTree::locate(std::span<const double> point) const {
  std::int32_t at = root;
  while (at >= 0) {
    const Node& node = nodes[at];
    at = distance(node.hyperplane, point) <= 0 ? node.negative : node.positive;
  }
  return ~at;
}

void BspTree::visit_back_to_front(std::int32_t from, std::span<const double> eye, bool parallel,
                                  const std::function<void(std::int32_t)>& visit) const {
  const auto eye_is_positive = [&](std::uint32_t hyperplane) {
    const double side = distance(hyperplane, eye);
    // Looking along a direction is an eye infinitely far back against it.
    return parallel ? side - hyperplanes[std::size_t{hyperplane} * (dimension + 1)] < 0 : side > 0;
  };
  std::vector<std::int32_t> stack{from};  // explicit: the tree may be deep
  while (!stack.empty()) {
    const std::int32_t at = stack.back();
    stack.pop_back();
    if (at < 0) {
      if (at != empty_leaf) visit(~at);
      continue;
    }
    const Node& node = nodes[at];
    const bool positive = eye_is_positive(node.hyperplane);
    stack.push_back(positive ? node.positive : node.negative);  // the near side, drawn last
    stack.push_back(positive ? node.negative : node.positive);
  }
}

}  // namespace bsp2::geometry
