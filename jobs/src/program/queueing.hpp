#pragma once

#include <filesystem>
#include <iosfwd>

#include "options/command_line.hpp"

namespace bsp2::jobs {

/// `bsp2 tables`. It needs no ranks: the nodes of a cluster are measured one after the other.
void tables_command(const RunCommand& command, std::ostream& out);

/// `bsp2 jobs split`, `run` and `status`. @return the exit code.
int queue_command(const RunCommand& command, std::ostream& speech);

/// The results of a queue as a snapshot to be resumed: the one that is asked for, else one that goes when
/// this does. Made and gone on all ranks together.
class JoinedSnapshot {
 public:
  JoinedSnapshot(const RunCommand& command, const Ranks& ranks);
  ~JoinedSnapshot();
  JoinedSnapshot(const JoinedSnapshot&) = delete;
  JoinedSnapshot& operator=(const JoinedSnapshot&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool is_mine_ = false;
};

}  // namespace bsp2::jobs
