#include "engine/outbox.hpp"

namespace bsp2::bsplib {

using wire::Op;
using wire::Record;
using wire::Short;

void Outbox::grow(std::size_t needed) {
  const std::size_t capacity = std::max({needed, 2 * block_.capacity, reserve_, std::size_t{1024}});
  if (block_.data)
    for (const std::size_t size : {capacity, needed + wire::stage_bytes, needed})
      if (staging_->extend(block_, size)) return;
  Staging::Block larger = staging_->allocate_shared(capacity);
  if (!larger.data) larger = staging_->allocate_private(std::max(capacity, peak_));
  if (size_ > 0) {
    // NOLINTNEXTLINE(clang-analyzer-core.NonNullParamChecker): what is not empty has a block
    std::memcpy(larger.data, block_.data, size_);
  } else {
    // The other puts announce what lies 1 KiB ahead; of a stream as long as the last one, this is what they
    // cannot announce.
    for (std::size_t at = 0; at < std::min(reserve_, std::size_t{1024}); at += 64)
      BSP2_SOON_WRITTEN(larger.data[at]);
  }
  block_ = larger;
}

/// The run goes on in a larger stream, if it only ended for want of room there.
bool Outbox::prolong_run(Registry::Id slot, std::size_t offset, std::size_t bytes) {
  if (slot != run_->slot) return false;
  settle();
  if (offset != last_ || bytes > limit_ - offset || last_ - first_ + bytes > longest_run) return false;
  make_room(wire::padded(bytes) + 8);
  open_run();
  return true;
}

void Outbox::put(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes,
                 std::size_t limit) {
  if (prolong_run(slot, offset, bytes)) {
    bsp2_continue_put(run_, 0, 0, offset, source, bytes);
    return;
  }
  close_run();
  make_room(sizeof(Record) + wire::padded(bytes));
  limit_ = limit;
  head_ = Short::can_name(slot, limit) ? sizeof(Short) : sizeof(Record);
  contents |= wire::has_puts;
  run_->slot = slot;
  write_put(offset, source, bytes);
}

void Outbox::close_run() {
  if (messages_in_run_ > 0) {
    end_messages();
    *messages_ = no_message_run;
    messages_in_run_ = 0;
  }
  if (run_->slot == Registry::no_id) return;
  settle();
  *run_ = no_put_run;
  limit_ = 0;
}

void Outbox::big_put(Registry::Id slot, std::size_t offset, const std::byte* bytes_at, std::size_t bytes,
                     std::size_t where) {
  std::byte* place = append(sizeof(wire::BigPut));
  const wire::BigPut big{{slot, Record::pack(Op::big_put, 0), offset},
                         bytes,
                         where,
                         static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(bytes_at))};
  std::memcpy(place, &big, sizeof big);
  if (where == wire::nowhere) data.push_back({bytes_at, bytes});
  contents |= wire::has_big_puts;
  payload += bytes;
  ++count;
}

void Outbox::long_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes) {
  const wire::Get record{{slot, Record::pack(Op::get, 0), offset}, bytes, 0};
  std::memcpy(append(sizeof record), &record, sizeof record);
  want(target, bytes);
}

void Outbox::direct_get(Registry::Id slot, std::size_t offset, std::byte* target, std::size_t bytes) {
  const wire::Get record{{slot, Record::pack(Op::get, 0), offset}, bytes, 1};
  std::memcpy(append(sizeof record), &record, sizeof record);
  contents |= wire::has_gets;
  wanted_direct.push_back({target, bytes});
  direct_bytes += bytes;
  ++count;
}

void Outbox::store(const std::byte* source, std::byte* target, std::size_t bytes) {
  copies.push_back({source, target, bytes});
  payload += bytes;
  ++count;
}

void Outbox::read(const std::byte* source, std::byte* target, std::size_t bytes) {
  copies.push_back({source, target, bytes});
  read_bytes += bytes;
  ++count;
}

void Outbox::reset() {
  close_run();
  reserve_ = size_;
  peak_ = std::max(size_, peak_ - peak_ / 8);
  block_ = {};
  reply = {};
  size_ = 0;
  data.clear();
  wanted.clear();
  wanted_direct.clear();
  copies.clear();
  contents = count = 0;
  payload = reply_bytes = direct_bytes = read_bytes = 0;
}

}  // namespace bsp2::bsplib
