#include "evaluate/assembling.hpp"

#include <limits>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Label;

namespace {

/// Codes of the workers' cells and nodes as children of one BSP tree.
template <int D>
class TreeNumbering {
 public:
  explicit TreeNumbering(const EvaluationContext<D>& context)
      : codes_(context.codes),
        first_node_{context.options.recorded_nodes},
        first_cell_{context.options.recorded_cells} {
    for (const auto& worker : context.workers) {
      first_node_.push_back(first_node_.back() + worker->nodes.size());
      first_cell_.push_back(first_cell_.back() + worker->emitted);
    }
    constexpr std::uint64_t limit = std::numeric_limits<std::int32_t>::max();
    if (context.options.record_tree && (first_node_.back() > limit || first_cell_.back() >= limit))
      throw std::length_error("the BSP tree has more than 2^31 nodes or cells");
  }
  [[nodiscard]] std::int32_t child(std::int64_t code) const {
    if (code == 0) return geometry::BspTree::empty_leaf;
    const std::uint32_t worker = codes_.worker(code);
    const bool is_earlier = worker == codes_.earlier();
    if (code < 0)
      return static_cast<std::int32_t>((is_earlier ? 0 : first_node_[worker]) + codes_.index(code));
    return ~static_cast<std::int32_t>((is_earlier ? 0 : first_cell_[worker]) + codes_.index(code) + 1);
  }

 private:
  const TreeCodes& codes_;
  std::vector<std::uint64_t> first_node_, first_cell_;  // of each worker
};

/// The workers' nodes as one tree per region.
template <int D>
void assemble_tree(EvaluationContext<D>& context, const TreeNumbering<D>& numbering, Evaluation<D>& result) {
  geometry::BspTree& tree = result.tree;
  tree.dimension = D;
  std::size_t count = 0;
  for (const auto& worker : context.workers) {
    count += worker->nodes.size();
    result.cells_of_worker.push_back(worker->emitted);
  }
  std::unordered_map<geometry::HyperplaneId, std::uint32_t> used;
  tree.nodes.reserve(count);
  for (const auto& worker : context.workers) {
    for (const auto& [id, children] : worker->nodes) {
      const auto [entry, is_new] = used.try_emplace(id, static_cast<std::uint32_t>(used.size()));
      if (is_new) {
        const auto h = context.network.table.rounded(id);
        tree.ids.push_back(id);
        tree.hyperplanes.push_back(h.offset);
        tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
      }
      tree.nodes.push_back({entry->second, numbering.child(children[0]), numbering.child(children[1])});
    }
    worker->nodes = {};
  }
  for (const std::int64_t code : context.region_codes) result.region_roots.push_back(numbering.child(code));
}

/// What is suspended under an outcome, in flat arrays.
template <int D>
Frontier frontier_of(const EvaluationContext<D>& context, const TreeNumbering<D>& numbering,
                     const Outcome<D>& root) {
  Frontier frontier;
  std::vector<const Outcome<D>*> left{&root};
  while (!left.empty()) {
    const Outcome<D>& outcome = *left.back();
    left.pop_back();
    switch (outcome.kind) {
      case OutcomeKind::cell:
        frontier.nodes.push_back({Frontier::Kind::held, outcome.label, 0, outcome.owner});
        break;
      case OutcomeKind::subtree:
        frontier.nodes.push_back({Frontier::Kind::emitted, Label::out, 0, numbering.child(outcome.tree)});
        break;
      case OutcomeKind::suspended_token: {
        const Token<D>& token = *outcome.token;
        if (token.restored != Token<D>::not_restored) {
          context.frontiers[token.region].copy(token.restored, frontier);
        } else {
          frontier.nodes.push_back({Frontier::Kind::token, Label::fuzzy,
                                    static_cast<std::uint16_t>(token.ended ? 1 : 0),
                                    static_cast<std::int32_t>(token.program.size())});
          frontier.programs.insert(frontier.programs.end(), token.program.begin(), token.program.end());
        }
        break;
      }
      case OutcomeKind::suspended_join:
        frontier.nodes.push_back(
            {Frontier::Kind::split, Label::fuzzy, 0, static_cast<std::int32_t>(outcome.join->hyperplane)});
        left.push_back(&outcome.join->outcomes[1]);
        left.push_back(&outcome.join->outcomes[0]);
    }
  }
  return frontier;
}

/// The regions in which something is left.
template <int D>
void collect_unfinished(EvaluationContext<D>& context, const TreeNumbering<D>& numbering,
                        Evaluation<D>& result) {
  for (std::size_t i = 0; i < context.suspended.size(); ++i) {
    Outcome<D>& root = context.suspended[i];
    if (!context.is_left[i]) continue;
    Region<D> region;
    region.number = context.region_numbers[i];
    region.level = root.level;
    region.frontier = frontier_of(context, numbering, root);
    region.cell = std::move(root.kind == OutcomeKind::suspended_token  ? root.token->cell
                            : root.kind == OutcomeKind::suspended_join ? root.join->cell
                                                                       : root.cell);
    result.unfinished.push_back(std::move(region));
  }
}

}  // namespace

template <int D>
void assemble(EvaluationContext<D>& context, Evaluation<D>& result) {
  const TreeNumbering<D> numbering(context);
  assemble_tree(context, numbering, result);
  collect_unfinished(context, numbering, result);
}

#define BSP2_INSTANTIATE(D) template void assemble<D>(EvaluationContext<D>&, Evaluation<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
