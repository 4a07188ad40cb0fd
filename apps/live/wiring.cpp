#include "wiring.hpp"

#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "live/clock.hpp"

namespace vantage {

live::Received received_now(live::Input input, std::string&& message) {
  return {.input = input,
          .arrival = live::now(),
          .time = live::time_of_day(),
          .message = std::move(message)};
}

void say(const std::string& text) { std::cerr << fmt::format("vantage live: {}\n", text); }

Result<std::map<live::Input, dds::Topic>> subscribe(dds::Participant& participant,
                                                    const live::LiveParams& params,
                                                    live::Inbox& inbox) {
  std::map<live::Input, dds::Topic> topics;
  for (const live::InputTopic& input : live::input_topics(params.topics)) {
    topics.emplace(input.input, input.topic);
    VANTAGE_CHECK(
        participant.subscribe(input.topic, [&inbox, kind = input.input](std::string&& message) {
          inbox.put(received_now(kind, std::move(message)));
        }));
  }
  return topics;
}

Result<std::map<live::Input, dds::Participant::Replier>> serve(dds::Participant& participant,
                                                               const live::ServiceParams& services,
                                                               live::Inbox& inbox) {
  std::map<live::Input, dds::Participant::Replier> repliers;
  for (const live::InputService& one : live::input_services(services)) {
    VANTAGE_TRY(auto replier,
                participant.serve(one.service, [&inbox, kind = one.input](const dds::RequestId& id,
                                                                          std::string&& request) {
                  live::Received received = received_now(kind, std::move(request));
                  received.request = id;
                  inbox.put(std::move(received));
                }));
    repliers.emplace(one.input, std::move(replier));
  }
  return repliers;
}

}  // namespace vantage
