#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "bsp2/bsplib/world.hpp"
#include "memory/registry.hpp"
#include "support/wire.hpp"

namespace bsp2::bsplib {

/// Memory that only grows, and whose contents do not outlive it.
class Buffer {
 public:
  std::byte* room(std::size_t bytes);
  std::byte* data() const { return data_.get(); }

 private:
  std::unique_ptr<std::byte[]> data_;
  std::size_t capacity_ = 0;
};

/// Messages of one size that a rank sent one after the other. They are where it staged them, or where they
/// were received.
struct MessageRun {
  int source = 0;
  std::size_t count = 0;
  const std::byte* place = nullptr;  ///< of the first: tag and payload, both padded to 8 bytes
  std::size_t tag = 0, payload = 0;  ///< bytes

  std::size_t stride() const { return wire::padded(tag) + wire::padded(payload); }
  void append_to(std::vector<Message>& messages) const;
};

/// What one rank sent us in a superstep, while it is being delivered.
struct Inflow {
  const std::byte* stream = nullptr;
  std::size_t size = 0;
  std::uint32_t contents = 0;
  const std::byte* staging = nullptr;  ///< the sender's, where we can read it
  bool own = false;                    ///< from ourselves

  struct Landing {  ///< a big put that comes in a message
    std::byte* target;
    std::size_t size;
    std::unique_ptr<std::byte[]> aside;  ///< received here, if other writes overlap it
  };
  struct Request {  ///< a get to be answered in a message of its own
    const std::byte* source;
    std::size_t size;
  };
  std::vector<Landing> landings;
  std::vector<Request> requests;

  Buffer buffer;  ///< for a stream that comes in a message

  /// Fetches the beginning of the stream, which nothing that is read before it can announce.
  void fetch_first() const;
  /// Finds the landings of the stream.
  void find_landings(const Registry& registry);
  /// Reads what the gets of the stream want: into one reply, except for the requests that it lists.
  void answer_gets(const Registry& registry, std::byte* reply);
  /// Writes the puts of the stream, in its order.
  void apply_puts(const Registry& registry);
  /// Appends the messages of the stream to their queues: those for queue 0, and those for the others.
  void deliver_to_first(int source, std::vector<MessageRun>& queue) const;
  void deliver_to_others(int source, std::vector<std::vector<Message>>& queues) const;
  void clear();

 private:
  void apply_big_put(const Registry& registry, const std::byte* place, std::size_t& landed);
};

/// Marks the landings that overlap another write of this rank: those must wait for their turn.
/// @param wanted memory that gets will write.
void set_overlapping_aside(std::vector<Inflow>& inflows, const Registry& registry,
                           const std::vector<std::pair<std::byte*, std::size_t>>& wanted);

}  // namespace bsp2::bsplib
