#pragma once

#include <array>
#include <bit>
#include <boost/archive/binary_iarchive.hpp>
#include <boost/archive/binary_oarchive.hpp>
#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/back_inserter.hpp>
#include <boost/iostreams/stream.hpp>
#include <concepts>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "bsp2/bsplib/world.hpp"

namespace bsp2::bsplib {

/// Types that can be messages: those whose bytes are their value, and objects that Boost.Serialization
/// archives (also those of the first kind that have a public `serialize`). Pointers, references and arrays
/// are refused, they would arrive as something else.
template <class T>
concept Sendable = Travels<T> ||(std::is_class_v<T> && !std::is_const_v<T> && std::default_initializable<T> &&
                                 std::movable<T> && !detail::HoldsPointer<T>::value);

namespace detail {

/// Says why a type cannot be a message.
template <class T>
struct MustBeSendable {
  static_assert(
      !HoldsPointer<T>::value,
      "bsp2: pointers, references, and views, arrays, pairs or tuples of them mean nothing on another rank");
  static_assert(!std::is_const_v<T>, "bsp2: a queue has no constant messages");
  static_assert(Travels<T> || HoldsPointer<T>::value || std::is_class_v<T>,
                "bsp2: send an array in an std::array or an std::vector");
  static_assert(
      Travels<T> || !std::is_class_v<T> || std::default_initializable<T>,
      "bsp2: a message that is archived needs a default constructor, since it is made before it is read");
  static_assert(Travels<T> || !std::is_class_v<T> || std::is_const_v<T> || std::movable<T>,
                "bsp2: a message must be movable");
};

/// A class that says itself how it is archived: its bytes are not its value.
template <class T>
concept ArchivesItself = requires(T& value, boost::archive::binary_oarchive& archive) {
  value.serialize(archive, 0U);
};
template <class T>
concept TravelsAsBytes = Travels<T> && !ArchivesItself<T>;

constexpr unsigned archive_flags = boost::archive::no_header;

template <class T>
void write_archive(std::vector<char>& bytes, const T& value) {
  namespace io = boost::iostreams;
  bytes.clear();
  io::stream<io::back_insert_device<std::vector<char>>> stream(bytes);
  boost::archive::binary_oarchive(stream, archive_flags) << value;
  stream.flush();
}

template <class T>
T read_archive(std::span<const std::byte> bytes) {
  namespace io = boost::iostreams;
  io::stream<io::array_source> stream(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  T value;
  boost::archive::binary_iarchive(stream, archive_flags) >> value;
  return value;
}

/// The number of a queue as long as it lives. It is given back at the sync after that.
class QueueNumber {
 public:
  explicit QueueNumber(World& world) : world_(World::Alias{}, world), number_(world.new_queue()) {}
  QueueNumber(QueueNumber&&) noexcept = default;
  QueueNumber& operator=(QueueNumber&&) = delete;
  ~QueueNumber() { world_.give_back_queue(number_); }

  World& world() { return world_; }
  const World& world() const { return world_; }
  std::uint32_t number() const { return number_; }

 private:
  World world_;
  std::uint32_t number_;
};

}  // namespace detail

template <class T>
class Collectives;

/// A queue of messages of one type. Messages sent in a superstep are there after its sync, and only until the
/// next.
///
/// Construction and destruction are collective. A queue can be moved, but not copied. Thread rule and errors:
/// as World.
template <class T>
class Queue {
  static_assert(sizeof(detail::MustBeSendable<T>) > 0);

 public:
  struct Received {
    int source;
    T value;
  };

  explicit Queue(World& world) : number_(world) { world.declare<T>(); }

  /// Sends a copy. @throws Error if there is no such rank; what Boost.Serialization throws.
  void send(int pid, const T& value) {
    if constexpr (detail::TravelsAsBytes<T>) {
      number_.world().send(number(), pid, {}, std::as_bytes(std::span<const T>(&value, 1)));
    } else {
      detail::write_archive(bytes_, value);
      number_.world().send(number(), pid, {}, std::as_bytes(std::span<const char>(bytes_)));
    }
  }

  const World& world() const { return number_.world(); }
  std::uint32_t number() const { return number_.number(); }  ///< equal on all ranks
  std::size_t size() const { return number_.world().messages(number()).size(); }

  /// What arrived at the last sync, in the order of the senders' ranks, and of one sender in the order sent.
  /// @throws Error (local) if a rank sent values of another size; what Boost.Serialization throws.
  std::vector<Received> receive() const {
    const auto messages = number_.world().messages(number());
    std::vector<Received> all;
    all.reserve(messages.size());
    for (const Message& message : messages) all.push_back({message.source, decode(message)});
    return all;
  }

 private:
  template <class U>
  friend class Collectives;

  World& alias() { return number_.world(); }  ///< for Collectives, which synchronize; nobody may move it away
  T decode(const Message& message) const {
    if constexpr (detail::TravelsAsBytes<T>) {
      std::array<std::byte, sizeof(T)> bytes;
      if (message.payload.size() != sizeof(T))
        throw Error(Errc::misuse, message.source, number_.world().superstep(), "receive",
                    "A message of " + detail::amount(message.payload.size(), "byte") + " is no value of " +
                        detail::amount(sizeof(T), "byte") +
                        ": the queues of the ranks differ in their types");
      std::memcpy(bytes.data(), message.payload.data(), sizeof(T));
      return std::bit_cast<T>(bytes);
    } else {
      return detail::read_archive<T>(message.payload);
    }
  }

  detail::QueueNumber number_;
  std::vector<char> bytes_;
};

}  // namespace bsp2::bsplib
