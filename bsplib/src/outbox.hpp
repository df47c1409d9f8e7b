#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "defect.hpp"
#include "registry.hpp"
#include "staging.hpp"
#include "wire.hpp"

namespace bsp2::bsplib {

/// What this rank wants from or for one other rank in a superstep: a stream of records, and the data beside
/// it.
///
/// The newest put stays open as a *run*: puts that continue where it ends only append their bytes. So a loop
/// of small puts over neighbouring elements costs little more than one large put.
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

  explicit Outbox(Staging* staging) : staging_(staging) {}

  /// Appends to the run, if the put continues it.
  bool continue_run(Registry::Id slot, std::size_t offset, const void* source, std::size_t bytes) {
    constexpr std::size_t gap = defect == Defect::merge_wrongly ? 1 : 0;
    if (slot != run_slot_ || offset - run_next_ > gap || bytes > run_left_) return false;
    copy(run_tail_, source, bytes);
    run_tail_ += bytes;
    run_next_ += bytes;
    run_left_ -= bytes;
    return true;
  }
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
  static void copy(std::byte* to, const void* from, std::size_t bytes) {
    if (bytes == 8) {
      std::memcpy(to, from, 8);
    } else if (bytes > 0) {
      std::memcpy(to, from, bytes);
    }
  }
  std::byte* append(std::size_t bytes);
  void grow(std::size_t needed);
  bool prolong_run(Registry::Id slot, std::size_t offset, std::size_t bytes, std::size_t limit);
  void set_room(std::size_t limit);
  bool extend_get(Registry::Id slot, std::size_t offset, const std::byte* target, std::size_t bytes);

  Staging* staging_;
  Staging::Block block_;
  std::size_t size_ = 0, reserve_ = 0;
  std::size_t last_get_ = 0;  ///< end of the newest get in the stream
  // The open run. run_slot_ is no_id if there is none.
  Registry::Id run_slot_ = Registry::no_id;
  std::size_t run_next_ = 0, run_left_ = 0;
  std::byte* run_tail_ = nullptr;
  std::size_t run_start_ = 0;  ///< of its record in the stream
};

}  // namespace bsp2::bsplib
