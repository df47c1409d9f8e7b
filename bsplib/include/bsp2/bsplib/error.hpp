#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace bsp2::bsplib {

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
  int culprit() const { return culprit_; }  ///< the rank that caused it
  std::uint64_t superstep() const { return superstep_; }
  const std::string& where() const { return where_; }    ///< the function, e.g. "put" or "sync/pop_reg"
  const std::string& detail() const { return detail_; }  ///< the message without place, rank and superstep
  bool agreed() const { return agreed_; }                ///< every rank has thrown this same error
  bool own() const { return own_; }                      ///< this rank is the culprit

 private:
  Errc code_;
  int culprit_;
  std::uint64_t superstep_;
  std::string where_, detail_;
  bool agreed_, own_;
};

}  // namespace bsp2::bsplib
