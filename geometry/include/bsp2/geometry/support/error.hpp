#pragma once

#include <stdexcept>
#include <string>

namespace bsp2 {

/// The user's mistake: a bad model, a bad option, a file that cannot be read or written.
///
/// `what()` is one complete message that says where and what to do. Programs print it after "bsp2: " and exit
/// with code 2. Broken invariants of our own are asserted or thrown as std::logic_error, and exit with
/// code 1.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace bsp2
