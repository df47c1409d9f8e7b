#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace bsp2::supersteps {

/// What a superstep is for.
enum class Phase : std::uint8_t {
  preparation,  ///< a run finds out what there is to do, or reads a snapshot: it has found nothing yet
  computation,  ///< it refines cells
  completion    ///< what it has found is brought together, saved, drawn and written
};

/// What a superstep cost, one value a rank.
struct SuperstepRecord {
  std::string name;
  unsigned step = 0;
  std::vector<double> seconds;  ///< from its begin to that of the next
  std::vector<double>
      work_seconds;  ///< without the time in which the rank only waited for others; w is the longest
  std::vector<double>
      hidden_seconds;  ///< that the main thread communicated while workers computed; not in snapshots
  std::vector<std::uint64_t> bytes_sent, bytes_received, cells;
  std::vector<std::uint64_t>
      hidden_bytes;  ///< sent or received, whichever is more, while workers computed; not in snapshots
  double predicted_seconds = 0.0;  ///< w + g h + l; h is the largest of bytes sent and received. Of w and
                                   ///< what is hidden of g h, the longer one
};

/// The text of an error of ours that all ranks agreed on.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A part of a run has failed, on all ranks alike: they may go on with another part.
class AgreedFailure : public std::runtime_error {
 public:
  AgreedFailure(const std::string& text, bool users) : std::runtime_error(text), is_users(users) {}
  bool is_users;  ///< a mistake of the user, as bsp2::Error; else of ours
};

/// What a person is told of an exception.
struct Cause {
  std::string text;
  bool is_users = false;  ///< a mistake of the user; else of ours
};
/// Of the exception that is being handled: a bsp2::Error is the user's mistake, all others are ours.
Cause cause_of_exception();

/// The ranks that evaluate one model together: all processes that a launcher (mpirun, srun) started with this
/// one, or this one alone. Alone, MPI is never touched.
///
/// Thread rule: the main thread makes all calls. "Collective" means that all ranks call the function in the
/// same order. If one rank fails, its `together` tells the others, whose next collective call throws: no rank
/// waits for ever. A rank that waits gives way, and sleeps before long, so that its cores serve the others.
class Ranks {
 public:
  /// This process alone.
  Ranks();
  /// Those that a launcher started, by what it left in the environment. Starts MPI if there is more than one.
  /// @throws bsp2::Error if a launcher is there that MPI will not understand.
  static Ranks launched();
  /// Name and version of the MPI library, as "Open MPI v4.1.4". Not collective, needs no MPI that has been
  /// started.
  static std::string library();
  Ranks(Ranks&&) noexcept;
  Ranks& operator=(Ranks&&) = delete;
  ~Ranks();

  [[nodiscard]] int rank() const;
  [[nodiscard]] int count() const;
  [[nodiscard]] bool is_master() const { return rank() == 0; }
  /// Cores of this node for each of the ranks on it, at least 1. Collective.
  unsigned cores_of_a_rank();

  /// After how many seconds without a sign of life from a rank those that wait for it end the run; 0: never.
  /// At first what the environment says (BSP2_TIMEOUT), else 300.
  void set_timeout(double seconds);
  [[nodiscard]] double timeout() const;

  /// Runs a program that all ranks run. An exception that leaves it on one of them is thrown on all: a
  /// bsp2::Error as such, others as Failure; with more than one rank the text ends with the superstep and the
  /// rank where it arose. Collective.
  void together(const std::function<void()>& program);

  /// Does this rank's own part of something that may fail without ending the run; then the ranks tell each
  /// other how it went. Collective; `work` is not, and sends nothing.
  /// @throws AgreedFailure on all ranks if it failed on one of them. A process alone is told by what `work`
  /// throws.
  void agree(const std::function<void()>& work);

  // --- Supersteps ---

  /// Another run begins: what has been recorded is forgotten, and time counts from its first superstep.
  void restart();
  /// The work of a superstep begins here. One that goes on is begun again.
  void begin(const std::string& name, unsigned step = 0, Phase phase = Phase::completion);
  /// Of the superstep that was begun last.
  [[nodiscard]] Phase phase() const;
  /// Cells that the superstep made or moved on this rank, for its record.
  void count_cells(std::uint64_t cells);
  /// The records of all supersteps so far, on the master. Collective.
  std::vector<SuperstepRecord> records();
  /// Since the first superstep began.
  [[nodiscard]] double seconds() const;
  /// Called when a superstep begins, on each rank.
  std::function<void(const std::string& name, unsigned step)> on_superstep;

  // --- Messages: there at the next sync, and until the one after it ---

  struct Message {
    int source;
    std::string_view bytes;
  };
  void send(int to, std::string_view bytes);
  /// Collective. All that was sent is received when it returns.
  void sync();
  /// Begins a sync that goes on while this rank works; meanwhile nothing can be sent. Collective, as the
  /// sync.
  void begin_sync();
  /// Whether the sync that was begun is complete.
  bool try_sync();
  /// Completes the sync that was begun.
  void wait();
  [[nodiscard]] bool is_syncing() const;
  /// Time that the main thread spent with messages while workers computed, besides that of the sync itself.
  void hide(double seconds);
  /// In the order of the ranks, and of one rank in the order sent.
  [[nodiscard]] const std::vector<Message>& received() const;

 private:
  class Implementation;
  explicit Ranks(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bsp2::supersteps
