#pragma once

#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// Gives every node of a graph an image, made from those of its children: each node once, without recursion,
/// since a graph may be nested ten thousand deep. Keeps the images, so several roots may share their nodes.
template <typename Image>
class BottomUp {
 public:
  /// @param known optional<Image>(const Expression&): the image of a node whose children need not be looked
  /// at.
  /// @param make Image(const Node&, std::vector<Image>&&): the image of any other one.
  template <typename Known, typename Make>
  Image run(const Expression& root, Known known, Make make) {
    std::vector<Expression> stack{root};
    while (!stack.empty()) {
      const Expression at = stack.back();
      const Node* node = &at.node();
      if (images_.contains(node)) {
        stack.pop_back();
        continue;
      }
      if (std::optional<Image> image = known(at)) {
        images_.try_emplace(node, at, std::move(*image));
        continue;
      }
      std::vector<Image> images;
      bool complete = true;
      for (const Expression& child : node->children()) {
        const auto found = images_.find(&child.node());
        if (found == images_.end()) {
          stack.push_back(child);
          complete = false;
        } else if (complete) {
          images.push_back(found->second.second);
        }
      }
      if (complete) images_.try_emplace(node, at, make(*node, std::move(images)));
    }
    return images_.at(&root.node()).second;
  }

 private:
  std::unordered_map<const Node*, std::pair<Expression, Image>>
      images_;  // the node is kept, so its address stays its own
};

}  // namespace bsp2::model
