#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "bsp2/bsplib/world.hpp"
#include "memory/registry.hpp"
#include "memory/staging.hpp"
#include "support/copy.hpp"
#include "support/defect.hpp"
#include "support/wire.hpp"

namespace bsp2::bsplib {

/// No run is open.
inline constexpr bsp2_put_run no_put_run{nullptr, 0, 0, 0, Registry::no_id, 0, 0, 0, 0};
inline constexpr bsp2_reference_run no_reference_run{nullptr, 0, 0, nullptr, 0, Registry::no_id, 0};
inline constexpr bsp2_message_run no_message_run{nullptr, nullptr, 0, 0, 0, 0};

/// What this rank wants from or for one other rank in a superstep: a stream of records, and the data beside
/// it.
///
/// The newest put stays open as a run (run.h): puts that continue where it ends only append their bytes. So a
/// loop of small puts over neighbouring elements costs little more than one large put. Messages of one size
/// are a run, too: one record. Any other record closes the run.
class Outbox {
 public:
  struct Piece {
    const std::byte* data;
    std::size_t size;
  };
  struct Copy {
    const std::byte* source;
    std::byte* target;
    std::size_t size;
  };
  struct Wanted {
    std::byte* target;
    std::size_t size;
  };

  Outbox(Staging* staging, bsp2_put_run* run, bsp2_message_run* messages)
      : staging_(staging), run_(run), messages_(messages) {}

  /// A small put that needs no checks but these: it goes to the same registration as the newest one.
  bool put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes);
  /// @param limit size of the registered memory; the run must not pass it.
  void put(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes, std::size_t limit);
  /// Data beside the stream: staged (`where`), or in a message of its own.
  void big_put(Registry::Id slot, std::size_t offset, const std::byte* data, std::size_t bytes,
               std::size_t where);
  void get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes, std::size_t limit) {
    if (!short_get(slot, offset, target, bytes, limit)) long_get(slot, offset, target, bytes);
  }
  /// A get whose answer is a message of its own.
  void direct_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes);
  /// A put into memory of the other rank that we can reach.
  void store(const std::byte* source, std::byte* target, std::size_t bytes);
  /// A get from such memory.
  void read(const std::byte* source, std::byte* target, std::size_t bytes);
  void message(std::uint32_t queue, const std::byte* tag, std::size_t tag_bytes, const std::byte* payload,
               std::size_t bytes);
  /// One more of the queue and the sizes of the newest message.
  bool message_again(std::uint32_t queue, const std::byte* tag, std::size_t tag_bytes,
                     const std::byte* bytes_at, std::size_t bytes) {
    return queue == queue_ && tag_bytes == messages_->tag &&
           bsp2_continue_messages(messages_, tag, bytes_at, bytes) != 0;
  }
  void close_run();
  /// No record follows: gives back memory that was reserved for more.
  void finish() { staging_->shrink(block_, size_); }
  /// Forgets everything; the next stream starts as large as this one became.
  void reset();

  const std::byte* stream() const { return block_.data; }
  std::size_t stream_bytes() const { return size_; }
  std::size_t where() const { return block_.where; }

  std::vector<Piece> data;            ///< for messages of their own, in the order of their records
  std::vector<Wanted> wanted;         ///< what the gets of this stream will bring, in one reply
  std::vector<Wanted> wanted_direct;  ///< in messages of their own
  std::vector<Copy> copies;           ///< straight into and from the other rank's memory
  Staging::Block reply;               ///< where the reply will be
  std::uint32_t contents = 0, count = 0;
  std::uint64_t payload = 0;  ///< bytes of puts and messages
  std::uint64_t reply_bytes = 0, direct_bytes = 0, read_bytes = 0;

 private:
  std::byte* append(std::size_t bytes) {
    if (run_->slot != Registry::no_id || messages_in_run_ > 0) close_run();
    make_room(bytes);
    return block_.data + std::exchange(size_, size_ + bytes);
  }
  void make_room(std::size_t bytes) {
    if (size_ + bytes > block_.capacity) grow(size_ + bytes);
  }
  bool short_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes,
                 std::size_t limit);
  void long_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes);
  void want(std::byte* target, std::size_t bytes);
  void grow(std::size_t needed);
  bool prolong_run(Registry::Id slot, std::size_t offset, std::size_t bytes);
  void open_run();
  void end_run();
  void open_scattered();
  void end_scattered();
  /// Takes in what went past this object.
  void settle() { run_->end != 0 ? end_run() : end_scattered(); }
  void open_messages(const std::byte* next_payload);
  void end_messages();
  bool prolong_messages(std::uint32_t queue, std::size_t tag_bytes, const std::byte* bytes_at,
                        std::size_t bytes);
  void write_head(std::byte* place, std::size_t offset, std::size_t bytes) const;
  void write_put(std::size_t offset, const void* source, std::size_t bytes);

  static constexpr std::size_t longest_run = wire::stage_bytes - 1;

  Staging* staging_;
  Staging::Block block_;
  std::size_t size_ = 0, reserve_ = 0;
  std::size_t peak_ = 0;  ///< of the last streams, fading; private memory is taken at once in this size
  // The newest put. As long as it has a slot, puts to the same registration need few checks; as long as it
  // has a `next`, it is continued without this object, which is told at its end. As long as it has a
  // `ceiling`, others follow it without this object.
  bsp2_put_run* run_;
  // The newest message: continued without this object as long as it has a `next`.
  bsp2_message_run* messages_;
  std::uint32_t queue_ = 0;                  ///< of the messages
  std::size_t messages_at_ = 0;              ///< where their record begins
  std::size_t messages_in_run_ = 0;          ///< 0: no messages end the stream
  std::size_t first_ = 0, last_ = 0;         ///< where it begins and ends in the registration
  std::size_t limit_ = 0;                    ///< size of the registration
  std::size_t head_ = sizeof(wire::Record);  ///< size of its record without the data
};

/// The newest record becomes a run: within the registration, the stream, and what a short record can tell.
/// Capacities are multiples of 8, so the padding has room, too.
inline void Outbox::open_run() {
  const std::size_t bytes = last_ - first_, end = size_ - wire::padded(bytes) + bytes;
  run_->origin = reinterpret_cast<std::uintptr_t>(block_.data + end) - last_;
  run_->next = last_;
  run_->end = last_ + std::min({limit_ - last_, block_.capacity - end, longest_run - bytes});
}

/// Puts of single words may follow, each a record of 16 bytes.
inline void Outbox::open_scattered() {
  if (head_ != sizeof(wire::Short) || limit_ < 8) return;
  run_->origin = reinterpret_cast<std::uintptr_t>(block_.data + size_);
  run_->head = wire::Short::pack(wire::Op::short_put, 8, run_->slot);
  run_->last = last_;
  run_->limit = limit_ - 7;
  run_->ceiling = reinterpret_cast<std::uintptr_t>(block_.data + block_.capacity) - 15;
}

inline void Outbox::end_scattered() {
  if (run_->ceiling == 0) return;
  const std::size_t bytes = run_->origin - reinterpret_cast<std::uintptr_t>(block_.data + size_);
  run_->origin = run_->ceiling = 0;
  if (bytes == 0) return;
  size_ += bytes;
  payload += bytes / 2;
  count += static_cast<std::uint32_t>(bytes / 16);
  last_ = run_->last;
  first_ = last_ - 8;
}

/// Brings the newest record up to date with its run, and the end of the stream, too.
inline void Outbox::end_run() {
  const std::size_t place = size_ - wire::padded(last_ - first_);
  payload += run_->next - last_;
  last_ = std::exchange(run_->next, 0);
  run_->end = 0;
  size_ = place + wire::padded(last_ - first_);
  write_head(block_.data + place - head_, first_, last_ - first_);
}

inline void Outbox::write_head(std::byte* place, std::size_t offset, std::size_t bytes) const {
  if (head_ == sizeof(wire::Short)) {
    const wire::Short record{static_cast<std::uint32_t>(offset),
                             wire::Short::pack(wire::Op::short_put, bytes, run_->slot)};
    std::memcpy(place, &record, sizeof record);
  } else {
    const wire::Record record{run_->slot, wire::Record::pack(wire::Op::put, bytes), offset};
    std::memcpy(place, &record, sizeof record);
  }
}

inline void Outbox::write_put(std::size_t offset, const void* source, std::size_t bytes) {
  std::byte* place = block_.data + size_;
  BSP2_SOON_WRITTEN(place[1024]);
  write_head(place, offset, bytes);
  copy_bytes(place + head_, static_cast<const std::byte*>(source), bytes);
  size_ += head_ + wire::padded(bytes);
  first_ = offset;
  last_ = offset + bytes;
  payload += bytes;
  ++count;
  if (bytes == 8) open_scattered();
}

inline void Outbox::want(std::byte* target, std::size_t bytes) {
  contents |= wire::has_gets;
  wanted.push_back({target, bytes});
  reply_bytes += bytes;
  ++count;
}

inline bool Outbox::short_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes,
                              std::size_t limit) {
  if (bytes >= wire::stage_bytes || !wire::Short::can_name(slot, limit)) return false;
  const wire::Short record{static_cast<std::uint32_t>(offset),
                           wire::Short::pack(wire::Op::short_get, bytes, slot)};
  std::memcpy(append(sizeof record), &record, sizeof record);
  want(target, bytes);
  return true;
}

/// The newest message may be followed by others of its size, within the stream and what a record can count.
inline void Outbox::open_messages(const std::byte* next_payload) {
  const std::size_t begin = messages_at_ + sizeof(wire::Short);
  messages_->tag_room = wire::padded(messages_->tag);
  const std::size_t all = messages_->tag_room + wire::padded(messages_->payload);
  const std::size_t end = std::min(block_.capacity, begin + wire::Short::most_messages * all);
  if (end < size_ + all) return;
  messages_->next = reinterpret_cast<char*>(block_.data + size_);
  messages_->ceiling = reinterpret_cast<char*>(block_.data + (end - all + 1));
  messages_->ahead =
      reinterpret_cast<std::size_t>(messages_->next) - reinterpret_cast<std::size_t>(next_payload);
}

/// Brings their record up to date, and the end of the stream, too.
inline void Outbox::end_messages() {
  if (!messages_->next) return;
  const std::size_t bytes =
      static_cast<std::size_t>(messages_->next - reinterpret_cast<char*>(block_.data + size_));
  messages_->next = messages_->ceiling = nullptr;
  if (bytes == 0) return;
  const std::size_t more = bytes / (wire::padded(messages_->tag) + wire::padded(messages_->payload));
  size_ += bytes;
  messages_in_run_ += more;
  payload += more * (messages_->tag + messages_->payload);
  count += static_cast<std::uint32_t>(more);
  const auto record = wire::Short::messages(queue_, messages_->tag, messages_->payload, messages_in_run_);
  std::memcpy(block_.data + messages_at_, &record, sizeof record);
}

/// The record goes on in a larger stream.
inline bool Outbox::prolong_messages(std::uint32_t queue, std::size_t tag_bytes, const std::byte* bytes_at,
                                     std::size_t bytes) {
  if (messages_in_run_ == 0 || queue != queue_ || tag_bytes != messages_->tag || bytes != messages_->payload)
    return false;
  end_messages();
  if (messages_in_run_ == wire::Short::most_messages) return false;
  make_room(wire::padded(tag_bytes) + wire::padded(bytes));
  open_messages(bytes_at);
  return true;
}

inline void Outbox::message(std::uint32_t queue, const std::byte* tag, std::size_t tag_bytes,
                            const std::byte* bytes_at, std::size_t bytes) {
  if (prolong_messages(queue, tag_bytes, bytes_at, bytes) &&
      message_again(queue, tag, tag_bytes, bytes_at, bytes))
    return;
  const bool is_short = wire::Short::can_carry(queue, tag_bytes, bytes);
  const std::size_t head = is_short ? sizeof(wire::Short) : sizeof(wire::Record);
  std::byte* place = append(head + wire::padded(tag_bytes) + wire::padded(bytes));
  const auto at = static_cast<std::size_t>(place - block_.data);
  BSP2_SOON_WRITTEN(place[1024]);
  if (is_short) {
    const auto record = wire::Short::messages(queue, tag_bytes, bytes, 1);
    std::memcpy(place, &record, sizeof record);
  } else {
    const wire::Record record{queue, wire::Record::pack(wire::Op::message, tag_bytes), bytes};
    std::memcpy(place, &record, sizeof record);
  }
  place += head;
  if (tag_bytes > 0) copy_bytes(place, tag, tag_bytes);
  if (bytes > 0) copy_bytes(place + wire::padded(tag_bytes), bytes_at, bytes);
  contents |= wire::has_messages;
  payload += bytes + tag_bytes;
  ++count;
  if (!is_short || bytes + tag_bytes == 0) return;
  queue_ = queue;
  messages_at_ = at;
  messages_in_run_ = 1;
  messages_->tag = tag_bytes;
  messages_->payload = bytes;
  open_messages(bytes_at + bytes);
}

inline bool Outbox::put_again(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes) {
  if (slot != run_->slot || bytes - 1 >= limit_ || offset > limit_ - bytes) return false;
  settle();
  if (defect == Defect::merge_wrongly)
    if (offset == last_ + 1) --offset;
  if (offset == last_) {
    open_run();
    return bsp2_continue_put(run_, 0, 0, offset, source, bytes) != 0;
  }
  if (bytes >= wire::stage_bytes || block_.capacity - size_ < head_ + wire::padded(bytes)) return false;
  write_put(offset, source, bytes);
  return true;
}

}  // namespace bsp2::bsplib
