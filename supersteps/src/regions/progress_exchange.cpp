#include "regions/progress_exchange.hpp"

#include <algorithm>
#include <cstring>

namespace bsp2::supersteps {
namespace {

constexpr char a_status = 'S';  // messages of a stream begin with other letters

}  // namespace

void ProgressExchange::progress(double done, std::uint64_t cells, std::int64_t grown) {
  mine_.done = std::min(done, share_);
  if (!done_at_first_) done_at_first_ = mine_.done;
  mine_.gained = mine_.done - *done_at_first_;
  mine_.left = share_ - mine_.done;
  mine_.cells = recorded_ + cells;
  mine_.grown = grown;
  if (ranks_.count() == 1) {
    if (report_) report_(mine_.done, mine_.cells);
    return;
  }
  const bool is_syncing = ranks_.is_syncing();
  if (is_syncing && !ranks_.try_sync()) return;
  const auto start = Clock::now();
  if (is_syncing) listen();
  tell();
  ranks_.hide(std::chrono::duration<double>(Clock::now() - start).count());
  ranks_.begin_sync();
}

void ProgressExchange::finish() {
  if (ranks_.count() == 1) return;
  mine_.done = share_;
  mine_.finished = true;
  if (ranks_.is_syncing()) {  // has been begun before the work was done
    ranks_.wait();
    listen();
  }
  while (!all_done_) {
    tell();
    ranks_.sync();
    listen();
  }
}

void ProgressExchange::tell() {
  mine_.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  mine_.passed_on = stream_ != nullptr && stream_->send();
  mine_.full = stream_ != nullptr && stream_->is_full();
  std::string bytes(1 + sizeof mine_, a_status);
  std::memcpy(bytes.data() + 1, &mine_, sizeof mine_);
  for (int rank = 0; rank < ranks_.count(); ++rank) ranks_.send(rank, bytes);
}

std::vector<ProgressExchange::Status> ProgressExchange::take_messages() {
  std::vector<Status> all;
  for (const Ranks::Message& message : ranks_.received()) {
    if (message.bytes.front() == a_status)
      std::memcpy(&all.emplace_back(), message.bytes.data() + 1, sizeof(Status));
    else if (stream_ != nullptr)
      stream_->take(message.bytes);
  }
  return all;
}

/// All ranks hear the same, and draw the same conclusions.
void ProgressExchange::listen() {
  Status sum;
  bool one_finished = false, all_finished = true;
  double longest_to_come = 0, passed = 0;  // seconds
  for (const Status& status : take_messages()) {
    sum.done += status.done;
    sum.cells += status.cells;
    sum.grown += status.grown;
    sum.passed_on = sum.passed_on || status.passed_on;
    sum.full = sum.full || status.full;
    sum.ends_all = sum.ends_all || status.ends_all;
    all_finished = all_finished && status.finished;
    one_finished = one_finished || status.finished;
    passed = std::max(passed, status.seconds);
    // Space is a rough measure of work: what comes of it is only whether it is worth the trouble.
    if (!status.finished)
      longest_to_come = std::max(
          longest_to_come, status.gained > 0 ? status.seconds * status.left / status.gained : status.seconds);
  }
  all_done_ = all_finished && !sum.passed_on;
  if (sum.full) stream_->abandon();
  if (!all_finished && !is_over_) {
    constexpr double worth_moving = 0.25;
    shall_move_ = limits_.move_after_seconds && one_finished && passed >= *limits_.move_after_seconds &&
                  longest_to_come >= worth_moving * std::max(passed, *limits_.move_after_seconds);
    is_over_ = shall_move_ || sum.ends_all ||
               (limits_.cells && sum.grown >= 0 && static_cast<std::uint64_t>(sum.grown) >= *limits_.cells);
  }
  if (report_ && ranks_.is_master()) report_(std::min(1.0, sum.done), sum.cells);
}

}  // namespace bsp2::supersteps
