#pragma once

#include <stdexcept>
#include <string>

/// Of what the shared library exports.
#define BSP2_API [[gnu::visibility("default")]]

namespace bsp2 {

/// What went wrong, for a person. `what()` is one complete message that says where and what to do; programs
/// print it after "bsp2: ".
///
/// It is the user's mistake (a bad model, a bad option, a file that cannot be read or written: exit code 2)
/// unless it says otherwise. The rooms throw it for mistakes of users alone; broken invariants of our own are
/// asserted or thrown as std::logic_error there, and leave the library as an Error that is not the user's
/// (exit code 1).
class BSP2_API Error : public std::runtime_error {
 public:
  explicit Error(const std::string& text, bool is_users_mistake = true)
      : std::runtime_error(text), is_users_mistake_(is_users_mistake) {}
  [[nodiscard]] bool is_users_mistake() const noexcept { return is_users_mistake_; }

 private:
  bool is_users_mistake_;
};

}  // namespace bsp2
