#include "io/ros/bag_scans.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "ros_messages.hpp"

namespace vantage::io::ros {
namespace {

using test::check_clear;
using test::MemoryBag;
using test::MessageWriter;
using test::raw;
using Messages = std::vector<MemoryBag::Message>;

constexpr std::int64_t kSecond = 1'000'000'000;
const Topic kPoints{"/points", "sensor_msgs/PointCloud2", Encoding::cdr, "cdr", 7};

/// A cloud of as many points as there are x, with times a tenth of a second apart.
std::string cloud(double stamp, const std::vector<float>& x) {
  constexpr std::uint8_t kFloat32 = 7;
  MessageWriter writer(MessageWriter::Layout::cdr_little);
  const auto seconds = static_cast<std::uint32_t>(stamp);
  writer.header(seconds, static_cast<std::uint32_t>(std::lround((stamp - seconds) * 1e9)), "lidar");
  writer.number(1U).number(static_cast<std::uint32_t>(x.size())).number(4U);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "time"}) {
    writer.text(name).number(offset).number(kFloat32).number(1U);
    offset += 4;
  }
  writer.number(std::uint8_t{0}).number(16U).number(static_cast<std::uint32_t>(16 * x.size()));
  writer.number(static_cast<std::uint32_t>(16 * x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    writer.append(raw(x[i]) + raw(0.0F) + raw(0.0F) + raw(0.125F * static_cast<float>(i)));
  }
  return writer.number(std::uint8_t{1}).bytes();
}

MemoryBag::Message message(double stamp, double log_time, const std::vector<float>& x = {1, 2}) {
  return {0, std::llround(log_time * 1e9), cloud(stamp, x)};
}

std::unique_ptr<ScanSource> open(const Messages& messages, std::vector<Topic> topics = {kPoints}) {
  auto scans = bag_scans(std::make_unique<MemoryBag>(std::move(topics), messages),
                         {.path = {}, .topic = {}});
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  return *std::move(scans);
}

/// The stamps of all that is left, after an optional seek.
std::vector<double> stamps(ScanSource& scans, std::optional<double> from = std::nullopt) {
  if (from) REQUIRE(scans.seek(*from));
  std::vector<double> stamps;
  for (;;) {
    const auto scan = scans.next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    if (!*scan) return stamps;
    stamps.push_back((*scan)->stamp);
  }
}

TEST_CASE("scans of a bag: points, stamps, times and where they are") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto scans = open({message(10.5, 77, {1, kNan, 3}), message(10.75, 78, {4})});
  const ScanDescription& description = scans->describe();
  CHECK(description.format == "memory");
  CHECK(description.topic == "/points");
  CHECK(description.frame == "lidar");
  CHECK(description.fields ==
        std::vector<std::string>{"x float32", "y float32", "z float32", "time float32"});
  CHECK(description.stamp_rule == "stamps are those of the messages' headers");
  CHECK(description.scans == 7);  // what the bag says

  const auto first = scans->next();
  REQUIRE(first);
  REQUIRE(*first);
  CHECK((*first)->stamp == 10.5);
  CHECK((*first)->points == PointCloud{{1, 0, 0}, {3, 0, 0}});
  CHECK((*first)->seconds == std::vector<float>{0.0F, 0.25F});
  CHECK((*first)->dropped == 1);
  CHECK((*first)->name == "run.bag, message at byte 1000 of /points");
  const auto second = scans->next();
  REQUIRE(second);
  REQUIRE(*second);
  CHECK((*second)->stamp == 10.75);
  CHECK((*second)->points == PointCloud{{4, 0, 0}});
  CHECK((*second)->name == "run.bag, message at byte 2000 of /points");
  CHECK(stamps(*scans).empty());
  CHECK(stamps(*scans).empty());
  CHECK(scans->skipped().total() == 0);
}

TEST_CASE("scans of a bag: what cannot be used is left out and counted") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto scans = open({message(10, 10), message(9, 11), message(10, 12), message(12, 13, {}),
                           message(11, 14), message(13, 15, {kNan})});
  CHECK(stamps(*scans) == std::vector<double>{10, 12, 13});  // also those without a finite point
  CHECK(scans->skipped().not_later == 3);
  CHECK(scans->skipped().incomplete == 0);
  // Counts begin anew, and what comes before is not counted.
  CHECK(stamps(*scans, 11) == std::vector<double>{12, 13});
  CHECK(scans->skipped().not_later == 1);
}

TEST_CASE("scans of a bag: log times where the first stamp was never set") {
  const auto scans = open({message(0, 1000.25), message(0, 1000.5), message(500, 1001)});
  CHECK(scans->describe().stamp_rule.find("the times at which the messages were recorded") !=
        std::string::npos);
  CHECK(stamps(*scans) == std::vector<double>{1000.25, 1000.5, 1001});
  CHECK(stamps(*scans, 1000.5) == std::vector<double>{1000.5, 1001});
  const auto later = open({message(5, 1000), message(0, 1001), message(6, 1002)});
  CHECK(stamps(*later) == std::vector<double>{5, 6});
  CHECK(later->skipped().not_later == 1);
}

TEST_CASE("scans of a bag: a first message alone without a stamp is left out and counted") {
  const auto scans = open({message(0, 1000.25), message(500.5, 1000.5), message(501, 1001)});
  CHECK(scans->describe().stamp_rule == "stamps are those of the messages' headers");
  CHECK(stamps(*scans) == std::vector<double>{500.5, 501});
  CHECK(scans->skipped().not_later == 1);
  CHECK(stamps(*scans, -1.0) == std::vector<double>{500.5, 501});
  CHECK(stamps(*scans, 500.75) == std::vector<double>{501});
  // A clock that starts with the recording may begin at 0: such stamps cannot be told from missing
  // ones, so log times are taken.
  const auto simulated = open({message(0, 1000.25), message(0.25, 1000.5)});
  CHECK(stamps(*simulated) == std::vector<double>{1000.25, 1000.5});
  const auto single = open({message(0, 1000.25)});
  CHECK(stamps(*single) == std::vector<double>{1000.25});
}

TEST_CASE("scans of a bag: seek is exact, whatever the clock of the log times") {
  std::vector<double> all;
  for (int i = 0; i < 100; ++i) all.push_back(1000 + 0.125 * i);
  const auto check = [&](auto log_time_of) {
    Messages messages;
    for (const double stamp : all) messages.push_back(message(stamp, log_time_of(stamp)));
    const auto scans = open(messages);
    for (const double from : {-1e300, 0.0, 999.9, 1000.0, 1000.01, 1000.125, 1003.3, 1006.0, 1011.0,
                              1012.375, 1012.376, 1e9, 1e300}) {
      CAPTURE(from);
      std::vector<double> expected;
      for (const double stamp : all) {
        if (stamp >= from) expected.push_back(stamp);
      }
      CHECK(stamps(*scans, from) == expected);
      CHECK(stamps(*scans, from) == expected);
    }
    CHECK(stamps(*scans, std::nan("")).empty());
    CHECK(stamps(*scans, -std::numeric_limits<double>::infinity()) == all);
  };
  SUBCASE("the same clock") {
    check([](double stamp) { return stamp; });
  }
  SUBCASE("another epoch") {
    check([](double stamp) { return stamp + 1.6e9; });
  }
  SUBCASE("with a delay that varies") {
    check([](double stamp) { return stamp + 0.1 * std::sin(1000 * stamp); });
  }
  SUBCASE("a bag made at another rate than the sensor's") {
    check([](double stamp) { return 50 + 0.01 * (stamp - 1000); });
    check([](double stamp) { return 50 + 20.0 * (stamp - 1000); });
  }
  SUBCASE("all at one moment") {
    check([](double) { return 5.0; });
  }
}

TEST_CASE("scans of a bag: seek uses the log times") {
  Messages messages;
  for (int i = 0; i < 1000; ++i) messages.push_back(message(100 + 0.1 * i, 5000 + 0.1 * i));
  auto bag = std::make_unique<MemoryBag>(std::vector<Topic>{kPoints}, messages);
  const MemoryBag& counted = *bag;
  auto scans = bag_scans(std::move(bag), {.path = {}, .topic = {}});
  REQUIRE(scans);
  const std::size_t before = counted.reads;
  REQUIRE((*scans)->seek(150.0));
  const auto scan = (*scans)->next();
  REQUIRE(scan);
  CHECK((*scan)->stamp == doctest::Approx(150.0));
  CHECK(counted.reads - before < 20);  // a second of slack

  SUBCASE("also after a gap in the recording") {
    messages.push_back(message(215, 5115));
    auto with_gap = std::make_unique<MemoryBag>(std::vector<Topic>{kPoints}, messages);
    const MemoryBag& counted_with_gap = *with_gap;
    auto more = bag_scans(std::move(with_gap), {.path = {}, .topic = {}});
    REQUIRE(more);
    CHECK(stamps(**more, 210) == std::vector<double>{215});
    CHECK(counted_with_gap.reads < 220);  // the last 30 s hold 200 of 1001 messages
  }
}

TEST_CASE("scans of a bag: a seek before all scans, and before the first was read") {
  const auto scans = open({message(10, 10), message(11, 11)});
  CHECK(stamps(*scans, 5) == std::vector<double>{10, 11});
  CHECK(stamps(*scans, 10.5) == std::vector<double>{11});
  CHECK(stamps(*scans, 12).empty());
  CHECK(stamps(*scans, 10) == std::vector<double>{10, 11});
}

TEST_CASE("scans of a bag: which topic") {
  const Topic other{"/other", "sensor_msgs/PointCloud2", Encoding::cdr, "cdr", {}};
  const Topic packets{"/packets", "velodyne_msgs/VelodyneScan", Encoding::cdr, "cdr", {}};
  const Topic odometry{"/odom", "nav_msgs/Odometry", Encoding::cdr, "cdr", {}};
  const Messages messages{{0, kSecond, cloud(1, {1})}, {1, kSecond, cloud(2, {1})}};
  const auto choose = [&](const std::vector<Topic>& topics, const std::string& topic) {
    return bag_scans(std::make_unique<MemoryBag>(topics, messages), {.path = {}, .topic = topic});
  };
  const auto refused = [&](const std::vector<Topic>& topics, const std::string& topic,
                           const std::string& expected) {
    const auto scans = choose(topics, topic);
    REQUIRE_FALSE(scans);
    check_clear(scans.error(), ErrorCode::invalid_input, "run.bag", expected);
  };
  SUBCASE("the only one with points") {
    for (const char* topic : {"", "/points"}) {
      const auto scans = choose({kPoints, odometry}, topic);
      REQUIRE_MESSAGE(scans, to_string(scans.error()));
      CHECK((*scans)->describe().topic == "/points");
      CHECK(stamps(**scans) == std::vector<double>{1});
    }
  }
  SUBCASE("the one that was named") {
    const auto scans = choose({kPoints, other}, "/other");
    REQUIRE(scans);
    CHECK(stamps(**scans) == std::vector<double>{2});
    CHECK((*scans)->describe().scans == std::nullopt);
    refused({kPoints, other}, "",
            "2 topics have scans, choose one with --topic: /other (sensor_msgs/PointCloud2), "
            "/points (sensor_msgs/PointCloud2)");
  }
  SUBCASE("one that a bag has twice is one") {
    const auto scans = choose({kPoints, kPoints}, "");
    REQUIRE(scans);
    CHECK(stamps(**scans) == std::vector<double>{1, 2});
    CHECK((*scans)->describe().scans == 14);
  }
  SUBCASE("points rather than packets") {
    CHECK(choose({kPoints, packets}, ""));
    refused({kPoints, packets}, "/nothing",
            "there is no topic '/nothing'; topics with scans: /packets "
            "(velodyne_msgs/VelodyneScan), /points (sensor_msgs/PointCloud2)");
  }
  SUBCASE("one of another type") {
    refused({kPoints, odometry}, "/odom",
            "topic '/odom' is of type 'nav_msgs/Odometry'; topics with scans: /points "
            "(sensor_msgs/PointCloud2)");
  }
  SUBCASE("one in an encoding that is not known") {
    const Topic json{"/json", "sensor_msgs/PointCloud2", std::nullopt, "json", {}};
    CHECK(choose({kPoints, json}, ""));
    refused({kPoints, json}, "/json",
            "topic '/json' is of type 'sensor_msgs/PointCloud2' in the encoding 'json'; topics "
            "with scans: /points (sensor_msgs/PointCloud2)");
    refused({json}, "", "no topic has scans; there are: /json (sensor_msgs/PointCloud2)");
  }
  SUBCASE("none") {
    refused({odometry}, "", "no topic has scans; there are: /odom (nav_msgs/Odometry)");
    refused({}, "", "no topic has scans; there are: none");
    const std::string name(5000, 'n');
    refused({{"/\n" + name, name, Encoding::cdr, "cdr", {}}}, name, "there is no topic 'nnn");
    std::vector<Topic> many;
    for (int i = 0; i < 50; ++i) {
      many.push_back({"/topic" + std::to_string(i), "std_msgs/String", Encoding::cdr, "cdr", {}});
    }
    refused(many, "", "/topic0 (std_msgs/String), /topic1 (std_msgs/String)");
    refused(many, "", "more");
  }
  SUBCASE("a topic without messages") {
    const auto scans = choose({odometry, odometry, kPoints}, "");
    REQUIRE(scans);
    CHECK(stamps(**scans).empty());
    CHECK(stamps(**scans, 5).empty());
    CHECK((*scans)->describe().fields.empty());
  }
}

TEST_CASE("scans of a bag: an error names the message, and nothing comes after it") {
  Messages messages{message(1, 1), message(2, 2), message(3, 3)};
  messages[1].bytes.resize(messages[1].bytes.size() - 1);
  const auto scans = open(messages);
  REQUIRE(scans->next());
  const auto broken = scans->next();
  REQUIRE_FALSE(broken);
  check_clear(broken.error(), ErrorCode::corrupt_data, "run.bag",
              "(while reading the message at byte 2000 of /points)");
  CHECK(stamps(*scans).empty());
  CHECK(stamps(*scans, 1).empty());

  messages = {message(1, 1, std::vector<float>(200, 1.0F))};  // a sweep of 25 s
  const auto sweep = open(messages)->next();
  REQUIRE_FALSE(sweep);
  check_clear(sweep.error(), ErrorCode::corrupt_data, "run.bag", "spans 24.875 s");

  messages.front().bytes.resize(10);
  const auto first = bag_scans(std::make_unique<MemoryBag>(std::vector<Topic>{kPoints}, messages),
                               {.path = {}, .topic = {}});
  REQUIRE_FALSE(first);
  check_clear(first.error(), ErrorCode::corrupt_data, "run.bag", "the message ends at byte 10");
}

/// Of a frame of the recorded street, from Python's struct and math.fsum.
struct Frame {
  double stamp = 0.0;
  std::size_t points = 0;
  Eigen::Vector3d sum;
};
const std::vector<Frame> kStreet{
    {1317037200.0, 123398, {62683.46966428438, 81858.17603949783, -151567.10599827452}},
    {1317037200.099999905, 123224, {23077.612008399446, 46936.07909652172, -152133.79499044106}},
    {1317037200.200000048, 122478, {50850.9377809118, 23866.979993136367, -153947.2799821901}},
    {1317037200.299999952, 122517, {-38468.291971896775, 36672.95690049173, -155961.25700787245}},
    {1317037200.400000095, 122692, {-78343.62197339616, 68784.08089121862, -151750.547013729}},
};

TEST_CASE("scans of recorded bags of every format") {
  struct Recording {
    std::string path, format;
    std::size_t frames = 0;
  };
  for (const Recording& recording :
       std::vector<Recording>{{"rosbag1/kitti0005_5frames_none.bag", "rosbag1 2.0 (none)", 5},
                              {"rosbag1/kitti0005_3frames_lz4.bag", "rosbag1 2.0 (lz4)", 3},
                              {"rosbag1/kitti0005_2frames_bz2.bag", "rosbag1 2.0 (bz2)", 2},
                              {"rosbag2/kitti0005_3frames", "rosbag2 (SQLite)", 3},
                              {"mcap/kitti0005_4frames_none.mcap", "MCAP (none)", 4},
                              {"mcap/kitti0005_2frames_lz4.mcap", "MCAP (lz4)", 2},
                              {"mcap/kitti0005_2frames_zstd.mcap", "MCAP (zstd)", 2}}) {
    const auto path = test::real_data("formats/" + recording.path);
    if (!path) return;
    CAPTURE(recording.path);
    auto bag = open_bag(*path);
    REQUIRE_MESSAGE(bag, to_string(bag.error()));
    const auto scans = bag_scans(*std::move(bag), {.path = {}, .topic = {}});
    REQUIRE_MESSAGE(scans, to_string(scans.error()));
    const ScanDescription& description = (*scans)->describe();
    CHECK(description.format == recording.format);
    CHECK(description.topic == "/points_raw");
    CHECK(description.frame == "velo");
    CHECK(description.fields ==
          std::vector<std::string>{"x float32", "y float32", "z float32", "intensity float32"});
    CHECK(description.scans == recording.frames);
    for (std::size_t i = 0; i < recording.frames; ++i) {
      const auto scan = (*scans)->next();
      REQUIRE_MESSAGE(scan, to_string(scan.error()));
      REQUIRE(*scan);
      CHECK((*scan)->stamp == kStreet[i].stamp);
      CHECK((*scan)->points.size() + 1 == kStreet[i].points);
      CHECK((*scan)->no_returns == 1);  // the recording has one in each scan
      CHECK((*scan)->dropped == 0);
      CHECK((*scan)->seconds.empty());
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const Point& point : (*scan)->points) sum += point;
      CHECK((sum - kStreet[i].sum).norm() < 1e-4);
      CHECK((*scan)->name.find(path->string()) == 0);
      CHECK((*scan)->name.find(" of /points_raw") != std::string::npos);
    }
    CHECK(stamps(**scans).empty());
    CHECK((*scans)->skipped().total() == 0);
    for (std::size_t i = 0; i < recording.frames; ++i) {
      CHECK(stamps(**scans, kStreet[i].stamp).size() == recording.frames - i);
      CHECK(stamps(**scans, kStreet[i].stamp + 0.01).size() == recording.frames - i - 1);
    }
  }
}

}  // namespace
}  // namespace vantage::io::ros
