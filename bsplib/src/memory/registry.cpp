#include "memory/registry.hpp"

#include <algorithm>
#include <utility>

#include "support/defect.hpp"

namespace bsp2::bsplib {

Registry::Id Registry::new_id() {
  if (free_.empty()) {
    slots_.emplace_back();
    return static_cast<Id>(slots_.size() - 1);
  }
  const Id id = free_.back();
  free_.pop_back();
  return id;
}

void Registry::drop(Stacks& stacks, const void* address, Id id) {
  auto found = stacks.find(address);
  if (found == stacks.end()) return;
  auto& ids = found->second;
  const auto place = std::find(ids.rbegin(), ids.rend(), id);
  if (place != ids.rend()) ids.erase(std::next(place).base());
  if (ids.empty()) stacks.erase(found);
}

Registry::Id Registry::push(const void* address, std::size_t size) {
  const Id id = new_id();
  Slot& slot = slots_[id];
  slot = Slot{};
  slot.address = static_cast<std::byte*>(const_cast<void*>(address));
  slot.in_use = true;
  if (address) latest_[address].push_back(id);
  changes_.push_back({0, id, address ? size : null_size});
  ++pushes_;
  if (defect == Defect::early_registration) {
    slot.sizes.assign(nprocs_, size);
    slot.effective = true;
    effective_[address].push_back(id);
    ++version_;
  }
  return id;
}

bool Registry::pop(const void* address) {
  if (!address) {
    changes_.push_back({1, no_id, 0});
    return true;
  }
  const auto found = latest_.find(address);
  if (found == latest_.end()) return false;
  pop_id(found->second.back());
  return true;
}

void Registry::pop_id(Id id) {
  drop(latest_, slots_[id].address, id);
  changes_.push_back({1, id, 0});
}

Registry::Id Registry::adopt(Slot slot) {
  const Id id = new_id();
  slot.in_use = slot.effective = true;
  slot.order = ++order_;
  if (slot.address) {
    effective_[slot.address].push_back(id);
    latest_[slot.address].push_back(id);
  }
  slots_[id] = std::move(slot);
  ++version_;
  return id;
}

Registry::Id Registry::find(const void* address) const {
  const auto found = effective_.find(address);
  return found == effective_.end() ? no_id : found->second.back();
}

bool Registry::pending(const void* address) const { return latest_.find(address) != latest_.end(); }

std::optional<Registry::Problem> Registry::resolve_null(Id& id) const {
  bool some_null = false;
  std::uint64_t newest = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const Slot& slot = slots_[i];
    if (!slot.effective) continue;
    const auto null_count = std::count(slot.sizes.begin(), slot.sizes.end(), null_size);
    some_null |= null_count > 0;
    if (null_count == static_cast<std::ptrdiff_t>(nprocs_) && slot.order > newest) {
      newest = slot.order;
      id = static_cast<Id>(i);
    }
  }
  if (newest > 0) return std::nullopt;
  return Problem{0, "pop_reg",
                 some_null
                     ? "Tried to deregister NULL on all ranks, but could not find a matching regisration"
                     : "Tried to deregister NULL on all ranks, but NULL was never registered"};
}

/// (Texts as in BSPonMPI, misspelling included, once classic_state.cpp says "process": published conformance
/// tests compare them.) Finds which registration all ranks mean: those that popped an address name it, those
/// that popped NULL follow.
std::optional<Registry::Problem> Registry::resolve_pop(const std::vector<Change>& all, std::size_t index,
                                                       Id& id) const {
  const std::size_t count = changes_.size();
  std::size_t first = nprocs_;
  for (std::size_t rank = 0; rank < nprocs_ && first == nprocs_; ++rank)
    if (all[rank * count + index].id != no_id) first = rank;
  if (first == nprocs_) return resolve_null(id);
  id = all[first * count + index].id;
  for (std::size_t rank = 0; rank < nprocs_; ++rank) {
    const Change& change = all[rank * count + index];
    const bool is_null = change.id == no_id;
    const bool fits = is_null
                          ? id < slots_.size() && slots_[id].effective && slots_[id].sizes[rank] == null_size
                          : change.pop && change.id == id;
    if (fits) continue;
    const auto [low, high] = std::minmax(first, rank);
    return Problem{static_cast<int>(rank), "pop_reg",
                   "Ranks " + std::to_string(low) + " and " + std::to_string(high) +
                       " did not pop the same memory registration"};
  }
  return std::nullopt;
}

void Registry::apply_push(const std::vector<Change>& all, std::size_t index) {
  const std::size_t count = changes_.size();
  const Id id = changes_[index].id;
  Slot& slot = slots_[id];
  slot.sizes.resize(nprocs_);
  for (std::size_t rank = 0; rank < nprocs_; ++rank) slot.sizes[rank] = all[rank * count + index].size;
  slot.effective = true;
  slot.order = ++order_;
  if (slot.address && defect != Defect::early_registration) effective_[slot.address].push_back(id);
}

void Registry::free_slot(Id id) {
  Slot& slot = slots_[id];
  if (slot.address) drop(effective_, slot.address, id);
  if (!slot.shared.empty() || slot.heap) released_.push_back(std::move(slot));
  slot = Slot{};
  free_.push_back(id);
}

std::optional<Registry::Problem> Registry::commit(const std::vector<Change>& all) {
  const std::size_t count = changes_.size();
  for (std::size_t index = 0; index < count; ++index) {
    for (std::size_t rank = 1; rank < nprocs_; ++rank)
      if (all[rank * count + index].pop != all[index].pop)
        return Problem{static_cast<int>(rank), "push_reg",
                       "Ranks 0 and " + std::to_string(rank) + " registered and popped in different order"};
    if (!changes_[index].pop) {
      apply_push(all, index);
      continue;
    }
    Id id = no_id;
    if (auto problem = resolve_pop(all, index, id)) return problem;
    if (id >= slots_.size() || !slots_[id].effective)
      return Problem{0, "pop_reg", "Tried to deregister memory that was deregistered already"};
    if (defect == Defect::forget_pop) continue;
    free_slot(id);
  }
  changes_.clear();
  pushes_ = 0;
  ++version_;
  return std::nullopt;
}

std::vector<Registry::Slot> Registry::take_released(bool everything) {
  if (everything)
    for (Slot& slot : slots_)
      if (slot.in_use && (!slot.shared.empty() || slot.heap))
        released_.push_back(std::exchange(slot, Slot{}));
  return std::exchange(released_, {});
}

}  // namespace bsp2::bsplib
