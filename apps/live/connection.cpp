#include "connection.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <utility>

namespace vantage {
namespace {

template <class Clock>
std::int64_t nanoseconds() {
  return std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
}

/// In the words of ROS 2, which its users search for.
std::string text_of(const dds::IncompatibleQos& found) {
  return found.is_read
             ? fmt::format(
                   "a publisher of {} offers incompatible QoS ({}): none of its messages is "
                   "received",
                   found.topic, found.policy)
             : fmt::format(
                   "a subscriber of {} requests incompatible QoS ({}): no message is sent to it",
                   found.topic, found.policy);
}

}  // namespace

std::int64_t now() { return nanoseconds<std::chrono::steady_clock>(); }
std::int64_t time_of_day() { return nanoseconds<std::chrono::system_clock>(); }

live::Received received_now(live::Input input, std::string&& message) {
  return {.input = input, .arrival = now(), .time = time_of_day(), .message = std::move(message)};
}

void say(const std::string& text) { std::cerr << fmt::format("vantage live: {}\n", text); }

Result<dds::Participant> open_participant(const live::LiveParams& params, live::Notices& notices) {
  const double bytes = std::min(params.receive_buffer * 1024.0 * 1024.0, 2e9);
  const dds::ParticipantOptions options{
      .domain = params.domain,
      .node = params.node,
      .release = params.release,
      .receive_buffer = static_cast<std::uint32_t>(bytes),
      .incompatible = [&notices](const dds::IncompatibleQos& found) {
        notices.tell(fmt::format("incompatible_qos {} {}", found.topic, found.policy),
                     text_of(found));
      }};
  if (const auto note = dds::Participant::note_on_buffers(options)) say("note: " + *note);
  VANTAGE_TRY(auto participant, dds::Participant::open(options));
  if (participant.is_alone()) {
    say("no network is up: until one is, nodes on this computer only are found");
  }
  return participant;
}

bool NetworkWatch::sees_first(const dds::Participant& participant) {
  constexpr std::chrono::seconds kPeriod(1);
  const auto time = std::chrono::steady_clock::now();
  if (looked_ && time - *looked_ < kPeriod) return false;
  looked_ = time;
  const auto before = std::exchange(came_, participant.new_networks());
  if (came_.empty() || came_ == before) return false;
  const bool is_first = participant.is_alone();
  say(fmt::format("the network {} came up: {}", fmt::join(came_, ", "),
                  is_first ? "connects again" : "nodes in it are found after a new start only"));
  return is_first;
}

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
