#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "bsp2/bsplib/error.hpp"
#include "memory/shared_memory.hpp"

namespace bsp2::bsplib {

/// Registered memory of this rank, and how much of it every other rank has.
///
/// Numbers are given at the call and freed at the sync, in the order of the calls; so they agree on all ranks
/// as long as these register and pop alike, which commit() checks.
class Registry {
 public:
  using Id = std::uint32_t;
  static constexpr std::size_t null_size = ~std::size_t{0};  ///< registered as NULL
  static constexpr Id no_id = ~Id{0};

  struct Slot {
    std::byte* address = nullptr;
    std::vector<std::size_t> sizes;  ///< by rank; null_size where NULL was registered
    std::vector<std::byte*> memory;  ///< by rank: where we can write it directly; empty if nowhere
    SharedMemory shared;             ///< memory that the layer allocated
    std::byte* heap = nullptr;       ///< the same, where there is no shared memory
    std::uint64_t order = 0;         ///< age
    bool in_use = false, effective = false;
  };

  /// One registration or removal on its way to the next sync.
  struct Change {
    std::uint32_t pop = 0;
    Id id = no_id;           ///< of a pop; no_id: NULL was popped
    std::uint64_t size = 0;  ///< of a push
  };

  /// What is wrong with the changes of a superstep; the same on every rank.
  struct Problem {
    int culprit;
    std::string where, detail;
  };

  explicit Registry(int nprocs) : nprocs_(static_cast<std::size_t>(nprocs)) {}

  Id push(const void* address, std::size_t size);
  /// Removes the newest registration of an address; false if there is none.
  bool pop(const void* address);
  void pop_id(Id id);
  /// Memory of the layer: in effect at once, since its creation is collective.
  Id adopt(Slot slot);

  /// The newest registration of an address that is in effect, or no_id.
  Id find(const void* address) const;
  /// Whether an address was pushed, but no sync has come yet.
  bool pending(const void* address) const;
  const Slot& slot(Id id) const { return slots_[id]; }
  /// Whether it was pushed and its removal has not taken effect.
  bool in_use(Id id) const { return id < slots_.size() && slots_[id].in_use; }
  bool effective(Id id) const { return id < slots_.size() && slots_[id].effective; }

  const std::vector<Change>& changes() const { return changes_; }
  std::uint32_t pushes() const { return pushes_; }
  std::uint32_t pops() const { return static_cast<std::uint32_t>(changes_.size()) - pushes_; }

  /// Applies every rank's changes (`all`: rank by rank, equally many each), in sequence.
  std::optional<Problem> commit(const std::vector<Change>& all);
  /// Slots whose memory the layer allocated and whose removal has taken effect, or all of them.
  std::vector<Slot> take_released(bool everything);
  std::uint64_t version() const { return version_; }  ///< changes whenever find() may answer differently

 private:
  Id new_id();
  void free_slot(Id id);
  std::optional<Problem> resolve_pop(const std::vector<Change>& all, std::size_t index, Id& id) const;
  std::optional<Problem> resolve_null(Id& id) const;
  void apply_push(const std::vector<Change>& all, std::size_t index);

  using Stacks = std::unordered_map<const void*, std::vector<Id>>;
  static void drop(Stacks& stacks, const void* address, Id id);

  std::size_t nprocs_;
  std::vector<Slot> slots_;
  std::vector<Id> free_;
  Stacks effective_;  ///< as the running superstep sees it
  Stacks latest_;     ///< as it will be after the sync
  std::vector<Change> changes_;
  std::vector<Slot> released_;
  std::uint32_t pushes_ = 0;
  std::uint64_t order_ = 0, version_ = 1;
};

}  // namespace bsp2::bsplib
