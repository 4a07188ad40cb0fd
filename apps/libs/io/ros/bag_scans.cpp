#include "io/ros/bag_scans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "io/made_scan.hpp"
#include "io/ros/bag_packets.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/topic_choice.hpp"
#include "io/velodyne/packet_scans.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::string_view kVelodyneScan = "velodyne_msgs/VelodyneScan";
constexpr double kForever = std::numeric_limits<double>::infinity();

Result<CloudMessage> parse_cloud(const BagMessage& message, const Topic& topic,
                                 const SourceLocation& where) {
  const auto parse = topic.type == kPointCloud2 ? parse_point_cloud2 : parse_livox;
  return parse(message.bytes, *topic.encoding, where);
}

TopicNeed scans_needed() {
  return {.what = "scans",
          .choices = {{kPointCloud2, kLivoxMessages[0], kLivoxMessages[1], kLivoxMessages[2]},
                      {kVelodyneScan}},
          .by_name = {}};
}

/// How many messages the topics have, if all of them say so.
std::optional<std::uint64_t> messages_of(const std::vector<Topic>& topics,
                                         const std::vector<std::size_t>& chosen) {
  std::uint64_t sum = 0;
  for (const std::size_t i : chosen) {
    if (!topics[i].messages || __builtin_add_overflow(sum, *topics[i].messages, &sum)) {
      return std::nullopt;
    }
  }
  return sum;
}

class BagScans final : public ScanSource {
 public:
  static Result<std::unique_ptr<ScanSource>> open(std::unique_ptr<MessageReader> reader,
                                                  const std::vector<std::size_t>& topics,
                                                  const ScanOptions& options) {
    auto scans = std::unique_ptr<BagScans>(new BagScans(std::move(reader), options));
    VANTAGE_TRY(scans->has_log_times_, lacks_stamps(*scans->reader_, topics));
    VANTAGE_CHECK(scans->reader_->select(topics));
    VANTAGE_CHECK(scans->read_description(topics));
    return scans;
  }

  [[nodiscard]] Result<std::optional<StampedScan>> next() override {
    auto scan = next_usable();
    if (!scan) has_failed_ = true;
    return scan;
  }

  [[nodiscard]] Result<void> seek(double stamp) override {
    skipped_ = {};
    last_stamp_ = -kForever;
    if (has_failed_) return {};
    auto done = find(stamp);
    if (!done) has_failed_ = true;
    return done;
  }

  [[nodiscard]] const ScanDescription& describe() const override { return description_; }
  [[nodiscard]] SkippedScans skipped() const override { return skipped_; }

 private:
  BagScans(std::unique_ptr<MessageReader> reader, ScanOptions options)
      : reader_(std::move(reader)), options_(std::move(options)) {}

  /// Taken from the first message, which stays the next one unless it alone has no stamp.
  [[nodiscard]] Result<void> read_description(const std::vector<std::size_t>& topics) {
    description_.format = reader_->format();
    description_.topic = reader_->topics()[topics.front()].name;
    description_.scans = messages_of(reader_->topics(), topics);
    description_.stamp_rule = kHeaderStamps;
    VANTAGE_TRY(waiting_, reader_->next());
    if (!waiting_) return {};
    VANTAGE_TRY(auto cloud, parse(*waiting_));
    if (options_.tags != Tags::all && !cloud.cloud.points.empty() && cloud.cloud.tags.empty()) {
      return fail(
          ErrorCode::invalid_input,
          fmt::format("the points of {} have no field tag of uint8, so none can be left out "
                      "by it; they have {}",
                      description_.topic, short_list(cloud.fields)),
          where());
    }
    if (has_log_times_) description_.stamp_rule = kLogTimes;
    description_.frame = std::move(cloud.header.frame);
    description_.fields = std::move(cloud.fields);
    if (!has_log_times_ && cloud.header.stamp == 0.0) {
      ++skipped_.not_later;
      VANTAGE_TRY(waiting_, reader_->next());
      if (!waiting_) return {};
    }
    VANTAGE_TRY(first_stamp_, stamp_of(*waiting_));
    log_time_after_stamp_ = seconds_from(waiting_->log_time) - first_stamp_;
    if (const auto span = reader_->span()) {
      description_.last_stamp = seconds_from(span->second) - log_time_after_stamp_;
    }
    return {};
  }

  /// The last file read; a bag may have several.
  [[nodiscard]] SourceLocation where() const { return {reader_->file(), 0, 0}; }

  [[nodiscard]] Result<CloudMessage> parse(const BagMessage& message) const {
    auto cloud = parse_cloud(message, reader_->topics()[message.topic], where());
    if (!cloud) return in_message(std::move(cloud).error(), *reader_, message);
    return cloud;
  }

  [[nodiscard]] double stamp_of(const Header& header, const BagMessage& message) const {
    return has_log_times_ ? seconds_from(message.log_time) : header.stamp.seconds();
  }

  /// The stamp of a message, found without reading the points.
  [[nodiscard]] Result<double> stamp_of(const BagMessage& message) const {
    const Topic& topic = reader_->topics()[message.topic];
    const auto header = parse_header(message.bytes, *topic.encoding, where());
    if (!header) return in_message(header.error(), *reader_, message);
    return stamp_of(*header, message);
  }

  [[nodiscard]] Result<std::optional<BagMessage>> next_message() {
    if (waiting_) return std::exchange(waiting_, std::nullopt);
    return reader_->next();
  }

  [[nodiscard]] Result<std::optional<StampedScan>> next_usable() {
    while (!has_failed_) {
      VANTAGE_TRY(const auto message, next_message());
      if (!message) break;
      VANTAGE_TRY(const double stamp, stamp_of(*message));
      const bool lacks_one = !has_log_times_ && stamp == 0.0;
      if (lacks_one || stamp <= last_stamp_) {
        ++skipped_.not_later;
        continue;
      }
      VANTAGE_TRY(auto cloud, parse(*message));
      last_stamp_ = stamp;
      return scan_of(std::move(cloud.cloud), stamp, *message);
    }
    return std::nullopt;
  }

  [[nodiscard]] Result<std::optional<StampedScan>> scan_of(LoadedCloud cloud, double stamp,
                                                           const BagMessage& message) const {
    auto scan = made_scan(std::move(cloud), stamp, options_, reader_->file());
    if (!scan) return in_message(std::move(scan).error(), *reader_, message);
    scan->name = fmt::format("{}, {}", reader_->file(), place_of(*reader_, message));
    return *std::move(scan);
  }

  /// Makes the first message stamped at or after `stamp` the waiting one.
  [[nodiscard]] Result<void> find(double stamp) {
    // Earlier messages may also be late enough: after a gap in the recording, or if stamps and log
    // times run at different rates. In that case the search goes farther back.
    for (const double slack : {1.0, 30.0, 1000.0, kForever}) {
      VANTAGE_CHECK(reader_->seek(log_time_of(stamp - slack)));
      VANTAGE_TRY(waiting_, reader_->next());
      if (!waiting_) continue;
      VANTAGE_TRY(const double found, stamp_of(*waiting_));
      if (found < stamp || found == first_stamp_) break;
    }
    while (waiting_) {
      VANTAGE_TRY(const double found, stamp_of(*waiting_));
      if (found >= stamp) break;
      VANTAGE_TRY(waiting_, reader_->next());
    }
    return {};
  }

  /// The log time that belongs to a stamp if they differ by as much as for the first message [ns].
  [[nodiscard]] std::int64_t log_time_of(double stamp) const {
    constexpr double kLargest = 9.2e18;  // below 2^63
    const double log_time = (stamp + log_time_after_stamp_) * 1e9;
    if (!(log_time > -kLargest)) return std::numeric_limits<std::int64_t>::min();
    return static_cast<std::int64_t>(std::min(log_time, kLargest));
  }

  std::unique_ptr<MessageReader> reader_;
  ScanOptions options_;
  ScanDescription description_;
  bool has_log_times_ = false;
  double first_stamp_ = 0.0;           // [s]
  double log_time_after_stamp_ = 0.0;  // of the first message [s]
  std::optional<BagMessage> waiting_;  // was read, and is the next one
  double last_stamp_ = -kForever;      // [s]
  SkippedScans skipped_;
  bool has_failed_ = false;
};

}  // namespace

Result<std::unique_ptr<ScanSource>> bag_scans(std::unique_ptr<MessageReader> reader,
                                              const ScanOptions& options) {
  VANTAGE_TRY(const auto topics, choose_topic(*reader, options.topic, scans_needed()));
  if (reader->topics()[topics.front()].type == kVelodyneScan) {
    VANTAGE_CHECK(velodyne::check_packet_options(options));
    return packet_scans(std::move(reader), topics);
  }
  return BagScans::open(std::move(reader), topics, options);
}

}  // namespace vantage::io::ros
