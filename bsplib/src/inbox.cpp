#include "inbox.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "defect.hpp"

namespace bsp2::bsplib {

namespace {

using wire::Op;
using wire::Record;

template <class T>
T load(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof value);
  return value;
}

/// Bytes of a record that is not a put, with its data.
std::size_t extent(const Record& record) {
  switch (record.op()) {
    case Op::big_put:
      return sizeof(wire::BigPut);
    case Op::get:
      return sizeof(wire::Get);
    case Op::message:
      return sizeof(Record) + wire::padded(record.size()) + wire::padded(record.offset);
    default:
      return sizeof(Record) + wire::padded(record.size());
  }
}

/// visit(record, place, data): records in their order, where they are, and where the data of a put or message
/// begins.
template <class Visit>
void for_each_record(const std::byte* stream, std::size_t size, Visit&& visit) {
  for (std::size_t at = 0; at < size;) {
    const auto put = load<wire::ShortPut>(stream + at);
    if (static_cast<Op>(put.bits & 15U) == Op::short_put) {
      const Record record = put.widen();
      visit(record, stream + at, stream + at + sizeof put);
      at += sizeof put + wire::padded(record.size());
    } else {
      const auto record = load<Record>(stream + at);
      visit(record, stream + at, stream + at + sizeof record);
      at += extent(record);
    }
  }
}

std::byte* target_of(const Registry& registry, const Record& record) {
  return registry.slot(record.target).address + record.offset;
}

void copy_bytes(std::byte* to, const std::byte* from, std::size_t bytes) {
  if (bytes == 8) {
    std::memcpy(to, from, 8);
  } else {
    std::memmove(to, from, bytes);  // a put to oneself may overlap its source
  }
}

bool travels_alone(const wire::BigPut& put, bool own) {
  return put.where == wire::nowhere && !own;
}

}  // namespace

std::byte* Inflow::room(std::size_t bytes) {
  if (bytes > capacity_) {
    capacity_ = std::max(bytes, 2 * capacity_);
    buffer_.reset(new std::byte[capacity_]);
  }
  return buffer_.get();
}

void Inflow::index(const Registry& registry, int source) {
  if (!(contents & (wire::has_gets | wire::has_big_puts | wire::has_messages))) return;
  for_each_record(
      stream, size,
      [&](const Record& record, const std::byte* place, [[maybe_unused]] const std::byte* data) {
        if (record.op() == Op::get) {
          const auto get = load<wire::Get>(place);
          requests.push_back({target_of(registry, record), get.size, get.direct != 0});
        } else if (record.op() == Op::big_put) {
          const auto put = load<wire::BigPut>(place);
          if (travels_alone(put, own)) landings.push_back({target_of(registry, record), put.size, nullptr});
        } else if (record.op() == Op::message) {
          messages.push_back(
              {source, {data, record.size()}, {data + wire::padded(record.size()), record.offset}});
          queues.push_back(record.target);
        }
      });
  if constexpr (defect == Defect::swap_messages)
    if (messages.size() > 1) std::swap(messages[0], messages[1]);
}

void Inflow::apply_big_put(const Registry& registry, const std::byte* place, std::size_t& landed) {
  const auto put = load<wire::BigPut>(place);
  if (travels_alone(put, own)) {
    const Landing& landing = landings[landed++];
    if (landing.aside) copy_bytes(landing.target, landing.aside.get(), landing.size);
  } else {
    const auto* from = own ? reinterpret_cast<const std::byte*>(static_cast<std::uintptr_t>(put.address))
                           : staging + put.where;
    copy_bytes(target_of(registry, put.record), from, put.size);
  }
}

void Inflow::apply_puts(const Registry& registry) {
  if (!(contents & (wire::has_puts | wire::has_big_puts))) return;
  std::size_t landed = 0;
  const std::byte* lost = nullptr;
  if constexpr (defect == Defect::drop_put)
    for_each_record(
        stream, size,
        [&](const Record& record, const std::byte* place, [[maybe_unused]] const std::byte* data) {
          if (record.op() == Op::put) lost = place;
        });
  Registry::Id last = Registry::no_id;
  std::byte* base = nullptr;
  for_each_record(stream, size,
                  [&](const Record& record, const std::byte* place, [[maybe_unused]] const std::byte* data) {
                    if (record.op() == Op::put) {
                      if (place == lost) return;
                      if (record.target != last) base = registry.slot(last = record.target).address;
                      copy_bytes(base + record.offset, data, record.size());
                    } else if (record.op() == Op::big_put) {
                      apply_big_put(registry, place, landed);
                    }
                  });
}

void Inflow::clear() {
  stream = nullptr;
  size = 0;
  contents = 0;
  landings.clear();
  requests.clear();
  messages.clear();
  queues.clear();
}

namespace {

struct Write {
  std::byte* begin;
  std::byte* end;
  Inflow::Landing* landing;  ///< null: another kind of write
};

std::vector<Write> all_writes(std::vector<Inflow>& inflows, const Registry& registry,
                              const std::vector<std::pair<std::byte*, std::size_t>>& wanted) {
  std::vector<Write> writes;
  for (const auto& [target, size] : wanted) writes.push_back({target, target + size, nullptr});
  for (Inflow& inflow : inflows) {
    std::size_t landed = 0;
    if (!(inflow.contents & (wire::has_puts | wire::has_big_puts))) continue;
    for_each_record(
        inflow.stream, inflow.size,
        [&](const Record& record, const std::byte* place, [[maybe_unused]] const std::byte* data) {
          std::byte* target = record.op() == Op::message ? nullptr : target_of(registry, record);
          if (record.op() == Op::put) {
            writes.push_back({target, target + record.size(), nullptr});
          } else if (record.op() == Op::big_put) {
            const auto put = load<wire::BigPut>(place);
            Inflow::Landing* landing = travels_alone(put, inflow.own) ? &inflow.landings[landed++] : nullptr;
            writes.push_back({target, target + put.size, landing});
          }
        });
  }
  return writes;
}

}  // namespace

void set_overlapping_aside(std::vector<Inflow>& inflows, const Registry& registry,
                           const std::vector<std::pair<std::byte*, std::size_t>>& wanted) {
  auto writes = all_writes(inflows, registry, wanted);
  std::sort(writes.begin(), writes.end(), [](const Write& a, const Write& b) { return a.begin < b.begin; });
  const auto set_aside = [](Write* write) {
    if (write->landing && !write->landing->aside)
      write->landing->aside.reset(new std::byte[write->landing->size]);
  };
  Write* reach = nullptr;  // of the writes so far, the one that ends last
  for (Write& write : writes) {
    if (reach && write.begin < reach->end) {
      set_aside(&write);
      set_aside(reach);
    }
    if (!reach || write.end > reach->end) reach = &write;
  }
}

}  // namespace bsp2::bsplib
