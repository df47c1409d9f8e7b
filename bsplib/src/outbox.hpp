#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "bsp2/bsplib/world.hpp"
#include "defect.hpp"
#include "registry.hpp"
#include "staging.hpp"
#include "wire.hpp"

namespace bsp2::bsplib {

/// No run is open.
inline constexpr bsp2_put_run no_put_run{nullptr, Registry::no_id, wire::nowhere, wire::nowhere, 0};
inline constexpr bsp2_reference_run no_reference_run{
    nullptr, Registry::no_id, wire::nowhere, wire::nowhere, nullptr, 0};

/// What this rank wants from or for one other rank in a superstep: a stream of records, and the data beside
/// it.
///
/// The newest put stays open as a run (run.h): puts that continue where it ends only append their bytes. So a
/// loop of small puts over neighbouring elements costs little more than one large put. Any other record
/// closes the run.
class Outbox {
 public:
  struct Piece {
    const std::byte* data;
    std::size_t size;
  };
  struct Store {
    const void* source;
    std::byte* target;
    std::size_t size;
  };
  struct Wanted {
    std::byte* target;
    std::size_t size;
  };

  Outbox(Staging* staging, bsp2_put_run* run) : staging_(staging), run_(run) {}

  /// A small put that needs no checks but these: it goes to the same registration as the newest one.
  bool put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes);
  /// @param limit size of the registered memory; the run must not pass it.
  void put(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes, std::size_t limit);
  /// Data beside the stream: staged (`where`), or in a message of its own.
  void big_put(Registry::Id slot, std::size_t offset, const std::byte* data, std::size_t bytes,
               std::size_t where);
  void get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes, std::size_t limit);
  /// A get whose answer is a message of its own.
  void direct_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes);
  void store(const void* source, std::byte* target, std::size_t bytes);
  void message(std::uint32_t queue, const std::byte* tag, std::size_t tag_bytes, const std::byte* payload,
               std::size_t bytes);
  void close_run();
  /// Forgets everything; the next stream starts as large as this one became.
  void reset();

  const std::byte* stream() const { return block_.data; }
  std::size_t stream_bytes() const { return size_; }
  std::size_t where() const { return block_.where; }

  std::vector<Piece> data;            ///< for messages of their own, in the order of their records
  std::vector<Wanted> wanted;         ///< what the gets of this stream will bring, in one reply
  std::vector<Wanted> wanted_direct;  ///< in messages of their own
  std::vector<Store> stores;          ///< to be written straight into the other rank's memory
  Staging::Block reply;               ///< where the reply will be
  std::uint32_t contents = 0, count = 0;
  std::uint64_t payload = 0;  ///< bytes of puts and messages
  std::uint64_t reply_bytes = 0, direct_bytes = 0;

 private:
  std::byte* append(std::size_t bytes);
  void make_room(std::size_t bytes);
  void grow(std::size_t needed);
  bool prolong_run(Registry::Id slot, std::size_t offset, std::size_t bytes);
  void begin_record(std::size_t start, std::size_t offset, const void* source, std::size_t bytes);
  std::size_t end_record();
  std::size_t run_bytes() const { return run_->next - first_; }
  void set_room();

  static constexpr std::size_t longest_run = wire::stage_bytes - 1;

  Staging* staging_;
  Staging::Block block_;
  std::size_t size_ = 0, reserve_ = 0;
  bsp2_put_run* run_;                        ///< the open run; it has no slot if there is none
  std::size_t record_ = 0;                   ///< where its record is in the stream,
  std::size_t first_ = 0;                    ///< and where it begins in the registration
  std::size_t limit_ = 0;                    ///< size of the registration
  std::size_t head_ = sizeof(wire::Record);  ///< size of the record without the data
};

/// How far the run may go: within the registration, the stream, and what a short record can tell. Capacities
/// are multiples of 8, so the padding has room, too.
inline void Outbox::set_room() {
  const std::size_t used = record_ + head_ + run_bytes();
  run_->end = run_->next + std::min({limit_ - run_->next, block_.capacity - used, longest_run - run_bytes()});
}

/// Begins a record with the first bytes of its run. The record itself is written at its end, and how far the
/// run may go is found out when something continues it.
inline void Outbox::begin_record(std::size_t start, std::size_t offset, const void* source,
                                 std::size_t bytes) {
  std::byte* place = block_.data + start + head_;
  if (bytes == 8) {
    std::memcpy(place, source, 8);
  } else {
    std::memcpy(place, source, bytes);
  }
  record_ = start;
  first_ = offset;
  run_->origin = reinterpret_cast<std::uintptr_t>(place) - offset;
  run_->next = run_->end = offset + bytes;
  ++count;
}

/// Writes the record of the run. @return where the next one goes.
inline std::size_t Outbox::end_record() {
  std::byte* place = block_.data + record_;
  const std::size_t bytes = run_bytes();
  if (head_ == sizeof(wire::Short)) {
    const wire::Short record{static_cast<std::uint32_t>(first_),
                             wire::Short::pack(wire::Op::short_put, bytes, run_->slot)};
    std::memcpy(place, &record, sizeof record);
  } else {
    const wire::Record record{run_->slot, wire::Record::pack(wire::Op::put, bytes), first_};
    std::memcpy(place, &record, sizeof record);
  }
  payload += bytes;
  return record_ + head_ + wire::padded(bytes);
}

inline bool Outbox::put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes) {
  if (slot != run_->slot || bytes > limit_ || offset > limit_ - bytes) return false;
  if constexpr (defect == Defect::merge_wrongly)
    if (offset == run_->next + 1) --offset;
  if (offset == run_->next) {
    set_room();
    return bsp2_continue_put(run_, offset, source, bytes) != 0;
  }
  const std::size_t end = record_ + head_ + wire::padded(run_bytes());
  if (bytes - 1 >= wire::stage_bytes - 1 || block_.capacity - end < head_ + wire::padded(bytes)) return false;
  begin_record(end_record(), offset, source, bytes);
  return true;
}

}  // namespace bsp2::bsplib
