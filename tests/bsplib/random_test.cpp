// Random BSP programs, run on the layer and on the sequential model; their states must agree after every
// sync.
//
//   bsplib_random [first seed] [number of seeds]
//
// Every process draws the whole program from the seed, so it knows what all do and keeps the whole model; on
// the layer it executes its own part. Blocks 0..2 are used with put and get at any place, also overlapping
// ones. Block 3 is for the unbuffered calls: there each process writes a part of its own, from block 4, which
// nobody changes meanwhile.
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "bsp.h"
#include "random_model.hpp"

namespace {

using namespace random_model;

constexpr int ordinary_blocks = 3, hp_block = 3, hp_source = 4, blocks = 5;

class Program {
 public:
  Program(std::uint64_t seed, Model& model, std::vector<Bytes>& mine)
      : seed_(seed), random_(seed), model_(model), mine_(mine), me_(bsp_pid()), p_(bsp_nprocs()) {
    big_ = seed % 40 == 0;
  }

  void run() {
    for (int b = 0; b < blocks; ++b)
      for (int q = 0; q < p_; ++q) scribble(q, b);
    for (int b = 0; b < 4; ++b) push(uniform_registration(b));
    sync();
    const int supersteps = 1 + pick(5);
    for (int s = 0; s < supersteps; ++s) superstep();
    while (!model_.upcoming().empty()) pop_any();
    sync();
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  int pick(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  std::size_t pick_size(std::size_t n) { return n == 0 ? 0 : random_() % n; }

  void superstep() {
    hp_used_.assign(at(p_ * p_), 0);
    calls();
    collective_calls();
    calls();  // these, too, see the registrations and the tag size of before
    sync();
  }

  void calls() {
    for (int q = 0; q < p_; ++q)
      for (int count = pick(5); count > 0; --count) call(q);
  }

  void call(int q) {
    switch (pick(11)) {
      case 0:
      case 1:
        put(q);
        break;
      case 2:
        run_of_puts(q);
        break;
      case 3:
        get(q);
        break;
      case 4:
        run_of_gets(q);
        break;
      case 5:
        hpput(q);
        break;
      case 6:
        hpget(q);
        break;
      case 7:
        send(q);
        break;
      case 8:
        run_of_messages(q);
        break;
      case 9:
        words(q);
        break;
      default:
        scribble(q, pick(ordinary_blocks));
        break;
    }
  }

  void collective_calls() {
    if (pick(4) == 0) push(random_registration());
    if (pick(4) == 0) pop_any();
    if (pick(8) == 0) push(random_registration());
    if (pick(4) == 0) set_tag_size();
  }

  // --- What a process does; q is the process, and if it is this one, then the layer does it, too. ---

  /// Changes a process's own memory, here and in the model.
  void scribble(int q, int b) {
    Bytes& block = model_.block(q, b);
    const std::size_t begin = pick_size(block.size()), end = begin + 1 + pick_size(block.size() - begin);
    const std::uint64_t start = random_();
    for (std::size_t i = begin; i < end; ++i) block[i] = static_cast<unsigned char>(start + i * 7 + i / 251);
    if (q == me_)
      std::copy(block.begin() + diff(begin), block.begin() + diff(end), mine_[at(b)].begin() + diff(begin));
  }

  struct Place {
    int known_as;
    std::size_t offset, size;
  };

  /// A random place in memory of process t that q may access; size 0 if it found none.
  Place random_place(int q, int t) {
    const int b = pick(ordinary_blocks);
    const Registration* r = model_.find(q, b);
    if (!r || r->block[at(t)] == no_block || r->size[at(t)] == 0) return {b, 0, 0};
    const std::size_t size = r->size[at(t)];
    const std::size_t offset = pick_size(size);
    std::size_t bytes = 1 + pick_size(size - offset);
    if (pick(3) == 0) bytes = std::min<std::size_t>(bytes, 8);
    return {b, offset, bytes};
  }

  void put_bytes(int q, int t, int known_as, std::size_t offset, int source, std::size_t from,
                 std::size_t size) {
    const Bytes& block = model_.block(q, source);
    model_.put(q, t, known_as, offset, Bytes(block.begin() + diff(from), block.begin() + diff(from + size)));
    if (q == me_)
      bsp_put(t, mine_[at(source)].data() + from, mine_[at(known_as)].data(), static_cast<int>(offset),
              static_cast<int>(size));
  }

  void put(int q) {
    const int t = pick(p_), source = pick(ordinary_blocks);
    Place place = random_place(q, t);
    place.size = std::min(place.size, model_.block(q, source).size());
    if (place.size == 0) return;
    const std::size_t from = pick_size(model_.block(q, source).size() - place.size + 1);
    put_bytes(q, t, place.known_as, place.offset, source, from, place.size);
    if (pick(2) == 0) scribble(q, source);  // the put must have read its source already
  }

  /// Small puts to neighbouring places, now and then with a gap between them.
  void run_of_puts(int q) {
    const int t = pick(p_), source = pick(ordinary_blocks), step = 1 + pick(12);
    const Place place = random_place(q, t);
    std::size_t offset = place.offset;
    const std::size_t end = std::min(place.offset + place.size, model_.block(q, source).size());
    while (offset + at(step) <= end) {
      put_bytes(q, t, place.known_as, offset, source, offset, at(step));
      offset += at(step) + (pick(4) == 0 ? 1U : 0U);
    }
  }

  /// Puts of 8 bytes, buffered or not, that mostly do not continue each other.
  void words(int q) {
    const int t = pick(p_), source = pick(ordinary_blocks);
    const bool unbuffered = pick(2) == 0;
    const Place place = random_place(q, t);
    for (int count = pick(10); count > 0; --count) {
      if (unbuffered) {
        hpput_to(q, t, 8);
      } else if (place.size >= 8) {
        put_bytes(q, t, place.known_as, place.offset + pick_size(place.size - 7), source,
                  pick_size(model_.block(q, source).size() - 7), 8);
      }
    }
  }

  void get_bytes(int q, int t, const Place& place, int target, std::size_t to) {
    model_.get(q, t, place.known_as, place.offset, target, to, place.size);
    if (q == me_)
      bsp_get(t, mine_[at(place.known_as)].data(), static_cast<int>(place.offset),
              mine_[at(target)].data() + to, static_cast<int>(place.size));
  }

  void get(int q) {
    const int t = pick(p_), target = pick(ordinary_blocks);
    Place place = random_place(q, t);
    place.size = std::min(place.size, model_.block(q, target).size());
    if (place.size == 0) return;
    get_bytes(q, t, place, target, pick_size(model_.block(q, target).size() - place.size + 1));
  }

  /// Small gets from neighbouring places to neighbouring places, now and then with a gap on one side or both.
  void run_of_gets(int q) {
    const int t = pick(p_), target = pick(ordinary_blocks);
    const std::size_t step = 1 + pick_size(12), limit = model_.block(q, target).size();
    const Place place = random_place(q, t);
    const std::size_t end = std::min(place.offset + place.size, limit);
    for (std::size_t offset = place.offset; offset + step <= end; offset += step + (pick(4) == 0 ? 1U : 0U)) {
      const std::size_t to = pick(4) == 0 ? pick_size(limit - step + 1) : offset;
      get_bytes(q, t, {place.known_as, offset, step}, target, to);
    }
  }

  /// The part of t's hp_block that only q writes; each byte once a superstep.
  bool hp_part(int q, int t, std::size_t& offset, std::size_t& size, std::size_t most = ~std::size_t{0}) {
    const std::size_t part = model_.block(t, hp_block).size() / at(p_);
    std::size_t& used = hp_used_[at(q * p_ + t)];
    const std::size_t gap = pick_size(3);
    if (used + gap >= part) return false;
    size = 1 + pick_size(part - used - gap);
    if (pick(2) == 0) size = std::min<std::size_t>(size, 16);
    size = std::min(size, most);
    offset = at(q) * part + used + gap;
    used += gap + size;
    return true;
  }

  void hpput(int q) { hpput_to(q, pick(p_), ~std::size_t{0}); }

  void hpput_to(int q, int t, std::size_t most) {
    std::size_t offset = 0, size = 0;
    if (!model_.find(q, hp_block) || !hp_part(q, t, offset, size, most)) return;
    const Bytes& source = model_.block(q, hp_source);
    model_.put(q, t, hp_block, offset,
               Bytes(source.begin() + diff(offset), source.begin() + diff(offset + size)));
    if (q == me_)
      bsp_hpput(t, mine_[hp_source].data() + offset, mine_[hp_block].data(), static_cast<int>(offset),
                static_cast<int>(size));
  }

  /// Reads from t's memory into this process's own part of its hp_block. The source is an ordinary block that
  /// may be written at this sync, so the call is buffered when it is small; a large one reads the part of a
  /// block that only hpput by nobody touches: the process's own part of t's hp_block is never used twice.
  void hpget(int q) {
    const int t = pick(p_);
    std::size_t offset = 0, size = 0;
    if (!model_.find(q, hp_block) || !hp_part(q, q, offset, size)) return;
    if (!hp_readable(q, t, offset, size)) return;
    model_.get(q, t, hp_block, offset, hp_block, offset, size);
    if (q == me_)
      bsp_hpget(t, mine_[hp_block].data(), static_cast<int>(offset), mine_[hp_block].data() + offset,
                static_cast<int>(size));
  }

  /// Reserves q's part of t's hp_block up to the end of a range, so that q does not write what it reads.
  bool hp_readable(int q, int t, std::size_t offset, std::size_t size) {
    if (q == t) return false;
    const std::size_t part = model_.block(t, hp_block).size() / at(p_);
    std::size_t& used = hp_used_[at(q * p_ + t)];
    if (at(q) * part + used > offset) return false;
    used = offset + size - at(q) * part;
    return true;
  }

  void send(int q) {
    send_to(q, pick(p_), pick(10) == 0 && big_ ? 50000U + pick_size(50000) : pick_size(40));
  }

  /// Of one size, now and then with another one between them.
  void run_of_messages(int q) {
    const int t = pick(p_);
    const std::size_t size = pick_size(20);
    for (int count = pick(big_ ? 400 : 20); count > 0; --count)
      send_to(q, t, pick(10) == 0 ? pick_size(20) : size);
  }

  void send_to(int q, int t, std::size_t size) {
    Message message{Bytes(model_.tag_size()), Bytes(size)};
    for (auto& byte : message.tag) byte = static_cast<unsigned char>(random_());
    for (auto& byte : message.payload) byte = static_cast<unsigned char>(random_());
    if (q == me_)
      bsp_send(t, message.tag.data(), message.payload.data(), static_cast<int>(message.payload.size()));
    model_.send(q, t, std::move(message));
  }

  // --- What all processes do together ---

  Registration uniform_registration(int b) {
    Registration r;
    for (int q = 0; q < p_; ++q) {
      r.block.push_back(b);
      r.size.push_back(model_.block(q, b).size());
    }
    return r;
  }

  /// Processes may register different blocks, parts of them, or NULL. Process 0 never does, since pop() looks
  /// there.
  Registration random_registration() {
    const int b = pick(ordinary_blocks);
    Registration r = uniform_registration(b);
    for (int q = 0; q < p_; ++q) {
      if (pick(3) == 0) r.block[at(q)] = q > 0 && pick(3) == 0 ? no_block : pick(ordinary_blocks);
      const std::size_t whole = r.block[at(q)] == no_block ? 0 : model_.block(q, r.block[at(q)]).size();
      r.size[at(q)] = pick(2) == 0 ? whole : pick_size(whole + 1);
    }
    return r;
  }

  void push(const Registration& r) {
    model_.push(r);
    const int b = r.block[at(me_)];
    bsp_push_reg(b == no_block ? nullptr : mine_[at(b)].data(), static_cast<int>(r.size[at(me_)]));
  }

  /// Pops a registration that is the newest one for the block of every process.
  void pop_any() {
    const auto& all = model_.upcoming();
    for (std::size_t tries = all.size(); tries-- > 0;) {
      const Registration r = all[tries];
      bool newest_everywhere = true;
      for (std::size_t later = tries + 1; later < all.size(); ++later)
        for (int q = 0; q < p_; ++q) newest_everywhere &= all[later].block[at(q)] != r.block[at(q)];
      if (!newest_everywhere) continue;
      const int b = r.block[at(me_)];
      model_.pop(r.block[0]);
      bsp_pop_reg(b == no_block ? nullptr : mine_[at(b)].data());
      return;
    }
  }

  void set_tag_size() {
    const std::size_t size = pick_size(12);
    int value = static_cast<int>(size);
    bsp_set_tagsize(&value);
    model_.set_tag_size(size);
  }

  void sync() {
    bsp_sync();
    const std::size_t tag_size = model_.tag_size();
    model_.sync();
    ++superstep_;
    for (int b = 0; b < blocks; ++b)
      if (mine_[at(b)] != model_.block(me_, b)) mismatch("memory of block " + std::to_string(b));
    check_messages(tag_size);
  }

  void check_messages(std::size_t tag_size) {
    int count = 0, bytes = 0;
    bsp_qsize(&count, &bytes);
    const auto& expected = model_.inbox(me_);
    if (at(count) != expected.size()) mismatch("number of messages");
    for (const Message& message : expected) {
      Bytes tag(tag_size + 1), payload(message.payload.size() + 1);
      int status = 0;
      bsp_get_tag(&status, tag.data());
      if (status != static_cast<int>(message.payload.size())) mismatch("size of a message");
      tag.resize(tag_size);
      if (tag != message.tag) mismatch("tag of a message");
      bsp_move(payload.data(), static_cast<int>(payload.size()));
      payload.resize(message.payload.size());
      if (payload != message.payload) mismatch("payload of a message");
    }
  }

  [[noreturn]] void mismatch(const std::string& what) {
    bsp_abort("MISMATCH seed %llu superstep %d process %d of %d: %s", static_cast<unsigned long long>(seed_),
              superstep_, me_, p_, what.c_str());
    std::abort();
  }

  static std::ptrdiff_t diff(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  std::uint64_t seed_;
  std::mt19937_64 random_;
  Model& model_;
  std::vector<Bytes>& mine_;
  int me_, p_, superstep_ = 0;
  bool big_ = false;
  std::vector<std::size_t> hp_used_;  ///< by writer and owner: bytes of the part that are taken
};

void run_seed(std::uint64_t seed, std::size_t& tag_size) {
  const std::size_t scale = seed % 40 == 0 ? 1500 : 1;
  const std::vector<std::size_t> sizes{64 * scale, 100 * scale, 37, 240 * scale, 240 * scale};
  Model model(bsp_nprocs(), sizes);
  model.set_tag_size(tag_size);
  model.sync();
  std::vector<Bytes> mine;
  for (const std::size_t size : sizes) mine.emplace_back(size);
  Program(seed, model, mine).run();
  tag_size = model.tag_size();
}

}  // namespace

int main(int argc, char** argv) {
  bsp_begin(bsp_nprocs());
  const std::uint64_t first = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1;
  const std::uint64_t count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000;
  std::size_t tag_size = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) run_seed(seed, tag_size);
  if (bsp_pid() == 0)
    std::printf("%llu random programs agree with the model, seeds %llu to %llu, %d processes\n",
                static_cast<unsigned long long>(count), static_cast<unsigned long long>(first),
                static_cast<unsigned long long>(first + count - 1), static_cast<int>(bsp_nprocs()));
  bsp_end();
  return 0;
}
