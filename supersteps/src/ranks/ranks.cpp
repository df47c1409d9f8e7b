#include "bsp2/supersteps/ranks/ranks.hpp"

#include <mpi.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/mpi/environment.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <new>
#include <optional>
#include <thread>

#include "bsp2/bsplib/world.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "ranks/exchange.hpp"
#include "ranks/signs_of_life.hpp"

namespace bsp2::supersteps {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One superstep on this rank; its name is the same on all.
struct Entry {
  std::string name;
  unsigned step = 0;
  double seconds = 0, waited = 0, hidden = 0;
  std::uint64_t bytes_sent = 0, bytes_received = 0, syncs = 0, cells = 0;
  std::uint64_t hidden_sent = 0, hidden_received = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& name& step& seconds& waited& hidden& bytes_sent& bytes_received& syncs& cells& hidden_sent&
        hidden_received;
  }
};

/// The number of ranks if the launcher says it; 0 if it only says that there is one; 1 if there is none.
unsigned launched_ranks() {
  const auto number = [](const char* variable) {
    return static_cast<unsigned>(std::max(0L, std::strtol(std::getenv(variable), nullptr, 10)));
  };
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (std::getenv(variable) != nullptr) return number(variable);
  const unsigned tasks = std::getenv("SLURM_STEP_NUM_TASKS") != nullptr ? number("SLURM_STEP_NUM_TASKS") : 0;
  if (std::getenv("PMIX_RANK") != nullptr) return tasks;
  if (tasks > 1 && std::getenv("SLURM_STEP_ID") != nullptr && std::getenv("PMI_RANK") == nullptr)
    throw Error("srun started " +
                counted(tasks, "# task[s] that cannot find each other; start them with 'srun --mpi=pmix'"));
  return 1;
}

/// How a failure travels: whose mistake it is, then the superstep, then the text.
enum Culprit : char { user = 'u', ours = 'o' };

std::string written(Culprit culprit, const std::string& superstep, const std::string& text) {
  return std::string(1, culprit).append(superstep).append("\n").append(text);
}

/// What the user reads: what went wrong, and where.
std::string with_place(std::string text, const std::string& superstep, int rank) {
  text.append(" (").append(superstep);
  return text.append(superstep.empty() ? "rank " : ", rank ").append(std::to_string(rank)).append(")");
}

/// Ends all ranks if they do not agree on a failure in time: one may be busy for minutes with what it does
/// alone, or wait in a call that the failure has made hopeless. The launcher does it; what is unfinished then
/// stays, as after a kill.
class LastResort {
 public:
  /// @param message what it says then; empty: it has been said.
  LastResort(const std::string& message, int code, std::chrono::milliseconds patience)
      : message_(message.empty() ? message : "bsp2: " + message + "\n"),
        code_(code),
        patience_(patience),
        thread_([this] { watch(); }) {}
  ~LastResort() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    change_.notify_one();
    thread_.join();
  }
  LastResort(const LastResort&) = delete;
  LastResort& operator=(const LastResort&) = delete;

 private:
  std::string message_;
  int code_;
  std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::condition_variable change_;
  bool over_ = false;
  std::thread thread_;  // the last one: it uses the others

  void watch() {
    std::unique_lock lock(mutex_);
    if (change_.wait_for(lock, patience_, [this] { return over_; })) return;
    [[maybe_unused]] const auto written = write(STDERR_FILENO, message_.data(), message_.size());
    boost::mpi::environment::abort(
        code_);  // not by the thread that MPI allows, which is stuck in it: nothing else ends all
  }
};

/// While one lives, this rank waits for others.
class Waiting {
 public:
  explicit Waiting(std::optional<SignsOfLife>& signs) : signs_(signs) {
    if (signs_) signs_->set_waiting(true);
  }
  ~Waiting() {
    if (signs_) signs_->set_waiting(false);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

 private:
  std::optional<SignsOfLife>& signs_;
};

/// Does a step that may never end; without a watch where there is no memory for its message or its thread.
template <typename Message, typename Step>
void watched(Message message, int code, std::chrono::milliseconds patience, Step step) {
  std::optional<LastResort> last_resort;
  try {
    last_resort.emplace(message(), code, patience);
  } catch (...) {
  }
  step();
}
constexpr std::chrono::seconds short_patience{4}, long_patience{60};

/// Where several ranks fail at once, the first that speaks shall have ended the others before they do.
std::chrono::milliseconds staggered(std::chrono::milliseconds patience, int rank) {
  return patience + std::chrono::milliseconds(300) * std::min(rank, 8);
}

[[noreturn]] void throw_agreed(const bsplib::Error& error) {
  const std::string& detail = error.detail();
  const auto end = detail.find('\n');
  if (error.code() == bsplib::Errc::ended_early)
    throw Error("rank " + std::to_string(error.culprit()) +
                " has ended while others go on: all ranks have to make the same calls in the same order");
  if (error.code() != bsplib::Errc::exception || end == std::string::npos)
    throw Failure("internal error: " + std::string(error.what()));
  const std::string superstep = detail.substr(1, end - 1);
  const std::string text = with_place(detail.substr(end + 1), superstep, error.culprit());
  if (detail[0] == Culprit::user) throw Error(text);
  throw Failure(text);
}

}  // namespace

Cause cause_of_exception() {
  try {
    throw;
  } catch (const Error& error) {
    return {error.what(), true};
  } catch (const AgreedFailure& failure) {
    return {failure.what(), failure.is_users};
  } catch (const Failure& failure) {
    return {failure.what(), false};
  } catch (const std::filesystem::filesystem_error& error) {
    return {"'" + error.path1().string().substr(0, 200) + "': " + error.code().message(), true};
  } catch (const std::bad_alloc&) {
    return {"out of memory", false};  // short enough to need none
  } catch (const std::exception& error) {
    return {std::string("internal error: ") + error.what(), false};
  } catch (...) {
    return {"internal error: an exception of unknown type", false};
  }
}

class Ranks::Implementation {
 public:
  Implementation() = default;
  explicit Implementation(std::unique_ptr<boost::mpi::environment> environment)
      : environment_(std::move(environment)),
        signs_(std::in_place),
        world_(std::in_place),
        queue_(world_->new_queue()) {
    MPI_Comm_create_keyval(MPI_COMM_NULL_COPY_FN, &Implementation::mpi_ends, &key_, nullptr);
    MPI_Comm_set_attr(MPI_COMM_SELF, key_, this);
  }
  ~Implementation() {
    if (key_ != MPI_KEYVAL_INVALID) {
      const int key = std::exchange(key_, MPI_KEYVAL_INVALID);
      MPI_Comm_delete_attr(MPI_COMM_SELF, key);
    }
    leave(true);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  [[nodiscard]] int rank() const { return world_ ? world_->pid() : 0; }
  [[nodiscard]] int count() const { return world_ ? world_->nprocs() : 1; }

  void together(const std::function<void()>& program) {
    if (!world_) return program();
    try {
      supervised(program);
    } catch (const AgreedFailure& failure) {  // all know of it already
      if (failure.is_users) throw Error(failure.what());
      throw Failure(failure.what());
    } catch (const bsplib::Error& error) {
      others_left_ = error.code() == bsplib::Errc::ended_early;
      failed_ = others_left_ ||
                        (error.code() == bsplib::Errc::exception && error.detail().starts_with(Culprit::user))
                    ? 2
                    : 1;
      throw_agreed(error);
    }
  }

  [[nodiscard]] std::string superstep() const {
    return entries_.empty() ? std::string() : entries_[current_].name;
  }

  [[nodiscard]] Phase phase() const { return phase_; }

  void begin(const std::string& name, unsigned step, Phase phase) {
    close_entry();
    phase_ = phase;
    if (entries_.empty()) first_ = Clock::now();
    const auto same = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return entry.name == name && entry.step == step;
    });
    current_ = static_cast<std::size_t>(same - entries_.begin());
    if (same == entries_.end()) entries_.push_back({name, step});
    begun_ = Clock::now();
    if (signs_) signs_->set_superstep(step == 0 ? name : name + " " + std::to_string(step));
  }
  void restart() {
    close_entry();
    entries_.clear();
    current_ = 0;
  }
  void set_timeout(double seconds) {
    if (signs_) signs_->set_timeout(seconds);
  }
  [[nodiscard]] double timeout() const { return signs_ ? signs_->timeout() : 0; }
  void count_cells(std::uint64_t cells) { entries_.at(current_).cells += cells; }

  [[nodiscard]] double seconds() const { return entries_.empty() ? 0 : seconds_since(first_); }

  [[nodiscard]] const std::vector<Entry>& entries() {
    close_entry();
    return entries_;
  }
  [[nodiscard]] std::optional<bsplib::Machine> machine() const {
    return world_ ? world_->machine() : std::nullopt;
  }

  void send(int to, std::string_view bytes) {
    if (to != rank()) unsent_ += bytes.size();
    if (to == rank())
      own_.emplace_back(bytes);
    else if (!world_)
      throw std::out_of_range("there is no rank " + std::to_string(to));
    else
      world_->send(queue_, to, {}, std::as_bytes(std::span(bytes)));
  }

  void begin_sync() {
    received_.clear();
    delivered_ = std::move(own_);
    own_.clear();
    sent_ = std::exchange(unsent_, 0);
    if (world_) open_.reset(new bsplib::OpenSuperstep(world_->open()));
    is_syncing_ = true;
  }
  void hide(double seconds) { hidden_ += seconds; }
  /// The sync has begun, or ended, while workers compute.
  void hide_sent() { hidden_sent_ += sent_; }
  void hide_received() {
    for (const Message& message : received_)
      if (message.source != rank()) hidden_received_ += message.bytes.size();
  }

  bool try_sync() {
    if (world_) {
      signs_->touch();
      if (!open_->poll()) return false;
      const auto start = Clock::now();
      const std::unique_ptr<bsplib::OpenSuperstep> open = std::move(open_);
      const Waiting waiting(signs_);
      open->close();
      waited_ += seconds_since(start);
      for (const bsplib::Message& message : world_->messages(queue_))
        received_.push_back(
            {message.source,
             {reinterpret_cast<const char*>(message.payload.data()), message.payload.size()}});
    }
    const auto place = std::find_if(received_.begin(), received_.end(),
                                    [this](const Message& message) { return message.source > rank(); });
    std::vector<Message> own;
    for (const std::string& bytes : delivered_) own.push_back({rank(), bytes});
    received_.insert(place, own.begin(), own.end());
    is_syncing_ = false;
    return true;
  }

  /// Sleeps ever longer, an eighth of the time waited so far and up to a millisecond: no wait becomes much
  /// longer than it has to be.
  void wait() {
    constexpr double short_wait = 0.5e-3, longest_sleep = 1e-3;
    const auto start = Clock::now();
    const Waiting waiting(signs_);
    while (!try_sync()) {
      const double waited = seconds_since(start);
      if (waited < short_wait)
        std::this_thread::yield();
      else
        std::this_thread::sleep_for(std::chrono::duration<double>(std::min(waited / 8, longest_sleep)));
    }
    waited_ += seconds_since(start);
  }

  [[nodiscard]] bool is_syncing() const { return is_syncing_; }
  [[nodiscard]] const std::vector<Message>& received() const { return received_; }

 private:
  std::unique_ptr<boost::mpi::environment> environment_;  // ends MPI after the world, if it started it
  int key_ = MPI_KEYVAL_INVALID;        // of what is attached to MPI_COMM_SELF, as long as MPI runs
  std::optional<SignsOfLife> signs_;    // as the world
  std::optional<bsplib::World> world_;  // none: this process alone
  std::uint32_t queue_ = 0;
  std::unique_ptr<bsplib::OpenSuperstep> open_;
  bool is_syncing_ = false;
  int failed_ = 0;            // the exit code that all agreed on
  bool others_left_ = false;  // they wait in the end of MPI
  std::vector<Message> received_;
  std::vector<std::string> own_, delivered_;  // messages to itself do not travel

  std::vector<Entry> entries_;
  std::size_t current_ = 0;
  Phase phase_ = Phase::preparation;
  Clock::time_point first_ = Clock::now(), begun_ = first_;
  double waited_ = 0, hidden_ = 0;
  std::uint64_t unsent_ = 0, sent_ = 0;  // bytes for others: for the next sync, and of the last one
  std::uint64_t hidden_sent_ = 0, hidden_received_ = 0;
  std::uint64_t bytes_sent_ = 0, bytes_received_ = 0, syncs_ = 0;  // up to the entry at hand

  /// MPI deletes what is attached to MPI_COMM_SELF as the first act of its end: somebody else, as mpi4py, may
  /// end it before this is gone.
  static int mpi_ends(MPI_Comm, int, void* self, void*) {
    auto& implementation = *static_cast<Implementation*>(self);
    if (std::exchange(implementation.key_, MPI_KEYVAL_INVALID) != MPI_KEYVAL_INVALID)
      implementation.leave(false);
    return MPI_SUCCESS;
  }

  /// After a failure, files that could not be written may keep MPI from its end. First all have to be here:
  /// until then the master may be about to say what went wrong. @param ends_mpi if it is ours.
  void leave(bool ends_mpi) {
    open_.reset();
    signs_.reset();
    if (!world_) return;
    if (failed_ == 0) return world_.reset();
    const auto said = [] { return std::string(); };
    if (!others_left_) watched(said, failed_, long_patience, [] { MPI_Barrier(MPI_COMM_WORLD); });
    watched(said, failed_, others_left_ ? long_patience : short_patience, [&] {
      world_.reset();
      if (ends_mpi) environment_.reset();
    });
  }

  void supervised(const std::function<void()>& program) {
    const auto fail = [&](Culprit culprit, const char* text) {
      const auto message = [&] { return with_place(text, superstep(), rank()); };
      watched(message, culprit == user ? 2 : 1, staggered(short_patience, rank()), [&] {
        open_.reset();
        world_->fail(written(culprit, superstep(), text));
      });
    };
    try {
      program();
    } catch (const AgreedFailure&) {
      throw;
    } catch (const bsplib::Error& error) {
      if (error.agreed()) throw;
      fail(ours, error.what());
    } catch (...) {
      const Cause cause = cause_of_exception();
      fail(cause.is_users ? user : ours, cause.text.c_str());
    }
  }

  void close_entry() {
    const bsplib::CostReport nothing;
    const bsplib::CostReport& costs = world_ ? world_->costs() : nothing;
    if (!entries_.empty()) {
      Entry& entry = entries_[current_];
      entry.seconds += seconds_since(begun_);
      entry.waited += waited_;
      entry.hidden += hidden_;
      entry.hidden_sent += hidden_sent_;
      entry.hidden_received += hidden_received_;
      entry.bytes_sent += costs.bytes_out - bytes_sent_;
      entry.bytes_received += costs.bytes_in - bytes_received_;
      entry.syncs += costs.supersteps - syncs_;
    }
    begun_ = Clock::now();
    waited_ = hidden_ = 0;
    hidden_sent_ = hidden_received_ = 0;
    bytes_sent_ = costs.bytes_out;
    bytes_received_ = costs.bytes_in;
    syncs_ = costs.supersteps;
  }
};

Ranks::Ranks() : Ranks(std::make_unique<Implementation>()) {}
Ranks::Ranks(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Ranks::Ranks(Ranks&&) noexcept = default;
Ranks::~Ranks() = default;

std::string Ranks::library() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = "";
  int size = 0;
  MPI_Get_library_version(text, &size);
  const std::string version(text);
  return version.substr(0, version.find(','));  // what follows is who packed it, and where
}

Ranks Ranks::launched() {
  if (launched_ranks() == 1) return {};
  return Ranks(std::make_unique<Implementation>(
      std::make_unique<boost::mpi::environment>(boost::mpi::threading::funneled)));
}

int Ranks::rank() const { return implementation_->rank(); }
int Ranks::count() const { return implementation_->count(); }

unsigned Ranks::cores_of_a_rank() {
  std::array<char, 256> node{};
  gethostname(node.data(), node.size() - 1);
  cpu_set_t allowed;  // the launcher may have bound this rank to some cores
  CPU_ZERO(&allowed);
  const bool known = sched_getaffinity(0, sizeof allowed, &allowed) == 0;
  const unsigned cores =
      known ? static_cast<unsigned>(CPU_COUNT(&allowed)) : std::thread::hardware_concurrency();
  const std::string mine =
      std::string(node.data()) + '\n' + std::string(reinterpret_cast<const char*>(&allowed), sizeof allowed);
  const auto all = all_gather(*this, mine);
  return std::max(1U, cores / static_cast<unsigned>(std::count(all.begin(), all.end(), mine)));
}

void Ranks::together(const std::function<void()>& program) { implementation_->together(program); }

void Ranks::agree(const std::function<void()>& work) {
  if (count() == 1) return work();
  std::string mine;  // whose mistake it is, then the text; empty if there is none
  try {
    work();
  } catch (const bsplib::Error&) {
    throw;  // the ranks have lost each other
  } catch (...) {
    const Cause cause = cause_of_exception();
    mine = std::string(1, cause.is_users ? user : ours).append(cause.text);
  }
  const auto all = all_gather(*this, mine);
  for (int rank = 0; rank < count(); ++rank)
    if (const std::string& text = all[static_cast<std::size_t>(rank)]; !text.empty())
      throw AgreedFailure(with_place(text.substr(1), implementation_->superstep(), rank),
                          text.front() == Culprit::user);
}

void Ranks::restart() { implementation_->restart(); }
Phase Ranks::phase() const { return implementation_->phase(); }
void Ranks::begin(const std::string& name, unsigned step, Phase phase) {
  implementation_->begin(name, step, phase);
  if (on_superstep) on_superstep(name, step);
}
void Ranks::count_cells(std::uint64_t cells) { implementation_->count_cells(cells); }

std::vector<SuperstepRecord> Ranks::records() {
  const auto all = gather(*this, std::vector<Entry>(implementation_->entries()));
  std::vector<SuperstepRecord> records;
  for (std::size_t i = 0; !all.empty() && i < all.front().size(); ++i) {
    SuperstepRecord& record = records.emplace_back();
    record.name = all.front()[i].name;
    record.step = all.front()[i].step;
    std::uint64_t h = 0, hidden_h = 0, syncs = 0;
    for (const auto& entries : all) {
      const Entry& entry = entries.at(i);
      record.seconds.push_back(entry.seconds);
      record.work_seconds.push_back(entry.seconds - entry.waited);
      record.hidden_seconds.push_back(entry.hidden);
      record.bytes_sent.push_back(entry.bytes_sent);
      record.bytes_received.push_back(entry.bytes_received);
      record.cells.push_back(entry.cells);
      h = std::max({h, entry.bytes_sent, entry.bytes_received});
      record.hidden_bytes.push_back(std::max(entry.hidden_sent, entry.hidden_received));
      hidden_h = std::min(h, std::max(hidden_h, record.hidden_bytes.back()));
      syncs = std::max(syncs, entry.syncs);
    }
    record.predicted_seconds = *std::max_element(record.work_seconds.begin(), record.work_seconds.end());
    if (const auto machine = implementation_->machine())
      record.predicted_seconds =
          std::max(record.predicted_seconds, machine->g * static_cast<double>(hidden_h)) +
          machine->g * static_cast<double>(h - hidden_h) + machine->l * static_cast<double>(syncs);
  }
  return records;
}

void Ranks::set_timeout(double seconds) { implementation_->set_timeout(seconds); }
double Ranks::timeout() const { return implementation_->timeout(); }
double Ranks::seconds() const { return implementation_->seconds(); }

void Ranks::send(int to, std::string_view bytes) { implementation_->send(to, bytes); }
void Ranks::sync() {
  implementation_->begin_sync();
  wait();
}
void Ranks::wait() { implementation_->wait(); }
void Ranks::begin_sync() {
  const auto start = Clock::now();
  implementation_->begin_sync();
  implementation_->hide_sent();
  implementation_->hide(seconds_since(start));
}
bool Ranks::try_sync() {
  const auto start = Clock::now();
  const bool done = implementation_->try_sync();
  if (done) implementation_->hide_received();
  implementation_->hide(seconds_since(start));
  return done;
}
void Ranks::hide(double seconds) { implementation_->hide(seconds); }
bool Ranks::is_syncing() const { return implementation_->is_syncing(); }
const std::vector<Ranks::Message>& Ranks::received() const { return implementation_->received(); }

}  // namespace bsp2::supersteps
