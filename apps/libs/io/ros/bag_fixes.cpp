#include "io/ros/bag_fixes.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>

#include "io/ros/message_reading.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/topic_choice.hpp"
#include "io/ros/transform_tree.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {

Result<BagFixes> read_bag_fixes(MessageReader& reader, const std::vector<std::size_t>& topics) {
  BagFixes found;
  bool is_first = true;
  VANTAGE_TRY(const bool has_log_times, lacks_stamps(reader, topics));
  const auto add = [&](const BagMessage& message) -> Result<void> {
    const Topic& topic = reader.topics()[message.topic];
    auto fix = parse_nav_sat_fix(message.bytes, *topic.encoding, {reader.file(), 0, 0});
    if (!fix) return in_message(std::move(fix).error(), reader, message);
    const std::string_view frame = frame_name(fix->header.frame);
    if (std::exchange(is_first, false)) found.frame = frame;
    if (frame != found.frame) {
      return in_message(
          Error{ErrorCode::corrupt_data,
                fmt::format("the position is that of {}, expected that of {} as before",
                            quoted(frame), quoted(std::string_view(found.frame))),
                SourceLocation{reader.file(), 0, 0},
                {}},
          reader, message);
    }
    const GeoPosition& at = fix->position;
    const double stamp =
        has_log_times ? seconds_from(message.log_time) : fix->header.stamp.seconds();
    if (!fix->has_fix) {
      ++found.without_fix;
    } else if (!std::isfinite(at.latitude) || !std::isfinite(at.longitude)) {
      ++found.not_finite;
    } else if ((!has_log_times && stamp == 0.0) ||
               (!found.fixes.empty() && stamp <= found.fixes.back().stamp)) {
      ++found.not_later;
    } else {
      found.fixes.push_back({stamp, at, fix->variances, std::isfinite(at.altitude)});
    }
    return {};
  };
  VANTAGE_TRY(found.damage, for_each_message(reader, topics, add));
  return found;
}

}  // namespace vantage::io::ros
