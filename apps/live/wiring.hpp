#pragma once

#include <map>
#include <string>

#include "dds/participant.hpp"
#include "live/inbox.hpp"
#include "live/live_params.hpp"
#include "live/received.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A message that comes now.
[[nodiscard]] live::Received received_now(live::Input input, std::string&& message);

/// A line on standard error, from any thread.
void say(const std::string& text);

/// Puts the messages of all inputs of [live.topics] into an inbox, which must outlive the
/// participant. Returns the topics. Errors: those of Participant.
[[nodiscard]] Result<std::map<live::Input, dds::Topic>> subscribe(dds::Participant& participant,
                                                                  const live::LiveParams& params,
                                                                  live::Inbox& inbox);

/// Puts requests to all services of [live.services] into an inbox, as `subscribe` does. Returns
/// what answers them. Errors: those of Participant.
[[nodiscard]] Result<std::map<live::Input, dds::Participant::Replier>> serve(
    dds::Participant& participant, const live::ServiceParams& services, live::Inbox& inbox);

}  // namespace vantage
