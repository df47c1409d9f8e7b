#include "drawing/unread.hpp"

namespace bsp2::model {

void Unread::add(const void* thing, const std::string& kind) {
  constexpr std::size_t most_kinds = 100;  // names that a file makes up are bounded by nothing else
  if (thing != nullptr && !things_.insert(thing).second) return;
  const bool is_known = counts_.size() < most_kinds || counts_.contains(kind);
  ++counts_[is_known ? kind : "others"];
}

std::string Unread::text(const std::string& name, const std::string& read) const {
  std::size_t all = 0;
  std::string kinds;
  for (const auto& [kind, count] : counts_) {
    all += count;
    kinds += (kinds.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
  }
  const bool is_one = all == 1;
  const std::string it = is_one ? "it" : "them";
  return (is_one ? "1 thing in " : std::to_string(all) + " things in ") + name + (is_one ? " is" : " are") +
         " not read: " + kinds + ". The result lacks " + it + "; convert " + it + " to " + read +
         " in the program that made the file, or delete " + it + " there";
}

}  // namespace bsp2::model
