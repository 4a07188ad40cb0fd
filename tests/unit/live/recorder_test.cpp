#include "live/recorder.hpp"

#include <doctest/doctest.h>

#include "io/ros/message_reader.hpp"
#include "io/ros/message_writers.hpp"
#include "live/inbox.hpp"
#include "live/kept_state.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::live {
namespace {

TEST_CASE("a recording holds every message, in the order in which it came") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "r.mcap";
  auto recorder = Recorder::create(path);
  REQUIRE(recorder);
  const dds::Topic a{.name = "/a", .type = "std_msgs/String"},
      b{.name = "/b", .type = "std_msgs/String"};
  for (int i = 0; i < 500; ++i) {
    (*recorder)->see(i % 2 == 0 ? a : b, 1'000'000'000'000'000'000 + i,
                     io::ros::write_string(std::to_string(i)).value());
  }
  REQUIRE((*recorder)->commit());
  CHECK((*recorder)->left_out() == 0);
  auto reader = io::ros::open_bag(path);
  REQUIRE(reader);
  for (int i = 0; i < 500; ++i) {
    const auto message = (*reader)->next();
    REQUIRE(message);
    REQUIRE(*message);
    CHECK((*reader)->topics()[(*message)->topic].name == (i % 2 == 0 ? "/a" : "/b"));
    CHECK((*message)->bytes == io::ros::write_string(std::to_string(i)).value());
  }
  CHECK_FALSE((*reader)->next().value());
}

TEST_CASE("a recording that is not committed leaves nothing, and a wrong type ends it") {
  const test::TemporaryFolder folder;
  {
    auto recorder = Recorder::create(folder.path() / "r.mcap");
    REQUIRE(recorder);
    (*recorder)->see({.name = "/a", .type = "my_msgs/Own"}, 1, "x");
    (*recorder)->see({.name = "/a", .type = "my_msgs/Own"}, 2, "x");
    CHECK_FALSE((*recorder)->commit());
    CHECK((*recorder)->complaint().value().starts_with("the recording has ended"));
    CHECK_FALSE((*recorder)->complaint());
    CHECK((*recorder)->left_out() == 2);
  }
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("of scans that wait, the last one is kept; samples all") {
  Inbox inbox;
  for (int i = 0; i < 5; ++i) {
    inbox.put({.input = Input::imu, .arrival = i, .message = {}});
    inbox.put({.input = Input::points, .arrival = i, .message = {}});
  }
  const auto taken = inbox.take(std::chrono::seconds(0));
  REQUIRE(taken.size() == 6);
  CHECK(taken.back().input == Input::points);
  CHECK(taken.back().arrival == 4);
  CHECK(inbox.take_dropped().scans == 4);
  CHECK(inbox.take_dropped().others == 0);
  CHECK(inbox.take(std::chrono::seconds(0)).empty());
  for (int i = 0; i < 20'010; ++i) inbox.put({.input = Input::imu, .arrival = i, .message = {}});
  CHECK(inbox.take_dropped().others == 10);
  CHECK(inbox.take(std::chrono::seconds(0)).front().arrival == 10);
}

TEST_CASE("a state is read as it was written; another file is refused") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "state.json";
  CHECK_FALSE(read_state(file).value());
  const KeptState state{.stamp = 1.7e9 + 0.1,
                        .T_map_sensor = pose_from_xyz_rpy({1.1, -2.2, 3.3}, {0.1, 0.2, 0.3})};
  REQUIRE(write_state(file, state));
  const auto read = read_state(file).value();
  REQUIRE(read);
  CHECK(read->stamp == state.stamp);
  CHECK(read->T_map_sensor.translation == state.T_map_sensor.translation);
  CHECK(read->T_map_sensor.rotation.coeffs() == state.T_map_sensor.rotation.coeffs());
  for (const char* text : {"", "[1]", "{\"stamp\": 1}", "{\"stamp\": 1, \"x\": \"1\"}",
                           R"({"stamp":1,"x":0,"y":0,"z":0,"qx":0,"qy":0,"qz":0,"qw":2})"}) {
    CAPTURE(text);
    test::write_text(file, text);
    CHECK_FALSE(read_state(file));
  }
}

}  // namespace
}  // namespace vantage::live
