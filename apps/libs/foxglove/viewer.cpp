#include "foxglove/viewer.hpp"

#include <fmt/format.h>

#include <chrono>

namespace vantage::foxglove {

Result<std::unique_ptr<Viewer>> Viewer::open(const live::LiveParams& params, PoseSink poses,
                                             Server::Sink say) {
  const live::FoxgloveParams& own = params.foxglove;
  const auto started = std::chrono::system_clock::now().time_since_epoch().count();
  const bool is_humble = params.release == dds::Release::humble;
  ServerOptions options{
      .address = own.address,
      .port = static_cast<std::uint16_t>(own.port.value_or(0)),
      .most_clients = own.clients,
      .hub = {.name = params.node,
              .distribution = is_humble ? "humble" : "jazzy",
              .session = std::to_string(started),
              .initial_pose = params.topics.initial_pose,
              .most_waiting = static_cast<std::size_t>(own.buffer * 1024.0 * 1024.0)}};
  VANTAGE_TRY(auto server, Server::open(std::move(options), std::move(poses), say));
  const bool is_v6 = own.address.find(':') != std::string::npos;
  say(fmt::format("Foxglove and Lichtblick find it at ws://{}{}{}:{}", is_v6 ? "[" : "",
                  own.address, is_v6 ? "]" : "", server->port()));
  return std::unique_ptr<Viewer>(new Viewer(std::move(server), Extras(params)));
}

Result<void> Viewer::show(const live::Localized& scan, std::int64_t time) {
  VANTAGE_TRY(const auto messages, extras_.messages(scan));
  for (const Extras::Message& one : messages) server_->see(one.topic, time, one.bytes);
  return {};
}

}  // namespace vantage::foxglove
