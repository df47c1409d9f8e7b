#include "contact.hpp"

#include <algorithm>
#include <cstring>

namespace bsp2::supersteps {

void Contact::progress(double done, std::uint64_t cells) {
  mine_.done = std::min(done, share_);
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
    ranks_.wait();
    listen();
  }
}

void Contact::tell() {
  std::string bytes(sizeof mine_, '\0');
  std::memcpy(bytes.data(), &mine_, sizeof mine_);
  for (int rank = 0; rank < ranks_.count(); ++rank) ranks_.send(rank, bytes);
  ranks_.begin_sync();
}

void Contact::listen() {
  Status sum;
  all_finished_ = true;
  for (const Ranks::Message& message : ranks_.received()) {
    Status status;
    std::memcpy(&status, message.bytes.data(), sizeof status);
    sum.done += status.done;
    sum.cells += status.cells;
    all_finished_ = all_finished_ && status.finished;
  }
  if (report_ && ranks_.is_master()) report_(std::min(1.0, sum.done), sum.cells);
}

}  // namespace bsp2::supersteps
