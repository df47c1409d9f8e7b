#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bsp2::bsplib {

namespace detail {
class Engine;

/// "1 byte", "8 bytes", for messages.
inline std::string amount(std::size_t count, const std::string& thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

/// Says that an error is on its way: only the object that was thrown has one, no copy of it.
class Flight {
 public:
  Flight() = default;
  Flight(const Flight&) noexcept {}
  Flight(Flight&&) noexcept = default;
  // NOLINTNEXTLINE(bugprone-unhandled-self-assignment): nothing is assigned
  Flight& operator=(const Flight&) noexcept { return *this; }
  Flight& operator=(Flight&&) noexcept = default;
  ~Flight() = default;
  std::shared_ptr<const int> token;
};
}  // namespace detail

/// What went wrong, for programs that react to it.
enum class Errc : std::uint8_t {
  bad_argument,           ///< a rank, size or pointer that cannot be
  not_registered,         ///< the address names no registration that is in effect
  out_of_range,           ///< an access beyond what the other rank registered
  registration_mismatch,  ///< ranks registered or popped different memory
  tag_mismatch,           ///< ranks announced different tag sizes
  ended_early,            ///< a rank left while others synchronize
  mixed_collectives,      ///< ranks called different collective functions
  exception,              ///< an exception left a rank's program
  misuse,                 ///< a call that is not allowed now
  resource                ///< memory or a file could not be had
};

/// The one error type of this layer.
///
/// A *local* error is thrown on the rank that made the mistake, at the call. The next collective call then
/// ends on every rank with an *agreed* error, equal on all of them: same code, culprit, superstep and text.
class Error : public std::runtime_error {
 public:
  Error(Errc code, int culprit, std::uint64_t superstep, std::string where, std::string detail,
        bool agreed = false, bool own = true);

  Errc code() const { return code_; }
  /// The rank that caused it, by its number in the world that threw this.
  int culprit() const { return culprit_; }
  std::uint64_t superstep() const { return superstep_; }
  const std::string& where() const { return where_; }    ///< the function, e.g. "put" or "sync/pop_reg"
  const std::string& detail() const { return detail_; }  ///< the message without place, rank and superstep
  bool agreed() const { return agreed_; }                ///< every rank has thrown this same error
  bool own() const { return own_; }                      ///< this rank is the culprit

 private:
  friend class detail::Engine;

  Errc code_;
  int culprit_;
  std::uint64_t superstep_;
  std::string where_, detail_;
  bool agreed_, own_;
  /// The ranks of its world, and the culprit (-1: unknown), as MPI_COMM_WORLD counts them.
  std::shared_ptr<const std::vector<int>> processes_;
  int process_ = -1;
  detail::Flight flight_;
};

}  // namespace bsp2::bsplib
