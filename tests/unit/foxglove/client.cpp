#include "client.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace vantage::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;

struct Client::State {
  asio::io_context io;
  websocket::stream<asio::ip::tcp::socket> stream{io};
  websocket::response_type response;
};

Client::Client(std::uint16_t port) : port_(port), state_(std::make_unique<State>()) {
  state_->stream.next_layer().connect({asio::ip::address_v4::loopback(), port});
  state_->stream.read_message_max(0);
}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;

int Client::shake_hands(const std::string& subprotocols) {
  state_->stream.set_option(
      websocket::stream_base::decorator([subprotocols](websocket::request_type& request) {
        if (!subprotocols.empty()) {
          request.set(beast::http::field::sec_websocket_protocol, subprotocols);
        }
      }));
  beast::error_code failure;
  state_->stream.handshake(state_->response, "localhost", "/", failure);
  if (!failure) return static_cast<int>(state_->response.result_int());
  return refused_with(subprotocols);
}

/// The status of the same handshake, asked for again: Beast does not hand on that of a refusal.
int Client::refused_with(const std::string& subprotocols) {
  namespace http = beast::http;
  asio::ip::tcp::socket socket(state_->io);
  socket.connect({asio::ip::address_v4::loopback(), port_});
  http::request<http::empty_body> request(http::verb::get, "/", 11);
  request.set(http::field::host, "localhost");
  request.set(http::field::upgrade, "websocket");
  request.set(http::field::connection, "Upgrade");
  request.set(http::field::sec_websocket_key, "dGhlIHNhbXBsZSBub25jZQ==");
  request.set(http::field::sec_websocket_version, "13");
  if (!subprotocols.empty()) request.set(http::field::sec_websocket_protocol, subprotocols);
  beast::error_code failure;
  http::write(socket, request, failure);
  beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(socket, buffer, response, failure);
  return static_cast<int>(response.result_int());
}

std::string Client::subprotocol() const {
  const auto value = state_->response[beast::http::field::sec_websocket_protocol];
  return {value.data(), value.size()};
}

void Client::text(std::string_view frame) {
  beast::error_code failure;
  state_->stream.text(true);
  state_->stream.write(asio::buffer(frame.data(), frame.size()), failure);
}

void Client::binary(std::string_view frame) {
  beast::error_code failure;
  state_->stream.binary(true);
  state_->stream.write(asio::buffer(frame.data(), frame.size()), failure);
}

bool Client::raw(std::string_view bytes) {
  beast::error_code failure;
  asio::write(state_->stream.next_layer(), asio::buffer(bytes.data(), bytes.size()), failure);
  return !failure;
}

std::optional<Client::Frame> Client::read() {
  beast::flat_buffer buffer;
  beast::error_code failure;
  state_->stream.read(buffer, failure);
  if (failure) return std::nullopt;
  return Frame{state_->stream.got_text(), beast::buffers_to_string(buffer.data())};
}

std::string Client::read_raw() {
  std::string all;
  beast::error_code failure;
  asio::read(state_->stream.next_layer(), asio::dynamic_buffer(all), failure);
  return all;
}

int Client::close_code() const { return static_cast<int>(state_->stream.reason().code); }

}  // namespace vantage::test
