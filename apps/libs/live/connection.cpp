#include "live/connection.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace vantage::live {
namespace {

/// Its name in diagnostics.
std::string kind_of(const dds::Misfit& found) {
  return found.policy.empty() ? fmt::format("other_type {}", found.topic)
                              : fmt::format("incompatible_qos {} {}", found.topic, found.policy);
}

}  // namespace

std::string text_of(const dds::Misfit& found) {
  if (found.policy.empty()) {
    return found.is_read ? fmt::format(
                               "a publisher of {} sends {}, expected {}: none of its "
                               "messages is received",
                               found.topic, found.other_type, found.own_type)
                         : fmt::format(
                               "a subscriber of {} expects {}, and {} is sent: no message "
                               "is sent to it",
                               found.topic, found.other_type, found.own_type);
  }
  return found.is_read
             ? fmt::format(
                   "a publisher of {} offers incompatible QoS ({}): none of its messages "
                   "is received",
                   found.topic, found.policy)
             : fmt::format(
                   "a subscriber of {} requests incompatible QoS ({}): no message is sent "
                   "to it",
                   found.topic, found.policy);
}

std::vector<std::string> obstacles_of(const std::vector<dds::Misfit>& found) {
  std::vector<std::string> texts;
  for (const dds::Misfit& one : found) {
    if (one.is_read) texts.push_back(text_of(one));
  }
  return texts;
}

dds::ParticipantOptions participant_options(const LiveParams& params, const std::string& node,
                                            Notices& notices) {
  const double bytes = std::min(params.receive_buffer * 1024.0 * 1024.0, 2e9);
  return {.domain = params.domain,
          .node = node,
          .release = params.release,
          .receive_buffer = static_cast<std::uint32_t>(bytes),
          .misfit = [&notices](const dds::Misfit& found) {
            notices.tell(kind_of(found), text_of(found));
          }};
}

Connection::Connection(std::function<Result<void>()> connect, std::function<void()> disconnect,
                       Notices& notices, Networks networks)
    : connect_(std::move(connect)),
      disconnect_(std::move(disconnect)),
      notices_(notices),
      networks_(std::move(networks)) {}

Result<void> Connection::connect() {
  reached_ = networks_();  // first: one that comes up meanwhile may not be reached
  told_.clear();
  return connect_();
}

Result<void> Connection::open() {
  VANTAGE_CHECK(connect());
  if (reached_.empty()) {
    notices_.say("no network is up: until one is, nodes on this computer only are found");
  }
  return {};
}

void Connection::follow(std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::seconds kPeriod(1);
  if (looked_ && now - *looked_ < kPeriod) return;
  looked_ = now;
  if (trouble_) return connect_anew();
  std::vector<std::string> came;
  std::ranges::set_difference(networks_(), reached_, std::back_inserter(came));
  const auto before = std::exchange(told_, came);
  if (came.empty() || came == before) return;
  const bool is_first = reached_.empty();
  notices_.say(
      fmt::format("the network {} came up: {}", fmt::join(came, ", "),
                  is_first ? "connects again" : "nodes in it are found after a new start only"));
  if (is_first) connect_anew();
}

void Connection::connect_anew() {
  disconnect_();
  const auto connected = connect();
  if (connected) {
    if (std::exchange(trouble_, std::nullopt)) notices_.say("connected again");
    return;
  }
  disconnect_();  // what was made of it
  const bool is_new = !trouble_;
  trouble_ = fmt::format("cannot connect again, which is tried every second: {}",
                         to_string(connected.error()));
  notices_.count("connections_failed");
  if (is_new) notices_.say(*trouble_);
}

}  // namespace vantage::live
