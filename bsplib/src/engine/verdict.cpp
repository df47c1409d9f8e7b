// What every rank concludes from the headers that all have. The answer depends on nothing else, so it is the
// same everywhere: agreeing costs no communication.
#include <algorithm>
#include <vector>

#include "engine/engine.hpp"

namespace bsp2::bsplib::detail {

using wire::Header;
using wire::Kind;

/// The lowest rank whose value is not the one that most ranks have (of equally many, that of the lower rank).
template <class Get>
std::optional<int> Engine::odd_one_out(Get&& get) const {
  const auto mine = get(header(0));
  bool equal = true;
  for (int rank = 1; rank < nprocs_ && equal; ++rank) equal = get(header(rank)) == mine;
  if (equal) return std::nullopt;
  auto common = mine;
  int votes = 0;
  for (int i = 0; i < nprocs_; ++i) {
    int same = 0;
    for (int j = 0; j < nprocs_; ++j) same += get(header(j)) == get(header(i));
    if (same > votes) votes = same, common = get(header(i));
  }
  for (int rank = 0; rank < nprocs_; ++rank)
    if (get(header(rank)) != common) return rank;
  return std::nullopt;
}

std::optional<Engine::Verdict> Engine::judge_errors() const {
  int teller = -1;
  for (int rank = nprocs_ - 1; rank >= 0; --rank) {
    const Header& h = header(rank);
    if (h.kind != Kind::error) continue;
    if (teller < 0 || h.error_origin >= header(teller).error_origin) teller = rank;
  }
  if (teller < 0) return std::nullopt;
  const Header& h = header(teller);
  Verdict verdict{
      static_cast<Errc>(h.error_code),        wire::unpack_culprit(h.argument).first, "", "", teller,
      wire::unpack_culprit(h.argument).second};
  if (h.error_origin == wire::Origin::left) {
    verdict.set_text({reinterpret_cast<const char*>(&h + 1), h.error_bytes});
  } else {
    verdict.text_bytes = h.error_bytes;
  }
  return verdict;
}

std::optional<Engine::Verdict> Engine::judge_kinds() const {
  const auto kind = [](const Header& h) { return h.kind; };
  const auto odd = odd_one_out(kind);
  if (!odd) return std::nullopt;
  int early = -1;
  bool only_sync_and_end = true;
  for (int rank = nprocs_ - 1; rank >= 0; --rank) {
    if (kind(header(rank)) == Kind::end) early = rank;
    only_sync_and_end &= kind(header(rank)) == Kind::end || kind(header(rank)) == Kind::sync;
  }
  if (early >= 0 && only_sync_and_end)
    return Verdict{Errc::ended_early, early, "sync/end",
                   "Rank " + std::to_string(early) + " left the world, while others synchronize"};
  const int other = *odd == 0 ? 1 : 0;
  const auto name = [&](int rank) {
    return std::string(wire::kind_names[static_cast<unsigned>(kind(header(rank)))]);
  };
  return Verdict{early >= 0 ? Errc::ended_early : Errc::mixed_collectives, early >= 0 ? early : *odd, "sync",
                 "Rank " + std::to_string(*odd) + " called " + name(*odd) + " while rank " +
                     std::to_string(other) + " called " + name(other)};
}

namespace {

/// "gather with root 2 (queue 1)".
std::string describe(const Call& call) {
  constexpr const char* names[] = {
      "sync alone", "broadcast",  "gather",      "all_gather",         "reduce",   "scan",    "all_to_all",
      "bsp_bcast",  "bsp_gather", "bsp_scatter", "bsp_total_exchange", "bsp_fold", "bsp_scan"};
  std::string text = names[call.function];
  if (wire::is_classic(call)) {
    text += " of " + detail::amount(call.bytes, "byte");
    if (call.function <= Call::classic_scatter) text += " with root " + std::to_string(call.root);
    return text;
  }
  if (call.function == Call::broadcast || call.function == Call::gather)
    text += " with root " + std::to_string(call.root);
  if (call.queue > 0) text += " (queue " + std::to_string(call.queue) + ")";
  return text;
}

}  // namespace

std::optional<Engine::Verdict> Engine::judge_calls() const {
  if (header(0).kind != Kind::sync) return std::nullopt;
  const auto argument = [](const Header& h) { return h.argument; };
  const auto odd = odd_one_out(argument);
  if (!odd) return std::nullopt;
  const int other = *odd == 0 ? 1 : 0;
  const auto name = [&](int rank) { return describe(wire::unpack_call(argument(header(rank)))); };
  return Verdict{Errc::mixed_collectives, *odd, "sync",
                 "Rank " + std::to_string(*odd) + " called " + name(*odd) + " while rank " +
                     std::to_string(other) + " called " + name(other)};
}

std::optional<Engine::Verdict> Engine::judge_counts() const {
  const auto differ = [&](int rank, auto get, const char* what) {
    const int other = rank == 0 ? 1 : 0;
    return ": rank " + std::to_string(rank) + " " + what + " " + std::to_string(get(header(rank))) +
           ", rank " + std::to_string(other) + " " + std::to_string(get(header(other)));
  };
  const auto pushes = [](const Header& h) { return h.pushes; };
  if (const auto odd = odd_one_out(pushes))
    return Verdict{
        Errc::registration_mismatch, *odd, "sync/push_reg",
        "Not all ranks registered the same number of memory blocks" + differ(*odd, pushes, "registered")};
  const auto pops = [](const Header& h) { return h.pops; };
  if (const auto odd = odd_one_out(pops))
    return Verdict{Errc::registration_mismatch, *odd, "sync/pop_reg",
                   "Not all ranks popped the same number of memory blocks" + differ(*odd, pops, "popped")};
  const auto sets = [](const Header& h) { return h.tag_sets; };
  if (const auto odd = odd_one_out(sets))
    return Verdict{Errc::tag_mismatch, *odd, "sync/set_tagsize",
                   "Not all ranks set the tag size same number of times" + differ(*odd, sets, "set it")};
  const auto size = [](const Header& h) { return h.tag_size; };
  if (const auto odd = odd_one_out(size))
    return Verdict{Errc::tag_mismatch, *odd, "sync/set_tagsize",
                   "Not all ranks announced the same tag size" + differ(*odd, size, "announced")};
  const auto queues = [](const Header& h) { return h.queues; };
  if (const auto odd = odd_one_out(queues))
    return Verdict{Errc::mixed_collectives, *odd, "sync/new_queue",
                   "Not all ranks have the same number of queues" + differ(*odd, queues, "has")};
  const auto types = [](const Header& h) { return h.types; };
  if (const auto odd = odd_one_out(types))
    return Verdict{Errc::mixed_collectives, *odd, "sync",
                   "Not all ranks made their queues and arrays of the same types, in the same order, and "
                   "gave them back alike"};
  return std::nullopt;
}

std::optional<Engine::Verdict> Engine::judge() const {
  if (nprocs_ == 1 && header(0).kind != Kind::error) return std::nullopt;
  if (auto verdict = judge_errors()) return verdict;
  if (auto verdict = judge_kinds()) return verdict;
  if (header(0).kind == Kind::end) return std::nullopt;    // what was announced for a next superstep is void
  if (header(0).kind == Kind::world) return std::nullopt;  // which concerns another world
  if (auto verdict = judge_calls()) return verdict;
  return judge_counts();
}

}  // namespace bsp2::bsplib::detail
