#include "drawing/unread.hpp"

#include "bsp2/geometry/support/counted.hpp"

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
    kinds += (kinds.empty() ? "" : ", ") + grouped(count) + " " + kind;
  }
  return counted(all, "# thing[s] in ") + name + counted(all, " [is|are] not read: ") + kinds +
         counted(all, ". The result lacks [it|them]; convert [it|them] to ") + read +
         counted(all, " in the program that made the file, or delete [it|them] there");
}

}  // namespace bsp2::model
