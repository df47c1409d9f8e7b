#pragma once

#include <functional>
#include <source_location>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/bsplib/memory.hpp"
#include "bsp2/bsplib/queue.hpp"

/// Collectives, written with the primitives that every program has. Each is a BSP algorithm whose cost is
/// stated; n is the size of a value in bytes, p the number of ranks. All ranks call them; each ends the
/// running superstep, so communication that was started before is complete afterwards, too. Errors: as
/// World::sync.
///
/// They work on a Collectives object, which owns the queue for values of one type: constructing it is
/// collective, using it as often as needed costs no registration.
namespace bsp2::bsplib {

template <class T>
class Collectives {
 public:
  using Place = std::source_location;  ///< of a call, for the profile

  explicit Collectives(World& world) : queue_(world) {}

  /// The root's value, on all ranks. One superstep, h = (p-1) n.
  T broadcast(const T& value, int root, Place place = Place::current()) {
    check(root, "broadcast");
    if (world().pid() == root) to_others(value);
    sync(Call::broadcast, place, root);
    return world().pid() == root ? value : only(queue_.receive());
  }

  /// All values in the order of ranks, on the root; empty elsewhere. One superstep, h = (p-1) n.
  std::vector<T> gather(const T& value, int root, Place place = Place::current()) {
    check(root, "gather");
    if (world().pid() != root) queue_.send(root, value);
    sync(Call::gather, place, root);
    return world().pid() == root ? in_order(value) : std::vector<T>();
  }

  /// All values in the order of ranks, on all ranks. One superstep, h = (p-1) n.
  std::vector<T> all_gather(const T& value, Place place = Place::current()) {
    return collect(value, Call::all_gather, place);
  }

  /// op over the values of all ranks, in their order, so it need not commute. One superstep, h = (p-1) n.
  template <class Op>
  T reduce(const T& value, Op op, Place place = Place::current()) {
    return fold(collect(value, Call::reduce, place), op, static_cast<std::size_t>(world().nprocs()));
  }

  /// op over the values of ranks 0..pid (inclusive scan). One superstep, h = (p-1) n.
  template <class Op>
  T scan(const T& value, Op op, Place place = Place::current()) {
    for (int pid = world().pid() + 1; pid < world().nprocs(); ++pid) queue_.send(pid, value);
    sync(Call::scan, place);
    auto values = received();
    values.push_back(value);
    return fold(std::move(values), op, static_cast<std::size_t>(world().pid()) + 1);
  }

  /// Value i goes to rank i; the result holds what rank i sent at i. One superstep, h = (p-1) n.
  std::vector<T> all_to_all(std::span<const T> values, Place place = Place::current()) {
    if (values.size() != static_cast<std::size_t>(world().nprocs()))
      world().fail("all_to_all: " + detail::amount(values.size(), "value") + " for " +
                   detail::amount(static_cast<std::size_t>(world().nprocs()), "rank"));
    for (int pid = 0; pid < world().nprocs(); ++pid)
      if (pid != world().pid()) queue_.send(pid, values[static_cast<std::size_t>(pid)]);
    sync(Call::all_to_all, place);
    return in_order(values[static_cast<std::size_t>(world().pid())]);
  }

 private:
  using Received = typename Queue<T>::Received;
  using Call = detail::Call;

  World& world() { return queue_.alias(); }

  /// All ranks must be in this function, on this queue, with this root.
  void sync(Call::Function function, Place place, int root = 0) {
    world().sync({function, queue_.number(), root}, place);
  }

  std::vector<T> collect(const T& value, Call::Function function, Place place) {
    to_others(value);
    sync(function, place);
    return in_order(value);
  }

  void check(int root, const char* what) {
    if (root < 0 || root >= world().nprocs())
      world().fail(std::string(what) + ": there is no rank " + std::to_string(root));
  }

  void to_others(const T& value) {
    for (int pid = 0; pid < world().nprocs(); ++pid)
      if (pid != world().pid()) queue_.send(pid, value);
  }

  static T only(std::vector<Received> all) { return std::move(all.at(0).value); }

  std::vector<T> received() {
    std::vector<T> values;
    for (Received& message : queue_.receive()) values.push_back(std::move(message.value));
    return values;
  }

  std::vector<T> in_order(const T& mine) {
    auto values = received();
    values.insert(values.begin() + world().pid(), mine);
    return values;
  }

  template <class Op>
  static T fold(std::vector<T> values, Op& op, std::size_t count) {
    T result = std::move(values.at(0));
    for (std::size_t i = 1; i < count; ++i) result = op(std::move(result), std::move(values[i]));
    return result;
  }

  Queue<T> queue_;
};

/// Broadcasts a long vector in two phases: the root scatters it, then all ranks exchange their parts.
/// Collective; `data` has the same size on all ranks. Two supersteps beside that of the registration, h = 2
/// n.
template <Travels T>
void broadcast(World& world, std::span<T> data, int root,
               std::source_location place = std::source_location::current()) {
  if (root < 0 || root >= world.nprocs()) world.fail("broadcast: there is no rank " + std::to_string(root));
  Registered<T> shared(world, data);
  const detail::Call call{detail::Call::broadcast, 0, root};
  world.sync(call, place);
  for (int pid = 0; pid < world.nprocs(); ++pid)
    if (shared.size(pid) != shared.size(root))
      world.fail("broadcast: rank " + std::to_string(pid) + " has " +
                 detail::amount(shared.size(pid), "element") + ", the root " +
                 std::to_string(shared.size(root)));
  const auto p = static_cast<std::size_t>(world.nprocs());
  const auto part = [&](std::size_t i) {
    const std::size_t begin = data.size() * i / p, end = data.size() * (i + 1) / p;
    return std::pair(begin, std::span<const T>(data).subspan(begin, end - begin));
  };
  if (world.pid() == root)
    for (std::size_t i = 0; i < p; ++i) shared.put(static_cast<int>(i), part(i).second, part(i).first);
  world.sync(call, place);
  const auto [begin, mine] = part(static_cast<std::size_t>(world.pid()));
  for (int pid = 0; pid < world.nprocs(); ++pid)
    if (pid != world.pid()) shared.put(pid, mine, begin);
  world.sync(call, place);
}

}  // namespace bsp2::bsplib
