#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/bsplib/world.hpp"
#include "engine/inbox.hpp"
#include "engine/outbox.hpp"
#include "memory/registry.hpp"
#include "memory/staging.hpp"
#include "support/defect.hpp"
#include "support/profile.hpp"
#include "support/wire.hpp"

namespace bsp2::bsplib::detail {

/// What World hides. See World for the meaning of the public functions.
///
/// Every collective call begins with the same exchange of one slot a pair of ranks. Each rank sees every
/// header, so all come to the same verdict on them without asking again. The slots travel point to point up
/// to `few_ranks`, and by MPI_Ialltoall above, whether a superstep is opened or not, so that both may meet.
class Engine : public std::enable_shared_from_this<Engine> {
 public:
  /// Takes the communicator over. @param room for the runs of so many ranks; used if it suffices for all.
  Engine(MPI_Comm comm, WorldOptions options, const bsp2_runs& room = {}, std::size_t room_ranks = 0);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  int pid() const { return pid_; }
  int nprocs() const { return nprocs_; }
  double time() const { return MPI_Wtime() - begin_; }
  std::uint64_t superstep() const { return superstep_; }
  bool failed() const { return verdict_.has_value(); }
  bool closed() const { return closed_; }
  std::uint64_t registry_version() const { return registry_.version(); }
  void wait_for_all() { MPI_Barrier(comm_); }

  const bsp2_runs& runs() const { return runs_; }

  void sync(const Call& call, Place place);
  void open_sync(Place place);
  bool advance(bool wait);
  void finish_sync();
  void close();
  /// Takes part in whatever the others do, to tell them.
  [[noreturn]] void fail(const std::string& why);
  [[noreturn]] void relay(const Error& error);
  void declare_type(std::uint64_t hash) { types_ = (types_ ^ hash) * 1099511628211U; }
  /// Tells the others that this rank has left this world and the younger ones of its ranks, but does not wait
  /// for them: they may wait for it in another world. @param why empty, if only that it was an exception is
  /// known.
  void abandon(const std::optional<Error>& why = std::nullopt);
  /// Completes a superstep that is open: the others count on it.
  void complete_open_as_failed();
  std::shared_ptr<Engine> split(int color, int key);
  /// Before a world is made of these ranks: a collective call of their newest world, if there is one. So all
  /// hear of a rank that failed, and nobody waits in MPI for a rank that does not come.
  static void announce_world(MPI_Comm comm);

  Registry::Id push_reg(const void* address, std::size_t bytes);
  void pop_reg(const void* address);
  void pop_slot(Registry::Id slot);
  void give_back_slot(Registry::Id slot) noexcept;
  void give_back_queue(std::uint32_t queue) noexcept;
  std::pair<Registry::Id, std::byte*> allocate(std::size_t bytes);
  std::size_t size_of(Registry::Id slot, int pid) const;
  Registry::Id slot_of(const void* address, const char* caller);
  void check_pid(int pid, const char* caller) { outbox(pid, caller); }

  /// What put, hpput, get and hpget do with a call that does not continue a run (run.h).
  void put(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes) {
    if (!put_again(pid, source, slot, offset, bytes)) start_put(pid, source, slot, offset, bytes);
  }
  bool put_again(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes) {
    return exists(pid) && source && out(pid).put_again(slot, offset, source, bytes);
  }
  void hpput(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes) {
    if (!hpput_again(pid, source, slot, offset, bytes)) start_hpput(pid, source, slot, offset, bytes);
  }
  /// A small one is a put, and a run only begins with what continues it: scattered ones cost what puts cost.
  bool hpput_again(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes) {
    if (!exists(pid) || runs_of(pid).hpput.slot != slot || bytes >= wire::store_bytes) return false;
    bsp2_reference_run& run = runs_of(pid).hpput;
    if (run.first != run.next) end_hpput(pid);
    run.first = run.next;
    if (!put_again(pid, source, slot, offset, bytes)) return false;
    place_run(run, offset + bytes, static_cast<const char*>(source) + bytes, 0);
    return true;
  }
  void get(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes, bool unbuffered) {
    if (!get_again(pid, slot, offset, target, bytes, unbuffered))
      start_get(pid, slot, offset, target, bytes, unbuffered);
  }
  /// One that reads the same memory as the newest one: its checks are few.
  bool get_again(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes,
                 bool unbuffered) {
    if (!exists(pid) || !target) return false;
    bsp2_reference_run& run = unbuffered ? runs_of(pid).hpget : runs_of(pid).get;
    if (run.slot != slot || bytes - 1 >= run.end || offset > run.end - bytes) return false;
    const std::size_t length = run.next - run.first;
    if (length >= (unbuffered ? wire::store_bytes : wire::stage_bytes)) return false;
    out(pid).get(slot, run.first, local_part(run), length, run.end);
    place_run(run, offset, target, bytes);
    return true;
  }

  /// Reads another rank's memory in the middle of a superstep: when that rank ends the superstep or fetches
  /// something itself, and is one that answers.
  void fetch(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes);
  /// From now on this rank answers such questions while it waits. All ranks do, or none.
  void answer_fetches() { answers_fetches_ = true; }

  std::size_t set_tagsize(std::size_t bytes);
  std::size_t tagsize() const { return tag_size_; }
  std::size_t received_tagsize() const { return received_tag_size_; }
  std::uint32_t new_queue();
  void close_queue(std::uint32_t queue);
  void send(std::uint32_t queue, int pid, std::span<const std::byte> tag, std::span<const std::byte> payload);
  std::span<const Message> messages(std::uint32_t queue);
  /// What arrived for queue 0, messages of one size together.
  const std::vector<MessageRun>& first_queue() const { return first_queue_; }

  /// The messages for queue 0 that are here, for the time after the next sync: in place of those that it
  /// brings.
  void keep_first_queue();
  void restore_first_queue();

  CostReport costs;
  std::optional<Machine> machine;

  /// Throws an error of this rank alone, and remembers it for the others.
  [[noreturn]] void reject(Errc code, const char* where, std::string detail);

 private:
  enum class Phase { idle, slots, streams, data, landed };
  struct Verdict {
    Errc code;
    int culprit;
    std::string where, detail;
    int teller = 0;                ///< whose header it is
    int process = -1;              ///< the culprit in MPI_COMM_WORLD, where the teller knows it
    std::uint32_t text_bytes = 0;  ///< > 0: the teller still has to tell the text
    /// What error_text() composed.
    void set_text(std::string_view text) {
      const auto end = text.find('\0');
      where = text.substr(0, end);
      detail = text.substr(end + 1);
    }
  };
  static constexpr int few_ranks = 32;

  // engine.cpp: the collective calls
  void start_sync(const Call& call);
  void complete_open();
  void abandon_younger(const Error& why);
  [[noreturn]] void throw_verdict();
  bool alive() const { return !closed_ && !verdict_; }
  static std::vector<Engine*>& living();
  void advance_as_failed();
  void dismiss_waiters();
  bool awaited_by_ranks_of(const Engine& failed);
  bool has_come(int rank) const;
  Error as_seen_here(const Error& error) const;
  void mark(Error& error, int culprit) const;
  static std::vector<std::pair<Error, std::weak_ptr<const int>>>& in_flight();
  [[noreturn]] static void throw_agreed(const Error& error);
  std::vector<int> numbers_here(const Error& error) const;
  [[noreturn]] void tell();
  void check_usable(const char* caller);
  void exchange(wire::Kind kind, std::uint64_t argument, bool wait);
  void meet(wire::Kind kind, std::uint64_t argument);
  void fill_slots(wire::Kind kind, std::uint64_t argument);
  void post_slots();
  const wire::Header& header(int rank) const;
  [[noreturn]] void raise(Verdict verdict);
  std::string error_text() const { return rejected_->where() + '\0' + rejected_->detail(); }
  void publish(std::string& text) const;
  std::byte* allocate_shared(Registry::Slot& slot, std::size_t bytes);
  void free_released(bool everything);
  void finish_profile(double left_last_sync);

  // verdict.cpp: judging headers
  std::optional<Verdict> judge() const;
  std::optional<Verdict> judge_errors() const;
  std::optional<Verdict> judge_kinds() const;
  std::optional<Verdict> judge_calls() const;
  std::optional<Verdict> judge_counts() const;
  template <class Get>
  std::optional<int> odd_one_out(Get&& get) const;

  // access.cpp: what a superstep asks for
  Outbox& outbox(int pid, const char* caller);
  void check_range(const char* caller, const char* verb, int pid, Registry::Id slot, std::size_t offset,
                   std::size_t bytes);
  void start_put(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes);
  void stage_put(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes);
  void start_hpput(int pid, const void* source, Registry::Id slot, std::size_t offset, std::size_t bytes);
  void start_get(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes,
                 bool unbuffered);
  static void place_run(bsp2_reference_run& run, std::size_t offset, const void* local, std::size_t bytes) {
    run.first = offset;
    run.next = offset + bytes;
    run.origin = static_cast<const char*>(local) - offset;
    run.pieced = bytes < wire::store_bytes;
  }
  /// Where it began in the memory of this rank.
  static std::byte* local_part(const bsp2_reference_run& run) {
    return reinterpret_cast<std::byte*>(const_cast<char*>(run.origin + run.first));
  }
  void begin_run(bsp2_reference_run& run, int pid, Registry::Id slot, std::size_t offset, const void* local,
                 std::size_t bytes);
  bool travels_alone(const bsp2_reference_run& run, int pid) const;
  void end_hpput(int pid);
  void end_get(int pid);
  [[nodiscard]] std::byte* memory_of(Registry::Id slot, int pid) const;
  void end_hpget(int pid);
  void end_runs(int pid);

  // delivery.cpp: the phases of a sync
  bool slots_have_come(bool wait);
  void answer_waiting_fetches();
  void receive_streams();
  void locate_stream(int rank);
  void answer_gets();
  void answer(int rank);
  void notify(int rank, int tag);
  void copy_directly();
  void exchange_data();
  void exchange_data_with(int rank);
  void exchange_registrations();
  void write_gets();
  void apply_puts();
  void deliver_messages();
  void clear_queues();
  void commit_registrations();
  void commit_queues();
  void account();
  void record(SuperstepCost cost, std::uint64_t previous_h);
  void settle(SuperstepCost& cost, std::uint64_t h);
  void next_superstep();

  bool has_queue(std::uint32_t queue) const { return queue < queues_.size() && queue_in_use_[queue]; }
  bool exists(int pid) const { return static_cast<unsigned>(pid) < static_cast<unsigned>(nprocs_); }
  struct RunsOf {
    bsp2_put_run& put;
    bsp2_reference_run &hpput, &get, &hpget;
    bsp2_message_run& send;
  };
  RunsOf runs_of(int rank) {
    return {runs_.put[rank], runs_.hpput[rank], runs_.get[rank], runs_.hpget[rank], runs_.send[rank]};
  }
  Outbox& out(int rank) { return out_[static_cast<std::size_t>(rank)]; }
  Buffer& reply_out(int rank) { return replies_out_[static_cast<std::size_t>(rank)]; }
  Buffer& reply_in(int rank) { return replies_in_[static_cast<std::size_t>(rank)]; }
  Inflow& in(int rank) { return in_[static_cast<std::size_t>(rank)]; }

  MPI_Comm comm_;
  WorldOptions options_;
  int pid_ = 0, nprocs_ = 1;
  double begin_ = 0.0, left_sync_ = 0.0, entered_sync_ = 0.0;
  std::uint64_t superstep_ = 0;
  bool closed_ = false, answers_fetches_ = false;
  std::unique_ptr<Profile> profile_;  ///< null: nobody asked for one
  Phase phase_ = Phase::idle;

  Staging staging_;
  Registry registry_;
  std::vector<Registry::Change> changes_of_all_;
  std::vector<bsp2_put_run> own_puts_;
  std::vector<bsp2_reference_run> own_references_;
  std::vector<bsp2_message_run> own_messages_;
  bsp2_runs runs_;
  std::vector<Outbox> out_;
  std::vector<Inflow> in_;
  std::vector<std::byte> slots_out_, slots_in_;
  std::vector<MPI_Request> requests_, send_requests_;
  std::vector<Buffer> replies_out_, replies_in_;
  std::vector<std::pair<std::byte*, std::size_t>> wanted_;
  std::vector<MessageRun> first_queue_;
  struct {  // of it
    std::vector<MessageRun> runs;
    Buffer data;
    std::size_t tag_size = 0;
  } kept_;
  std::vector<std::vector<Message>>
      queues_;                      ///< queue 0 is empty until somebody asks for its single messages
  std::vector<bool> queue_in_use_;  ///< by number
  std::vector<std::uint32_t> free_queues_, closed_queues_;  ///< to be given out again; at the next sync
  std::vector<Registry::Id>
      slots_later_;  ///< what was destroyed in an open superstep is given back in the next
  std::vector<std::uint32_t> queues_later_;

  std::size_t tag_size_ = 0, next_tag_size_ = 0, received_tag_size_ = 0;
  std::uint32_t tag_sets_ = 0;
  std::uint64_t types_ = 0;
  std::uint64_t previous_h_ = 0, bytes_out_ = 0, bytes_in_ = 0;

  std::optional<Error> rejected_;  ///< an error of this rank that the others do not know yet
  wire::Origin rejected_origin_ = wire::Origin::here;
  std::optional<Verdict> pending_;  ///< of the exchange that is going on
  std::optional<Error> verdict_;    ///< the agreed error that ended this world

  std::shared_ptr<const std::vector<int>> processes_;  ///< by rank: its number in MPI_COMM_WORLD
  std::uint64_t number_ = 0;                           ///< of the worlds that this process made
  bool waits_as_failed_ = false;
  std::shared_ptr<Engine>
      keep_alive_;  ///< itself, a cycle on purpose: MPI still reads a world that was abandoned

  struct LateCopy {
    int pid;
    const void* source;
    Registry::Id slot;
    std::size_t offset, bytes;
  };
  std::vector<LateCopy> late_;  ///< only with Defect::late_put
};

}  // namespace bsp2::bsplib::detail
