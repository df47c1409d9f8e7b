#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <unordered_set>

namespace bsp2::model {

/// What a reader of drawings passes over, by its kinds.
class Unread {
 public:
  /// @param thing where it stands: each counts once, however often it is drawn. null: counts each time.
  void add(const void* thing, const std::string& kind);
  [[nodiscard]] bool empty() const { return counts_.empty(); }
  /// One sentence with all of it.
  /// @param name of the file. @param read what it could be converted to.
  [[nodiscard]] std::string text(const std::string& name, const std::string& read) const;

 private:
  std::map<std::string, std::size_t> counts_;
  std::unordered_set<const void*> things_;
};

}  // namespace bsp2::model
