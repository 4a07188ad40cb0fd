#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// What a topic is needed for.
struct TopicNeed {
  std::string_view what;  ///< "scans"
  /// Types to choose from (std::string_view each); the first group for which there is a topic
  /// decides.
  std::vector<std::vector<std::string_view>> choices;
  std::vector<std::string_view> by_name;  ///< types of topics that are used only if they are named
  std::string_view option = "--topic";    ///< the option that names one
};

/// The topic of that name or, without a name, the only topic of a suitable type.
/// @return  indices into topics(): more than one if a bag has a topic several times
/// Errors (`where` is the file): `invalid_input` with a list of the topics to choose from, for a
/// topic that does not exist or is not suitable, if no topic is suitable, or if there are several
/// and no name.
[[nodiscard]] Result<std::vector<std::size_t>> choose_topic(const MessageReader& reader,
                                                            std::string_view name,
                                                            const TopicNeed& need);

/// The indices of all topics of that name and one of those types whose messages can be read.
[[nodiscard]] std::vector<std::size_t> find_topics(const MessageReader& reader,
                                                   std::string_view name,
                                                   std::span<const std::string_view> types);

/// "a, b, c and 12 more", in about this many bytes; unprintable bytes as '?'.
[[nodiscard]] std::string short_list(const std::vector<std::string>& items);

/// "message at byte 4117 of /points_raw"; databases have no offsets and give the log time instead.
[[nodiscard]] std::string place_of(const MessageReader& reader, const BagMessage& message);

/// Adds the place of a message to an error.
[[nodiscard]] tl::unexpected<Error> in_message(Error error, const MessageReader& reader,
                                               const BagMessage& message);

/// Whether messages have no stamps, which are then their log times. Some drivers leave out the
/// stamp of their first message only: that message is to be left out, and the second one decides.
/// If the second is stamped 10 s or less after 0, the clock may have started with the recording,
/// and log times are taken, too. What the reader selects is changed.
/// @param topics  of messages that begin with a header
[[nodiscard]] Result<bool> lacks_stamps(MessageReader& reader,
                                        const std::vector<std::size_t>& topics);

/// Stamps come from headers; if these have no stamps, they are log times.
inline constexpr std::string_view kHeaderStamps = "stamps are those of the messages' headers";
inline constexpr std::string_view kLogTimes =
    "the first message's header has the stamp 0, so stamps are the times at which the messages "
    "were recorded";

}  // namespace vantage::io::ros
