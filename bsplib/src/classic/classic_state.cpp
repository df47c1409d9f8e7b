#include "classic/classic_state.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>

#include "bsp.h"
#include "classic/speaker.hpp"

namespace bsp2::bsplib::classic {

State state;

}  // namespace bsp2::bsplib::classic

extern "C" {
bsp2_put_run bsp2_classic_puts[BSP2_RUNS];
bsp2_reference_run bsp2_classic_hpputs[BSP2_RUNS], bsp2_classic_gets[BSP2_RUNS],
    bsp2_classic_hpgets[BSP2_RUNS];
bsp2_message_run bsp2_classic_sends[BSP2_RUNS];
bsp2_messages bsp2_classic_messages;
bsp2_place bsp2_here;
}

namespace bsp2::bsplib::classic {

namespace {

int world_size() {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

/// Of bsp_begin, or all that there are.
int participants() {
  int initialized = 0, finalized = 0;
  MPI_Initialized(&initialized);
  MPI_Finalized(&finalized);
  return state.nprocs > 0 || !initialized || finalized ? state.nprocs : world_size();
}

[[noreturn]] void end_all() {
  state.aborting = true;
  int initialized = 0, finalized = 0;
  MPI_Initialized(&initialized);
  MPI_Finalized(&finalized);
  if (initialized && !finalized) MPI_Abort(MPI_COMM_WORLD, EXIT_FAILURE);
  std::_Exit(EXIT_FAILURE);
}

void print(std::string message) {
  if (message.empty() || message.back() != '\n') message += '\n';
  std::fflush(stdout);
  std::fputs(message.c_str(), stderr);
  std::fflush(stderr);
}

/// All processes come by here once, where they begin or, if they never do, at their end: so nobody waits in
/// bsp_begin for one that ended.
void meet_before_begin(bool begins) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const int none = -world_size();
  const std::array<int, 2> mine{begins ? none : rank, begins ? -rank : none};
  std::array<int, 2> most{};  // the highest that ended, and minus the lowest that begins
  MPI_Allreduce(mine.data(), most.data(), 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  if (most[0] == none || most[1] == none) return;
  if (rank == -most[1])
    die("bsp_begin", "Process " + std::to_string(most[0]) + " has ended without calling it");
  MPI_Barrier(
      MPI_COMM_WORLD);  // until that process ends all: one that finalized MPI meanwhile could keep mpirun
}

/// A program that ends without bsp_end must not leave the others waiting.
void at_exit() {
  int finalized = 0;
  MPI_Finalized(&finalized);
  if (finalized || state.aborting) return;
  if (state.began && !state.ended) die("bsp_end", "was not called before the end of the program");
  if (state.init_called && !state.began && world_size() > 1)
    die("bsp_begin", "was not called before the end of the program, after bsp_init");
  if (!state.began) meet_before_begin(false);
  if (state.ends_mpi) MPI_Finalize();
}

[[noreturn]] void leave() {
  state.ends_mpi = true;
  std::exit(EXIT_SUCCESS);
}

/// Who starts MPI ends it: a program that did so itself does it for the processes that come back to its main.
void start_mpi(int* argc, char*** argv) {
  int initialized = 0, provided = 0;
  MPI_Initialized(&initialized);
  if (!initialized) {
    MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided);
    state.ends_mpi = true;
  }
  static const int registered = std::atexit(at_exit);
  static_cast<void>(registered);
}

/// "sync/push_reg" is "bsp_sync/bsp_push_reg" to a classic program.
std::string classic_name(const std::string& where) {
  std::string name = "bsp_";
  for (const char c : where) {
    name += c;
    if (c == '/') name += "bsp_";
  }
  return name;
}

/// What the layer says of ranks, in the words of BSPlib.
std::string in_classic_words(const Error& error) {
  if (error.code() == Errc::ended_early)
    return "Some processes have called bsp_sync, while others have called bsp_end instead";  // as in BSPonMPI
  // By hand: a regular expression takes half of the time in which this file is compiled.
  const std::string& detail = error.detail();
  const auto is_of_word = [&](std::size_t i) {
    return i < detail.size() &&
           (std::isalnum(static_cast<unsigned char>(detail[i])) != 0 || detail[i] == '_');
  };
  std::string text;
  for (std::size_t at = 0; at < detail.size();) {
    const bool is_large = detail.compare(at, 4, "Rank") == 0;
    const bool begins = (is_large || detail.compare(at, 4, "rank") == 0) && (at == 0 || !is_of_word(at - 1));
    const std::size_t plural = begins && at + 4 < detail.size() && detail[at + 4] == 's' ? 1 : 0;
    if (!begins || is_of_word(at + 4 + plural)) {
      text += detail[at++];
      continue;
    }
    text += is_large ? "Process" : "process";
    if (plural != 0) text += "es";
    at += 4 + plural;
  }
  return text;
}

std::string place(int rank, std::uint64_t superstep) {
  return " (process " + std::to_string(rank) + ", superstep " + std::to_string(superstep) + ")";
}

}  // namespace

void die(const Error& error) {
  if (!error.agreed()) wait_to_speak(participants());
  if (!error.agreed() || state.nprocs == 1 || state.engine->pid() == 0)
    print(classic_name(error.where()) + ": " + in_classic_words(error) +
          place(error.culprit(), error.superstep()));
  if (error.agreed()) state.engine->wait_for_all();  // everyone is here; let process 0 finish its message
  end_all();
}

void die(const char* function, const std::string& message) {
  std::string where;
  if (state.engine) where = place(state.engine->pid(), state.engine->superstep());
  wait_to_speak(participants());
  print(std::string(function) + ": " + message + where);
  end_all();
}

void abort_with(const char* format, va_list arguments) {
  if (!format) die("bsp_abort", "The message is NULL");
  va_list again;
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  std::string message(static_cast<std::size_t>(std::max(length, 0)) + 1, '\0');
  std::vsnprintf(message.data(), message.size(), format, again);
  va_end(again);
  message.pop_back();
  wait_to_speak(participants());
  print(message);
  end_all();
}

void not_in_spmd(const char* function) { die(function, "can only be called within SPMD section"); }

void init(void (*spmd)(void), int argc, char** argv) {
  start_mpi(&argc, &argv);
  if (state.began) die("bsp_init", "must be called before bsp_begin");
  if (state.init_called) die("bsp_init", "May be called only once");
  if (!spmd) die("bsp_init", "The function is NULL");
  state.init_called = true;
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0) return;
  spmd();
  if (!state.began) die("bsp_init", "The SPMD function did not call bsp_begin");
  if (!state.ended) die("bsp_init", "The SPMD function did not call bsp_end");
  leave();
}

void begin(long long maxprocs) {
  start_mpi(nullptr, nullptr);
  if (state.began) die("bsp_begin", "May be called only once");
  meet_before_begin(true);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Bcast(&maxprocs, 1, MPI_LONG_LONG, 0, MPI_COMM_WORLD);  // other processes may not know it yet
  if (maxprocs <= 0 && rank == 0)
    die("bsp_begin", "The number of processes must be greater than 0, it was " + std::to_string(maxprocs));
  state.began = true;
  state.nprocs = static_cast<int>(std::clamp<long long>(maxprocs, 1, world_size()));
  const bool active = rank < state.nprocs;
  MPI_Comm part = MPI_COMM_NULL;
  MPI_Comm_split(MPI_COMM_WORLD, active ? 0 : MPI_UNDEFINED, rank, &part);
  if (!active) {
    state.ended = true;
    leave();
  }
  try {
    const bsp2_runs room{bsp2_classic_puts, bsp2_classic_hpputs, bsp2_classic_gets, bsp2_classic_hpgets,
                         bsp2_classic_sends};
    state.engine = std::make_unique<detail::Engine>(part, WorldOptions::from_environment(), room, BSP2_RUNS);
  } catch (const Error& error) {
    if (!error.own()) MPI_Barrier(MPI_COMM_WORLD);  // until the process that knows more ends all
    die("bsp_begin", error.where() + ": " + error.detail());
  }
  state.engine->answer_fetches();
  if (state.engine->machine) state.machine = *state.engine->machine;
  MPI_Bcast(&state.machine, sizeof state.machine, MPI_BYTE, 0, part);  // all take the same decisions
  state.runs = state.engine->runs();
  state.with_runs = static_cast<unsigned>(state.nprocs);
}

void end() {
  detail::Engine& world = engine("bsp_end");
  guarded("bsp_end", [&] { world.close(); });
  state.with_runs = 0;
  bsp2_classic_messages = {};
  state.engine.reset();
  state.ended = true;
}

void sync(const char* function, const detail::Call& call, bool keeps_messages) {
  detail::Engine& world = engine(function);
  const detail::Place place(bsp2_here.file ? bsp2_here.file : function, bsp2_here.line);
  bsp2_here = {};
  guarded(function, [&] {
    if (keeps_messages) world.keep_first_queue();
    world.sync(call, place);
    if (keeps_messages) world.restore_first_queue();
  });
  state.next_run = state.messages_behind = state.bytes_behind = 0;
  for (const MessageRun& run : world.first_queue()) {
    state.messages_behind += run.count;
    state.bytes_behind += run.count * run.payload;
  }
  next_messages();
}

void next_messages() {
  const auto& runs = state.engine->first_queue();
  if (state.next_run == runs.size()) {
    bsp2_classic_messages = {};
    return;
  }
  const MessageRun& run = runs[state.next_run++];
  const auto* first = reinterpret_cast<const char*>(run.place);
  bsp2_classic_messages = {first,
                           first + (run.count - 1) * run.stride(),
                           run.payload,
                           wire::padded(run.payload),
                           run.tag,
                           wire::padded(run.tag),
                           0};
  state.messages_behind -= run.count;
  state.bytes_behind -= run.count * run.payload;
}

int nprocs() {
  if (state.nprocs > 0) return state.nprocs;
  start_mpi(nullptr, nullptr);
  return world_size();
}

World::Slot look_up(detail::Engine& engine, const void* address, const char* function) {
  if (state.version != engine.registry_version()) state.known.fill({});
  state.version = engine.registry_version();
  try {
    const World::Slot slot = engine.slot_of(address, function + 4);  // without "bsp_"
    known_at(address) = {address, slot};
    return slot;
  } catch (const Error& error) {
    die(error);
  }
}

}  // namespace bsp2::bsplib::classic
