#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bsp2/dataflow/evaluate/frontier.hpp"
#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"
#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::dataflow {

template <int D>
struct Join;
template <int D>
struct Token;

/// What became of a token.
enum class OutcomeKind : std::uint8_t {
  cell,             ///< a cell of one label, not yet emitted
  subtree,          ///< several cells, all emitted
  suspended_token,  ///< undecided, to be gone on with later
  suspended_join    ///< a split of which a half is suspended
};

template <int D>
struct Outcome {
  OutcomeKind kind = OutcomeKind::cell;
  geometry::Label label = geometry::Label::out;  ///< of a cell
  bool divided =
      false;  ///< of a suspended one: some of its cells have been emitted, so it is never given back whole
  std::uint16_t level = 0;
  std::int32_t owner = no_owner;  ///< the producer that a cell belongs to, or a Container
  union {
    std::int64_t tree = 0;  ///< of a subtree: see TreeCodes
    Token<D>* token;        ///< of a suspended token
    Join<D>* join;          ///< of a suspended join
  };
  geometry::Cell<D> cell;  ///< may be empty for OUT

  [[nodiscard]] bool is_suspended() const {
    return kind == OutcomeKind::suspended_token || kind == OutcomeKind::suspended_join;
  }
};

/// A split that waits for both of its halves, and keeps the whole cell in case they turn out alike.
template <int D>
struct Join {
  Join* parent = nullptr;
  std::uint32_t region = 0;
  std::uint16_t level = 0;
  std::uint8_t side = 0;  ///< which half of the parent this is
  geometry::HyperplaneId hyperplane = 0;
  geometry::Cell<D> cell;
  std::atomic<int> pending{2};
  std::array<Outcome<D>, 2> outcomes;
};

/// A FUZZY cell and what is still undecided about it.
/// Source: the paper, section 3.
template <int D>
struct Token {
  static constexpr std::uint32_t not_restored = 0xffffffff;
  geometry::Cell<D> cell;
  Words program;
  Join<D>* parent = nullptr;
  std::uint32_t region = 0;
  std::uint32_t restored =
      not_restored;  ///< else a node of the region's frontier, to be unfolded; `program` is not used
  std::uint16_t level = 0;
  std::uint8_t side = 0;
  bool ended = false;  ///< looked at closely, and not to be cut
};

/// The frontier of a suspended region with the places of its subtrees, to be unfolded in any order by any
/// thread.
class UnfoldedFrontier {
 public:
  /// @throws std::invalid_argument if the nodes are no tree or do not fit the programs.
  explicit UnfoldedFrontier(Frontier frontier)
      : frontier_(std::move(frontier)), end_(frontier_.nodes.size()), before_(frontier_.nodes.size() + 1) {
    std::vector<std::uint32_t> open;  // splits whose second subtree has not ended
    std::vector<std::uint8_t> halves;
    const auto& nodes = frontier_.nodes;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      if (i > 0 && open.empty()) throw std::invalid_argument("a frontier has more than one root");
      const bool is_token = nodes[i].kind == Frontier::Kind::token;
      if (is_token && nodes[i].value < 0)
        throw std::invalid_argument("a frontier has a token of negative length");
      before_[i + 1] = before_[i];
      if (is_token) before_[i + 1].words += static_cast<std::size_t>(nodes[i].value);
      if (nodes[i].kind == Frontier::Kind::elsewhere || (is_token && nodes[i].ended == 0))
        ++before_[i + 1].open;
      if (nodes[i].kind == Frontier::Kind::emitted ||
          (nodes[i].kind == Frontier::Kind::elsewhere && nodes[i].value != 0))
        ++before_[i + 1].emitted;
      if (nodes[i].kind == Frontier::Kind::split) {
        open.push_back(i);
        halves.push_back(2);
        continue;
      }
      end_[i] = i + 1;
      while (!open.empty() && --halves.back() == 0) {
        end_[open.back()] = i + 1;
        open.pop_back();
        halves.pop_back();
      }
    }
    if (!open.empty() || before_.back().words != frontier_.programs.size())
      throw std::invalid_argument("a frontier is not complete");
  }

  [[nodiscard]] bool empty() const { return frontier_.empty(); }
  [[nodiscard]] const Frontier::Node& node(std::uint32_t i) const { return frontier_.nodes[i]; }
  [[nodiscard]] std::uint32_t negative(std::uint32_t split) const { return split + 1; }
  [[nodiscard]] std::uint32_t positive(std::uint32_t split) const { return end_[split + 1]; }
  [[nodiscard]] std::span<const Word> program(std::uint32_t token) const {
    return {frontier_.programs.data() + before_[token].words,
            before_[token + 1].words - before_[token].words};
  }
  /// Whether a subtree has tokens and all of them have ended.
  [[nodiscard]] bool has_ended(std::uint32_t root) const {
    const Before &begin = before_[root], &end = before_[end_[root]];
    return end.open == begin.open && end.words > begin.words;
  }
  /// Whether cells of a subtree have been emitted, as far as this portion knows.
  [[nodiscard]] bool has_emitted(std::uint32_t root) const {
    return before_[end_[root]].emitted > before_[root].emitted;
  }
  /// Appends the subtree as it is.
  void copy(std::uint32_t root, Frontier& to) const {
    to.nodes.insert(to.nodes.end(), frontier_.nodes.begin() + root, frontier_.nodes.begin() + end_[root]);
    to.programs.insert(to.programs.end(),
                       frontier_.programs.begin() + static_cast<std::ptrdiff_t>(before_[root].words),
                       frontier_.programs.begin() + static_cast<std::ptrdiff_t>(before_[end_[root]].words));
  }

 private:
  Frontier frontier_;
  std::vector<std::uint32_t> end_;  // of each node: behind its subtree
  struct Before {
    std::size_t words = 0;                // of the tokens' programs
    std::uint32_t open = 0, emitted = 0;  // nodes with something to do, nodes whose cells have been emitted
  };
  std::vector<Before> before_;  // in all nodes before each
};

/// Where a child of a BSP node is, while several workers build the tree: 0 is empty space, positive a cell,
/// negative a node. Cells and nodes are numbered by each of the `workers` for itself; those of earlier
/// evaluations count as the cells and nodes of one worker more.
class TreeCodes {
 public:
  explicit TreeCodes(std::uint32_t workers) : workers_(workers + 1) {}
  [[nodiscard]] std::uint32_t earlier() const { return workers_ - 1; }
  [[nodiscard]] std::int64_t cell(std::uint32_t worker, std::uint64_t index) const {
    return static_cast<std::int64_t>(index * workers_ + worker + 1);
  }
  [[nodiscard]] std::int64_t node(std::uint32_t worker, std::uint64_t index) const {
    return -cell(worker, index);
  }
  [[nodiscard]] std::uint32_t worker(std::int64_t code) const {
    return static_cast<std::uint32_t>((magnitude(code) - 1) % workers_);
  }
  [[nodiscard]] std::uint64_t index(std::int64_t code) const { return (magnitude(code) - 1) / workers_; }

 private:
  std::uint32_t workers_;
  static std::uint64_t magnitude(std::int64_t code) {
    return static_cast<std::uint64_t>(code < 0 ? -code : code);
  }
};

/// A node of the BSP tree as its worker wrote it down; children as TreeCodes have them.
struct RecordedNode {
  geometry::HyperplaneId hyperplane;
  std::array<std::int64_t, 2> children;
};

/// Recycled objects: the steady state allocates nothing. Owns all that it ever made, so that an evaluation
/// that ends in an exception loses nothing; an object may be given to another pool than the one it came from.
template <typename T>
class Pool {
 public:
  T* take() {
    if (free_.empty()) return &all_.emplace_back();
    T* object = free_.back();
    free_.pop_back();
    return object;
  }
  void give(T* object) { free_.push_back(object); }

 private:
  std::deque<T> all_;  // does not move what it holds
  std::vector<T*> free_;
};

}  // namespace bsp2::dataflow
