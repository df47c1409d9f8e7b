#pragma once

#include <mpi.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <ranges>
#include <source_location>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <variant>
#include <vector>

#include "bsp2/bsplib/cost.hpp"
#include "bsp2/bsplib/error.hpp"
#include "bsp2/bsplib/run.h"

namespace bsp2::bsplib {

namespace detail {

/// Whether a type is a pointer or a reference, or made of such by the standard library. Members of classes
/// cannot be seen.
template <class T>
struct HoldsPointer
    : std::bool_constant<std::is_pointer_v<T> || std::is_member_pointer_v<T> || std::is_null_pointer_v<T> ||
                         std::is_reference_v<T> || std::ranges::view<T>> {};
template <class T>
struct HoldsPointer<std::reference_wrapper<T>> : std::true_type {};
template <class T, std::size_t n>
struct HoldsPointer<T[n]> : HoldsPointer<T> {};
template <class T, std::size_t n>
struct HoldsPointer<std::array<T, n>> : HoldsPointer<T> {};
template <class... T>
struct HoldsPointer<std::pair<T...>> : std::disjunction<HoldsPointer<T>...> {};
template <class... T>
struct HoldsPointer<std::tuple<T...>> : std::disjunction<HoldsPointer<T>...> {};
template <class... T>
struct HoldsPointer<std::variant<T...>> : std::disjunction<HoldsPointer<T>...> {};
template <class T>
struct HoldsPointer<std::optional<T>> : HoldsPointer<T> {};
template <class T, class Allocator>
struct HoldsPointer<std::vector<T, Allocator>> : HoldsPointer<T> {};

}  // namespace detail

/// Types whose bytes are their value: these travel by put and get. Pointers and references do not, nor what
/// consists of them (std::span, std::reference_wrapper, an std::array of pointers): they mean nothing
/// elsewhere.
template <class T>
concept Travels = std::is_trivially_copyable_v<T> && !std::is_const_v<T> && !detail::HoldsPointer<T>::value;

namespace detail {

/// Says why a type does not travel.
template <class T>
struct MustTravel {
  static_assert(
      !HoldsPointer<T>::value,
      "bsp2: pointers, references, and views, arrays, pairs or tuples of them mean nothing on another rank");
  static_assert(std::is_trivially_copyable_v<T> || HoldsPointer<T>::value,
                "bsp2: only trivially copyable types travel by put and get; send others through a Queue");
  static_assert(!std::is_const_v<T>, "bsp2: constant elements cannot be written");
};

}  // namespace detail

struct WorldOptions {
  /// Staging memory of a rank for the messages within a node, twice this much; what does not fit travels by
  /// MPI. Where ranks differ, the least of them counts.
  std::size_t staging_bytes = std::size_t{4} << 20;
  /// Supersteps whose cost is kept one by one.
  std::size_t kept_costs = 1024;
  /// A file for the profile of all supersteps, which rank 0 writes; what rank 0 says counts. Empty: none.
  /// Worlds that are made after the first one add a number to its name.
  std::string profile;

  static constexpr std::size_t most_staging_bytes = std::size_t{1} << 40U;
  /// BSP2_STAGING_BYTES, where it is no number: an error of all ranks of a world.
  std::optional<std::string> unreadable;

  /// The defaults, or what the environment says: BSP2_STAGING_BYTES, BSP2_PROFILE.
  static WorldOptions from_environment();
};

/// A message as it arrived. It is valid until the next sync() or open().
struct Message {
  int source = 0;
  std::span<const std::byte> tag, payload;
};

class OpenSuperstep;

namespace detail {

/// A collective function that is part of a superstep. Ranks compare them at the sync: all must be in the
/// same.
struct Call {
  // clang-format off
  enum Function : std::uint8_t {
    none, broadcast, gather, all_gather, reduce, scan, all_to_all,
    // of classic programs:
    classic_broadcast, classic_gather, classic_scatter, classic_total_exchange, classic_fold, classic_scan
  };
  // clang-format on
  Function function = none;
  std::uint32_t queue = 0;  ///< that it uses; below 2^24
  int root = 0;
  std::size_t bytes = 0;  ///< of a value; compared in classic programs only
};

/// Where in a program's source a superstep ends, for its profile.
struct Place {
  Place() = default;
  Place(const char* file_name, int line_number) : file(file_name), line(line_number) {}
  Place(const std::source_location& at) : file(at.file_name()), line(static_cast<int>(at.line())) {}
  const char* file = nullptr;  ///< lives as long as the program; null: unknown
  int line = 0;
};

/// What ranks compare of the types of their queues and arrays.
template <class T>
std::uint64_t type_hash() {
  std::uint64_t hash = 14695981039346656037U + sizeof(T);
  for (const char c : std::string_view(typeid(T).name()))
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

class Engine;

/// The runs of a world, for calls that may continue one: these return whether they did. They live as long as
/// its engine.
class Runs {
 public:
  Runs() = default;
  Runs(const bsp2_runs& by_rank, int nprocs) : by_rank_(by_rank), nprocs_(static_cast<unsigned>(nprocs)) {}

  bool put(int pid, const void* source, std::uint32_t target, std::size_t offset, std::size_t bytes) const {
    if (!exists(pid)) return false;
    bsp2_put_run& run = by_rank_.put[pid];
    return bsp2_continue_put(&run, run.slot, target, offset, source, bytes) != 0 ||
           bsp2_scatter_put(&run, run.slot, target, offset, source, bytes) != 0;
  }
  bool hpput(int pid, const void* source, std::uint32_t target, std::size_t offset, std::size_t bytes) const {
    if (!exists(pid)) return false;
    bsp2_reference_run& run = by_rank_.hpput[pid];
    if (continues(run, target, offset, source, bytes)) return true;
    bsp2_put_run& puts = by_rank_.put[pid];
    return run.first == run.next && bsp2_scatter_put(&puts, puts.slot, target, offset, source, bytes) != 0;
  }
  bool get(int pid, std::uint32_t source, std::size_t offset, const void* target, std::size_t bytes) const {
    return exists(pid) && continues(by_rank_.get[pid], source, offset, target, bytes);
  }
  bool hpget(int pid, std::uint32_t source, std::size_t offset, const void* target, std::size_t bytes) const {
    return exists(pid) && continues(by_rank_.hpget[pid], source, offset, target, bytes);
  }

 private:
  bool exists(int pid) const { return static_cast<unsigned>(pid) < nprocs_; }
  static bool continues(bsp2_reference_run& run, std::uint32_t slot, std::size_t offset, const void* local,
                        std::size_t bytes) {
    return bsp2_continue_reference(&run, run.slot, slot, offset, local, bytes) != 0;
  }

  bsp2_runs by_rank_{};
  unsigned nprocs_ = 0;
};

}  // namespace detail

template <class T>
class Distributed;
namespace detail {
class QueueNumber;
}
/// The ranks of a communicator as a BSP computer. Worlds are independent of each other, but for errors: one
/// that ends a world ends the worlds that were made later of its ranks, too.
///
/// Threads: MPI_THREAD_FUNNELED; the thread that initialized MPI makes all calls, others may compute
/// meanwhile. "Collective" below means that all ranks of the world call the function, in the same order. If
/// they do not, or if one rank fails, then all of them get the same Error from their next collective call; no
/// rank hangs. After an agreed error a world is dead: every call throws this error again.
class World {
 public:
  /// Number of registered memory; equal on all ranks.
  using Slot = std::uint32_t;
  static constexpr std::size_t memory_alignment = 64;  ///< bytes; a cache line

  /// Collective over comm, which is duplicated, and a collective call of the newest world that has the same
  /// ranks: so nobody waits for a rank that failed there. A boost::mpi::communicator converts to MPI_Comm.
  /// @throws Error, agreed, of that world.
  explicit World(MPI_Comm comm = MPI_COMM_WORLD, WorldOptions options = WorldOptions::from_environment());
  /// As close(), but does not throw. While an exception leaves the scope, it tells the other ranks that this
  /// one failed, so that they do not wait for it.
  ~World();
  /// Arrays, registrations, queues and an open superstep go on with the world wherever it moves; an
  /// assignment ends the world that was here before. Those that outlive their world find that it has ended.
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  int pid() const;
  int nprocs() const;
  double time() const;              ///< seconds since the world began, on this rank's clock
  std::uint64_t superstep() const;  ///< counts the syncs

  /// Ends the superstep. Collective. In this order: all gets read; then gets write their results; then puts
  /// write, in the order of their ranks, and of one rank in the order of the calls (so overlapping puts have
  /// a defined result); then registrations, removals and the tag size take effect; the messages of the
  /// superstep are there.
  /// @throws Error, agreed.
  void sync(std::source_location place = std::source_location::current()) { sync(detail::Call{}, place); }
  /// Ends the superstep within a collective function. @throws Error, agreed, if ranks are in different ones.
  void sync(const detail::Call& call, detail::Place place);
  /// Begins the end of the superstep: communication runs while this rank goes on computing. Collective, as
  /// its close().
  [[nodiscard]] OpenSuperstep open(std::source_location place = std::source_location::current());
  /// Ends the world, after a superstep that is still open. Collective. @throws Error, agreed, if other ranks
  /// still synchronize.
  void close();

  /// Tells all ranks that this one cannot go on; they get it from their next collective call. Does not
  /// return. Those that wait for it in another world meanwhile get it there, and that world ends, too.
  /// @throws Error, agreed, with this text.
  [[noreturn]] void fail(const std::string& why);
  /// As fail(), for an error that this rank got: the same code, function and text. One of a sub-world yields
  /// to failures that arose in this world; its culprit becomes that rank's number here.
  [[noreturn]] void relay(const Error& error);
  /// Says that this rank now makes something that all ranks must make of the same type; compared by the next
  /// collective call. Queues and arrays do so.
  template <class T>
  void declare() {
    declare_type(detail::type_hash<T>());
  }
  bool failed() const;

  /// A world of the ranks with the same color, ordered by key. Collective.
  World split(int color, int key = 0);

  // --- Memory. Takes effect at the next sync, in sequence. ---

  /// Makes memory accessible to the other ranks. Collective; sizes may differ, nullptr gives no access.
  Slot push_reg(const void* address, std::size_t bytes);
  /// Removes the newest registration of an address. Collective. The memory must live until the next sync.
  void pop_reg(const void* address);
  void pop_slot(Slot slot);
  /// New zeroed memory, registered at once, which ranks of the same node write without a transfer; it begins
  /// at a multiple of `memory_alignment`. Collective. It is freed at the sync after its pop; what nobody
  /// popped, when this object and all that belongs to the world are gone.
  std::pair<Slot, std::byte*> allocate(std::size_t bytes);
  std::size_t size_of(Slot slot, int pid) const;  ///< bytes that a rank registered
  /// The newest registration of an address that is in effect. @throws Error if there is none.
  Slot slot_of(const void* address, const char* caller = "slot_of") const;

  // --- Communication: complete after the next sync. The memory of the other rank is named by a slot. ---
  // @throws Error (local) if the rank, the slot or the range does not exist.

  /// Reads the source now.
  void put(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes) {
    if (BSP2_RARELY(!runs_.put(pid, source, target, offset, bytes)))
      start_put(pid, source, target, offset, bytes);
  }
  void get(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes) {
    if (BSP2_RARELY(!runs_.get(pid, source, offset, target, bytes)))
      start_get(pid, source, offset, target, bytes);
  }
  /// Unbuffered: source and target must not change, and are undefined, until the sync ends.
  void hpput(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes) {
    if (BSP2_RARELY(!runs_.hpput(pid, source, target, offset, bytes)))
      start_hpput(pid, source, target, offset, bytes);
  }
  void hpget(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes) {
    if (BSP2_RARELY(!runs_.hpget(pid, source, offset, target, bytes)))
      start_hpget(pid, source, offset, target, bytes);
  }

  // --- Messages ---

  /// Sets the size of the tags of queue 0 from the next superstep on; collective. @return the size set
  /// before.
  std::size_t set_tagsize(std::size_t bytes);
  std::size_t tagsize() const;           ///< of the messages sent in this superstep
  std::size_t received_tagsize() const;  ///< of the messages received
  /// Opens one more queue. Collective; takes effect at once.
  std::uint32_t new_queue();
  /// Ends a queue at the next sync; later ones may have its number. Collective.
  void close_queue(std::uint32_t queue);
  void send(std::uint32_t queue, int pid, std::span<const std::byte> tag, std::span<const std::byte> payload);
  /// What arrived for a queue at the last sync, in the order of the ranks (queue 0: descending) and of their
  /// calls.
  std::span<const Message> messages(std::uint32_t queue) const;

  // --- Cost ---

  const CostReport& costs() const;
  /// The machine that predictions use. By default the one in machine_file(), if any.
  void set_machine(const Machine& machine);
  const std::optional<Machine>& machine() const;

 private:
  template <class T>
  friend class Distributed;
  friend class detail::QueueNumber;

  explicit World(std::shared_ptr<detail::Engine> engine);
  /// For what belongs to the world: the same one, wherever the object moves that the program has of it.
  struct Alias {};
  World(Alias, const World& other)
      : runs_(other.runs_), engine_(other.engine_), owns_(false), last_pid_(other.last_pid_) {}
  detail::Engine& engine() const;
  /// For destructors: as pop_slot and close_queue, but does nothing in a world that is dead or over. In an
  /// open superstep it counts for the next one.
  void give_back_slot(Slot slot) noexcept;
  void give_back_queue(std::uint32_t queue) noexcept;
  void declare_type(std::uint64_t hash);
  [[noreturn]] void reject_index(int pid, std::size_t index, std::size_t size) const;
  void start_put(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes);
  void start_get(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes);
  void start_hpput(int pid, const void* source, Slot target, std::size_t offset, std::size_t bytes);
  void start_hpget(int pid, Slot source, std::size_t offset, void* target, std::size_t bytes);

  detail::Runs runs_;
  std::shared_ptr<detail::Engine> engine_;  ///< shared with what belongs to the world
  bool owns_ = true;                        ///< ends the world in its destructor
  int last_pid_ = 0;                        ///< this rank in the world that is, or was, here
};

/// A superstep that is ending while its ranks compute. Between open() and close() no communication may be
/// started, received messages are gone, and the memory that this superstep reads or writes must be left
/// alone.
class OpenSuperstep {
 public:
  OpenSuperstep(const OpenSuperstep&) = delete;
  OpenSuperstep& operator=(const OpenSuperstep&) = delete;
  ~OpenSuperstep();  ///< closes, if nobody did

  /// Lets the communication advance. Call it now and then while computing. @return whether all data has
  /// arrived.
  bool poll();
  /// The sync is complete after this. Collective. @throws Error, agreed.
  void close();

 private:
  friend class World;
  explicit OpenSuperstep(std::shared_ptr<detail::Engine> engine) : engine_(std::move(engine)) {}
  std::shared_ptr<detail::Engine> engine_;  ///< the world's; it may move meanwhile
};

/// Runs a program on a world; whatever exception leaves it on one rank ends it on all, with one agreed Error.
/// Collective. @throws Error, agreed.
template <class Program>
void supervise(World& world, Program&& program) {
  try {
    std::forward<Program>(program)(world);
  } catch (const Error& error) {
    world.relay(error);
  } catch (const std::exception& error) {
    world.fail(error.what());
  } catch (...) {
    world.fail("an exception of unknown type");
  }
}

}  // namespace bsp2::bsplib
