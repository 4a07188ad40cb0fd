#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "foxglove/extras.hpp"
#include "foxglove/server.hpp"
#include "live/live_params.hpp"
#include "live/observer.hpp"
#include "live/session.hpp"
#include "vantage/result.hpp"

namespace vantage::foxglove {

/// Shows a live session to clients of Foxglove: all that it localizes and publishes, and Extras.
class Viewer final : public live::Observer {
 public:
  /// Listens as [live.foxglove] says, and writes the layout. Errors: those of Server::open and
  /// io::OutputFile.
  /// @param poses  takes the poses that clients publish on the topic `initial_pose`
  /// @param say    takes what a person may want to know, from the server's thread
  [[nodiscard]] static Result<std::unique_ptr<Viewer>> open(const live::LiveParams& params,
                                                            PoseSink poses, Server::Sink say);

  void see(const dds::Topic& topic, std::int64_t time, std::string_view message) override {
    server_->see(topic, time, message);
  }
  /// Shows what was found for a scan. Called from one thread.
  /// @param time  [ns since the epoch]
  /// Errors: those of Extras::messages.
  [[nodiscard]] Result<void> show(const live::Localized& scan, std::int64_t time);

 private:
  Viewer(std::unique_ptr<Server> server, Extras extras)
      : server_(std::move(server)), extras_(std::move(extras)) {}

  std::unique_ptr<Server> server_;
  Extras extras_;
};

}  // namespace vantage::foxglove
