#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/geometry/cell.hpp"
#include "bsp2/geometry/cell_batch.hpp"

namespace bsp2::dataflow {

/// What became of a token: a cell of one label, not yet emitted, or (mixed) a subtree whose cells have been.
template <int D>
struct Outcome {
  geometry::Label label = geometry::Label::out;
  bool mixed = false;
  std::int32_t part = geometry::no_part;
  std::uint16_t level = 0;
  std::int64_t tree = 0;  ///< of a mixed one: see TreeCodes
  geometry::Cell<D> cell;  ///< may be empty for OUT
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
  geometry::Cell<D> cell;
  std::vector<Word> program;
  Join<D>* parent = nullptr;
  std::uint32_t region = 0;
  std::uint16_t level = 0;
  std::uint8_t side = 0;
};

/// Where a child of a BSP node is, while several workers build the tree: 0 is empty space, positive a cell, negative a
/// node. Cells and nodes are numbered by each of the `workers` for itself.
class TreeCodes {
 public:
  explicit TreeCodes(std::uint32_t workers) : workers_(workers) {}
  [[nodiscard]] std::int64_t cell(std::uint32_t worker, std::uint64_t index) const {
    return static_cast<std::int64_t>(index * workers_ + worker + 1);
  }
  [[nodiscard]] std::int64_t node(std::uint32_t worker, std::uint64_t index) const { return -cell(worker, index); }
  [[nodiscard]] std::uint32_t worker(std::int64_t code) const { return static_cast<std::uint32_t>((magnitude(code) - 1) % workers_); }
  [[nodiscard]] std::uint64_t index(std::int64_t code) const { return (magnitude(code) - 1) / workers_; }

 private:
  std::uint32_t workers_;
  static std::uint64_t magnitude(std::int64_t code) { return static_cast<std::uint64_t>(code < 0 ? -code : code); }
};

/// A node of the BSP tree as its worker wrote it down; children as TreeCodes have them.
struct RecordedNode {
  geometry::HyperplaneId hyperplane;
  std::array<std::int32_t, 2> children;
};

/// Recycled objects: the steady state allocates nothing. Owns all that it ever made, so that an evaluation that ends in an
/// exception loses nothing; an object may be given to another pool than the one it came from.
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
