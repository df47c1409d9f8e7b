#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "serving/detail.hpp"

namespace bsp2::api {

/// What there is to see, as messages under keys: the newest of each key, in the order in which they came.
///
/// Readers go through it at their own pace. For one that is slow, messages that have been replaced meanwhile
/// are gone: it gets the newest state of each thing once, and nothing waits for it. So its size is that of
/// what is to be seen, however many read. All functions may be called by any thread.
class Scene {
 public:
  using Bytes = std::shared_ptr<const std::string>;  // shared by all who are sending it
  struct Entry {
    std::uint64_t number;  ///< ask for what comes after it next
    Bytes bytes;
    std::shared_ptr<const Detail> detail{};  ///< null: it has one level; shared by all who read
  };

  /// @param on_change called after each change, by whoever made it.
  explicit Scene(std::function<void()> on_change = {}) : on_change_(std::move(on_change)) {}
  /// Nobody is called any more once it returns.
  void forget_listener();
  void listen(std::function<void()> on_change);

  /// The message under a key becomes another one, and the last in order.
  void put(const std::string& key, std::string bytes, std::shared_ptr<const Detail> detail = {});
  /// As `put`, for what the others are shown with: whoever begins to read gets it before all of them, too.
  void put_first(const std::string& key, std::string bytes);
  /// Takes all those away whose keys begin so.
  void remove(std::string_view beginning);
  /// The first message that came after `number`; 0: the first of all.
  [[nodiscard]] std::optional<Entry> after(std::uint64_t number) const;
  /// A message that is still there.
  [[nodiscard]] std::optional<Entry> find(std::uint64_t number) const;
  /// All that have levels, by number.
  [[nodiscard]] std::vector<std::pair<std::uint64_t, std::shared_ptr<const Detail>>> detailed() const;
  /// The run whose surface there is, the newest one; 0: none.
  [[nodiscard]] std::uint64_t run_of_surface() const;
  [[nodiscard]] std::size_t size() const;         ///< messages
  [[nodiscard]] std::uint64_t bytes_put() const;  ///< of all that were ever put

 private:
  mutable std::mutex mutex_, listening_;
  std::function<void()> on_change_;
  std::map<std::uint64_t, Entry> messages_;
  std::map<std::string, std::uint64_t, std::less<>> number_of_;
  static constexpr std::uint64_t number_of_first = 1;
  Bytes first_;  // null: none
  std::uint64_t last_ = number_of_first, bytes_ = 0, run_of_surface_ = 0;

  void put(const std::string& key, Entry entry, bool is_first);
  void tell();
};

}  // namespace bsp2::api
