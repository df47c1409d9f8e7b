#pragma once

#include <string>

#include "import/parts_stream.hpp"

/// What the programs that read files for the model have in common (import/reader_process.hpp).
namespace bsp2::model {

/// What is asked of a program, by its arguments.
struct ReadRequest {
  std::string path;
  double fn = 0, fa = 12, fs = 2, deflection = 0;  ///< see Fineness
};

/// Runs `read`: limits the process, keeps what libraries print away from the pipe, and tells of exceptions.
/// @return the exit code.
int read_for_model(int argc, char** argv, void (*read)(const ReadRequest& request, PartsWriter& parts));

/// What is left to do may take long: it depends on what is asked for, no more on what is in the file alone.
void file_is_read();

/// For as long as it lives no more than what a file of its size may take is left to the process, as while it
/// was read: of what a library does to mend what is damaged, which may not end.
class MendingLimit {
 public:
  explicit MendingLimit(const std::string& path);
  ~MendingLimit();
  MendingLimit(const MendingLimit&) = delete;
  MendingLimit& operator=(const MendingLimit&) = delete;
};

}  // namespace bsp2::model
