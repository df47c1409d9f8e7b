#pragma once

#include <concepts>
#include <exception>
#include <span>
#include <string>
#include <utility>

#include "bsp2/bsplib/world.hpp"

namespace bsp2::bsplib {

/// The view that all ranks have on memory that they registered together: element i of rank p.
///
/// Indices are in elements and are checked against what rank p registered. Communication is complete after
/// the next sync. Thread rule and errors: as World.
template <class T>
class Distributed {
  static_assert(sizeof(detail::MustTravel<T>) > 0);

 public:
  World::Slot slot() const { return slot_; }
  std::size_t size(int pid) const {
    return world_.size_of(slot_, pid) / sizeof(T);
  }  ///< known after the next sync

  /// Writes to rank pid from element `first` on; reads the values now.
  void put(int pid, std::span<const T> values, std::size_t first) {
    put_bytes(pid, values.data(), offset_of(pid, first), values.size_bytes());
  }
  void put(int pid, const T& value, std::size_t index) {
    put_bytes(pid, &value, offset_of(pid, index), sizeof(T));
  }
  /// Reads from rank pid, from element `first` on, what will be there when all have come to the sync.
  void get(int pid, std::size_t first, std::span<T> target) {
    get_bytes(pid, offset_of(pid, first), target.data(), target.size_bytes());
  }
  void get(int pid, std::size_t index, T& target) {
    get_bytes(pid, offset_of(pid, index), &target, sizeof(T));
  }
  /// Unbuffered: values and target must be left alone until the sync is over.
  void hpput(int pid, std::span<const T> values, std::size_t first) {
    const std::size_t offset = offset_of(pid, first), bytes = values.size_bytes();
    if (BSP2_RARELY(!world_.runs_.hpput(pid, values.data(), slot_, offset, bytes)))
      world_.start_hpput(pid, values.data(), slot_, offset, bytes);
  }
  void hpget(int pid, std::size_t first, std::span<T> target) {
    const std::size_t offset = offset_of(pid, first), bytes = target.size_bytes();
    if (BSP2_RARELY(!world_.runs_.hpget(pid, slot_, offset, target.data(), bytes)))
      world_.start_hpget(pid, slot_, offset, target.data(), bytes);
  }

 protected:
  Distributed(World& world, World::Slot slot) : world_(World::Alias{}, world), slot_(slot) {}
  Distributed(Distributed&&) noexcept = default;
  Distributed& operator=(Distributed&&) = delete;
  /// Takes the registration back at the next sync.
  ~Distributed() { world_.give_back_slot(slot_); }
  /// All ranks make it of the same type.
  static World& declared(World& world) {
    world.declare<T>();
    return world;
  }

 private:
  /// Where an element begins, in bytes. The product must not wrap around.
  std::size_t offset_of(int pid, std::size_t index) const {
    if constexpr (sizeof(T) > 1)
      if (BSP2_RARELY(index > static_cast<std::size_t>(-1) / sizeof(T)))
        world_.reject_index(pid, index, size(pid));
    return index * sizeof(T);
  }
  void put_bytes(int pid, const T* values, std::size_t offset, std::size_t bytes) {
    if (BSP2_RARELY(!world_.runs_.put(pid, values, slot_, offset, bytes)))
      world_.start_put(pid, values, slot_, offset, bytes);
  }
  void get_bytes(int pid, std::size_t offset, T* target, std::size_t bytes) {
    if (BSP2_RARELY(!world_.runs_.get(pid, slot_, offset, target, bytes)))
      world_.start_get(pid, slot_, offset, target, bytes);
  }

  World world_;
  World::Slot slot_;
};

/// Registers memory of the program for as long as this object lives. Construction and destruction are
/// collective and take effect at the next sync; the memory must live that long.
template <class T>
class Registered : public Distributed<T> {
 public:
  Registered(World& world, std::span<T> local)
      : Distributed<T>(world, Distributed<T>::declared(world).push_reg(local.data(), local.size_bytes())),
        local_(local) {}

  std::span<T> local() const { return local_; }

 private:
  std::span<T> local_;
};

/// An array with a part on every rank, in memory of the layer. Parts may differ in size; elements begin as
/// zero bytes.
///
/// Construction is collective and takes effect at once. Where ranks share a node, hpput writes into this
/// memory and hpget reads from it without a transfer. The memory lives until the sync after the destruction,
/// also where the world ends before the array.
template <class T>
class Array : public Distributed<T> {
  static_assert(alignof(T) <= World::memory_alignment);

 public:
  Array(World& world, std::size_t local_size)
      : Array(world, world.allocate(checked(world, local_size)), local_size) {}

  std::span<T> local() const { return local_; }
  T& operator[](std::size_t i) const { return local_[i]; }
  T* begin() const { return local_.data(); }
  T* end() const { return local_.data() + local_.size(); }
  std::size_t size() const { return local_.size(); }
  using Distributed<T>::size;

 private:
  Array(World& world, std::pair<World::Slot, std::byte*> memory, std::size_t local_size)
      : Distributed<T>(world, memory.first), local_(reinterpret_cast<T*>(memory.second), local_size) {}

  static std::size_t checked(World& world, std::size_t size) {
    if (size > static_cast<std::size_t>(-1) / 2 / sizeof(T))
      world.fail("An array of " + detail::amount(size, "element") + " does not fit");
    Distributed<T>::declared(world);
    return size * sizeof(T);
  }

  std::span<T> local_;
};

}  // namespace bsp2::bsplib
