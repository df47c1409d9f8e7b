#include "serving/server.hpp"

#include <unistd.h>

#include <atomic>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <random>
#include <set>
#include <thread>

#include "bsp2/error.hpp"
#include "serving/reader.hpp"

namespace bsp2::api {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Failed = beast::error_code;
using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

constexpr unsigned most_connections = 64;
constexpr auto patience = std::chrono::seconds(10);
constexpr std::size_t longest_message = 64 * 1024, longest_header = 16 * 1024;

/// 128 bits that nobody can guess.
std::string new_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) {
    constexpr const char* digits = "0123456789abcdef";
    const std::uint32_t word = random();
    for (int shift = 28; shift >= 0; shift -= 4) token += digits[(word >> shift) & 15U];
  }
  return token;
}

/// In a time that does not tell where they differ.
bool are_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

std::string name_of_machine() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "";
}

/// What a request asks for: the part of its path behind the token, if it has the right one.
std::optional<std::string> asked_name(std::string_view target, const std::string& token) {
  target = target.substr(0, target.find('?'));
  if (!target.starts_with('/')) return std::nullopt;
  target.remove_prefix(1);
  const auto slash = target.find('/');
  if (!are_equal(target.substr(0, slash), token) || slash == std::string_view::npos) return std::nullopt;
  return std::string(target.substr(slash + 1));
}

Response answer(const Request& request, http::status status, const std::string& type, std::string body) {
  Response response(status, request.version(), std::move(body));
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Content-Security-Policy",
               "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
               "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  response.keep_alive(false);
  response.prepare_payload();
  return response;
}

Response refusal(const Request& request, http::status status, const std::string& why) {
  return answer(request, status, "text/plain; charset=utf-8", why + "\n");
}

}  // namespace

bool is_own_host(const std::string& host, const std::string& address, std::uint16_t port) {
  const std::string end = ":" + std::to_string(port);
  const bool has_port = host.ends_with(end);
  if (!has_port && port != 80) return false;
  std::string name = has_port ? host.substr(0, host.size() - end.size()) : host;
  if (name.starts_with('[') && name.ends_with(']')) name = name.substr(1, name.size() - 2);
  Failed no_address;
  const auto own = asio::ip::make_address(address, no_address);
  if (name == address) return true;
  const auto asked = asio::ip::make_address(name, no_address);
  const bool is_number = !no_address;
  if (own.is_loopback()) return name == "localhost" || (is_number && asked.is_loopback());
  if (!own.is_unspecified()) return is_number && asked == own;
  return name == "localhost" || is_number || beast::iequals(name, name_of_machine());
}

class Server::Implementation {
 public:
  Implementation(const ServerOptions& options, PageFiles page, Scene& scene,
                 std::function<void(const std::string&)> on_message, Sections sections)
      : address_(options.address),
        page_(std::move(page)),
        scene_(scene),
        on_message_(std::move(on_message)),
        sections_(std::move(sections)) {
    open(options);
    accept();
    thread_ = std::thread([this] { context_.run(); });
    scene_.listen([this] {
      if (is_told_.exchange(true)) return;  // one look is enough for many changes
      asio::post(context_, [this] { look_around(); });
    });
  }
  ~Implementation() {
    scene_.forget_listener();
    context_.stop();
    thread_.join();
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  [[nodiscard]] std::string link() const {
    const auto own = asio::ip::make_address(address_);
    std::string host = own.is_unspecified() ? name_of_machine() : address_;
    if (own.is_v6() && !own.is_unspecified()) host = "[" + host + "]";
    return "http://" + host + ":" + std::to_string(port_) + "/" + token_ + "/";
  }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] const std::string& token() const { return token_; }
  [[nodiscard]] unsigned pages() const { return pages_; }
  [[nodiscard]] unsigned visits() const { return visits_; }
  [[nodiscard]] std::uint64_t bytes_sent() const { return bytes_; }

 private:
  class Connection;
  class Page;

  std::string address_, token_ = new_token();
  std::uint16_t port_ = 0;
  PageFiles page_;
  Scene& scene_;
  std::function<void(const std::string&)> on_message_;
  Sections sections_;
  std::set<Page*> open_;  // of the server's thread
  Levels levels_;         // likewise
  std::atomic<unsigned> pages_ = 0, visits_ = 0, connections_ = 0;
  std::atomic<std::uint64_t> bytes_ = 0;
  std::atomic<bool> is_told_ = false;
  asio::io_context context_{1};  // goes before what its connections use
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  std::thread thread_;

  void open(const ServerOptions& options);
  void accept();
  void look_around();
  [[nodiscard]] Response answer_to(const Request& request) const;
  [[nodiscard]] bool is_own(const Request& request) const {
    return is_own_host(std::string(request[http::field::host]), address_, port_);
  }
};

void Server::Implementation::open(const ServerOptions& options) {
  Failed failed;
  const auto address = asio::ip::make_address(options.address, failed);
  if (failed)
    throw Error("--listen: '" + options.address +
                "' is no address; write numbers, for example 127.0.0.1 or 0.0.0.0");
  const tcp::endpoint endpoint(address, options.port);
  acceptor_.open(endpoint.protocol(), failed);
  if (!failed) acceptor_.set_option(tcp::acceptor::reuse_address(true), failed);
  if (!failed) acceptor_.bind(endpoint, failed);
  if (!failed) acceptor_.listen(asio::socket_base::max_listen_connections, failed);
  if (!failed) port_ = acceptor_.local_endpoint(failed).port();
  if (failed)
    throw Error("cannot listen on " + options.address + ", port " + std::to_string(options.port) + ": " +
                failed.message() + "; choose another --port, or none for one that is free");
}

/// The data for one page: the scene, and then what changes, or is seen better.
class Server::Implementation::Page : public std::enable_shared_from_this<Page> {
 public:
  Page(Implementation& server, beast::tcp_stream stream, bool tells_gaze)
      : server_(server),
        socket_(std::move(stream)),
        reader_(server.scene_, server.levels_, tells_gaze, Reader::enough_bytes, server.sections_) {
    server_.open_.insert(this);
    ++server_.pages_;
    ++server_.visits_;
  }
  ~Page() {
    server_.open_.erase(this);
    --server_.pages_;
    --server_.connections_;
  }
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;

  void begin(const Request& request) {
    auto times = beast::websocket::stream_base::timeout::suggested(beast::role_type::server);
    times.idle_timeout = std::chrono::seconds(60);
    times.keep_alive_pings = true;  // a page that sleeps is not gone
    socket_.set_option(times);
    socket_.read_message_max(longest_message);
    beast::websocket::permessage_deflate packed;
    packed.server_enable = true;
    packed.compLevel = 1;
    packed.memLevel = 8;
    socket_.set_option(packed);
    socket_.async_accept(request, [self = shared_from_this()](Failed failed) {
      if (failed) return;
      self->is_ready_ = true;
      self->read();
      self->write();
    });
  }

  /// Sends what is new, if nothing is being sent.
  void write() {
    if (!is_ready_ || is_writing_) return;
    std::optional<Reader::Next> next;
    try {
      next = reader_.next();
    } catch (const std::exception&) {  // no memory for a level: the page goes, not what is computed
      beast::get_lowest_layer(socket_).close();
      return;
    }
    if (!next) return;
    is_writing_ = true;
    socket_.binary(!next->is_text);
    socket_.async_write(asio::buffer(*next->bytes),
                        [self = shared_from_this(), bytes = next->bytes](Failed failed, std::size_t written) {
                          self->is_writing_ = false;
                          if (failed) return;
                          self->server_.bytes_ += written;
                          self->write();
                        });
  }

 private:
  Implementation& server_;
  beast::websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  Reader reader_;
  bool is_ready_ = false, is_writing_ = false;

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](Failed failed, std::size_t) {
      if (failed) return;
      if (self->socket_.got_text()) self->hear(beast::buffers_to_string(self->buffer_.data()));
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void hear(const std::string& text) {
    server_.on_message_(text);
    if (const auto gaze = Gaze::heard(text)) reader_.look(*gaze);
    write();
  }
};

/// Somebody who asks for one file, or for the data.
class Server::Implementation::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Implementation& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections_;
  }
  ~Connection() {
    if (!is_given_on_) --server_.connections_;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void begin() {
    parser_.header_limit(longest_header);
    parser_.body_limit(0);
    stream_.expires_after(patience);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](Failed failed, std::size_t) {
      if (!failed) self->serve();
    });
  }

 private:
  Implementation& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  Response response_;
  bool is_given_on_ = false;

  void serve() {
    const Request request = parser_.release();
    const auto name = asked_name({request.target().data(), request.target().size()}, server_.token_);
    const bool asks_for_data =
        beast::websocket::is_upgrade(request) && name == "data" && server_.is_own(request);
    if (asks_for_data && is_own_origin(request)) {
      stream_.expires_never();
      is_given_on_ = true;
      const bool tells_gaze = request.target().ends_with("?levels");
      std::make_shared<Page>(server_, std::move(stream_), tells_gaze)->begin(request);
      return;
    }
    response_ = asks_for_data
                    ? refusal(request, http::status::forbidden, "This is for the page of bsp2 view alone.")
                    : server_.answer_to(request);
    if (request.method() == http::verb::head) response_.body().clear();
    http::async_write(stream_, response_, [self = shared_from_this()](Failed, std::size_t) {
      Failed ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  /// Browsers tell whose page it is that asks. Programs do not, and are let in by the token.
  static bool is_own_origin(const Request& request) {
    const auto origin = request[http::field::origin];
    return origin.empty() || origin == "http://" + std::string(request[http::field::host]);
  }
};

void Server::Implementation::accept() {
  acceptor_.async_accept([this](Failed failed, tcp::socket socket) {
    if (failed == asio::error::operation_aborted) return;
    if (!failed && connections_ < most_connections)
      std::make_shared<Connection>(*this, std::move(socket))->begin();
    if (!failed) return accept();
    pause_.expires_after(
        std::chrono::milliseconds(100));  // as where too many files are open: not again at once
    pause_.async_wait([this](Failed aborted) {
      if (!aborted) accept();
    });
  });
}

void Server::Implementation::look_around() {
  is_told_ = false;
  for (Page* page : std::set<Page*>(open_)) page->write();
}

Response Server::Implementation::answer_to(const Request& request) const {
  if (!is_own(request))
    return refusal(request, http::status::forbidden, "This is not the host that was asked for.");
  const auto name = asked_name({request.target().data(), request.target().size()}, token_);
  if (!name)
    return refusal(
        request, http::status::forbidden,
        "The link is not complete, or it is that of another run: open the one that bsp2 view has printed.");
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return refusal(request, http::status::method_not_allowed, "Files can only be read.");
  const auto file = page_.find(*name);
  if (file == page_.end()) return refusal(request, http::status::not_found, "There is no such file.");
  return answer(request, http::status::ok, file->second.type, file->second.bytes);
}

Server::Server(const ServerOptions& options, PageFiles page, Scene& scene,
               std::function<void(const std::string&)> on_message, Sections sections)
    : implementation_(std::make_unique<Implementation>(options, std::move(page), scene, std::move(on_message),
                                                       std::move(sections))) {}

Server::~Server() = default;

std::string Server::link() const { return implementation_->link(); }
std::uint16_t Server::port() const { return implementation_->port(); }
const std::string& Server::token() const { return implementation_->token(); }
unsigned Server::pages() const { return implementation_->pages(); }
unsigned Server::visits() const { return implementation_->visits(); }
std::uint64_t Server::bytes_sent() const { return implementation_->bytes_sent(); }

}  // namespace bsp2::api
