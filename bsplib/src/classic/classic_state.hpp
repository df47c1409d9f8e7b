#pragma once

#include <array>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>

#include "bsp2/bsplib/world.hpp"
#include "engine/engine.hpp"

/// The one world of a classic program. Here, and only here, is global state: the interface of BSPlib has no
/// handle.
namespace bsp2::bsplib::classic {

struct State {
  std::unique_ptr<detail::Engine> engine;  ///< of the world, between bsp_begin and bsp_end
  bsp2_runs runs{};                        ///< its runs
  unsigned with_runs = 0;                  ///< the processes that have them: all, or none
  bool init_called = false, began = false, ended = false, aborting = false;
  bool ends_mpi = false;  ///< at the exit: where the layer started MPI, and where it ends the process
  int nprocs = 0;

  /// Addresses that were looked up, as long as the registrations do not change.
  struct Known {
    const void* address = nullptr;
    World::Slot slot = 0;
  };
  std::array<Known, 16> known;
  std::uint64_t version = 0;

  /// Of process 0, or a guess: what the collectives count with.
  Machine machine{1, 1e9, 1e-9, 4e-6};
  bool has_level1_queue = false;  ///< for the collectives; made when the first one is called
  std::uint32_t level1_queue = 0;

  // The queue of messages, behind those of one size at its front: these are in bsp2_classic_messages.
  std::size_t next_run = 0;
  std::size_t messages_behind = 0, bytes_behind = 0;
};

extern State state;

void init(void (*spmd)(void), int argc, char** argv);
void begin(long long maxprocs);
void end();
/// Ends the superstep for a function of BSPlib, at the place in the source that the program left in
/// bsp2_here. @param keeps_messages those that are there stay, as for a collective's second superstep.
void sync(const char* function, const detail::Call& call = {}, bool keeps_messages = false);
int nprocs();
/// Goes on to the messages of the next size.
void next_messages();

/// Ends all processes with an error of the layer; one process prints it.
[[noreturn]] void die(const Error& error);
/// Ends all processes with a message of this one, which names the function of BSPlib.
[[noreturn]] void die(const char* function, const std::string& message);
[[noreturn]] void abort_with(const char* format, va_list arguments);
[[noreturn]] void not_in_spmd(const char* function);

/// The world, for a function that makes sense in the parallel part only.
inline detail::Engine& engine(const char* function) {
  if (!state.engine) not_in_spmd(function);
  return *state.engine;
}

/// Calls the layer for a function of BSPlib. Its errors end all processes.
template <class Call>
void guarded(const char* function, Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    die(error);
  } catch (const std::bad_alloc&) {
    die(function, "There is not enough memory");
  } catch (const std::length_error&) {
    die(function, "There is not enough memory");
  }
}

World::Slot look_up(detail::Engine& engine, const void* address, const char* function);

inline State::Known& known_at(const void* address) {
  return state.known[(reinterpret_cast<std::uintptr_t>(address) >> 4U) % state.known.size()];
}

inline World::Slot slot_of(detail::Engine& engine, const void* address, const char* function) {
  const State::Known& known = known_at(address);
  if (address && address == known.address && engine.registry_version() == state.version) return known.slot;
  return look_up(engine, address, function);
}

}  // namespace bsp2::bsplib::classic
