#pragma once

#include <optional>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Passes all messages of these topics to `visit`. One rule for every input that is read as a
/// whole: of a bag that is cut off or damaged, what comes before the damage is used, and the error
/// is returned for the user. A bag that gives no message before the damage is an error.
/// @param visit  Result<void>(const BagMessage&)
/// @return  the error at which the messages end; nothing if they are complete
/// Errors: those of MessageReader, and of `visit`.
template <class Visit>
[[nodiscard]] Result<std::optional<Error>> for_each_message(MessageReader& reader,
                                                            const std::vector<std::size_t>& topics,
                                                            const Visit& visit) {
  VANTAGE_CHECK(reader.select(topics));
  for (bool is_first = true;; is_first = false) {
    auto message = reader.next();
    if (!message) {
      if (is_first || message.error().code != ErrorCode::corrupt_data) {
        return fail(std::move(message).error());
      }
      return std::optional<Error>(std::move(message).error());
    }
    if (!*message) return std::optional<Error>();
    VANTAGE_CHECK(visit(**message));
  }
}

}  // namespace vantage::io::ros
