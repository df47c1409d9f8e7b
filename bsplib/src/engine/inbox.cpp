#include "engine/inbox.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "support/copy.hpp"
#include "support/defect.hpp"

namespace bsp2::bsplib {

namespace {

using wire::Op;
using wire::Record;
using wire::Short;

/// How far ahead of its reader a stream is fetched.
constexpr std::size_t ahead_bytes = 1024;

template <class T>
T load(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof value);
  return value;
}

/// Bytes of a long record with its data.
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

/// A put, a get or messages, from a short or a long record; or another record.
struct Item {
  Op op;
  Registry::Id target;
  std::size_t offset, size;  ///< of messages: that of a payload, and that of a tag
  const std::byte* place;    ///< of the record
  const std::byte* data;     ///< of a put or messages
  std::size_t count = 1;     ///< of messages
  MessageRun messages(int source) const {
    const std::size_t lost = defect == Defect::lose_message && count > 1 ? 1 : 0;
    return {source, count - lost, data, size, offset};
  }
};

/// visit(item): records in their order. Their sender has just written them: each line is fetched from its
/// cache well before it is read, else every header is waited for.
template <class Visit>
inline void for_each_record(const std::byte* stream, std::size_t size, Visit&& visit) {
  const std::byte* end = stream + size;
  for (const std::byte* at = stream; at < end;) {
    __builtin_prefetch(at + ahead_bytes);
    const auto brief = load<Short>(at);
    if (brief.op() == Op::short_put) {
      visit(Item{Op::put, brief.target(), brief.offset, brief.size(), at, at + sizeof brief});
      at += sizeof brief + wire::padded(brief.size());
    } else if (brief.op() == Op::short_get) {
      visit(Item{Op::get, brief.target(), brief.offset, brief.size(), at, nullptr});
      at += sizeof brief;
    } else if (brief.op() == Op::short_messages) {
      visit(Item{Op::message, brief.target(), brief.payload(), brief.size(), at, at + sizeof brief,
                 brief.count()});
      at += sizeof brief + brief.count() * (wire::padded(brief.size()) + wire::padded(brief.payload()));
    } else {
      const auto record = load<Record>(at);
      const std::size_t bytes = record.op() == Op::get ? load<wire::Get>(at).size : record.size();
      visit(Item{record.op(), record.target, record.offset, bytes, at, at + sizeof record});
      at += extent(record);
    }
  }
}

/// Finds registered memory; the records of a loop name the same again and again.
class Addresses {
 public:
  explicit Addresses(const Registry& registry) : registry_(&registry) {}
  std::byte* of(const Item& item) {
    if (item.target != last_) base_ = registry_->slot(last_ = item.target).address;
    return base_ + item.offset;
  }

 private:
  const Registry* registry_;
  Registry::Id last_ = Registry::no_id;
  std::byte* base_ = nullptr;
};

bool travels_alone(const wire::BigPut& put, bool own) { return put.where == wire::nowhere && !own; }

}  // namespace

std::byte* Buffer::room(std::size_t bytes) {
  if (bytes > capacity_) {
    capacity_ = std::max(bytes, 2 * capacity_);
    data_.reset(new std::byte[capacity_]);
  }
  return data_.get();
}

void Inflow::fetch_first() const {
  for (std::size_t at = 0; at < std::min(size, ahead_bytes); at += 64) __builtin_prefetch(stream + at);
}

void Inflow::find_landings(const Registry& registry) {
  if (!(contents & wire::has_big_puts)) return;
  Addresses addresses(registry);
  for_each_record(stream, size, [&](const Item& item) {
    if (item.op != Op::big_put) return;
    const auto put = load<wire::BigPut>(item.place);
    if (travels_alone(put, own)) landings.push_back({addresses.of(item), put.size, nullptr});
  });
}

void MessageRun::append_to(std::vector<Message>& messages) const {
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* at = place + i * stride();
    messages.push_back({source, {at, tag}, {at + wire::padded(tag), payload}});
  }
}

void Inflow::deliver_to_first(int source, std::vector<MessageRun>& queue) const {
  if (!(contents & wire::has_messages)) return;
  [[maybe_unused]] const std::size_t before = queue.size();
  for_each_record(stream, size, [&](const Item& item) {
    if (item.op == Op::message && item.target == 0) queue.push_back(item.messages(source));
  });
  if (defect == Defect::swap_messages)
    if (queue.size() > before + 1) std::swap(queue[before], queue[before + 1]);
}

void Inflow::deliver_to_others(int source, std::vector<std::vector<Message>>& queues) const {
  if (!(contents & wire::has_messages)) return;
  for_each_record(stream, size, [&](const Item& item) {
    if (item.op == Op::message && item.target != 0) item.messages(source).append_to(queues[item.target]);
  });
}

void Inflow::answer_gets(const Registry& registry, std::byte* reply) {
  Addresses addresses(registry);
  for_each_record(stream, size, [&](const Item& item) {
    if (item.op != Op::get) return;
    const bool is_long = load<Short>(item.place).op() != Op::short_get;
    if (is_long && load<wire::Get>(item.place).direct) {
      requests.push_back({addresses.of(item), item.size});
    } else {
      copy_bytes(reply, addresses.of(item), item.size);
      reply += item.size;
    }
  });
}

void Inflow::apply_big_put(const Registry& registry, const std::byte* place, std::size_t& landed) {
  const auto put = load<wire::BigPut>(place);
  if (travels_alone(put, own)) {
    const Landing& landing = landings[landed++];
    if (landing.aside) copy_bytes(landing.target, landing.aside.get(), landing.size);
  } else {
    const auto* from = own ? reinterpret_cast<const std::byte*>(static_cast<std::uintptr_t>(put.address))
                           : staging + put.where;
    copy_bytes(registry.slot(put.record.target).address + put.record.offset, from, put.size);
  }
}

void Inflow::apply_puts(const Registry& registry) {
  if (!(contents & (wire::has_puts | wire::has_big_puts))) return;
  std::size_t landed = 0;
  const std::byte* lost = nullptr;
  if (defect == Defect::drop_put)
    for_each_record(stream, size, [&](const Item& item) {
      if (item.op == Op::put) lost = item.place;
    });
  Addresses addresses(registry);
  for_each_record(stream, size, [&](const Item& item) {
    if (item.op == Op::put) {
      if (item.place != lost) copy_bytes(addresses.of(item), item.data, item.size);
    } else if (item.op == Op::big_put) {
      apply_big_put(registry, item.place, landed);
    }
  });
}

void Inflow::clear() {
  stream = nullptr;
  size = 0;
  contents = 0;
  landings.clear();
  requests.clear();
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
  Addresses addresses(registry);
  for (Inflow& inflow : inflows) {
    std::size_t landed = 0;
    if (!(inflow.contents & (wire::has_puts | wire::has_big_puts))) continue;
    for_each_record(inflow.stream, inflow.size, [&](const Item& item) {
      if (item.op == Op::put) {
        std::byte* target = addresses.of(item);
        writes.push_back({target, target + item.size, nullptr});
      } else if (item.op == Op::big_put) {
        const auto put = load<wire::BigPut>(item.place);
        std::byte* target = addresses.of(item);
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
