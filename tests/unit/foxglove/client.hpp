#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace vantage::test {

/// A client of WebSocket for tests; its calls wait.
class Client {
 public:
  struct Frame {
    bool is_text;
    std::string bytes;
  };

  explicit Client(std::uint16_t port);
  ~Client();
  Client(Client&&) noexcept;

  /// @param subprotocols  as in the header; "" for none
  /// @return the status of HTTP: 101 if the connection is open
  int shake_hands(const std::string& subprotocols);
  /// The header Sec-WebSocket-Protocol of the answer.
  [[nodiscard]] std::string subprotocol() const;
  void text(std::string_view frame);
  void binary(std::string_view frame);
  /// Bytes past WebSocket, also before the handshake. False if the server is gone.
  bool raw(std::string_view bytes);
  /// The next frame; nothing if the connection has ended.
  [[nodiscard]] std::optional<Frame> read();
  /// All that the server still sends before it closes, past WebSocket.
  [[nodiscard]] std::string read_raw();
  /// Why the server closed it: RFC 6455, 7.4.
  [[nodiscard]] int close_code() const;

 private:
  struct State;
  [[nodiscard]] int refused_with(const std::string& subprotocols);

  std::uint16_t port_;
  std::unique_ptr<State> state_;
};

}  // namespace vantage::test
