#include "engine/engine.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <utility>

namespace bsp2::bsplib::detail {

using wire::Header;
using wire::Kind;
using wire::Route;

namespace {

constexpr std::size_t alignment = World::memory_alignment;  // a page, where shared memory begins, has it

/// What all ranks can do. Collective.
WorldOptions agreed(MPI_Comm comm, WorldOptions options) {
  int rank = 0, size = 0;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  std::array<unsigned long long, 2> least{options.staging_bytes, static_cast<unsigned long long>(size)};
  if (options.unreadable) least[1] = static_cast<unsigned long long>(rank);
  MPI_Allreduce(MPI_IN_PLACE, least.data(), 2, MPI_UNSIGNED_LONG_LONG, MPI_MIN, comm);
  if (const int culprit = static_cast<int>(least[1]); culprit < size) {
    std::array<char, 64> value{};
    if (culprit == rank) options.unreadable->copy(value.data(), value.size() - 1);
    MPI_Bcast(value.data(), static_cast<int>(value.size()), MPI_CHAR, culprit, comm);
    throw Error(Errc::bad_argument, culprit, 0, "BSP2_STAGING_BYTES",
                "'" + std::string(value.data()) + "' is not a number of bytes between 0 and " +
                    std::to_string(WorldOptions::most_staging_bytes),
                true, culprit == rank);
  }
  options.staging_bytes = least[0];
  return options;
}

/// The ranks of a communicator, as MPI_COMM_WORLD counts them.
std::vector<int> processes_of(MPI_Comm comm) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  std::vector<int> ranks(static_cast<std::size_t>(size)), processes(ranks.size());
  std::iota(ranks.begin(), ranks.end(), 0);
  MPI_Group group = MPI_GROUP_NULL, all = MPI_GROUP_NULL;
  MPI_Comm_group(comm, &group);
  MPI_Comm_group(MPI_COMM_WORLD, &all);
  MPI_Group_translate_ranks(group, size, ranks.data(), all, processes.data());
  MPI_Group_free(&group);
  MPI_Group_free(&all);
  return processes;
}

/// What to say of the numbers in a text of another world. @param here the numbers that its ranks have here,
/// -1: none.
std::string note_on_numbers(const std::vector<int>& here) {
  constexpr std::size_t most = 16;
  std::string there, these;
  for (std::size_t i = 0; i < std::min(here.size(), most); ++i) {
    there += (i > 0 ? ", " : "") + std::to_string(i);
    these += (i > 0 ? ", " : "") + (here[i] < 0 ? "none" : std::to_string(here[i]));
  }
  if (here.size() > most) there += ", ...", these += ", ...";
  return " [numbered as in a world whose ranks " + there + " are " + these + " here]";
}

}  // namespace

Engine::Engine(MPI_Comm comm, WorldOptions options, const bsp2_runs& room, std::size_t room_ranks)
    : comm_(comm),
      options_(agreed(comm, std::move(options))),
      staging_(comm, options_.staging_bytes),
      registry_([&] {
        int size = 0;
        MPI_Comm_size(comm, &size);
        return size;
      }()) {
  MPI_Comm_rank(comm, &pid_);
  MPI_Comm_size(comm, &nprocs_);
  const auto n = static_cast<std::size_t>(nprocs_);
  runs_ = room;
  if (room_ranks < n) {
    own_puts_.resize(n);
    own_references_.resize(3 * n);
    own_messages_.resize(n);
    bsp2_reference_run* references = own_references_.data();
    runs_ = {own_puts_.data(), references, references + n, references + 2 * n, own_messages_.data()};
  }
  for (int rank = 0; rank < nprocs_; ++rank) {
    const RunsOf runs = runs_of(rank);
    runs.put = no_put_run;
    runs.hpput = runs.get = runs.hpget = no_reference_run;
    runs.send = no_message_run;
    out_.emplace_back(&staging_, &runs.put, &runs.send);
  }
  in_.resize(n);
  slots_out_.resize(n * wire::slot_bytes);
  slots_in_.resize(n * wire::slot_bytes);
  replies_out_.resize(n);
  replies_in_.resize(n);
  queues_.resize(1);
  queue_in_use_.push_back(true);
  try {
    machine = find_machine(load_machines(machine_file()), nprocs_);
  } catch (const std::runtime_error& error) {
    machine.reset();  // an unreadable file means no predictions, not the end of the program
    static bool told = false;
    if (pid_ == 0 && !std::exchange(told, true))
      std::fprintf(stderr, "bsp2::bsplib: %s; there are no predictions\n", error.what());
  }
  processes_ = std::make_shared<const std::vector<int>>(processes_of(comm));
  static std::uint64_t worlds = 0;
  number_ = ++worlds;
  living().push_back(this);
  begin_ = left_sync_ = MPI_Wtime();
  profile_ = Profile::open(comm, options_.profile, number_, begin_, machine);
}

/// All engines of this process, in the order in which they were made. One thread makes all calls. It stays to
/// the end of the process: engines that statics hold look for others when they go.
std::vector<Engine*>& Engine::living() {
  static auto* const engines = new std::vector<Engine*>;
  return *engines;
}

/// Arrays hold the engine, so their memory outlives the end of the world, but not them.
Engine::~Engine() {
  std::erase(living(), this);
  free_released(true);
}

const Header& Engine::header(int rank) const {
  return *reinterpret_cast<const Header*>(slots_in_.data() +
                                          static_cast<std::size_t>(rank) * wire::slot_bytes);
}

void Engine::fill_slots(Kind kind, std::uint64_t argument) {
  Header common;
  common.kind = kind;
  common.superstep = superstep_;
  common.pushes = registry_.pushes();
  common.pops = registry_.pops();
  common.tag_sets = tag_sets_;
  common.queues = static_cast<std::uint32_t>(queues_.size() - free_queues_.size() - closed_queues_.size());
  common.tag_size = next_tag_size_;
  common.argument = argument;
  common.types = types_;
  common.work_seconds = entered_sync_ - left_sync_;
  common.previous_h = previous_h_;
  std::string text;
  if (kind == Kind::error) {
    text = error_text();
    if (rejected_origin_ == wire::Origin::left) text.resize(std::min(text.size(), wire::inline_bytes));
    common.error_code = static_cast<std::uint32_t>(rejected_->code());
    common.error_origin = rejected_origin_;
    common.error_bytes = static_cast<std::uint32_t>(text.size());
  }
  for (int rank = 0; rank < nprocs_; ++rank) end_runs(rank);
  for (int rank = nprocs_ - 1; kind == Kind::sync && rank >= 0; --rank) out(rank).finish();
  for (int rank = 0; rank < nprocs_; ++rank) {
    std::byte* slot = slots_out_.data() + static_cast<std::size_t>(rank) * wire::slot_bytes;
    Header h = common;
    if (kind == Kind::sync && rank != pid_) {
      Outbox& box = out(rank);
      h.stream_bytes = box.stream_bytes();
      h.stream_where = box.where();
      h.contents = box.contents;
      h.copies = static_cast<std::uint32_t>(box.copies.size());
      h.read_bytes = box.read_bytes;
      h.messages = box.count;
      h.payload = box.payload;
      h.reply_bytes = box.reply_bytes;
      if (box.reply_bytes >= wire::reply_bytes && staging_.peer(rank))
        box.reply = staging_.allocate_shared(box.reply_bytes);
      h.reply_where = box.reply.where;
      h.route = h.stream_bytes == 0                                   ? Route::none
                : h.stream_bytes <= wire::inline_bytes                ? Route::in_slot
                : staging_.peer(rank) && box.where() != wire::nowhere ? Route::in_staging
                                                                      : Route::message;
      if (h.route == Route::in_slot) std::memcpy(slot + sizeof h, box.stream(), h.stream_bytes);
    }
    if (h.error_origin == wire::Origin::left) std::memcpy(slot + sizeof h, text.data(), text.size());
    std::memcpy(slot, &h, sizeof h);
  }
}

void Engine::post_slots() {
  const auto at = [](std::vector<std::byte>& slots, int rank) {
    return slots.data() + static_cast<std::size_t>(rank) * wire::slot_bytes;
  };
  constexpr int size = static_cast<int>(wire::slot_bytes);
  if (nprocs_ > few_ranks) {
    MPI_Ialltoall(slots_out_.data(), size, MPI_BYTE, slots_in_.data(), size, MPI_BYTE, comm_,
                  &requests_.emplace_back());
    return;
  }
  std::memcpy(at(slots_in_, pid_), at(slots_out_, pid_), wire::slot_bytes);
  for (int i = 1; i < nprocs_; ++i) {
    const int from = (pid_ + nprocs_ - i) % nprocs_;
    MPI_Irecv(at(slots_in_, from), size, MPI_BYTE, from, wire::tag_slot, comm_, &requests_.emplace_back());
  }
  for (int i = 1; i < nprocs_; ++i) {
    const int to = (pid_ + i) % nprocs_;
    MPI_Isend(at(slots_out_, to), size, MPI_BYTE, to, wire::tag_slot, comm_, &requests_.emplace_back());
  }
}

/// Starts, or with `wait` completes, the exchange that every collective call begins with.
void Engine::exchange(Kind kind, std::uint64_t argument, bool wait) {
  entered_sync_ = MPI_Wtime();
  if (defect == Defect::late_put)
    if (kind == Kind::sync)
      for (const auto& put : std::exchange(late_, {}))
        out(put.pid).put(put.slot, put.offset, put.source, put.bytes,
                         registry_.slot(put.slot).sizes[static_cast<std::size_t>(put.pid)]);
  fill_slots(kind, argument);
  std::atomic_thread_fence(std::memory_order_release);
  post_slots();
  phase_ = Phase::slots;
  if (wait) advance(true);
}

/// A collective call that is not a sync. On return all ranks have called the same.
void Engine::meet(Kind kind, std::uint64_t argument) {
  if (rejected_ && kind != Kind::error) tell();
  exchange(kind, argument, true);
  if (pending_) raise(*pending_);
  phase_ = Phase::idle;
  left_sync_ += MPI_Wtime() - entered_sync_;  // the work before counts as work of this superstep
}

void Engine::publish(std::string& text) const {
  if (pending_->teller == pid_) {
    text = error_text();
  } else {
    text.resize(pending_->text_bytes);
  }
  MPI_Bcast(text.data(), static_cast<int>(text.size()), MPI_BYTE, pending_->teller, comm_);
}

void Engine::raise(Verdict verdict) {
  pending_ = verdict;
  if (verdict.text_bytes > 0) {
    std::string text;
    publish(text);
    verdict.set_text(text);
  }
  phase_ = Phase::idle;
  pending_.reset();
  verdict_.emplace(verdict.code, verdict.culprit, superstep_, verdict.where, verdict.detail, true,
                   verdict.process < 0 ? verdict.culprit == pid_
                                       : verdict.process == (*processes_)[static_cast<std::size_t>(pid_)]);
  mark(*verdict_, verdict.culprit);
  if (verdict.process >= 0) verdict_->process_ = verdict.process;
  abandon_younger(*verdict_);
  throw_agreed(*verdict_);
}

void Engine::fail(const std::string& why) {
  if (verdict_) throw_verdict();
  if (!rejected_) {
    rejected_.emplace(Errc::exception, pid_, superstep_, "exception", why);
    mark(*rejected_, pid_);
    rejected_origin_ = wire::Origin::here;
  }
  tell();
}

void Engine::relay(const Error& error) {
  if (verdict_) throw_verdict();
  if (!rejected_) {
    rejected_ = as_seen_here(error);
    rejected_origin_ = !error.agreed() ? wire::Origin::here
                       : error.own()   ? wire::Origin::sub_world_culprit
                                       : wire::Origin::sub_world;
  }
  tell();
}

void Engine::mark(Error& error, int culprit) const {
  error.processes_ = processes_;
  error.process_ = (*processes_)[static_cast<std::size_t>(culprit)];
}

/// The agreed errors that were thrown and are still on their way: the worlds that the last one leaves can say
/// why.
std::vector<std::pair<Error, std::weak_ptr<const int>>>& Engine::in_flight() {
  static std::vector<std::pair<Error, std::weak_ptr<const int>>> errors;
  std::erase_if(errors, [](const auto& error) { return error.second.expired(); });
  return errors;
}

void Engine::throw_agreed(const Error& error) {
  Error thrown = error;
  thrown.flight_.token = std::make_shared<const int>(0);
  in_flight().emplace_back(error, thrown.flight_.token);
  throw thrown;
}

/// The numbers that the ranks of an error's world have in this one; -1: none. Empty if its world is unknown.
std::vector<int> Engine::numbers_here(const Error& error) const {
  std::vector<int> numbers;
  if (!error.processes_) return numbers;
  for (const int process : *error.processes_) {
    const auto found = std::ranges::find(*processes_, process);
    const bool is_here = process >= 0 && found != processes_->end();
    numbers.push_back(is_here ? static_cast<int>(found - processes_->begin()) : -1);
  }
  return numbers;
}

/// An error of another world. Its culprit becomes that rank's number here, or, if it has none, the rank that
/// tells of it. What the layer itself said names ranks of that world, and says so now.
Error Engine::as_seen_here(const Error& error) const {
  const std::vector<int> numbers = numbers_here(error);
  const auto found = std::ranges::find(*processes_, error.process_);
  const bool is_here = error.process_ >= 0 && found != processes_->end();
  const int culprit = is_here ? static_cast<int>(found - processes_->begin()) : pid_;
  std::string detail = error.detail();
  bool equal = true;
  for (std::size_t i = 0; i < numbers.size(); ++i) equal &= numbers[i] == static_cast<int>(i);
  if (!equal && error.code() != Errc::exception) detail += note_on_numbers(numbers);
  if (!is_here && error.process_ >= 0)
    detail +=
        " [by rank " + std::to_string(error.process_) + " of MPI_COMM_WORLD, which is not in this world]";
  Error seen(error.code(), culprit, superstep_, error.where(), detail, false,
             is_here ? culprit == pid_ : error.own());
  mark(seen, culprit);
  if (error.process_ >= 0) seen.process_ = error.process_;
  return seen;
}

/// This rank failed and waits here for the others. Whoever waits for it in another world would never come.
void Engine::advance_as_failed() {
  waits_as_failed_ = true;
  while (!advance(false)) dismiss_waiters();
  waits_as_failed_ = false;
}

void Engine::dismiss_waiters() {
  for (Engine* other : living()) {
    if (other->waits_as_failed_ || !other->alive()) continue;
    try {
      if (other->awaited_by_ranks_of(*this)) other->abandon(rejected_);
    } catch (const Error&) {
      // It has ended by an error of its own, which the others got, too.
    }
  }
}

/// Whether a rank that the failed world needs is in an exchange of this world that this rank has not come to.
/// Among many ranks that cannot be seen: a world that was made later than the failed one counts then.
bool Engine::awaited_by_ranks_of(const Engine& failed) {
  if (phase_ != Phase::idle && !advance(false)) return false;
  if (pending_) finish_sync();  // an error: the others wait until its text is told
  if (nprocs_ > few_ranks) return number_ > failed.number_;
  for (int rank = 0; rank < nprocs_; ++rank) {
    const auto there = std::ranges::find(*failed.processes_, (*processes_)[static_cast<std::size_t>(rank)]);
    if (rank == pid_ || there == failed.processes_->end()) continue;
    const auto rank_there = static_cast<int>(there - failed.processes_->begin());
    if (failed.has_come(rank_there)) continue;
    int waits = 0;
    MPI_Iprobe(rank, wire::tag_slot, comm_, &waits, MPI_STATUS_IGNORE);
    if (waits && !failed.has_come(rank_there)) return true;  // it may have come to both in between
  }
  return false;
}

/// Whether all that this rank waits for of another one is here.
bool Engine::has_come(int rank) const {
  if (phase_ != Phase::slots || nprocs_ > few_ranks) return false;
  const int distance = (pid_ + nprocs_ - rank) % nprocs_;
  int complete = 0;
  if (distance > 0)
    MPI_Request_get_status(requests_[static_cast<std::size_t>(distance) - 1], &complete, MPI_STATUS_IGNORE);
  return complete != 0;
}

/// The others count on the superstep that is open, and its slots are in use.
void Engine::complete_open() {
  if (phase_ == Phase::idle) return;
  advance(true);
  finish_sync();
}

void Engine::complete_open_as_failed() {
  if (phase_ == Phase::idle) return;
  advance_as_failed();
  finish_sync();
}

/// Of what this rank was refused.
void Engine::tell() {
  if (closed_) throw *rejected_;
  complete_open_as_failed();
  exchange(Kind::error, wire::pack_culprit(rejected_->culprit(), rejected_->process_), false);
  advance_as_failed();
  raise(*pending_);  // an exchange with an error in it is judged as one
}

void Engine::abandon(const std::optional<Error>& why) {
  if (!alive()) return;
  keep_alive_ = weak_from_this().lock();
  if (!rejected_ && why) rejected_ = as_seen_here(*why);
  if (!rejected_ && !in_flight().empty()) rejected_ = as_seen_here(in_flight().back().first);
  complete_open_as_failed();
  if (!rejected_) {
    rejected_.emplace(Errc::exception, pid_, superstep_, "exception",
                      "The rank left its world by an exception");
    mark(*rejected_, pid_);
  }
  const Error told = *rejected_;
  const std::size_t room = wire::inline_bytes - std::min(told.where().size() + 1, wire::inline_bytes);
  rejected_.emplace(told.code(), told.culprit(), superstep_, told.where(), told.detail().substr(0, room),
                    false, told.own());
  rejected_->processes_ = processes_;
  rejected_->process_ = told.process_;
  rejected_origin_ = wire::Origin::left;
  exchange(Kind::error, wire::pack_culprit(rejected_->culprit(), rejected_->process_), false);
  verdict_ = rejected_;  // what this rank still has of the world gets it, and waits for nobody
  abandon_younger(*rejected_);
}

/// Of a world that this rank abandoned it now learns, as the others did, whose error counts.
void Engine::throw_verdict() {
  if (phase_ == Phase::idle) throw_agreed(*verdict_);
  verdict_.reset();
  advance_as_failed();
  raise(*pending_);
}

/// What ends a world ends those that were made later of its ranks, on all of them. Others may wait there, so
/// they are told.
void Engine::abandon_younger(const Error& why) {
  for (Engine* other : living()) {
    if (other->waits_as_failed_ || !other->alive() || other->number_ <= number_) continue;
    const bool within = std::ranges::all_of(*other->processes_, [&](int process) {
      return std::ranges::find(*processes_, process) != processes_->end();
    });
    try {
      if (within) other->abandon(why);
    } catch (const Error&) {
      // It has ended by an error of its own, which its other ranks got, too.
    }
  }
}

void Engine::announce_world(MPI_Comm comm) {
  for (std::size_t i = living().size(); i-- > 0;) {
    Engine& engine = *living()[i];
    int relation = MPI_UNEQUAL;
    if (engine.alive()) MPI_Comm_compare(comm, engine.comm_, &relation);
    if (relation == MPI_UNEQUAL) continue;
    engine.complete_open();
    engine.meet(Kind::world, 0);
    return;
  }
}

void Engine::close() {
  if (closed_) return;
  if (verdict_) throw_agreed(*verdict_);
  complete_open();
  if (profile_) profile_->ends_at({"the end", 0});
  const double left = left_sync_;
  meet(Kind::end, 0);
  closed_ = true;
  if (profile_) finish_profile(left);
  if (!costs.recent.empty()) {
    std::uint64_t h = 0;
    for (int rank = 0; rank < nprocs_; ++rank) h = std::max(h, header(rank).previous_h);
    settle(costs.recent.back(), h);
  }
  clear_queues();  // their messages are in the staging memory
  staging_.release();
  if (comm_ != MPI_COMM_NULL) MPI_Comm_free(&comm_);
}

/// What followed the last superstep is the profile's last one.
void Engine::finish_profile(double left_last_sync) {
  SuperstepCost cost;
  cost.superstep = superstep_;
  cost.work_seconds = entered_sync_ - left_last_sync;
  cost.sync_seconds = MPI_Wtime() - entered_sync_;
  profile_->add(cost, entered_sync_);
  profile_->finish();
  profile_.reset();
}

std::shared_ptr<Engine> Engine::split(int color, int key) {
  check_usable("split");
  if (color < 0) reject(Errc::bad_argument, "split", "The color " + std::to_string(color) + " is negative");
  meet(Kind::split, 0);
  MPI_Comm part = MPI_COMM_NULL;
  MPI_Comm_split(comm_, color, key, &part);
  return std::make_shared<Engine>(part, options_);
}

std::pair<Registry::Id, std::byte*> Engine::allocate(std::size_t bytes) {
  check_usable("allocate");
  constexpr std::size_t address_space = std::size_t{1} << 47U;
  if (bytes >= address_space)
    reject(Errc::resource, "allocate", "No memory for " + detail::amount(bytes, "byte"));
  meet(Kind::allocate, bytes);
  Registry::Slot slot;
  for (int rank = 0; rank < nprocs_; ++rank) slot.sizes.push_back(header(rank).argument);
  slot.address = allocate_shared(slot, bytes);
  if (!slot.address) {
    const std::size_t size = bytes / alignment * alignment + alignment;
    slot.heap = static_cast<std::byte*>(std::aligned_alloc(alignment, size));
    slot.address = slot.heap;
    if (slot.heap) std::memset(slot.heap, 0, bytes);
  }
  if (!slot.address) reject(Errc::resource, "allocate", "No memory for " + detail::amount(bytes, "byte"));
  std::byte* address = slot.address;
  return {registry_.adopt(std::move(slot)), address};
}

/// Memory that the ranks of this node reach; null if there is not enough. It begins in a page where copies to
/// and from large blocks of the heap, which begin 16 bytes into theirs, are fast both ways: see copy_bytes().
std::byte* Engine::allocate_shared(Registry::Slot& slot, std::size_t bytes) {
  if (staging_.node() == MPI_COMM_NULL) return nullptr;
  slot.shared = SharedMemory(staging_.node(), bytes + alignment);
  if (slot.shared.empty()) return nullptr;
  slot.memory = parts_by_rank(comm_, staging_.node(), slot.shared);
  for (std::byte*& part : slot.memory)
    if (part) part += alignment;
  return slot.memory[static_cast<std::size_t>(pid_)];
}

void Engine::free_released(bool everything) {
  for (const auto& slot : registry_.take_released(everything)) std::free(slot.heap);
}

}  // namespace bsp2::bsplib::detail
