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

/// What this rank wants from or for one other rank in a superstep: a stream of records, and the data beside
/// it.
///
/// The newest put stays open as a *run*: puts that continue where it ends only append their bytes. So a loop
/// of small puts over neighbouring elements costs little more than one large put. Any other record closes the
/// run.
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
    Registry::Id slot;
    std::size_t offset_end;
    std::byte* target;
    std::size_t size;
    bool direct;
  };

  Outbox(Staging* staging, detail::Run* run) : staging_(staging), run_(run) {}

  /// A small put that needs no checks but these: it continues the run, or goes to the same registration.
  bool put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes);
  /// @param limit size of the registered memory; the run must not pass it.
  void put(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes, std::size_t limit);
  /// Data beside the stream: staged (`where`), or in a message of its own.
  void big_put(Registry::Id slot, std::size_t offset, const std::byte* data, std::size_t bytes,
               std::size_t where);
  void get(Registry::Id slot, std::size_t offset, void* target, std::size_t bytes, bool direct);
  void store(const void* source, std::byte* target, std::size_t bytes);
  void message(std::uint32_t queue, const std::byte* tag, std::size_t tag_bytes, const std::byte* payload,
               std::size_t bytes);
  void close_run();
  /// Forgets everything; the next stream starts as large as this one became.
  void reset();

  const std::byte* stream() const { return block_.data; }
  std::size_t stream_bytes() const { return size_; }
  std::size_t where() const { return block_.where; }

  std::vector<Piece> data;     ///< for messages of their own, in the order of their records
  std::vector<Wanted> wanted;  ///< what the gets of this stream will bring
  std::vector<Store> stores;   ///< to be written straight into the other rank's memory
  std::uint32_t contents = 0, count = 0;
  std::uint64_t payload = 0;  ///< bytes of puts and messages
  std::uint64_t wanted_bytes = 0;

 private:
  std::byte* append(std::size_t bytes);
  void make_room(std::size_t bytes);
  void grow(std::size_t needed);
  bool extend_get(Registry::Id slot, std::size_t offset, const std::byte* target, std::size_t bytes);
  bool prolong_run(Registry::Id slot, std::size_t offset, std::size_t bytes);
  std::size_t run_bytes() const {
    return static_cast<std::size_t>(run_->tail - block_.data) - run_start_ - head_;
  }
  void begin_record(std::size_t start, std::size_t offset, const void* source, std::size_t bytes);
  std::size_t end_record();
  void set_room();

  static constexpr std::size_t head = sizeof(wire::Record);
  static constexpr std::size_t longest_run = wire::stage_bytes - 1;

  Staging* staging_;
  Staging::Block block_;
  std::size_t size_ = 0, reserve_ = 0;
  std::size_t last_get_ = 0;   ///< end of the newest get in the stream
  detail::Run* run_;           ///< the open run; it has no slot if there is none
  std::size_t run_start_ = 0;  ///< of its record in the stream
  std::size_t limit_ = 0;      ///< size of its registration
  std::size_t head_ = head;    ///< size of its record
};

/// How far the run may go: within the registration, the stream, and what a short record can tell. Capacities
/// are multiples of 8, so the padding has room, too.
inline void Outbox::set_room() {
  const auto room = static_cast<std::size_t>(block_.data + block_.capacity - run_->tail);
  run_->end = run_->tail + std::min({limit_ - run_->next(), room, longest_run - run_bytes()});
}

/// Begins a record with the first bytes of its run, at `start` of the stream. The record itself is written at
/// its end.
inline void Outbox::begin_record(std::size_t start, std::size_t offset, const void* source,
                                 std::size_t bytes) {
  std::byte* place = block_.data + start + head_;
  if (bytes == 8) {
    std::memcpy(place, source, 8);
  } else {
    std::memcpy(place, source, bytes);
  }
  run_start_ = start;
  run_->origin = reinterpret_cast<std::uintptr_t>(place) - offset;
  run_->tail = place + bytes;
  set_room();
  ++count;
}

/// Writes the record of the run. @return where the next one goes.
inline std::size_t Outbox::end_record() {
  std::byte* place = block_.data + run_start_;
  const std::size_t bytes = run_bytes();
  const std::size_t offset = reinterpret_cast<std::uintptr_t>(place + head_) - run_->origin;
  if (head_ == sizeof(wire::ShortPut)) {
    const wire::ShortPut record{static_cast<std::uint32_t>(offset), wire::ShortPut::pack(bytes, run_->slot)};
    std::memcpy(place, &record, sizeof record);
  } else {
    const wire::Record record{run_->slot, wire::Record::pack(wire::Op::put, bytes), offset};
    std::memcpy(place, &record, sizeof record);
  }
  payload += bytes;
  return run_start_ + head_ + wire::padded(bytes);
}

inline bool Outbox::put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes) {
  if (run_->append(slot, offset, source, bytes)) return true;
  if (slot != run_->slot || bytes > limit_ || offset > limit_ - bytes) return false;
  if constexpr (defect == Defect::merge_wrongly)
    if (offset == run_->next() + 1 && bytes <= run_->left())
      return run_->append(slot, run_->next(), source, bytes);
  const std::size_t end = run_start_ + head_ + wire::padded(run_bytes());
  if (offset == run_->next() || bytes == 0 || bytes >= wire::stage_bytes ||
      block_.capacity - end < head_ + wire::padded(bytes))
    return false;
  begin_record(end_record(), offset, source, bytes);
  return true;
}

}  // namespace bsp2::bsplib
