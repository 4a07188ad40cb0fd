#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "live/inbox.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/received.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// By a clock that nobody sets, for durations [ns].
[[nodiscard]] std::int64_t now();
/// What the clock of this computer shows [ns since the epoch].
[[nodiscard]] std::int64_t time_of_day();
/// A message that comes now.
[[nodiscard]] live::Received received_now(live::Input input, std::string&& message);

/// A line on standard error, from any thread.
void say(const std::string& text);

/// The participant that [live] describes. Tells how the kernel's limit of buffers is raised, and
/// which endpoints of others do not fit. Errors: those of Participant.
/// @param notices  must outlive the participant
[[nodiscard]] Result<dds::Participant> open_participant(const live::LiveParams& params,
                                                        live::Notices& notices);

/// Looks for networks that came up since a participant was made, once a second, and tells of them.
class NetworkWatch {
 public:
  /// Tells of networks that came up.
  /// @return whether the participant is to be made anew: it was made without any
  [[nodiscard]] bool sees_first(const dds::Participant& participant);

 private:
  std::optional<std::chrono::steady_clock::time_point> looked_;
  std::vector<std::string> came_;
};

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
