#include "foxglove/server.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <exception>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "foxglove/page.hpp"

namespace vantage::foxglove {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Failure = beast::error_code;
using Request = http::request<http::empty_body>;

constexpr auto kLongestHandshake = std::chrono::seconds(10);
constexpr auto kLongestFarewell = std::chrono::seconds(1);
constexpr auto kRestOfAcceptor = std::chrono::milliseconds(100);
constexpr std::uint32_t kLargestHeader = 8192;    // of a request [bytes]
constexpr std::size_t kLargestFrame = 1U << 20U;  // of a client [bytes]
constexpr std::size_t kLargestRest = 1U << 20U;   // of a request that was answered [bytes]
constexpr std::size_t kPiece = 4096;              // that is read at once of it [bytes]
// Connections besides those of clients: browsers load the page by them, and clients are refused.
constexpr std::size_t kMostOthers = 16;

std::string_view text_of(beast::string_view text) { return {text.data(), text.size()}; }

/// The first subprotocol that a client offers and this server knows.
std::optional<std::string> chosen_subprotocol(const Request& request) {
  for (auto [field, end] = request.equal_range(http::field::sec_websocket_protocol); field != end;
       ++field) {
    for (const auto offered : http::token_list{field->value()}) {
      const std::string_view name = text_of(offered);
      if (std::ranges::find(kSubprotocols, name) != std::end(kSubprotocols)) {
        return std::string(name);
      }
    }
  }
  return std::nullopt;
}

}  // namespace

struct Server::State {
  class Connection;

  State(ServerOptions o, PoseSink poses, Sink s)
      : options(std::move(o)), hub(options.hub, std::move(poses)), say(std::move(s)) {}

  [[nodiscard]] Result<void> listen();
  void accept();
  void stop();
  void work();

  const ServerOptions options;
  const Page page = make_page();
  Hub hub;
  const Sink say;
  asio::io_context io{1};  // before what uses it
  tcp::acceptor acceptor{io};
  asio::steady_timer timer{io};
  std::set<std::shared_ptr<Connection>> connections;
  std::size_t clients = 0;  // of the connections, those with WebSocket
  bool told_refused = false, stops = false;
  std::thread thread;  // only it uses what is above, but for the hub
};

/// One connection, from its request to its end.
class Server::State::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, State& server) : stream_(std::move(socket)), server_(server) {
    Failure failure;
    const auto peer = beast::get_lowest_layer(stream_).socket().remote_endpoint(failure);
    if (!failure) peer_ = fmt::format("{} port {}", peer.address().to_string(), peer.port());
  }

  void start() {
    auto& link = beast::get_lowest_layer(stream_);
    link.socket().set_option(tcp::no_delay(true), ignored_);
    link.expires_after(kLongestHandshake);  // until the answer is sent
    parser_.header_limit(kLargestHeader);
    http::async_read_header(link, input_, parser_,
                            [self = shared_from_this()](Failure failure, std::size_t) {
                              failure ? self->end() : self->answer();
                            });
  }

  void close(websocket::close_code code) {
    if (phase_ != Phase::open) return end();
    phase_ = Phase::closing;
    stream_.async_close(code, [self = shared_from_this()](Failure) { self->end(); });
  }

 private:
  enum class Phase : std::uint8_t { request, open, closing, ended };

  void answer() {
    if (phase_ != Phase::request) return;
    input_.consume(input_.size());
    const Request& request = parser_.get();
    if (!websocket::is_upgrade(request)) {
      return send(
          answer_of(server_.page, text_of(request.method_string()), text_of(request.target())),
          request.method() == http::verb::head);
    }
    const auto subprotocol = chosen_subprotocol(request);
    if (!subprotocol) {
      return refuse(http::status::bad_request,
                    fmt::format("the client offers no subprotocol that this server knows: {}",
                                fmt::join(kSubprotocols, ", ")));
    }
    if (server_.clients >= server_.options.most_clients) {
      if (!std::exchange(server_.told_refused, true)) {
        server_.say(
            fmt::format("a Foxglove client from {} is refused: there are {} already, see "
                        "[live.foxglove] clients",
                        peer_, server_.options.most_clients));
      }
      return refuse(http::status::service_unavailable, "there are too many clients");
    }
    ++server_.clients;
    is_client_ = true;
    beast::get_lowest_layer(stream_).expires_never();  // the stream has its own limits
    stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    stream_.set_option(websocket::stream_base::decorator(
        [name = *subprotocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, name);
        }));
    stream_.read_message_max(kLargestFrame);
    stream_.auto_fragment(false);
    stream_.async_accept(request,
                         [self = shared_from_this(), name = *subprotocol](Failure failure) {
                           failure ? self->end() : self->open(name);
                         });
  }

  void refuse(http::status why, std::string_view text) {
    send({static_cast<unsigned>(why), {{"Content-Type", "text/plain; charset=utf-8"}}, text},
         false);
  }

  void send(const Answer& answer, bool is_head) {
    response_ = http::response<http::string_body>(http::int_to_status(answer.status), 11);
    for (const auto& [name, value] : answer.fields) {
      response_.insert(beast::string_view(name.data(), name.size()),
                       beast::string_view(value.data(), value.size()));
    }
    response_.keep_alive(false);
    response_.content_length(answer.body.size());
    if (!is_head) response_.body() = answer.body;
    auto& link = beast::get_lowest_layer(stream_);
    http::async_write(link, response_, [self = shared_from_this()](Failure failure, std::size_t) {
      beast::get_lowest_layer(self->stream_)
          .socket()
          .shutdown(tcp::socket::shutdown_send, self->ignored_);
      failure ? self->end() : self->drain();
    });
  }

  /// Reads what the peer still sends, such as the body of a POST, until it closes: a connection
  /// that is closed before is reset, and the peer may lose the answer.
  void drain() {
    if (phase_ != Phase::request) return;
    input_.consume(input_.size());
    beast::get_lowest_layer(stream_).async_read_some(
        input_.prepare(kPiece), [self = shared_from_this()](Failure failure, std::size_t bytes) {
          self->rest_ += bytes;
          failure || self->rest_ > kLargestRest ? self->end() : self->drain();
        });
  }

  void open(const std::string& subprotocol) {
    if (phase_ != Phase::request) return;
    phase_ = Phase::open;
    server_.say(fmt::format("a Foxglove client is there, from {} ({})", peer_, subprotocol));
    client_ = server_.hub.join([weak = weak_from_this(), &io = server_.io] {
      asio::post(io, [weak] {
        if (const auto self = weak.lock()) self->write();
      });
    });
    write();
    read();
  }

  void read() {
    stream_.async_read(input_, [self = shared_from_this()](Failure failure, std::size_t) {
      failure ? self->end() : self->take();
    });
  }

  void take() {
    if (phase_ != Phase::open) return;
    const auto data = input_.cdata();
    const std::string_view frame(static_cast<const char*>(data.data()), data.size());
    const bool stays =
        stream_.got_text() ? server_.hub.text(client_, frame) : server_.hub.binary(client_, frame);
    input_.consume(input_.size());
    if (!stays) return close(websocket::close_code::policy_error);
    read();
  }

  void write() {
    if (phase_ != Phase::open || frame_) return;
    frame_ = server_.hub.next(client_);
    if (!frame_) return;
    stream_.text(frame_->is_text);
    const std::array<asio::const_buffer, 2> bytes{
        asio::buffer(frame_->head),
        frame_->body ? asio::buffer(*frame_->body) : asio::const_buffer()};
    stream_.async_write(bytes, [self = shared_from_this()](Failure failure, std::size_t) {
      self->frame_.reset();
      failure ? self->end() : self->write();
    });
  }

  void end() {
    if (std::exchange(phase_, Phase::ended) == Phase::ended) return;
    beast::get_lowest_layer(stream_).close();
    if (client_ != 0) {
      server_.hub.leave(client_);
      server_.say(fmt::format("the Foxglove client from {} is gone", peer_));
    }
    if (is_client_) --server_.clients;
    server_.connections.erase(shared_from_this());
    if (server_.stops && server_.connections.empty()) server_.timer.cancel();
  }

  websocket::stream<beast::tcp_stream> stream_;
  State& server_;
  std::string peer_;
  beast::flat_buffer input_{kLargestFrame + 65'536};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
  std::size_t rest_ = 0;  // that came after the request [bytes]
  bool is_client_ = false;
  Phase phase_ = Phase::request;
  Hub::ClientId client_ = 0;
  std::optional<Frame> frame_;  // that is being written
  Failure ignored_;
};

Result<void> Server::State::listen() {
  Failure failure;
  const auto address = asio::ip::make_address(options.address, failure);
  if (failure) {
    return fail(
        ErrorCode::invalid_config,
        fmt::format("'{}' is no address, expected one of IPv4 or IPv6 like 127.0.0.1 or ::1",
                    options.address));
  }
  const tcp::endpoint endpoint(address, options.port);
  acceptor.open(endpoint.protocol(), failure);
  if (!failure) acceptor.set_option(tcp::acceptor::reuse_address(true), failure);
  if (!failure) acceptor.bind(endpoint, failure);
  if (!failure) acceptor.listen(asio::socket_base::max_listen_connections, failure);
  if (failure) {
    return fail(ErrorCode::io_failure,
                fmt::format("the Foxglove server cannot listen on port {} of {}: {}{}",
                            options.port, options.address, failure.message(),
                            failure == asio::error::address_in_use
                                ? "; another program does, so choose another port"
                                : ""));
  }
  return {};
}

void Server::State::accept() {
  acceptor.async_accept([this](Failure failure, tcp::socket socket) {
    if (stops) return;
    if (failure) {  // no file descriptor is left, for example
      timer.expires_after(kRestOfAcceptor);
      timer.async_wait([this](Failure) {
        if (!stops) accept();
      });
      return;
    }
    if (connections.size() < options.most_clients + kMostOthers) {
      const auto connection = std::make_shared<Connection>(std::move(socket), *this);
      connections.insert(connection);
      connection->start();
    }
    accept();
  });
}

/// In the thread.
void Server::State::stop() {
  stops = true;
  Failure ignored;
  acceptor.close(ignored);
  timer.cancel();
  if (connections.empty()) return;
  timer.expires_after(kLongestFarewell);
  timer.async_wait([this](Failure failure) {
    if (failure != asio::error::operation_aborted) io.stop();
  });
  const auto all = connections;  // some end at once
  for (const auto& connection : all) connection->close(websocket::close_code::going_away);
}

void Server::State::work() {
  while (true) {
    try {
      io.run();
      return;
    } catch (const std::exception& error) {  // for want of memory; the rest goes on
      say(fmt::format("the Foxglove server: {}", error.what()));
    }
  }
}

Result<std::unique_ptr<Server>> Server::open(ServerOptions options, PoseSink poses, Sink say) {
  auto state = std::make_unique<State>(std::move(options), std::move(poses), std::move(say));
  VANTAGE_CHECK(state->listen());
  state->accept();
  state->thread = std::thread([s = state.get()] { s->work(); });
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}

Server::~Server() {
  asio::post(state_->io, [s = state_.get()] { s->stop(); });
  state_->thread.join();
}

void Server::see(const dds::Topic& topic, std::int64_t time, std::string_view message) {
  state_->hub.see(topic, time, message);
}

std::uint16_t Server::port() const {
  Failure failure;
  const auto endpoint = state_->acceptor.local_endpoint(failure);
  return failure ? std::uint16_t{0} : endpoint.port();
}

}  // namespace vantage::foxglove
