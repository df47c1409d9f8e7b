#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "bsp2/dataflow/evaluate/frontier.hpp"

/// Portions of what is left of a region: it can be divided, the portions go on separately, each by an
/// evaluation of its own, and what has become of them is put together again.
///
/// In each portion what belongs to others is `Frontier::Kind::elsewhere`: it stays undecided there, so that
/// no split above is finished before all portions are together. Hence cells, joins and digest are those of an
/// evaluation that was never divided. Every node that emits something belongs to exactly one portion. Source:
/// the paper, section 4.2 (portions that outnumber the nodes; a job that is too big splits itself).
namespace bsp2::dataflow {

/// How much is left in a frontier.
struct Remains {
  std::uint64_t tokens = 0;     ///< FUZZY cells
  std::uint64_t open = 0;       ///< of them those that have not ended: what there is to do
  std::uint64_t words = 0;      ///< of their localized expressions
  std::uint64_t elsewhere = 0;  ///< subtrees that belong to other portions
};
Remains remains_of(const Frontier& frontier);

/// What of a frontier has been emitted, and what has not, as two portions of it. The second knows no roots of
/// recorded trees, so an evaluation of it counts nodes and cells for itself.
/// @throws std::invalid_argument if the frontier is no tree.
struct Separated {
  Frontier emitted, pending;
};
Separated separate_emitted(const Frontier& frontier);

/// Two portions of a frontier with about equally much to do, by the length of the open tokens' expressions:
/// between a third and two thirds where no single token has more. Each has an open token. Depends on the
/// frontier alone.
/// @return nothing if there are not two open tokens to divide.
/// @throws std::invalid_argument if the frontier is no tree.
std::optional<std::array<Frontier, 2>> divide(const Frontier& frontier);

/// Two portions of one frontier together; what belongs to neither stays elsewhere.
/// @throws std::invalid_argument if they are no portions of one frontier.
Frontier overlay(const Frontier& a, const Frontier& b);

}  // namespace bsp2::dataflow
