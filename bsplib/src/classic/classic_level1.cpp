// The collectives of classic programs (bsp_level1.h), as messages of a queue of their own.
#define BSP2_NO_INLINE
#define BSP2_NO_PLACES
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

#include "bsp.h"
#include "bsp_level1.h"
#include "classic/classic_state.hpp"
#include "classic/grouping.hpp"
#include "support/copy.hpp"

namespace bsp2::bsplib::classic {

namespace {

using detail::Call;
using Operator = void (*)(void*, void*, void*, int*);

/// One call of a collective: its arguments are checked, and it can send and synchronize.
class Collective {
 public:
  Collective(const char* name, Call::Function function, int root, int bytes)
      : name_(name), world_(engine(name)), bytes_(static_cast<std::size_t>(bytes)) {
    if (bytes < 0) die(name, "The size was negative, which is illegal");
    if (root < 0 || root >= world_.nprocs())
      die(name, "Process " + std::to_string(root) + " does not exist, there are " +
                    std::to_string(world_.nprocs()));
    if (!state.has_level1_queue) guarded(name, [&] { state.level1_queue = world_.new_queue(); });
    state.has_level1_queue = true;
    call_ = {function, state.level1_queue, root, bytes_};
  }

  int me() const { return world_.pid(); }
  int p() const { return world_.nprocs(); }
  std::size_t bytes() const { return bytes_; }

  void needs(const void* memory, const char* what) const {
    if (!memory && bytes_ > 0) die(name_, std::string(what) + " is NULL");
  }
  void send(int to, const void* data, std::size_t bytes) {
    guarded(name_, [&] {
      world_.send(state.level1_queue, to, {}, {static_cast<const std::byte*>(data), bytes});
    });
  }
  void send(int to, const void* value) { send(to, value, bytes_); }
  /// Ends the superstep. @return what has come, by process number.
  std::span<const Message> sync() {
    classic::sync(name_, call_, std::exchange(is_second_, true));
    return world_.messages(state.level1_queue);
  }

 private:
  const char* name_;
  detail::Engine& world_;
  std::size_t bytes_;
  Call call_;
  bool is_second_ = false;  ///< messages that the program sent before are there after the whole call
};

std::byte* at(void* memory, std::size_t place) { return static_cast<std::byte*>(memory) + place; }

void copy(void* to, const void* from, std::size_t bytes) {
  if (bytes > 0) copy_bytes(static_cast<std::byte*>(to), static_cast<const std::byte*>(from), bytes);
}

/// Applies an operator to one value after the other. Each is copied first: for the operator's sake, which may
/// count on alignment and on arguments that do not overlap.
class Folding {
 public:
  Folding(Operator op, std::size_t bytes)
      : op_(op), bytes_(bytes), left_(room(bytes)), right_(room(bytes)), result_(room(bytes)) {}

  void add(const void* value) {
    if (!std::exchange(empty_, false)) {
      copy(right_.get(), value, bytes_);
      int bytes = static_cast<int>(bytes_);
      op_(result_.get(), left_.get(), right_.get(), &bytes);
      left_.swap(result_);
    } else {
      copy(left_.get(), value, bytes_);
    }
  }
  bool empty() const { return empty_; }
  const void* value() const { return left_.get(); }

 private:
  using Room = std::unique_ptr<std::max_align_t[]>;
  static Room room(std::size_t bytes) {
    return Room(new std::max_align_t[bytes / sizeof(std::max_align_t) + 1]);
  }

  Operator op_;
  std::size_t bytes_;
  Room left_, right_, result_;
  bool empty_ = true;
};

void broadcast(int root, void* src, void* dst, int nbytes) {
  Collective all("bsp_bcast", Call::classic_broadcast, root, nbytes);
  all.needs(dst, "The destination");
  if (all.me() == root) all.needs(src, "The source");
  const std::size_t n = all.bytes();
  const auto p = static_cast<std::size_t>(all.p());
  const auto begin = [&](int process) { return n * static_cast<std::size_t>(process) / p; };
  const auto length = [&](int process) { return begin(process + 1) - begin(process); };
  const bool in_parts = scatters_first(all.p(), n, state.machine);
  for (int to = 0; all.me() == root && to < all.p(); ++to)
    if (to != root) all.send(to, in_parts ? at(src, begin(to)) : src, in_parts ? length(to) : n);
  const auto first = all.sync();
  if (all.me() == root) {
    copy(dst, src, n);
  } else {
    copy(at(dst, in_parts ? begin(all.me()) : 0), first[0].payload.data(), first[0].payload.size());
  }
  if (!in_parts) return;
  for (int to = 0; to < all.p(); ++to)
    if (to != root && to != all.me()) all.send(to, at(dst, begin(all.me())), length(all.me()));
  for (const Message& part : all.sync())
    copy(at(dst, begin(part.source)), part.payload.data(), part.payload.size());
}

void gather(int root, void* src, void* dst, int nbytes) {
  Collective all("bsp_gather", Call::classic_gather, root, nbytes);
  all.needs(src, "The source");
  if (all.me() == root) all.needs(dst, "The destination");
  if (all.me() != root) all.send(root, src);
  const auto values = all.sync();
  if (all.me() != root) return;
  copy(at(dst, static_cast<std::size_t>(root) * all.bytes()), src, all.bytes());
  for (const Message& value : values)
    copy(at(dst, static_cast<std::size_t>(value.source) * all.bytes()), value.payload.data(), all.bytes());
}

void scatter(int root, void* src, void* dst, int nbytes) {
  Collective all("bsp_scatter", Call::classic_scatter, root, nbytes);
  all.needs(dst, "The destination");
  if (all.me() == root) all.needs(src, "The source");
  const auto value = [&](int process) { return at(src, static_cast<std::size_t>(process) * all.bytes()); };
  for (int to = 0; all.me() == root && to < all.p(); ++to)
    if (to != root) all.send(to, value(to));
  const auto mine = all.sync();
  copy(dst, all.me() == root ? value(root) : mine[0].payload.data(), all.bytes());
}

/// One's own value travels, too: so src and dst may be the same.
void total_exchange(void* src, void* dst, int nbytes) {
  Collective all("bsp_total_exchange", Call::classic_total_exchange, 0, nbytes);
  all.needs(src, "The source");
  all.needs(dst, "The destination");
  for (int to = 0; to < all.p(); ++to) all.send(to, at(src, static_cast<std::size_t>(to) * all.bytes()));
  for (const Message& value : all.sync())
    copy(at(dst, static_cast<std::size_t>(value.source) * all.bytes()), value.payload.data(), all.bytes());
}

/// Whether a process hears of another one, or of its group: a fold asks all, a scan the lower ones.
bool counts(bool scans, int from, int to) { return !scans || from <= to; }

/// A fold or a scan: within the groups, then among them. In the second superstep each process tells the value
/// of its group.
void combine(Collective& all, Operator op, void* src, void* dst, bool scans) {
  const Groups groups = choose_groups(all.p(), all.bytes(), state.machine);
  const int me = all.me(), mine = groups.of(me), begin = groups.begin(mine), end = groups.begin(mine + 1);
  const bool alone = groups.count == 1;
  // Where groups follow, a scan needs the value of its whole group, too.
  for (int to = begin; to < end; ++to)
    if (counts(scans && alone, me, to)) all.send(to, src);
  Folding group(op, all.bytes()), prefix(op, all.bytes());
  for (const Message& value : all.sync()) {
    group.add(value.payload.data());
    if (scans && value.source <= me) prefix.add(value.payload.data());
  }
  if (!alone) {
    for (int to = 0; to < all.p(); ++to)
      if (counts(scans, mine, groups.of(to)) && groups.of(to) != mine && groups.teller(mine, to) == me)
        all.send(to, group.value());
    Folding sum(op, all.bytes());
    const auto values = all.sync();
    const auto add_own = [&] { sum.add(scans ? prefix.value() : group.value()); };
    std::size_t i = 0;
    for (; i < values.size() && values[i].source < begin; ++i) sum.add(values[i].payload.data());
    add_own();
    for (; i < values.size(); ++i) sum.add(values[i].payload.data());
    copy(dst, sum.value(), all.bytes());
  } else {
    copy(dst, group.value(), all.bytes());
  }
}

void combine(const char* name, Call::Function function, Operator op, void* src, void* dst, int nbytes) {
  Collective all(name, function, 0, nbytes);
  if (!op) die(name, "The operator is NULL");
  all.needs(src, "The source");
  all.needs(dst, "The destination");
  guarded(name, [&] { combine(all, op, src, dst, function == Call::classic_scan); });
}

template <class T, class Function>
void apply(void* result, const void* left, const void* right, Function function) {
  *static_cast<T*>(result) = function(*static_cast<const T*>(left), *static_cast<const T*>(right));
}

/// A collective over one number each. Sums of int wrap around, as elsewhere in the layer nothing is
/// undefined.
struct Sum {
  template <class T>
  T operator()(T a, T b) const {
    if constexpr (std::is_same_v<T, int>)
      return static_cast<int>(static_cast<unsigned>(a) + static_cast<unsigned>(b));
    return a + b;
  }
};
struct Product {
  template <class T>
  T operator()(T a, T b) const {
    if constexpr (std::is_same_v<T, int>)
      return static_cast<int>(static_cast<unsigned>(a) * static_cast<unsigned>(b));
    return a * b;
  }
};
struct Least {
  template <class T>
  T operator()(T a, T b) const {
    return std::min(a, b);
  }
};
struct Most {
  template <class T>
  T operator()(T a, T b) const {
    return std::max(a, b);
  }
};

template <class T, class Function>
T of_one(const char* name, bool scans, T x) {
  const Operator op = [](void* result, void* left, void* right, int*) {
    apply<T>(result, left, right, Function());
  };
  T all{};
  combine(name, scans ? Call::classic_scan : Call::classic_fold, op, &x, &all, static_cast<int>(sizeof x));
  return all;
}

}  // namespace

}  // namespace bsp2::bsplib::classic

namespace classic = bsp2::bsplib::classic;
using classic::Call;

extern "C" {

void bsp_bcast(int root, void* src, void* dst, int nbytes) { classic::broadcast(root, src, dst, nbytes); }
void bsp_gather(int root, void* src, void* dst, int nbytes) { classic::gather(root, src, dst, nbytes); }
void bsp_scatter(int root, void* src, void* dst, int nbytes) { classic::scatter(root, src, dst, nbytes); }
void bsp_total_exchange(void* src, void* dst, int nbytes) { classic::total_exchange(src, dst, nbytes); }
void bsp_fold(BSP2_OPERATOR(op), void* src, void* dst, int nbytes) {
  classic::combine("bsp_fold", Call::classic_fold, op, src, dst, nbytes);
}
void bsp_reduce(BSP2_OPERATOR(op), void* src, void* dst, int nbytes) {
  classic::combine("bsp_reduce", Call::classic_fold, op, src, dst, nbytes);
}
void bsp_scan(BSP2_OPERATOR(op), void* src, void* dst, int nbytes) {
  classic::combine("bsp_scan", Call::classic_scan, op, src, dst, nbytes);
}

#define BSP2_OF_ONE(name, type, function)                                                              \
  type bsp_##name(type x) { return classic::of_one<type, classic::function>("bsp_" #name, false, x); } \
  type bsp_##name##_prefix(type x) {                                                                   \
    return classic::of_one<type, classic::function>("bsp_" #name "_prefix", true, x);                  \
  }
BSP2_OF_ONE(sumI, int, Sum)
BSP2_OF_ONE(sumR, float, Sum)
BSP2_OF_ONE(sumD, double, Sum)
BSP2_OF_ONE(productI, int, Product)
BSP2_OF_ONE(productR, float, Product)
BSP2_OF_ONE(productD, double, Product)
BSP2_OF_ONE(minI, int, Least)
BSP2_OF_ONE(minR, float, Least)
BSP2_OF_ONE(minD, double, Least)
BSP2_OF_ONE(maxI, int, Most)
BSP2_OF_ONE(maxR, float, Most)
BSP2_OF_ONE(maxD, double, Most)
#undef BSP2_OF_ONE

int bsp_all(int x) { return classic::of_one<int, classic::Least>("bsp_all", false, x != 0); }
int bsp_any(int x) { return classic::of_one<int, classic::Most>("bsp_any", false, x != 0); }
int bsp_constantI(int x) {
  struct Range {
    int least, most;
  } mine{x, x}, all{};
  const classic::Operator op = [](void* result, void* left, void* right, int*) {
    const auto *a = static_cast<const Range*>(left), *b = static_cast<const Range*>(right);
    *static_cast<Range*>(result) = {std::min(a->least, b->least), std::max(a->most, b->most)};
  };
  classic::combine("bsp_constantI", Call::classic_fold, op, &mine, &all, static_cast<int>(sizeof mine));
  return all.least == all.most;
}

double bsp_s(void) {
  classic::engine("bsp_s");
  return classic::state.machine.r;
}
double bsp_l(void) {
  classic::engine("bsp_l");
  return classic::state.machine.l * classic::state.machine.r;
}
double bsp_g(void) {
  classic::engine("bsp_g");
  return 4 * classic::state.machine.g * classic::state.machine.r;
}
int bsp_nhalf(void) {
  classic::engine("bsp_nhalf");
  const double words = classic::state.machine.l / (4 * classic::state.machine.g);
  return static_cast<int>(std::clamp(std::ceil(words), 1.0, 1e9));
}

}  // extern "C"
