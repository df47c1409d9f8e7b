#include "ranks/signs_of_life.hpp"

#include <arpa/inet.h>
#include <mpi.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/mpi/environment.hpp>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <random>
#include <sstream>
#include <system_error>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"

namespace bsp2::supersteps {
namespace {

struct Sign {
  std::uint64_t token;
  std::uint32_t rank, zero;
};

sockaddr_in internet_address(std::uint32_t address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_addr.s_addr = address;
  result.sin_port = port;
  return result;
}

/// A socket that waits for nothing. @return -1 if there is none; else `port` is its own.
int listen(std::uint32_t& port) {
  const int number = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (number < 0) return -1;
  sockaddr_in any = internet_address(htonl(INADDR_ANY), 0);
  socklen_t size = sizeof any;
  if (::bind(number, reinterpret_cast<const sockaddr*>(&any), size) == 0 &&
      ::getsockname(number, reinterpret_cast<sockaddr*>(&any), &size) == 0) {
    port = any.sin_port;
    return number;
  }
  ::close(number);
  return -1;
}

/// The first address of a host. @return whether it has one.
bool find_host(const char* name, std::uint32_t& address) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(name, nullptr, &wanted, &found) != 0 || found == nullptr) return false;
  sockaddr_in first{};
  std::memcpy(&first, found->ai_addr, sizeof first);
  address = first.sin_addr.s_addr;
  ::freeaddrinfo(found);
  return true;
}

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Negative if the environment says something that is no number of seconds.
double timeout_of_environment() {
  constexpr double usual = 300, wrong = -1;
  const char* text = std::getenv("BSP2_TIMEOUT");
  if (text == nullptr || *text == '\0') return usual;
  char* end = nullptr;
  const double seconds = std::strtod(text, &end);
  return *end == '\0' && seconds >= 0 && seconds <= 1e9 ? seconds : wrong;
}

/// What "of rank 2" or "of the ranks 1, 3 and 4" needs.
std::string spoken(const std::vector<int>& ranks) {
  std::string text = counted(ranks.size(), "[rank|the ranks] ");
  for (std::size_t i = 0; i < ranks.size(); ++i)
    text += (i == 0 ? "" : i + 1 == ranks.size() ? " and " : ", ") + std::to_string(ranks[i]);
  return text;
}

}  // namespace

/// Where a rank listens, as it tells the others.
struct SignsOfLife::Place {
  std::array<char, 256> host{};
  std::uint64_t token = 0;
  double timeout = 0;
  std::uint32_t port = 0;  // 0: it does not
};

SignsOfLife::SignsOfLife() {
  int count = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count);
  Place mine;
  gethostname(mine.host.data(), mine.host.size() - 1);
  std::random_device random;
  mine.token = std::uint64_t{random()} << 32 | random();
  mine.timeout = timeout_of_environment();
  socket_ = listen(mine.port);
  std::vector<Place> all(static_cast<std::size_t>(count));
  MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all.data(), sizeof mine, MPI_BYTE, MPI_COMM_WORLD);
  if (all.front().timeout < 0) {
    if (socket_ >= 0) ::close(socket_);
    const char* text = std::getenv("BSP2_TIMEOUT");  // as the first rank has it, as a rule
    throw Error(std::string("BSP2_TIMEOUT must be a number of seconds, 0 for ever, not '") +
                (text == nullptr ? "" : text) + "'");
  }
  token_ = all.front().token;
  set_timeout(all.front().timeout);
  find(all, mine.host.data());
  sigset_t all_signals, before;  // they are the main thread's
  sigfillset(&all_signals);
  pthread_sigmask(SIG_SETMASK, &all_signals, &before);
  try {
    thread_ = std::thread([this] { watch(); });
  } catch (const std::system_error&) {
    // Others will never have heard of this rank, and it does not judge them.
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void SignsOfLife::find(const std::vector<Place>& places, const std::string& here) {
  std::string host;  // that was looked up last: the ranks of a node follow each other
  std::uint32_t address_of_host = 0;
  bool is_found = false;
  for (const Place& place : places) {
    const bool is_here = place.host.data() == here;
    if (!is_here && host != place.host.data()) {
      host = place.host.data();
      is_found = find_host(host.c_str(), address_of_host);
    }
    address_.push_back(is_here ? htonl(INADDR_LOOPBACK) : address_of_host);
    port_.push_back(static_cast<std::uint16_t>(is_here || is_found ? place.port : 0));
  }
  heard_.assign(places.size(), Clock::now());
  is_known_.assign(places.size(), false);
}

SignsOfLife::~SignsOfLife() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  change_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (socket_ >= 0) ::close(socket_);
}

void SignsOfLife::set_timeout(double seconds) {
  {
    const std::lock_guard lock(mutex_);
    timeout_ = seconds > 0 ? std::max(seconds, 1.0) : 0;  // less would be judged by chance
  }
  change_.notify_one();
}

double SignsOfLife::timeout() const {
  const std::lock_guard lock(mutex_);
  return timeout_;
}

void SignsOfLife::set_superstep(const std::string& name) {
  const std::lock_guard lock(mutex_);
  superstep_ = name;
}

void SignsOfLife::set_waiting(bool waits) {
  waiting_since_.store(waits ? Clock::now().time_since_epoch().count() : 0, std::memory_order_relaxed);
}

void SignsOfLife::watch() {
  try {
    watch_until_over();
  } catch (...) {
    // No memory for a message: nobody is judged any more, and this rank may be thought missing.
  }
}

void SignsOfLife::watch_until_over() {
  constexpr double longest_period = 5, share = 10;
  // A socket holds some 270 datagrams, by default.
  const double reads_a_period = std::max(1.0, static_cast<double>(port_.size()) / 100);
  Clock::time_point last = Clock::now(), next_sign = last;
  std::unique_lock lock(mutex_);
  while (!over_) {
    const double timeout = timeout_;
    const std::string superstep = superstep_;
    lock.unlock();
    const double period = timeout > 0 ? std::min(longest_period, timeout / share) : longest_period;
    const Clock::time_point now = Clock::now();
    // Who has been stopped itself cannot tell how long others have been silent.
    if (std::chrono::duration<double>(now - last).count() > std::max(3 * period, 1.0))
      std::fill(heard_.begin(), heard_.end(), now);
    last = now;
    receive(now);
    if (now >= next_sign) {
      if (is_well()) send();
      if (timeout > 0) judge(now, timeout, superstep);
      next_sign = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period));
    }
    lock.lock();
    change_.wait_for(lock, std::chrono::duration<double>(period / reads_a_period),
                     [&] { return over_ || timeout_ != timeout; });
    if (timeout_ != timeout) next_sign = Clock::now();
  }
}

/// Whether the process has done anything since this was asked, or waits for others.
bool SignsOfLife::is_well() {
  constexpr double least = 1e-3;
  const double computed = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - seconds_of(CLOCK_THREAD_CPUTIME_ID);
  const bool is_busy = computed - computed_ >= least;
  computed_ = computed;
  const bool touched = touched_.exchange(false, std::memory_order_relaxed);
  return is_busy || touched || waiting_since_.load(std::memory_order_relaxed) != 0;
}

void SignsOfLife::send() const {
  const Sign sign{token_, static_cast<std::uint32_t>(rank_), 0};
  for (std::size_t other = 0; other < port_.size(); ++other) {
    if (static_cast<int>(other) == rank_ || port_[other] == 0 || socket_ < 0) continue;
    const sockaddr_in to = internet_address(address_[other], port_[other]);
    // One that is lost is followed by others.
    ::sendto(socket_, &sign, sizeof sign, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
}

void SignsOfLife::receive(Clock::time_point now) {
  Sign sign{};
  while (socket_ >= 0) {
    const ssize_t bytes = ::recv(socket_, &sign, sizeof sign, MSG_DONTWAIT);
    if (bytes < 0) return;
    if (bytes != sizeof sign || sign.token != token_ || sign.rank >= heard_.size()) continue;
    heard_[sign.rank] = now;
    is_known_[sign.rank] = true;
  }
}

void SignsOfLife::judge(Clock::time_point now, double timeout, const std::string& superstep) const {
  const std::int64_t since = waiting_since_.load(std::memory_order_relaxed);
  if (since == 0) return;
  std::vector<int> missing;
  int before = 0;  // who may speak before this one does
  for (std::size_t other = 0; other < heard_.size(); ++other) {
    const int rank = static_cast<int>(other);
    if (rank != rank_ && is_known_[other] &&
        std::chrono::duration<double>(now - heard_[other]).count() > timeout)
      missing.push_back(rank);
    else if (rank < rank_)
      ++before;
  }
  const double patience = timeout + std::min(before, 8);  // the first one ends all others before they speak
  const auto waited = Clock::duration(now.time_since_epoch().count() - since);
  if (missing.empty() || std::chrono::duration<double>(waited).count() < patience) return;
  std::ostringstream text;
  text << "bsp2: " << spoken(missing) << counted(missing.size(), " [is|are] missing in the superstep '")
       << superstep << "': there has been no sign of life for " << timeout
       << " s, so the run ends. The last snapshot stays as it is. What waits longer: --timeout SECONDS or "
          "BSP2_TIMEOUT, 0 for ever\n";
  const std::string message = text.str();
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, message.data(), message.size());
  boost::mpi::environment::abort(1);  // the main thread waits in MPI: nothing else ends all
}

}  // namespace bsp2::supersteps
