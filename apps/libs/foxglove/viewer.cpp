#include "foxglove/viewer.hpp"

#include <fmt/format.h>

#include <chrono>

#include "foxglove/layout.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::foxglove {

namespace {

/// The keys are those of live::Publisher.
LayoutNames names_of(const live::LiveParams& params) {
  const std::string& diagnostics = params.topics.diagnostics;
  return {.map = params.topics.map,
          .scan = params.topics.points,
          .pose = params.topics.pose,
          .path = kPathTopic,
          .region = value_of(diagnostics, "region"),
          .diagnostics = diagnostics,
          .status = params.node + ": localization",
          .map_frame = params.frames.map,
          .follow = params.frames.base,
          .plots = {{{"Integrity risk", {"risk"}},
                     {"Points of the scan", {"scan_points"}},
                     {"Times [s]", {"scan_s", "align_s", "verdict_s", "stall_s", "search_s"}}}}};
}

/// What the page shows as what: its messages say no more than their types.
std::map<std::string, std::string> metadata_of(const live::LiveParams& params) {
  return {{"vantage.map", params.topics.map},
          {"vantage.points", params.topics.points},
          {"vantage.pose", params.topics.pose},
          {"vantage.diagnostics", params.topics.diagnostics},
          {"vantage.initial_pose", params.topics.initial_pose},
          {"vantage.risk", kRiskTopic},
          {"vantage.path", kPathTopic},
          {"vantage.map_frame", params.frames.map},
          {"vantage.odom_frame", params.frames.odom},
          {"vantage.base_frame", params.frames.base}};
}

Result<void> write_layout(const live::LiveParams& params) {
  VANTAGE_TRY(auto file, io::OutputFile::create(*params.foxglove.layout));
  VANTAGE_CHECK(file.write(layout(names_of(params))));
  return file.commit();
}

}  // namespace

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
              .metadata = metadata_of(params),
              .most_waiting = static_cast<std::size_t>(own.buffer * 1024.0 * 1024.0)}};
  VANTAGE_TRY(auto server, Server::open(std::move(options), std::move(poses), say));
  if (own.layout) VANTAGE_CHECK(write_layout(params));
  const bool is_v6 = own.address.find(':') != std::string::npos;
  const std::string place =
      fmt::format("{}{}{}:{}", is_v6 ? "[" : "", own.address, is_v6 ? "]" : "", server->port());
  say(fmt::format("a browser shows it at http://{0}/, Foxglove and Lichtblick at ws://{0}", place));
  return std::unique_ptr<Viewer>(new Viewer(std::move(server), Extras(params)));
}

Result<void> Viewer::show(const live::Localized& scan, std::int64_t time) {
  VANTAGE_TRY(const auto messages, extras_.messages(scan));
  for (const Extras::Message& one : messages) server_->see(one.topic, time, one.bytes);
  return {};
}

}  // namespace vantage::foxglove
