#pragma once

#include <boost/serialization/string.hpp>
#include <string>
#include <vector>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"

/// Collectives over what Boost.Serialization archives. All ranks call them; nothing else may be on its way.
namespace bsp2::supersteps {

/// The master's value, on all ranks. h = (p - 1) times its size.
template <typename T>
void broadcast(Ranks& ranks, T& value) {
  if (ranks.is_master() && ranks.count() > 1) {
    const std::string bytes = dataflow::to_bytes(value);
    for (int rank = 1; rank < ranks.count(); ++rank) ranks.send(rank, bytes);
  }
  ranks.sync();
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, value);
}

/// Gives all ranks the master's text, which may be long: as it is, without an archive.
inline void broadcast(Ranks& ranks, std::string& text) {
  if (ranks.is_master())
    for (int rank = 1; rank < ranks.count(); ++rank) ranks.send(rank, text);
  ranks.sync();
  for (const auto& message : ranks.received()) text.assign(message.bytes);
}

/// All values in the order of the ranks, on the master; empty elsewhere.
/// @param blank what the values are loaded into.
template <typename T>
std::vector<T> gather(Ranks& ranks, const T& value, const T& blank = {}) {
  ranks.send(0, dataflow::to_bytes(value));
  ranks.sync();
  std::vector<T> values;
  for (const auto& message : ranks.received())
    dataflow::from_bytes(message.bytes, values.emplace_back(blank));
  return values;
}

/// All values in the order of the ranks, on all ranks.
template <typename T>
std::vector<T> all_gather(Ranks& ranks, const T& value, const T& blank = {}) {
  const std::string bytes = dataflow::to_bytes(value);
  for (int rank = 0; rank < ranks.count(); ++rank) ranks.send(rank, bytes);
  ranks.sync();
  std::vector<T> values;
  for (const auto& message : ranks.received())
    dataflow::from_bytes(message.bytes, values.emplace_back(blank));
  return values;
}

}  // namespace bsp2::supersteps
