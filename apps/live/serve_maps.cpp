#include "serve_maps.hpp"

#include <fmt/format.h>

#include <chrono>

#include "live/connection.hpp"
#include "live/map_server.hpp"
#include "live/publisher.hpp"
#include "wiring.hpp"

namespace vantage {

Result<void> serve_maps(const live::LiveParams& params, const Bundle& bundle, double switch_margin,
                        live::Notices& notices, const std::function<bool()>& is_over) {
  VANTAGE_CHECK(bundle.need_points("publish"));
  live::MapServer server(bundle, params, switch_margin, notices);
  live::Inbox inbox;
  std::optional<dds::Participant> participant;
  std::optional<dds::Participant::Writer> maps;
  const auto disconnect = [&] {
    maps.reset();
    participant.reset();
    server.forget();  // who comes later gets the map from the new writer
  };
  const auto connect = [&]() -> Result<void> {
    VANTAGE_TRY(participant,
                dds::Participant::open(live::participant_options(params, params.node, notices)));
    VANTAGE_TRY(maps, participant->advertise(live::output_topics(params).front().topic));
    VANTAGE_CHECK(subscribe(*participant, params, inbox));
    return participant->announce();
  };
  live::Connection connection(connect, disconnect, notices);
  VANTAGE_CHECK(connection.open());
  say(fmt::format("ready in domain {}: maps for the poses of {}", params.domain,
                  params.topics.followed_pose));
  while (!is_over()) {
    connection.follow(std::chrono::steady_clock::now());
    const auto taken = inbox.take(std::chrono::milliseconds(50));
    if (!participant) continue;
    for (const live::Received& received : taken.messages) {
      const auto map = server.take(received);
      if (!map) {
        notices.tell("maps_missing", map.error().message);
        continue;
      }
      if (!*map) continue;
      if (const auto sent = maps->write(**map); !sent) notices.say(sent.error().message);
    }
  }
  return {};
}

}  // namespace vantage
