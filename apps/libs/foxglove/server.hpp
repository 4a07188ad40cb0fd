#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "foxglove/hub.hpp"
#include "live/observer.hpp"
#include "vantage/result.hpp"

namespace vantage::foxglove {

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6
  std::uint16_t port = 8765;          ///< 0: any that is free
  std::size_t most_clients = 16;
  HubOptions hub = {};
};

/// Serves a hub over WebSocket, in a thread of its own, and the page that shows it (page.hpp) over
/// HTTP. Nobody who shows it something waits for a client. A client that breaks the rules of
/// WebSocket or sends a frame of more than 1 MiB is closed, and so is a request that is not
/// answered within 10 s, or whose header has more than 8 KiB; others do not notice.
class Server final : public live::Observer {
 public:
  /// Says that clients came and went, from the server's thread.
  using Sink = std::function<void(const std::string&)>;

  /// Listens. Errors: `invalid_config` for a text that is no address; `io_failure` if the port
  /// cannot be listened on, for example because another program does.
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(ServerOptions options, PoseSink poses,
                                                            Sink say);
  /// Tells clients that it goes, waits a second at most for their answers, and ends.
  ~Server() override;

  void see(const dds::Topic& topic, std::int64_t time, std::string_view message) override;
  /// The port that is listened on.
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vantage::foxglove
