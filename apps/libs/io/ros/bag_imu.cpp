#include "io/ros/bag_imu.hpp"

#include <fmt/format.h>

#include <utility>

#include "io/ros/message_reading.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/transform_tree.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {

TopicNeed imu_needed() {
  return {.what = "inertial samples", .choices = {{kImu}}, .by_name = {}, .option = "--imu-topic"};
}

Result<RawImu> read_bag_imu(MessageReader& reader, const std::vector<std::size_t>& topics) {
  RawImu found;
  bool is_first = true;
  VANTAGE_TRY(const bool has_log_times, lacks_stamps(reader, topics));
  const auto add = [&](const BagMessage& message) -> Result<void> {
    const Topic& topic = reader.topics()[message.topic];
    auto imu = parse_imu(message.bytes, *topic.encoding, {reader.file(), 0, 0});
    if (!imu) return in_message(std::move(imu).error(), reader, message);
    const std::string_view frame = frame_name(imu->header.frame);
    if (std::exchange(is_first, false)) found.frame = frame;
    if (frame != found.frame) {
      return in_message(Error{ErrorCode::corrupt_data,
                              fmt::format("the sample is that of {}, expected that of {} as before",
                                          quoted(frame), quoted(std::string_view(found.frame))),
                              SourceLocation{reader.file(), 0, 0},
                              {}},
                        reader, message);
    }
    if (!imu->is_measured || (!has_log_times && imu->header.stamp == 0.0)) {
      ++found.not_measured;
      return {};
    }
    found.samples.push_back(
        {.stamp = has_log_times ? seconds_from(message.log_time) : imu->header.stamp.seconds(),
         .angular_velocity = imu->angular_velocity,
         .specific_force = imu->linear_acceleration});
    return {};
  };
  VANTAGE_TRY(found.damage, for_each_message(reader, topics, add));
  found.stamp_rule = has_log_times ? kLogTimes : kHeaderStamps;
  return found;
}

}  // namespace vantage::io::ros
