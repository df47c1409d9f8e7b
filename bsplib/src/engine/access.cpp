// What a superstep asks for: checked here, at the call, and put into the outboxes.
#include <cstdint>
#include <cstring>

#include "engine/engine.hpp"
#include "support/copy.hpp"

namespace bsp2::bsplib::detail {

namespace {

std::string address_of(const void* p) {
  char text[32];
  std::snprintf(text, sizeof text, "%p", p);
  return text;
}

}  // namespace

void Engine::reject(Errc code, const char* where, std::string detail) {
  if (verdict_) throw_agreed(*verdict_);
  Error error(code, pid_, superstep_, where, std::move(detail));
  mark(error, pid_);
  if (!rejected_) {
    rejected_ = error;
    rejected_origin_ = wire::Origin::here;
  }
  throw error;
}

void Engine::check_usable(const char* caller) {
  if (verdict_) throw_agreed(*verdict_);
  if (closed_) throw Error(Errc::misuse, pid_, superstep_, caller, "The world has ended");
  if (phase_ != Phase::idle)
    throw Error(Errc::misuse, pid_, superstep_, caller, "Not allowed while a superstep is open");
}

Outbox& Engine::outbox(int pid, const char* caller) {
  check_usable(caller);
  if (pid < 0 || pid >= nprocs_)
    reject(Errc::bad_argument, caller,
           "Rank " + std::to_string(pid) + " does not exist, there are " + std::to_string(nprocs_));
  return out(pid);
}

void Engine::check_range(const char* caller, const char* verb, int pid, Registry::Id slot, std::size_t offset,
                         std::size_t bytes) {
  if (!registry_.effective(slot)) reject(Errc::not_registered, caller, "Remote address is not registered");
  std::size_t size = registry_.slot(slot).sizes[static_cast<std::size_t>(pid)];
  if (size == Registry::null_size) size = 0;
  if (offset <= size && bytes <= size - offset) return;
  const std::size_t beyond = offset > size ? bytes + (offset - size) : bytes - (size - offset);
  reject(Errc::out_of_range, caller,
         std::string(verb) + " " + detail::amount(beyond, "byte") + " beyond registered range of " +
             detail::amount(size, "byte") + " at rank " + std::to_string(pid) + ": " +
             detail::amount(bytes, "byte") + " at offset " + std::to_string(offset));
}

Registry::Id Engine::slot_of(const void* address, const char* caller) {
  if (!address) reject(Errc::bad_argument, caller, "Remote memory cannot be identified by NULL");
  const Registry::Id id = registry_.find(address);
  if (id != Registry::no_id) return id;
  if (registry_.pending(address))
    reject(Errc::not_registered, caller,
           "Remote address was just registered with push_reg(" + address_of(address) +
               "), which takes effect at the next sync");
  reject(Errc::not_registered, caller, "Remote address " + address_of(address) + " was not registered");
}

void Engine::start_put(int pid, const void* source, Registry::Id slot, std::size_t offset,
                       std::size_t bytes) {
  Outbox& box = outbox(pid, "put");
  check_range("put", "Writes", pid, slot, offset, bytes);
  if (bytes == 0) return;
  if (!source) reject(Errc::bad_argument, "put", "The source is NULL");
  if (defect == Defect::late_put) {
    late_.push_back({pid, source, slot, offset, bytes});
    return;
  }
  if (bytes < wire::stage_bytes) {
    box.put(slot, offset, source, bytes, registry_.slot(slot).sizes[static_cast<std::size_t>(pid)]);
    return;
  }
  stage_put(pid, source, slot, offset, bytes);
}

void Engine::stage_put(int pid, const void* source, Registry::Id slot, std::size_t offset,
                       std::size_t bytes) {
  const Staging::Block block = staging_.allocate_data(bytes);
  copy_bytes(block.data, static_cast<const std::byte*>(source), bytes);
  out(pid).big_put(slot, offset, block.data, bytes, staging_.peer(pid) ? block.where : wire::nowhere);
}

namespace {

/// A run that a call begins, or would begin if its range exists.
bool same_memory(const bsp2_reference_run& run, Registry::Id slot, std::size_t offset, std::size_t bytes) {
  return run.slot == slot && slot != Registry::no_id && bytes <= run.end && offset <= run.end - bytes;
}

std::size_t length(const bsp2_reference_run& run) { return run.next - run.first; }

}  // namespace

void Engine::begin_run(bsp2_reference_run& run, int pid, Registry::Id slot, std::size_t offset,
                       const void* local, std::size_t bytes) {
  if (run.slot != slot) run = {nullptr, 0, size_of(slot, pid), nullptr, 0, slot, 0};
  place_run(run, offset, local, bytes);
}

void Engine::start_hpput(int pid, const void* source, Registry::Id slot, std::size_t offset,
                         std::size_t bytes) {
  if (!exists(pid) || !same_memory(runs_of(pid).hpput, slot, offset, bytes)) {
    outbox(pid, "hpput");
    check_range("hpput", "Writes", pid, slot, offset, bytes);
  }
  if (bytes == 0) return;
  if (!source) reject(Errc::bad_argument, "hpput", "The source is NULL");
  end_hpput(pid);
  bsp2_reference_run& run = runs_of(pid).hpput;
  begin_run(run, pid, slot, offset, source, bytes);
  if (bytes >= wire::store_bytes) return;
  out(pid).put(slot, offset, source, bytes, run.end);
  run.first = run.next;
}

/// Unbuffered. Pieces are combined instead, as small accesses are, where two copies through shared memory
/// beat the one that MPI makes.
bool Engine::travels_alone(const bsp2_reference_run& run, int pid) const {
  const std::size_t bytes = length(run);
  if (bytes < wire::direct_bytes) return false;
  return pid == pid_ || !run.pieced || bytes > wire::combined_bytes || !staging_.peer(pid) ||
         !staging_.has_room(bytes);
}

/// Another rank's memory of a registration, where we can reach it.
std::byte* Engine::memory_of(Registry::Id slot, int pid) const {
  const auto& memory = registry_.slot(slot).memory;
  return pid == pid_ || memory.empty() ? nullptr : memory[static_cast<std::size_t>(pid)];
}

void Engine::end_hpput(int pid) {
  bsp2_reference_run& run = runs_of(pid).hpput;
  const std::size_t bytes = length(run);
  if (bytes == 0) return;
  const std::byte* source = local_part(run);
  if (bytes < wire::store_bytes && out(pid).put_again(run.slot, run.first, source, bytes)) return;
  std::byte* const target = memory_of(run.slot, pid);
  if (target && bytes >= wire::store_bytes) {
    out(pid).store(source, target + run.first, bytes);
  } else if (travels_alone(run, pid)) {
    out(pid).big_put(run.slot, run.first, source, bytes, wire::nowhere);
  } else if (bytes >= wire::stage_bytes) {
    stage_put(pid, source, run.slot, run.first, bytes);
  } else {
    out(pid).put(run.slot, run.first, source, bytes,
                 registry_.slot(run.slot).sizes[static_cast<std::size_t>(pid)]);
  }
}

void Engine::start_get(int pid, Registry::Id slot, std::size_t offset, void* target, std::size_t bytes,
                       bool unbuffered) {
  const char* caller = unbuffered ? "hpget" : "get";
  const auto run = [&]() -> bsp2_reference_run& {
    return unbuffered ? runs_of(pid).hpget : runs_of(pid).get;
  };
  if (!exists(pid) || !same_memory(run(), slot, offset, bytes)) {
    outbox(pid, caller);
    check_range(caller, "Reads", pid, slot, offset, bytes);
  }
  if (bytes == 0) return;
  if (!target) reject(Errc::bad_argument, caller, "The destination is NULL");
  unbuffered ? end_hpget(pid) : end_get(pid);
  begin_run(run(), pid, slot, offset, target, bytes);
}

void Engine::end_get(int pid) {
  bsp2_reference_run& run = runs_of(pid).get;
  if (run.slot == Registry::no_id) return;
  out(pid).get(run.slot, run.first, local_part(run), length(run), run.end);
}

void Engine::end_hpget(int pid) {
  bsp2_reference_run& run = runs_of(pid).hpget;
  if (run.slot == Registry::no_id) return;
  const std::size_t bytes = length(run);
  std::byte* target = local_part(run);
  const std::byte* source = memory_of(run.slot, pid);
  if (source && bytes >= wire::store_bytes) {
    out(pid).read(source + run.first, target, bytes);
  } else if (pid != pid_ && travels_alone(run, pid)) {
    out(pid).direct_get(run.slot, run.first, target, bytes);
  } else {
    out(pid).get(run.slot, run.first, target, bytes, run.end);
  }
}

void Engine::end_runs(int pid) {
  end_hpput(pid);
  end_get(pid);
  end_hpget(pid);
  const RunsOf runs = runs_of(pid);
  runs.hpput = runs.get = runs.hpget = no_reference_run;
  out(pid).close_run();
}

Registry::Id Engine::push_reg(const void* address, std::size_t bytes) {
  check_usable("push_reg");
  if (bytes > static_cast<std::size_t>(PTRDIFF_MAX))
    reject(Errc::bad_argument, "push_reg",
           "No memory has " + detail::amount(bytes, "byte") + "; was the size negative?");
  return registry_.push(address, bytes);
}

void Engine::pop_reg(const void* address) {
  check_usable("pop_reg");
  if (!registry_.pop(address))
    reject(Errc::not_registered, "pop_reg",
           "memory at address " + address_of(address) + " was not registered");
}

void Engine::pop_slot(Registry::Id slot) {
  check_usable("pop_reg");
  if (!registry_.in_use(slot))
    reject(Errc::not_registered, "pop_reg", "There is no registration " + std::to_string(slot));
  registry_.pop_id(slot);
}

void Engine::give_back_slot(Registry::Id slot) noexcept {
  try {
    if (phase_ != Phase::idle && !verdict_) {
      slots_later_.push_back(slot);
    } else {
      pop_slot(slot);
    }
  } catch (const std::exception&) {
    // The world is dead or over, and the registration with it.
  }
}

void Engine::give_back_queue(std::uint32_t queue) noexcept {
  try {
    if (phase_ != Phase::idle && !verdict_) {
      queues_later_.push_back(queue);
    } else {
      close_queue(queue);
    }
  } catch (const std::exception&) {
    // The world is dead or over, and the queue with it.
  }
}

std::size_t Engine::size_of(Registry::Id slot, int pid) const {
  if (!registry_.effective(slot) || pid < 0 || pid >= nprocs_) return 0;
  const std::size_t size = registry_.slot(slot).sizes[static_cast<std::size_t>(pid)];
  return size == Registry::null_size ? 0 : size;
}

std::size_t Engine::set_tagsize(std::size_t bytes) {
  check_usable("set_tagsize");
  if (bytes > wire::max_inline_size)
    reject(Errc::bad_argument, "set_tagsize", "Tag size " + std::to_string(bytes) + " is too large");
  const std::size_t before = next_tag_size_;
  next_tag_size_ = bytes;
  ++tag_sets_;
  if (defect == Defect::early_tagsize) tag_size_ = bytes;
  return before;
}

std::uint32_t Engine::new_queue() {
  check_usable("new_queue");
  if (free_queues_.empty()) {
    queues_.emplace_back();
    queue_in_use_.push_back(true);
    return static_cast<std::uint32_t>(queues_.size() - 1);
  }
  const std::uint32_t queue = free_queues_.back();
  free_queues_.pop_back();
  queue_in_use_[queue] = true;
  return queue;
}

/// Ranks that close different queues differ in the sequence that types_ sums up.
void Engine::close_queue(std::uint32_t queue) {
  check_usable("close_queue");
  if (queue == 0 || !has_queue(queue)) reject(Errc::bad_argument, "close_queue", "There is no such queue");
  queue_in_use_[queue] = false;
  closed_queues_.push_back(queue);
  declare_type(~std::uint64_t{queue});
}

void Engine::send(std::uint32_t queue, int pid, std::span<const std::byte> tag,
                  std::span<const std::byte> payload) {
  const bool known = has_queue(queue);
  if (known && exists(pid) &&
      out(pid).message_again(queue, tag.data(), tag.size(), payload.data(), payload.size()))
    return;
  Outbox& box = outbox(pid, "send");
  if (!known) reject(Errc::bad_argument, "send", "There is no such queue");
  box.message(queue, tag.data(), tag.size(), payload.data(), payload.size());
}

std::span<const Message> Engine::messages(std::uint32_t queue) {
  if (!has_queue(queue)) reject(Errc::bad_argument, "messages", "There is no such queue");
  if (queue == 0 && queues_[0].empty())
    for (const MessageRun& run : first_queue_) run.append_to(queues_[0]);
  return queues_[queue];
}

}  // namespace bsp2::bsplib::detail
