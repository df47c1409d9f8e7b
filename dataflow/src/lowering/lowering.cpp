#include "lowering/lowering.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <unordered_set>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/colour.hpp"

namespace bsp2::dataflow {

using model::Operation;

namespace {

/// A visit on the walk: a sub-expression under the maps and the complement above it, or the end of a
/// combiner.
struct Visit {
  const model::Node* node;  // null: the combiner that starts at `begin` is complete
  std::uint32_t placement;
  bool complemented;
  Word enclosing;  // kind of the combiner around it
  std::size_t begin;
  const model::Colour* colour = nullptr;  // the outermost one on the way here
  std::int32_t number =
      -1;  // of the primitive that all in it is one of; -1: each primitive has a number of its own
  std::int32_t part = geometry::no_part;
  bool is_mute = false;      // nothing belongs to what is in it
  bool is_repeated = false;  // an operand that was there already: it counts primitives, no more
};

/// Which operands are the same node as an earlier one that is combined in the same way; nothing if none is.
/// Of those, a union, an intersection or the subtrahends of a difference take one.
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
      for (std::size_t j = first; j < i && !is_repeated; ++j)
        is_repeated = children[j].same_node(children[i]);
    if (!is_repeated) continue;
    repeated.resize(children.size());
    repeated[i] = true;
  }
  return repeated;
}

template <int D>
class Lowering {
 public:
  explicit Lowering(Parts divided_by) : divided_by_(divided_by) {}

  Lowered<D> run(const model::Expression& expression) {
    root_ = &expression.node();
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
        take_numbers(visit.number < 0 ? visit.node->parts : 0);
      else
        std::visit([&](const auto& value) { enter(visit, value); }, visit.node->value);
    }
    if (lowered_.parts.empty()) make_one();
    return std::move(lowered_);
  }

 private:
  using Net = Network<D>;
  const Parts divided_by_;
  Lowered<D> lowered_;
  std::vector<Transformer<D>> placements_;  // products of the maps on the way down to where the walk is
  std::vector<Visit> stack_;
  const model::Node* root_ = nullptr;
  std::optional<bool> is_told_apart_;
  std::uint64_t numbers_ = 0;  // of the primitives that have been met
  std::int32_t guard_ = -1;    // the innermost one that is open
  std::map<std::string, std::int32_t, std::less<>> part_of_name_;

  /// @return the first of them.
  std::int32_t take_numbers(std::uint64_t count) {
    const std::uint64_t first = std::exchange(numbers_, numbers_ + count);
    if (numbers_ > std::numeric_limits<std::int32_t>::max())
      throw Error("the model has more than 2,147,483,647 primitives");
    return static_cast<std::int32_t>(first);
  }

  /// One name is one part, wherever it stands. Also what is only subtracted is told, as a part without cells.
  std::int32_t part_named(const std::string& name) {
    const auto [found, is_new] =
        part_of_name_.try_emplace(name, static_cast<std::int32_t>(lowered_.parts.size()));
    if (is_new) lowered_.parts.push_back({name, {}});
    return found->second;
  }

  /// Whether anything has a name or a colour. Looked up once, where it matters: a symmetric difference in
  /// another one, in which an operand that is IN may be cancelled by another, is no list of operands of which
  /// the first one that is IN has the cell.
  bool is_told_apart() {
    if (is_told_apart_) return *is_told_apart_;
    is_told_apart_ = false;
    std::unordered_set<const model::Node*> seen;
    std::vector<const model::Node*> left{root_};
    while (!left.empty() && !*is_told_apart_ && divided_by_ != Parts::none) {
      const model::Node* const node = left.back();
      left.pop_back();
      if (!seen.insert(node).second) continue;
      const auto* named = std::get_if<model::Named>(&node->value);
      const bool is_part =
          divided_by_ == Parts::named && named != nullptr && named->role == model::Named::Role::part;
      is_told_apart_ = is_part || std::holds_alternative<model::Coloured>(node->value);
      for (const model::Expression& child : node->children()) left.push_back(&child.node());
    }
    return *is_told_apart_;
  }

  /// Nothing has a name: all is one part, whatever is subtracted from what.
  void make_one() {
    for (Occurrence<D>& occurrence : lowered_.occurrences) {
      occurrence.part = 0;
      lowered_.program[occurrence.leaf] &= ~Net::mute;
    }
  }

  void enter(const Visit& visit, const model::Primitive& primitive) {
    const auto producer = static_cast<Word>(lowered_.occurrences.size());
    lowered_.occurrences.push_back(
        {&primitive, placements_[visit.placement], visit.number >= 0 ? visit.number : take_numbers(1),
         visit.is_mute ? geometry::no_part : visit.part, visit.colour,
         static_cast<std::uint32_t>(lowered_.program.size()), guard_, !visit.is_mute});
    const Word kind = Net::kind_leaf | Net::whole | (visit.complemented ? Net::negated : 0) |
                      (visit.is_mute ? Net::mute : 0);
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
    if (child.colour == nullptr) {
      child.colour = &coloured.colour;
      if (divided_by_ == Parts::colours) child.part = part_named(model::name_of(coloured.colour));
    }
    stack_.push_back(child);
  }

  void enter(const Visit& visit, const model::Named& named) {
    Visit child = visit;
    child.node = &named.child.node();
    const bool counts =
        divided_by_ == Parts::named && named.role == model::Named::Role::part && visit.part < 0;
    if (counts) child.part = part_named(named.name);
    stack_.push_back(child);
  }

  void enter(Visit visit, const model::Boolean& boolean) {
    const auto& children = boolean.children;
    if (boolean.parts != 0 && visit.number < 0) visit.number = take_numbers(boolean.parts);
    if (children.size() == 1 && boolean.operation != Operation::complement) {
      visit.node = &children[0].node();
      stack_.push_back(visit);
      return;
    }
    if (boolean.operation == Operation::complement) {
      Visit child = visit;
      child.node = &children[0].node();
      child.complemented = !visit.complemented;
      child.is_mute = child.is_mute || !is_one_primitive(visit);
      stack_.push_back(child);
      return;
    }
    // De Morgan: a complemented union is the intersection of complements; a complemented symmetric difference
    // has one operand complemented.
    const bool differ = boolean.operation == Operation::symmetric_difference;
    const bool unites = (boolean.operation == Operation::unite) != visit.complemented;
    const Word kind = differ ? Net::kind_differ : unites ? Net::kind_unite : Net::kind_intersect;
    const std::vector<bool> repeated = repeated_operands(boolean);
    const bool is_one = !repeated.empty() && std::count(repeated.begin(), repeated.end(), false) == 1;
    const bool is_merged = kind == visit.enclosing && !children.empty() && !(differ && is_told_apart());
    if (!is_one && !is_merged) open(kind);
    const bool may_divide = divided_by_ != Parts::none && !is_one_primitive(visit);
    const std::size_t first_mute = may_divide ? first_of_the_mute(boolean) : children.size();
    for (std::size_t i = children.size(); i-- > 0;) {
      Visit child = visit;
      child.node = &children[i].node();
      if (differ) child.complemented = visit.complemented && i == 0;
      if (boolean.operation == Operation::subtract && i > 0) child.complemented = !visit.complemented;
      child.enclosing = is_one ? visit.enclosing : kind;
      child.begin = 0;
      child.is_mute = visit.is_mute || i >= first_mute;
      child.is_repeated = !repeated.empty() && repeated[i];
      stack_.push_back(child);
    }
  }

  /// What a primitive of the source is made of belongs to it, and nothing in it has a say.
  static bool is_one_primitive(const Visit& visit) { return visit.number >= 0; }

  /// Whether each point of a solid belongs to a primitive: no complement makes it. Of large ones nobody
  /// looks: then it is not known.
  static bool owns_its_points(const model::Node& node, int& nodes_to_look_at) {
    if (--nodes_to_look_at < 0) return false;
    const auto owns = [&](const model::Expression& child) {
      return owns_its_points(child.node(), nodes_to_look_at);
    };
    const auto children = node.children();
    const auto* boolean = std::get_if<model::Boolean>(&node.value);
    if (boolean == nullptr || boolean->operation == Operation::unite ||
        boolean->operation == Operation::symmetric_difference)
      return std::all_of(children.begin(), children.end(), owns);
    if (boolean->operation == Operation::complement) return false;
    if (boolean->operation == Operation::subtract) return children.empty() || owns(children.front());
    return std::any_of(children.begin(), children.end(), owns);
  }

  /// The first operand to which nothing belongs, nor to those behind it: what is subtracted, and in an
  /// intersection what comes after an operand that says of each of its points whose it is.
  static std::size_t first_of_the_mute(const model::Boolean& boolean) {
    const auto& children = boolean.children;
    if (boolean.operation == Operation::subtract) return 1;
    if (boolean.operation != Operation::intersect) return children.size();
    const auto first = std::find_if(children.begin(), children.end(), [](const model::Expression& child) {
      int nodes_to_look_at = 64;
      return owns_its_points(child.node(), nodes_to_look_at);
    });
    return static_cast<std::size_t>(std::min(first - children.begin() + 1, std::ssize(children)));
  }

  void enter(const Visit&, const model::Construction&) {
    throw std::logic_error("constructs are resolved before lowering");
  }

  static constexpr std::size_t deepest = 100000;  // what the stacks that walk the program are made for
  std::size_t depth_ = 0;

  /// Starts a combiner and schedules its end behind its operands.
  void open(Word kind) {
    if (++depth_ > deepest)
      throw Error("unions, intersections and differences are nested more than 100000 deep");
    stack_.push_back({nullptr, 0, false, 0, lowered_.program.size()});
    if (kind != Net::kind_unite) {
      lowered_.guards.push_back({static_cast<std::uint32_t>(lowered_.program.size()), guard_});
      guard_ = static_cast<std::int32_t>(lowered_.guards.size() - 1);
    }
    lowered_.program.insert(lowered_.program.end(), {kind, 0, 0});
  }
  void close(std::size_t begin) {
    --depth_;
    if (lowered_.program[begin] != Net::kind_unite)
      guard_ = lowered_.guards[static_cast<std::size_t>(guard_)].around;
    lowered_.program[begin + 1] = static_cast<Word>(lowered_.program.size() - begin);
  }
};

}  // namespace

template <int D>
Lowered<D> lower(const model::Expression& expression, Parts parts) {
  return Lowering<D>(parts).run(expression);
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
      open.push_back(
          {kind, at + word[1], kind == Net::kind_intersect ? Box<D>::everything() : Box<D>::empty()});
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
  template Lowered<D> lower<D>(const model::Expression&, Parts);                    \
  template Box<D> bounds_of<D>(const Lowered<D>&, const std::vector<Producer<D>>&); \
  template Box<D> hull_of<D>(const std::vector<Producer<D>>&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
