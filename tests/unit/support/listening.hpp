#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>

namespace bsp2::samples {

/// Waits until a process handles a signal, as its `SigCgt` of /proc says: on a busy machine, under a
/// sanitizer, it may take seconds to come so far. Gives up if the process ends, or after a minute.
inline void wait_for_handler(pid_t process, int signal) {
  const std::string status = "/proc/" + std::to_string(process) + "/status";
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
       std::chrono::steady_clock::now() < end;) {
    std::ifstream file(status);
    bool ended = !file;
    for (std::string word; file >> word;) {
      if (word == "State:" && file >> word && word == "Z") ended = true;
      if (word == "SigCgt:" && file >> word &&
          (std::stoull(word, nullptr, 16) >> static_cast<unsigned>(signal - 1) & 1U) != 0)
        return;
    }
    if (ended) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace bsp2::samples
