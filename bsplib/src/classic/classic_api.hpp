#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "bsp.h"
#include "classic/classic_state.hpp"
#include "support/copy.hpp"

/// The functions of BSPlib for one dialect, that is, for its types of process numbers and sizes.
///
/// Some messages are worded (and misspelt) as in BSPonMPI, since published conformance tests compare their
/// beginning.
namespace bsp2::bsplib::classic {

template <class Pid, class Nprocs, class Size>
struct Api {
  /// Process numbers that cannot be stay so when they become int.
  static int pid(Pid pid) {
    if constexpr (std::is_unsigned_v<Pid>)
      if (pid > static_cast<Pid>(std::numeric_limits<int>::max())) return -1;
    return static_cast<int>(pid);
  }

  /// A size without sign that no object can have was a negative one, or the difference of the wrong two.
  static bool negative(Size size) {
    if constexpr (std::is_signed_v<Size>) return size < 0;
    return static_cast<std::size_t>(size) > static_cast<std::size_t>(PTRDIFF_MAX);
  }

  static void check_access(const char* function, Size offset, Size bytes) {
    if (negative(offset)) die(function, "The offset was negative, which is illegal");
    if (negative(bytes)) die(function, "The size was negative, which is illegal");
  }

  /// Of an access of no bytes: the memory need not be registered.
  static void check_pid(detail::Engine& world, const char* function, Pid to) {
    guarded(function, [&] { world.check_pid(pid(to), function + 4); });  // without "bsp_"
  }

  template <class To>
  static To narrow(std::size_t value, const char* function, const char* what) {
    if (value > static_cast<std::size_t>(std::numeric_limits<To>::max()))
      die(function, std::string(what) + " " + std::to_string(value) + " is too large for its type");
    return static_cast<To>(value);
  }

  static void push_reg(const void* address, Size bytes) {
    auto& world = engine("bsp_push_reg");
    if (negative(bytes)) die("bsp_push_reg", "The memory size was negative, which is illegal");
    guarded("bsp_push_reg", [&] { world.push_reg(address, static_cast<std::size_t>(bytes)); });
  }

  /// Null if there is no such process.
  template <class Run>
  static Run* run_of(Run* bsp2_runs::*kind, Pid pid) {
    return static_cast<unsigned>(pid) < state.with_runs ? state.runs.*kind + pid : nullptr;
  }

  /// The run that a call began is now known by the address that the program used (run.h).
  template <class Run>
  static void name(Run* bsp2_runs::*kind, Pid to, World::Slot slot, const void* address) {
    Run& begun = *run_of(kind, to);
    if (begun.slot == slot) begun.name = address;
  }

  static void put(Pid to, const void* src, const void* dst, Size offset, Size bytes) {
    if (put_again(to, src, dst, offset, bytes)) return;
    start_put(to, src, dst, offset, bytes);
  }

  /// A scattered put, if the last one to this process went to the same memory.
  static bool put_again(Pid to, const void* src, const void* dst, Size offset, Size bytes) {
    bsp2_put_run* run = run_of(&bsp2_runs::put, to);
    if (!run || run->name != dst || negative(offset) || negative(bytes)) return false;
    const auto at = static_cast<std::size_t>(offset), size = static_cast<std::size_t>(bytes);
    return bsp2_continue_put(run, 0, 0, at, src, size) || bsp2_scatter_put(run, 0, 0, at, src, size) ||
           state.engine->put_again(static_cast<int>(to), src, run->slot, at, size);
  }

  static bool scatter_hpput(const bsp2_reference_run& run, Pid to, const void* dst, std::size_t at,
                            const void* src, std::size_t size) {
    bsp2_put_run& puts = *run_of(&bsp2_runs::put, to);
    return run.first == run.next && puts.name == dst && bsp2_scatter_put(&puts, 0, 0, at, src, size);
  }

  static bool hpput_again(Pid to, const void* src, const void* dst, Size offset, Size bytes) {
    bsp2_reference_run* run = run_of(&bsp2_runs::hpput, to);
    if (!run || run->name != dst || negative(offset) || negative(bytes)) return false;
    const auto at = static_cast<std::size_t>(offset), size = static_cast<std::size_t>(bytes);
    return bsp2_continue_reference(run, 0, 0, at, src, size) || scatter_hpput(*run, to, dst, at, src, size) ||
           state.engine->hpput_again(static_cast<int>(to), src, run->slot, at, size);
  }

  [[gnu::noinline]] static void start_put(Pid to, const void* src, const void* dst, Size offset, Size bytes) {
    auto& world = engine("bsp_put");
    check_access("bsp_put", offset, bytes);
    if (bytes == 0) return check_pid(world, "bsp_put", to);
    const auto slot = slot_of(world, dst, "bsp_put");
    guarded("bsp_put", [&] {
      world.put(pid(to), src, slot, static_cast<std::size_t>(offset), static_cast<std::size_t>(bytes));
    });
    name(&bsp2_runs::put, to, slot, dst);
  }

  static void hpput(Pid to, const void* src, const void* dst, Size offset, Size bytes) {
    if (hpput_again(to, src, dst, offset, bytes)) return;
    start_hpput(to, src, dst, offset, bytes);
  }

  [[gnu::noinline]] static void start_hpput(Pid to, const void* src, const void* dst, Size offset,
                                            Size bytes) {
    auto& world = engine("bsp_hpput");
    check_access("bsp_hpput", offset, bytes);
    if (bytes == 0) return check_pid(world, "bsp_hpput", to);
    const auto slot = slot_of(world, dst, "bsp_hpput");
    guarded("bsp_hpput", [&] {
      world.hpput(pid(to), src, slot, static_cast<std::size_t>(offset), static_cast<std::size_t>(bytes));
    });
    name(&bsp2_runs::hpput, to, slot, dst);
    name(&bsp2_runs::put, to, slot, dst);  // it was a put, if it is small
  }

  /// As put_again.
  static bool get_again(bsp2_reference_run* bsp2_runs::*kind, Pid from, const void* src, Size offset,
                        void* dst, Size bytes, bool unbuffered) {
    bsp2_reference_run* run = run_of(kind, from);
    if (!run || run->name != src || negative(offset) || negative(bytes)) return false;
    const auto at = static_cast<std::size_t>(offset), size = static_cast<std::size_t>(bytes);
    return bsp2_continue_reference(run, 0, 0, at, dst, size) ||
           state.engine->get_again(static_cast<int>(from), run->slot, at, dst, size, unbuffered);
  }

  static void get(const char* function, Pid from, const void* src, Size offset, void* dst, Size bytes,
                  bool unbuffered) {
    const auto kind = unbuffered ? &bsp2_runs::hpget : &bsp2_runs::get;
    if (get_again(kind, from, src, offset, dst, bytes, unbuffered)) return;
    start_get(function, from, src, offset, dst, bytes, unbuffered);
  }

  [[gnu::noinline]] static void start_get(const char* function, Pid from, const void* src, Size offset,
                                          void* dst, Size bytes, bool unbuffered) {
    const auto kind = unbuffered ? &bsp2_runs::hpget : &bsp2_runs::get;
    auto& world = engine(function);
    check_access(function, offset, bytes);
    if (bytes == 0) return check_pid(world, function, from);
    const auto slot = slot_of(world, src, function);
    guarded(function, [&] {
      world.get(pid(from), slot, static_cast<std::size_t>(offset), dst, static_cast<std::size_t>(bytes),
                unbuffered);
    });
    name(kind, from, slot, src);
  }

  static void direct_get(Pid from, const void* src, Size offset, void* dst, Size bytes) {
    auto& world = engine("bsp_direct_get");
    check_access("bsp_direct_get", offset, bytes);
    if (bytes == 0) return check_pid(world, "bsp_direct_get", from);
    const auto slot = slot_of(world, src, "bsp_direct_get");
    guarded("bsp_direct_get", [&] {
      world.fetch(pid(from), slot, static_cast<std::size_t>(offset), dst, static_cast<std::size_t>(bytes));
    });
  }

  static void set_tagsize(Size* bytes) {
    auto& world = engine("bsp_set_tagsize");
    if (!bytes) die("bsp_set_tagsize", "NULL ptr as argument is now allowed: it must point to the tag size");
    if (negative(*bytes)) die("bsp_set_tagsize", "Tag size may not be negative");
    guarded("bsp_set_tagsize",
            [&] { *bytes = static_cast<Size>(world.set_tagsize(static_cast<std::size_t>(*bytes))); });
  }

  static void send(Pid to, const void* tag, const void* payload, Size bytes) {
    auto& world = engine("bsp_send");
    if (pid(to) < 0 || pid(to) >= world.nprocs())
      die("bsp_send", "The source process ID does not exist: there is no process " + std::to_string(to) +
                          " to send to, there are " + std::to_string(world.nprocs()));
    if (negative(bytes)) die("bsp_send", "Payload size may not be negative");
    if (!payload && bytes != 0) die("bsp_send", "payload may not be NULL if its size is non-zero");
    if (!tag && world.tagsize() > 0) die("bsp_send", "tag may not be NULL if the tag size is non-zero");
    guarded("bsp_send", [&] {
      world.send(0, pid(to), {static_cast<const std::byte*>(tag), world.tagsize()},
                 {static_cast<const std::byte*>(payload), static_cast<std::size_t>(bytes)});
    });
  }

  static void qsize(Nprocs* count, Size* bytes) {
    engine("bsp_qsize");
    constexpr bool bytes_wanted = std::is_signed_v<Size>;  // MulticoreBSP leaves it to the program
    if (!count || (bytes_wanted && !bytes))
      die("bsp_qsize", bytes_wanted ? "both arguments may not be NULL, nor may one"
                                    : "The first argument may not be NULL");
    const bsp2_messages& front = bsp2_classic_messages;
    *count = narrow<Nprocs>(state.messages_behind + left(), "bsp_qsize", "The number of messages");
    if (bytes)
      *bytes =
          narrow<Size>(state.bytes_behind + left() * front.payload, "bsp_qsize", "The size of all messages");
  }

  /// How many messages of one size there are at the front of the queue.
  static std::size_t left() {
    const bsp2_messages& front = bsp2_classic_messages;
    if (!front.place) return 0;
    if (front.place == front.last) return 1;
    return static_cast<std::size_t>(front.last - front.place) / (front.tag_room + front.payload_room) + 1;
  }

  static const char* front_payload() { return bsp2_classic_messages.place + bsp2_classic_messages.tag_room; }

  static void drop_front() {
    bsp2_messages& front = bsp2_classic_messages;
    if (front.place == front.last)
      next_messages();
    else
      front.place = front_payload() + front.payload_room;
  }

  static void get_tag(Size* status, void* tag) {
    auto& world = engine("bsp_get_tag");
    if (!status) die("bsp_get_tag", "the first argument may not be NULL: it is where the size goes");
    const std::size_t bytes = world.received_tagsize();
    if (!tag && bytes > 0)
      die("bsp_get_tag", "tag must point to a block of available memory at least " +
                             detail::amount(bytes, "byte") + " long");
    const bsp2_messages& front = bsp2_classic_messages;
    *status = front.place ? narrow<Size>(front.payload, "bsp_get_tag", "The size of the message")
                          : static_cast<Size>(-1);
    if (front.place && bytes > 0) std::memcpy(tag, front.place, bytes);
  }

  static void move(void* payload, Size bytes) {
    engine("bsp_move");
    if (negative(bytes)) die("bsp_move", "size argument may not be negative");
    if (!payload && bytes != 0) die("bsp_move", "payload may not be NULL if reception_nbytes is non-zero");
    if (!bsp2_classic_messages.place) die("bsp_move", "Message queue was empty");
    const std::size_t size = std::min(static_cast<std::size_t>(bytes), bsp2_classic_messages.payload);
    if (size > 0)
      copy_bytes(static_cast<std::byte*>(payload), reinterpret_cast<const std::byte*>(front_payload()), size);
    drop_front();
  }

  static Size hpmove(void** tag, void** payload) {
    engine("bsp_hpmove");
    if (!tag || !payload) die("bsp_hpmove", "pointer arguments may not be NULL");
    if (!bsp2_classic_messages.place) return static_cast<Size>(-1);
    const auto size = narrow<Size>(bsp2_classic_messages.payload, "bsp_hpmove", "The size of the message");
    *tag = const_cast<char*>(bsp2_classic_messages.place);
    *payload = const_cast<char*>(front_payload());
    drop_front();
    return size;
  }
};

}  // namespace bsp2::bsplib::classic
