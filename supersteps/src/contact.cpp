#include "contact.hpp"

#include <algorithm>
#include <cstring>

namespace bsp2::supersteps {

void Contact::progress(double done, std::uint64_t cells) {
  mine_.done = std::min(done, share_);
  if (!done_at_first_) done_at_first_ = mine_.done;
  mine_.gained = mine_.done - *done_at_first_;
  mine_.left = share_ - mine_.done;
  mine_.cells = cells;
  if (ranks_.count() == 1) {
    if (report_) report_(mine_.done, mine_.cells);
    return;
  }
  if (ranks_.is_syncing()) {
    if (!ranks_.try_sync()) return;
    listen();
  }
  tell();
  ranks_.begin_sync();
}

void Contact::finish() {
  if (ranks_.count() == 1) return;
  mine_.done = share_;
  mine_.finished = true;
  if (ranks_.is_syncing()) {  // has been begun before the work was done
    ranks_.wait();
    listen();
  }
  while (!all_finished_) {
    tell();
    ranks_.sync();
    listen();
  }
}

void Contact::tell() {
  mine_.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  std::string bytes(sizeof mine_, '\0');
  std::memcpy(bytes.data(), &mine_, sizeof mine_);
  for (int rank = 0; rank < ranks_.count(); ++rank) ranks_.send(rank, bytes);
}

/// All ranks hear the same, and draw the same conclusions.
void Contact::listen() {
  Status sum;
  bool one_finished = false;
  double longest_to_come = 0, passed = 0;  // seconds
  all_finished_ = true;
  for (const Ranks::Message& message : ranks_.received()) {
    Status status;
    std::memcpy(&status, message.bytes.data(), sizeof status);
    sum.done += status.done;
    sum.cells += status.cells;
    all_finished_ = all_finished_ && status.finished;
    one_finished = one_finished || status.finished;
    passed = std::max(passed, status.seconds);
    // Space is a rough measure of work: what comes of it is only whether it is worth the trouble.
    if (!status.finished) longest_to_come = std::max(longest_to_come, status.gained > 0 ? status.seconds * status.left / status.gained : status.seconds);
  }
  if (!all_finished_ && !is_over_) {
    constexpr double worth_moving = 0.25;
    shall_move_ = limits_.move_after_seconds && one_finished && passed >= *limits_.move_after_seconds &&
                  longest_to_come >= worth_moving * std::max(passed, *limits_.move_after_seconds);
    is_over_ = shall_move_ || (limits_.cells && sum.cells >= *limits_.cells);
  }
  if (report_ && ranks_.is_master()) report_(std::min(1.0, sum.done), sum.cells);
}

}  // namespace bsp2::supersteps
