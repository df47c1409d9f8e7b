// The phases of a sync. Notation: a *stream* is what one rank asks of another; *data* is what does not fit in
// streams.
//
//   slots    every pair exchanges a slot; all ranks judge the headers
//   streams  streams that are neither in a slot nor in shared staging memory arrive
//   data     gets are answered from memory as it is now, unbuffered copies are made, big puts travel
//   landed   results of gets are written, then puts in the order of ranks; messages are handed out; the next
//   superstep
#include <atomic>
#include <climits>
#include <cstring>

#include "engine/engine.hpp"
#include "support/copy.hpp"

namespace bsp2::bsplib::detail {

using wire::Header;
using wire::Kind;
using wire::Route;

namespace {

bool complete(std::vector<MPI_Request>& requests, bool wait) {
  if (requests.empty()) return true;
  int done = 1;
  const int count = static_cast<int>(requests.size());
  if (wait) {
    MPI_Waitall(count, requests.data(), MPI_STATUSES_IGNORE);
  } else {
    MPI_Testall(count, requests.data(), &done, MPI_STATUSES_IGNORE);
  }
  if (done) requests.clear();
  return done != 0;
}

constexpr std::size_t piece_bytes = std::size_t{1} << 30;  // MPI counts in int

template <class Post>
void in_pieces(std::size_t bytes, Post&& post) {
  for (std::size_t at = 0; at < bytes; at += piece_bytes)
    post(at, static_cast<int>(bytes - at < piece_bytes ? bytes - at : piece_bytes));
}

void receive(std::byte* to, std::size_t bytes, int from, int tag, MPI_Comm comm,
             std::vector<MPI_Request>& requests) {
  in_pieces(bytes, [&](std::size_t at, int count) {
    MPI_Irecv(to + at, count, MPI_BYTE, from, tag, comm, &requests.emplace_back());
  });
}

void transmit(const std::byte* data, std::size_t bytes, int to, int tag, MPI_Comm comm,
              std::vector<MPI_Request>& requests) {
  in_pieces(bytes, [&](std::size_t at, int count) {
    MPI_Isend(data + at, count, MPI_BYTE, to, tag, comm, &requests.emplace_back());
  });
}

}  // namespace

void Engine::start_sync(const Call& call) {
  if (rejected_) tell();
  exchange(Kind::sync, wire::pack(call), false);
}

void Engine::open_sync(Place place) {
  check_usable("open");
  if (profile_) profile_->ends_at(place);
  start_sync({});
  clear_queues();  // what they refer to is overwritten from now on
}

void Engine::sync(const Call& call, Place place) {
  check_usable("sync");
  if (profile_) profile_->ends_at(place);
  start_sync(call);
  advance(true);
  finish_sync();
}

/// A rank that comes later may want to read memory of this one before: it is asked for that now and then.
bool Engine::slots_have_come(bool wait) {
  if (!wait || !answers_fetches_) return complete(requests_, wait);
  constexpr int at_once = 1000;  // attempts: most syncs are over before
  for (int i = 0; i < at_once; ++i)
    if (complete(requests_, false)) return true;
  while (!complete(requests_, false)) answer_waiting_fetches();
  return true;
}

/// Those who ask wait for the answer, so it is sent at once.
void Engine::answer_waiting_fetches() {
  while (true) {
    int waits = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, wire::tag_fetch, comm_, &waits, &status);
    if (!waits) return;
    wire::Fetch question{};
    MPI_Recv(&question, sizeof question, MPI_BYTE, status.MPI_SOURCE, wire::tag_fetch, comm_,
             MPI_STATUS_IGNORE);
    const std::byte* source = registry_.slot(question.slot).address + question.offset;
    in_pieces(question.bytes, [&](std::size_t at, int count) {
      MPI_Send(source + at, count, MPI_BYTE, status.MPI_SOURCE, wire::tag_fetched, comm_);
    });
    bytes_out_ += question.bytes;
  }
}

void Engine::fetch(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes) {
  outbox(pid, "direct_get");
  check_range("direct_get", "Reads", pid, slot, offset, bytes);
  if (bytes == 0) return;
  if (!target) reject(Errc::bad_argument, "direct_get", "The destination is NULL");
  if (pid == pid_) {
    copy_bytes(static_cast<std::byte*>(target), registry_.slot(slot).address + offset, bytes);
    return;
  }
  const wire::Fetch question{slot, offset, bytes};
  std::vector<MPI_Request> requests;
  receive(static_cast<std::byte*>(target), bytes, pid, wire::tag_fetched, comm_, requests);
  MPI_Isend(&question, sizeof question, MPI_BYTE, pid, wire::tag_fetch, comm_, &requests.emplace_back());
  while (!complete(requests, false)) answer_waiting_fetches();
  bytes_in_ += bytes;
}

/// @return whether everything has arrived, or the superstep has failed.
bool Engine::advance(bool wait) {
  if (verdict_) return true;  // of a rank that has left: it does not wait
  if (phase_ == Phase::slots) {
    if (!slots_have_come(wait)) return false;
    if (profile_) profile_->all_are_here(MPI_Wtime());
    std::atomic_thread_fence(std::memory_order_acquire);
    pending_ = judge();
    phase_ = Phase::landed;
    if (pending_ || header(pid_).kind != Kind::sync) return true;
    phase_ = Phase::streams;
    receive_streams();
  }
  if (phase_ == Phase::streams) {
    if (!complete(requests_, wait)) return false;
    for (int rank = 0; rank < nprocs_; ++rank) in(rank).find_landings(registry_);
    if (defect == Defect::gets_after_puts) apply_puts();
    answer_gets();
    copy_directly();
    exchange_data();
    phase_ = Phase::data;
  }
  if (phase_ == Phase::data) {
    if (!complete(requests_, wait) || !complete(send_requests_, wait)) return false;
    std::atomic_thread_fence(std::memory_order_acquire);
    phase_ = Phase::landed;
  }
  return true;
}

void Engine::finish_sync() {
  if (verdict_) throw_agreed(*verdict_);  // fail() has ended an open superstep
  if (phase_ == Phase::idle) return;      // the end of the world has
  if (pending_) raise(*pending_);
  write_gets();
  if (defect != Defect::gets_after_puts) apply_puts();
  deliver_messages();
  commit_registrations();
  commit_queues();
  account();
  next_superstep();
}

void Engine::locate_stream(int rank) {
  Inflow& inflow = in(rank);
  inflow.own = rank == pid_;
  if (inflow.own) {
    inflow.stream = out(rank).stream();
    inflow.size = out(rank).stream_bytes();
    inflow.contents = out(rank).contents;
    return;
  }
  const Header& h = header(rank);
  inflow.size = h.stream_bytes;
  inflow.contents = h.contents;
  inflow.staging = staging_.peer(rank);
  if (h.route == Route::in_slot) {
    inflow.stream = slots_in_.data() + static_cast<std::size_t>(rank) * wire::slot_bytes + sizeof(Header);
  } else if (h.route == Route::in_staging) {
    inflow.stream = inflow.staging + h.stream_where;
    inflow.fetch_first();
  } else if (h.route == Route::message) {
    std::byte* room = inflow.buffer.room(inflow.size);
    inflow.stream = room;
    receive(room, inflow.size, rank, wire::tag_stream, comm_, requests_);
  }
}

void Engine::receive_streams() {
  for (int rank = 0; rank < nprocs_; ++rank) locate_stream(rank);
  for (int rank = 0; rank < nprocs_; ++rank) {
    if (rank == pid_) continue;
    const Outbox& box = out(rank);
    if (box.stream_bytes() > wire::inline_bytes && !(staging_.peer(rank) && box.where() != wire::nowhere))
      transmit(box.stream(), box.stream_bytes(), rank, wire::tag_stream, comm_, send_requests_);
  }
}

/// Reads what others get from here, before anything is written.
void Engine::answer_gets() {
  for (int rank = 0; rank < nprocs_; ++rank)
    if (in(rank).contents & wire::has_gets) answer(rank);
}

void Engine::answer(int rank) {
  Inflow& inflow = in(rank);
  const bool own = rank == pid_;
  const std::uint64_t bytes = own ? out(rank).reply_bytes : header(rank).reply_bytes;
  const bool staged = !own && header(rank).reply_where != wire::nowhere;
  Buffer& buffer = own ? reply_in(rank) : reply_out(rank);
  std::byte* reply = staged ? staging_.peer(rank) + header(rank).reply_where : buffer.room(bytes);
  inflow.answer_gets(registry_, reply);
  if (own) return;
  bytes_out_ += bytes;
  for (const auto& request : inflow.requests) {
    bytes_out_ += request.size;
    transmit(request.source, request.size, rank, wire::tag_direct_reply, comm_, send_requests_);
  }
  if (staged) {
    notify(rank, wire::tag_reply);
  } else {
    transmit(reply, bytes, rank, wire::tag_reply, comm_, send_requests_);
  }
}

/// Tells a rank that what we copy to and from its memory is done.
void Engine::notify(int rank, int tag) {
  std::atomic_thread_fence(std::memory_order_release);
  MPI_Isend(nullptr, 0, MPI_BYTE, rank, tag, comm_, &send_requests_.emplace_back());
}

/// Unbuffered puts into and gets from memory that we can reach. The other rank is in its sync, since its slot
/// is here, and stays there until it has our notice.
void Engine::copy_directly() {
  for (int rank = 0; rank < nprocs_; ++rank) {
    if (out(rank).copies.empty()) continue;
    for (const auto& copy : out(rank).copies) copy_bytes(copy.target, copy.source, copy.size);
    notify(rank, wire::tag_notice);
  }
}

void Engine::exchange_data() {
  bool landing = false;
  for (const Inflow& inflow : in_) landing |= !inflow.landings.empty();
  wanted_.clear();
  if (landing) {
    for (const Outbox& box : out_)
      for (const auto* list : {&box.wanted, &box.wanted_direct})
        for (const auto& wanted : *list) wanted_.emplace_back(wanted.target, wanted.size);
    set_overlapping_aside(in_, registry_, wanted_);
  }
  for (int rank = 0; rank < nprocs_; ++rank)
    if (rank != pid_) exchange_data_with(rank);
  exchange_registrations();
}

/// As many on all ranks, and they stay as they are until the superstep is complete.
void Engine::exchange_registrations() {
  const auto& mine = registry_.changes();
  if (mine.empty()) return;
  changes_of_all_.resize(mine.size() * static_cast<std::size_t>(nprocs_));
  const int bytes = static_cast<int>(mine.size() * sizeof(Registry::Change));
  MPI_Iallgather(mine.data(), bytes, MPI_BYTE, changes_of_all_.data(), bytes, MPI_BYTE, comm_,
                 &requests_.emplace_back());
}

void Engine::exchange_data_with(int rank) {
  if (header(rank).copies > 0)
    MPI_Irecv(nullptr, 0, MPI_BYTE, rank, wire::tag_notice, comm_, &requests_.emplace_back());
  for (auto& landing : in(rank).landings)
    receive(landing.aside ? landing.aside.get() : landing.target, landing.size, rank, wire::tag_data, comm_,
            requests_);
  for (const auto& piece : out(rank).data)
    transmit(piece.data, piece.size, rank, wire::tag_data, comm_, send_requests_);
  for (const auto& wanted : out(rank).wanted_direct)
    receive(wanted.target, wanted.size, rank, wire::tag_direct_reply, comm_, requests_);
  const std::size_t bytes = out(rank).reply_bytes;
  if (out(rank).reply.where != wire::nowhere) {
    MPI_Irecv(nullptr, 0, MPI_BYTE, rank, wire::tag_reply, comm_, &requests_.emplace_back());
  } else {
    receive(reply_in(rank).room(bytes), bytes, rank, wire::tag_reply, comm_, requests_);
  }
}

void Engine::write_gets() {
  for (int rank = 0; rank < nprocs_; ++rank) {
    const Outbox& box = out(rank);
    const std::byte* reply = box.reply.where != wire::nowhere ? box.reply.data : reply_in(rank).data();
    for (const auto& wanted : box.wanted) {
      copy_bytes(wanted.target, reply, wanted.size);
      reply += wanted.size;
    }
  }
}

void Engine::apply_puts() {
  if (defect == Defect::puts_in_reverse) {
    for (int rank = nprocs_ - 1; rank >= 0; --rank) in(rank).apply_puts(registry_);
  } else {
    for (Inflow& inflow : in_) inflow.apply_puts(registry_);
  }
}

/// Queue 0 is in descending order of ranks, which classic programs have come to expect; the others ascend.
void Engine::deliver_messages() {
  clear_queues();
  for (int rank = nprocs_ - 1; rank >= 0; --rank) in(rank).deliver_to_first(rank, first_queue_);
  for (int rank = 0; queues_.size() > 1 && rank < nprocs_; ++rank) in(rank).deliver_to_others(rank, queues_);
}

void Engine::clear_queues() {
  first_queue_.clear();
  for (auto& queue : queues_) queue.clear();
}

void Engine::keep_first_queue() {
  kept_.runs = first_queue_;
  kept_.tag_size = received_tag_size_;
  std::size_t bytes = 0;
  for (const MessageRun& run : kept_.runs) bytes += run.count * run.stride();
  std::byte* place = kept_.data.room(bytes);
  for (MessageRun& run : kept_.runs) {
    const std::size_t size = run.count * run.stride();
    if (size > 0) std::memcpy(place, run.place, size);
    run.place = place;
    place += size;
  }
}

void Engine::restore_first_queue() {
  first_queue_ = kept_.runs;
  received_tag_size_ = kept_.tag_size;
}

void Engine::commit_registrations() {
  if (!registry_.changes().empty()) {
    if (auto problem = registry_.commit(changes_of_all_))
      raise({Errc::registration_mismatch, problem->culprit, "sync/" + problem->where, problem->detail});
    free_released(false);
  }
  received_tag_size_ = tag_size_;
  tag_size_ = next_tag_size_;
  tag_sets_ = 0;
}

/// What was sent to a queue before it was closed is lost.
void Engine::commit_queues() {
  for (const std::uint32_t queue : closed_queues_) queues_[queue].clear();
  free_queues_.insert(free_queues_.end(), closed_queues_.begin(), closed_queues_.end());
  closed_queues_.clear();
}

void Engine::account() {
  SuperstepCost cost;
  cost.superstep = superstep_;
  cost.work_seconds = entered_sync_ - left_sync_;
  std::uint64_t previous_h = previous_h_;
  for (int rank = 0; rank < nprocs_; ++rank) {
    const Header& h = header(rank);
    cost.max_work_seconds = std::max(cost.max_work_seconds, h.work_seconds);
    previous_h = std::max(previous_h, h.previous_h);
    if (rank == pid_) continue;
    cost.messages_out += out(rank).count;
    cost.messages_in += h.messages;
    bytes_out_ += out(rank).payload + h.read_bytes;
    bytes_in_ += h.payload + out(rank).reply_bytes + out(rank).direct_bytes + out(rank).read_bytes;
  }
  cost.bytes_out = bytes_out_;
  cost.bytes_in = bytes_in_;
  cost.h_bytes = previous_h_ = std::max(bytes_out_, bytes_in_);
  left_sync_ = MPI_Wtime();
  cost.sync_seconds = left_sync_ - entered_sync_;
  record(cost, previous_h);
  if (profile_ && profile_->add(cost, entered_sync_))
    left_sync_ = MPI_Wtime();  // which is no work of the program
}

/// Sets h of a superstep, and what follows from it.
void Engine::settle(SuperstepCost& cost, std::uint64_t h) {
  if (cost.predicted_seconds) costs.predicted_seconds -= *cost.predicted_seconds;
  cost.h_bytes = h;
  if (machine) cost.predicted_seconds = predict(cost, *machine);
  if (cost.predicted_seconds) costs.predicted_seconds += *cost.predicted_seconds;
}

void Engine::record(SuperstepCost cost, std::uint64_t previous_h) {
  if (!costs.recent.empty()) settle(costs.recent.back(), previous_h);
  settle(cost, cost.h_bytes);
  ++costs.supersteps;
  costs.work_seconds += cost.work_seconds;
  costs.sync_seconds += cost.sync_seconds;
  costs.bytes_out += cost.bytes_out;
  costs.bytes_in += cost.bytes_in;
  costs.messages_out += cost.messages_out;
  costs.messages_in += cost.messages_in;
  costs.recent.push_back(cost);
  if (costs.recent.size() > std::max<std::size_t>(options_.kept_costs, 1)) costs.recent.pop_front();
}

void Engine::next_superstep() {
  for (Inflow& inflow : in_) inflow.clear();
  for (Outbox& box : out_) box.reset();
  staging_.flip();
  bytes_out_ = bytes_in_ = 0;
  ++superstep_;
  phase_ = Phase::idle;
  for (const Registry::Id slot : std::exchange(slots_later_, {})) give_back_slot(slot);
  for (const std::uint32_t queue : std::exchange(queues_later_, {})) give_back_queue(queue);
}

}  // namespace bsp2::bsplib::detail
