#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace bsp2::samples {

/// How a command has ended, and what it has printed on standard output and standard error.
struct Ended {
  int code;  ///< 128 + the signal if one ended it
  std::string text;
};

/// Runs a command of the shell to its end.
inline Ended run_command(const std::string& command) {
  std::FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text};
}

/// What a command prints. It is expected to end with exit code 0.
inline std::string printed(const std::string& command) {
  const Ended ended = run_command(command);
  EXPECT_EQ(ended.code, 0) << command << "\n" << ended.text;
  return ended.text;
}

}  // namespace bsp2::samples
