#include "lowering.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <unordered_set>
#include <utility>

#include "bsp2/geometry/dimensions.hpp"
#include "bsp2/geometry/error.hpp"

namespace bsp2::dataflow {

using model::Operation;

namespace {

/// A visit on the walk: a sub-expression under the maps and the complement above it, or the end of a combiner.
struct Visit {
  const model::Node* node;  // null: the combiner that starts at `begin` is complete
  std::uint32_t placement;
  bool complemented;
  Word enclosing;  // kind of the combiner around it
  std::size_t begin;
  const model::Colour* colour = nullptr;  // the outermost one on the way here
  std::int32_t part = -1;  // that all in it belongs to; -1: each primitive is a part of its own
  bool is_repeated = false;  // an operand that was there already: it counts parts, no more
};

/// Which operands are the same node as an earlier one that is combined in the same way; nothing if none is. Of those, a union, an
/// intersection or the subtrahends of a difference take one.
std::vector<bool> repeated_operands(const model::Boolean& boolean) {
  std::vector<bool> repeated;
  if (boolean.operation == Operation::symmetric_difference) return repeated;
  const auto& children = boolean.children;
  const std::size_t first = boolean.operation == Operation::subtract ? 1 : 0;
  constexpr std::size_t few = 16;
  std::unordered_set<const model::Node*> seen;
  for (std::size_t i = first; i < children.size(); ++i) {
    bool is_repeated = false;
    if (children.size() > few)
      is_repeated = !seen.insert(&children[i].node()).second;
    else
      for (std::size_t j = first; j < i && !is_repeated; ++j) is_repeated = children[j].same_node(children[i]);
    if (!is_repeated) continue;
    repeated.resize(children.size());
    repeated[i] = true;
  }
  return repeated;
}

template <int D>
class Lowering {
 public:
  Lowered<D> run(const model::Expression& expression) {
    placements_.emplace_back();
    // One occurrence a part, mostly. Room that is not needed is never touched.
    constexpr std::uint64_t most = 1 << 22;
    const auto expected = static_cast<std::size_t>(std::min(expression.node().parts, most));
    lowered_.occurrences.reserve(expected);
    lowered_.program.reserve(3 * expected);
    stack_.push_back({&expression.node(), 0, false, Network<D>::kind_leaf, 0});
    while (!stack_.empty()) {
      const Visit visit = stack_.back();
      stack_.pop_back();
      if (visit.node == nullptr)
        close(visit.begin);
      else if (visit.is_repeated)
        take_parts(visit.part < 0 ? visit.node->parts : 0);
      else
        std::visit([&](const auto& value) { enter(visit, value); }, visit.node->value);
    }
    return std::move(lowered_);
  }

 private:
  using Net = Network<D>;
  Lowered<D> lowered_;
  std::vector<Transformer<D>> placements_;  // products of the maps on the way down to where the walk is
  std::vector<Visit> stack_;
  std::uint64_t parts_ = 0;  // that have been met

  /// @return the first of them.
  std::int32_t take_parts(std::uint64_t count) {
    const std::uint64_t first = std::exchange(parts_, parts_ + count);
    if (parts_ > std::numeric_limits<std::int32_t>::max()) throw Error("the model has more than 2,147,483,647 primitives");
    return static_cast<std::int32_t>(first);
  }

  void enter(const Visit& visit, const model::Primitive& primitive) {
    const auto producer = static_cast<Word>(lowered_.occurrences.size());
    lowered_.occurrences.push_back({&primitive, placements_[visit.placement], visit.part >= 0 ? visit.part : take_parts(1), visit.colour});
    const Word kind = Net::kind_leaf | Net::whole | (visit.complemented ? Net::negated : 0);
    lowered_.program.insert(lowered_.program.end(), {kind, static_cast<Word>(Net::header), producer});
  }

  void enter(const Visit& visit, const model::Transform& transform) {
    placements_.resize(visit.placement + 1);  // what is still to be visited has this one or earlier ones
    placements_.push_back(placements_[visit.placement].after(Transformer<D>(transform.matrix)));
    Visit child = visit;
    child.node = &transform.child.node();
    child.placement = static_cast<std::uint32_t>(placements_.size() - 1);
    stack_.push_back(child);
  }

  void enter(const Visit& visit, const model::Coloured& coloured) {
    Visit child = visit;
    child.node = &coloured.child.node();
    if (child.colour == nullptr) child.colour = &coloured.colour;
    stack_.push_back(child);
  }

  void enter(const Visit& visit, const model::Named& named) {
    Visit child = visit;
    child.node = &named.child.node();
    if (named.role == model::Named::Role::part && visit.part < 0) {
      child.part = take_parts(visit.node->parts);
      lowered_.part_names.emplace_back(child.part, named.name);
    }
    stack_.push_back(child);
  }

  void enter(Visit visit, const model::Boolean& boolean) {
    const auto& children = boolean.children;
    if (boolean.parts != 0 && visit.part < 0) visit.part = take_parts(boolean.parts);
    if (children.size() == 1 && boolean.operation != Operation::complement) {
      visit.node = &children[0].node();
      stack_.push_back(visit);
      return;
    }
    if (boolean.operation == Operation::complement) {
      Visit child = visit;
      child.node = &children[0].node();
      child.complemented = !visit.complemented;
      stack_.push_back(child);
      return;
    }
    // De Morgan: a complemented union is the intersection of complements; a complemented symmetric difference has one
    // operand complemented.
    const bool differ = boolean.operation == Operation::symmetric_difference;
    const bool unites = (boolean.operation == Operation::unite) != visit.complemented;
    const Word kind = differ ? Net::kind_differ : unites ? Net::kind_unite : Net::kind_intersect;
    const std::vector<bool> repeated = repeated_operands(boolean);
    const bool is_one = !repeated.empty() && std::count(repeated.begin(), repeated.end(), false) == 1;
    if (!is_one && (kind != visit.enclosing || children.empty())) open(kind);
    for (std::size_t i = children.size(); i-- > 0;) {
      bool complemented = visit.complemented;
      if (differ) complemented = visit.complemented && i == 0;
      if (boolean.operation == Operation::subtract && i > 0) complemented = !complemented;
      stack_.push_back({&children[i].node(), visit.placement, complemented, is_one ? visit.enclosing : kind, 0, visit.colour, visit.part,
                        !repeated.empty() && repeated[i]});
    }
  }

  void enter(const Visit&, const model::Construction&) { throw std::logic_error("constructs are resolved before lowering"); }

  static constexpr std::size_t deepest = 100000;  // what the stacks that walk the program are made for
  std::size_t depth_ = 0;

  /// Starts a combiner and schedules its end behind its operands.
  void open(Word kind) {
    if (++depth_ > deepest) throw Error("unions, intersections and differences are nested more than 100000 deep");
    stack_.push_back({nullptr, 0, false, 0, lowered_.program.size()});
    lowered_.program.insert(lowered_.program.end(), {kind, 0, 0});
  }
  void close(std::size_t begin) {
    --depth_;
    lowered_.program[begin + 1] = static_cast<Word>(lowered_.program.size() - begin);
  }
};

}  // namespace

template <int D>
Lowered<D> lower(const model::Expression& expression) {
  return Lowering<D>().run(expression);
}

template <int D>
Box<D> bounds_of(const Lowered<D>& lowered, const std::vector<Producer<D>>& producers) {
  struct Open {
    Word kind;
    std::size_t end;
    Box<D> box;
  };
  using Net = Network<D>;
  std::vector<Open> open{{Net::kind_unite, lowered.program.size(), Box<D>::empty()}};
  const auto add = [&](const Box<D>& box) {
    if (open.back().kind == Net::kind_intersect)
      open.back().box.intersect(box);
    else
      open.back().box.unite(box);
  };
  for (std::size_t at = 0; at < lowered.program.size();) {
    const Word* word = lowered.program.data() + at;
    const Word kind = word[0] & Net::kind_mask;
    if (kind == Net::kind_leaf) {
      const Producer<D>& producer = producers[word[2]];
      add((word[0] & Net::negated) != 0 ? Box<D>::everything() : static_cast<const Box<D>&>(producer));
      at += word[1];
    } else {
      open.push_back({kind, at + word[1], kind == Net::kind_intersect ? Box<D>::everything() : Box<D>::empty()});
      at += Net::header;
    }
    while (open.size() > 1 && open.back().end == at) {
      const Box<D> box = open.back().box;
      open.pop_back();
      add(box);
    }
  }
  return open.front().box;
}

template <int D>
Box<D> hull_of(const std::vector<Producer<D>>& producers) {
  Box<D> box = Box<D>::empty();
  for (const Producer<D>& producer : producers) box.unite(producer);
  return box;
}

#define BSP2_INSTANTIATE(D)                                                         \
  template Lowered<D> lower<D>(const model::Expression&);                           \
  template Box<D> bounds_of<D>(const Lowered<D>&, const std::vector<Producer<D>>&); \
  template Box<D> hull_of<D>(const std::vector<Producer<D>>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
