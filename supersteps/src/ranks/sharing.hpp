#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "ranks/exchange.hpp"

/// What ranks do that share something: each has something for each of the others, again and again.
namespace bsp2::supersteps {

/// What a rank has for each of the others.
template <typename T>
std::vector<std::string> texts_of(const std::vector<T>& for_ranks) {
  std::vector<std::string> texts;
  for (const T& value : for_ranks) texts.push_back(dataflow::to_bytes(value));
  return texts;
}

/// What has come from each rank, in their order.
template <typename T>
std::vector<T> values_of(const Ranks& ranks) {
  std::vector<T> values;
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, values.emplace_back());
  return values;
}

/// A part of a superstep: `work` makes what this rank has for each. Collective.
inline void step(Ranks& ranks, const std::function<std::vector<std::string>()>& work) {
  std::vector<std::string> texts;
  ranks.agree([&] { texts = work(); });
  for (int rank = 0; rank < ranks.count(); ++rank)
    ranks.send(rank, std::exchange(texts[static_cast<std::size_t>(rank)], {}));
  ranks.sync();
}

/// All that is on the master then. Collective.
template <typename T>
std::vector<T> gather_all(Ranks& ranks, T mine) {
  std::string bytes;
  ranks.agree([&] {
    if (!ranks.is_master()) bytes = dataflow::to_bytes(std::exchange(mine, {}));
  });
  if (!ranks.is_master()) ranks.send(0, std::exchange(bytes, {}));
  ranks.sync();
  std::vector<T> all;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    all.push_back(std::move(mine));
    for (auto& other : values_of<T>(ranks)) all.push_back(std::move(other));
  });
  return all;
}

}  // namespace bsp2::supersteps
