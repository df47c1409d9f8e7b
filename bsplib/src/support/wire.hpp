#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "bsp2/bsplib/world.hpp"

/// What travels: one fixed slot a pair of ranks in every exchange, and streams of records.
///
/// A slot is a Header and up to `inline_bytes` of a stream. A longer stream stays in the sender's staging
/// memory, where ranks of the same node read it, or follows in a message.
namespace bsp2::bsplib::wire {

inline constexpr std::size_t nowhere = ~std::size_t{0};
inline constexpr std::size_t slot_bytes = 256;

/// From here on data is staged beside the stream instead of in it.
inline constexpr std::size_t stage_bytes = std::size_t{16} << 10;
/// From here on the reply to gets is written into staging memory. Below, a message is as fast.
inline constexpr std::size_t reply_bytes = 1024;
/// From here on an unbuffered access has a message of its own. Below, combining is faster.
inline constexpr std::size_t direct_bytes = std::size_t{64} << 10;
/// Up to here unbuffered accesses that a program cut into small pieces are combined, if there is room.
inline constexpr std::size_t combined_bytes = std::size_t{1} << 20;
/// From here on an unbuffered put into memory of the layer is written straight into it.
inline constexpr std::size_t store_bytes = std::size_t{4} << 10;

enum class Kind : std::uint32_t { sync, end, allocate, split, world, error };
inline constexpr const char* kind_names[] = {"sync", "end", "allocate", "split", "World", "error"};

/// Where an error arose. Of several errors the one with the largest value counts, and of these that of the
/// lowest rank.
enum class Origin : std::uint32_t {
  sub_world,          ///< it is one of a world that was split off, where another rank caused it
  sub_world_culprit,  ///< this rank caused it there
  here,
  left  ///< here, and the rank has left: its text is in the slot, as far as it fits there
};

enum Contents : std::uint32_t { has_puts = 1, has_big_puts = 2, has_gets = 4, has_messages = 8 };
enum class Route : std::uint32_t { none, in_slot, in_staging, message };

struct Header {
  // The same to every rank: what all must agree on.
  Kind kind = Kind::sync;
  std::uint32_t error_code = 0;
  std::uint64_t superstep = 0;
  std::uint32_t pushes = 0, pops = 0;
  std::uint32_t tag_sets = 0, queues = 0;
  std::uint64_t tag_size = 0;
  std::uint64_t argument =
      0;  ///< bytes to allocate; of a sync, which collective it is part of (Call); of an error, the culprit
  std::uint64_t types = 0;  ///< of all queues and memory made so far: a hash of their sequence
  Origin error_origin = Origin::sub_world;
  std::uint32_t error_bytes = 0;  ///< length of the error's text
  double work_seconds = 0.0;
  std::uint64_t previous_h = 0;  ///< h of the superstep before, which its end could not tell
  // For the receiver alone.
  Route route = Route::none;
  std::uint32_t contents = 0;
  std::uint64_t stream_bytes = 0;
  std::uint64_t stream_where = 0;
  std::uint32_t copies =
      0;  ///< puts and gets that the sender copies to and from the receiver's memory; a notice follows them
  std::uint32_t messages = 0;
  std::uint64_t payload = 0;
  std::uint64_t read_bytes = 0;   ///< of the gets among the copies
  std::uint64_t reply_bytes = 0;  ///< that the gets of this stream want in one reply
  std::uint64_t reply_where = 0;  ///< in the sender's staging memory: where to write the reply; or `nowhere`
};
static_assert(sizeof(Header) <= 144);
inline constexpr std::size_t inline_bytes = slot_bytes - sizeof(Header);

/// Records are 8-byte aligned; the data of put and message follows its record, padded to 8 bytes.
enum class Op : std::uint32_t {
  put = 1,
  big_put = 2,
  get = 3,
  message = 4,
  short_put = 5,
  short_get = 6,
  short_messages = 7
};
inline constexpr std::size_t max_inline_size = (std::size_t{1} << 28) - 8;

struct Record {
  std::uint32_t target;   ///< registration, or queue
  std::uint32_t op_size;  ///< op in the low 4 bits; above them the size of a put, or of a message's tag
  std::uint64_t offset;   ///< in the registration; for a message, the size of its payload
  Op op() const { return static_cast<Op>(op_size & 15U); }
  std::size_t size() const { return op_size >> 4U; }
  static std::uint32_t pack(Op op, std::size_t size) {
    return static_cast<std::uint32_t>(op) | static_cast<std::uint32_t>(size << 4U);
  }
};
static_assert(sizeof(Record) == 16);

/// A put or a get that fits in fewer bits: most do. Also messages with tags and payloads of one size, one
/// after the other. Its op is where that of a Record is.
struct Short {
  static constexpr std::uint32_t target_limit = 1U << 14U;
  static constexpr std::size_t reach = std::size_t{1} << 32U;  ///< registrations up to this size

  static constexpr std::size_t most_messages = (1U << 16U) - 1;

  std::uint32_t offset;  ///< of messages, the size of a payload in the low 16 bits, and their number above
  std::uint32_t bits;    ///< op, 14 bits of the size (of messages, that of a tag), 14 bits of the target
  Op op() const { return static_cast<Op>(bits & 15U); }
  std::size_t size() const { return bits >> 4U & (target_limit - 1); }
  std::uint32_t target() const { return bits >> 18U; }
  static std::uint32_t pack(Op op, std::size_t size, std::uint32_t target) {
    return static_cast<std::uint32_t>(op) | static_cast<std::uint32_t>(size << 4U) | target << 18U;
  }
  static bool can_name(std::uint32_t target, std::size_t registered) {
    return target < target_limit && registered <= reach;
  }
  static bool can_carry(std::uint32_t queue, std::size_t tag_size, std::size_t payload) {
    return queue < target_limit && tag_size < target_limit && payload < std::size_t{1} << 16U;
  }
  static Short messages(std::uint32_t queue, std::size_t tag_size, std::size_t payload, std::size_t count) {
    return {static_cast<std::uint32_t>(count << 16U | payload), pack(Op::short_messages, tag_size, queue)};
  }
  std::size_t payload() const { return offset & 0xffffU; }
  std::size_t count() const { return offset >> 16U; }
};
static_assert(sizeof(Short) == 8 && stage_bytes <= Short::target_limit);

struct BigPut {
  Record record;
  std::uint64_t size;
  std::uint64_t where;    ///< in the sender's staging memory, or `nowhere`: a message follows
  std::uint64_t address;  ///< in the sender's address space, for puts to oneself
};

struct Get {
  Record record;
  std::uint64_t size;
  std::uint64_t direct;  ///< 1: the answer is a message of its own
};

/// As an argument of a header: the function in the high 8 bits, the queue in 24, the root in 32. Of a classic
/// program, whose queue is always the same, the root in 24 and the bytes of a value in 32.
constexpr bool is_classic(const detail::Call& call) {
  return call.function >= detail::Call::classic_broadcast;
}
constexpr std::uint64_t pack(const detail::Call& call) {
  const std::uint64_t middle =
      (is_classic(call) ? static_cast<std::uint32_t>(call.root) : call.queue) & 0xffffffU;
  const auto low =
      is_classic(call) ? static_cast<std::uint32_t>(call.bytes) : static_cast<std::uint32_t>(call.root);
  return std::uint64_t{call.function} << 56U | middle << 32U | low;
}
constexpr detail::Call unpack_call(std::uint64_t argument) {
  detail::Call call{static_cast<detail::Call::Function>(argument >> 56U), 0, 0, 0};
  const auto middle = static_cast<std::uint32_t>(argument >> 32U) & 0xffffffU,
             low = static_cast<std::uint32_t>(argument);
  if (is_classic(call)) {
    call.root = static_cast<int>(middle);
    call.bytes = low;
  } else {
    call.queue = middle;
    call.root = static_cast<int>(low);
  }
  return call;
}

/// A question for memory as it is now. The answer is the bytes.
struct Fetch {
  std::uint32_t slot;
  std::uint64_t offset, bytes;
};

/// As an argument of a header: the culprit in the world, and in MPI_COMM_WORLD (-1: unknown).
constexpr std::uint64_t pack_culprit(int culprit, int process) {
  return std::uint64_t{static_cast<std::uint32_t>(process)} << 32U | static_cast<std::uint32_t>(culprit);
}
constexpr std::pair<int, int> unpack_culprit(std::uint64_t argument) {
  return {static_cast<int>(argument & 0xffffffffU), static_cast<int>(argument >> 32U)};
}

constexpr std::size_t padded(std::size_t n) { return (n + 7) & ~std::size_t{7}; }

enum Tag : int {
  tag_slot = 1,
  tag_stream,
  tag_data,
  tag_reply,
  tag_direct_reply,
  tag_notice,
  tag_fetch,
  tag_fetched
};

}  // namespace bsp2::bsplib::wire
