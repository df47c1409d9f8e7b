#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "serving/reader.hpp"
#include "serving/scene.hpp"

namespace bsp2::api {

/// A file of the page, as it is sent.
struct PageFile {
  std::string type;  ///< "text/html; charset=utf-8"
  std::string bytes;
};
/// By name; the one without a name is what the link opens.
using PageFiles = std::map<std::string, PageFile>;

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< as numbers
  std::uint16_t port = 0;             ///< 0: one that is free
};

/// Serves a page and a scene to browsers, over HTTP and WebSocket, by a thread of its own.
///
/// Whoever asks must know the token, which is the first part of each path, and ask for the host that it is:
/// so neither other users of the machine nor pages of others in the same browser get anything. Nothing is
/// read from disk. Any number of pages may be open up to a limit; each gets the scene, and what changes in
/// it, as fast as it takes it.
class Server {
 public:
  /// @param page its files. @param scene must outlive the server.
  /// @param on_message what a page says, short text, on the server's thread.
  /// @param sections makes what pages see cut open, on the server's thread; without it they get none.
  /// @throws bsp2::Error if the address cannot be listened to.
  Server(const ServerOptions& options, PageFiles page, Scene& scene,
         std::function<void(const std::string& text)> on_message, Sections sections = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::string link() const;  ///< what to open
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] const std::string& token() const;
  [[nodiscard]] unsigned pages() const;            ///< that are open
  [[nodiscard]] unsigned visits() const;           ///< pages that were ever opened
  [[nodiscard]] std::uint64_t bytes_sent() const;  ///< of the scene, to all pages

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Whether a Host header names this server: its address or this machine, and its port.
/// @param address that it listens on. Any address of this machine where that is 0.0.0.0 or ::, given as
/// numbers.
[[nodiscard]] bool is_own_host(const std::string& host, const std::string& address, std::uint16_t port);

}  // namespace bsp2::api
