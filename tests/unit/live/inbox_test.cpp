#include "live/inbox.hpp"

#include <doctest/doctest.h>

#include <chrono>

#include "live/clock.hpp"
#include "robot.hpp"

namespace vantage::live {
namespace {

using namespace test_world;
using std::chrono::nanoseconds;

TEST_CASE("of scans that wait, the last one is kept; samples all") {
  Inbox inbox;
  for (int i = 0; i < 5; ++i) {
    inbox.put({.input = Input::imu, .arrival = i, .message = {}});
    inbox.put({.input = Input::points, .arrival = i, .message = {}});
  }
  const auto taken = inbox.take(std::chrono::seconds(0)).messages;
  REQUIRE(taken.size() == 6);
  CHECK(taken.back().input == Input::points);
  CHECK(taken.back().arrival == 4);
  CHECK(inbox.take_dropped().scans == 4);
  CHECK(inbox.take_dropped().others == 0);
  CHECK(inbox.take(std::chrono::seconds(0)).messages.empty());
  for (int i = 0; i < 20'010; ++i) inbox.put({.input = Input::imu, .arrival = i, .message = {}});
  CHECK(inbox.take_dropped().others == 10);
  CHECK(inbox.take(std::chrono::seconds(0)).messages.front().arrival == 10);
}

TEST_CASE("a scan that waits while another is worked on is not missing") {
  constexpr std::int64_t kSecond = 1'000'000'000;
  LiveParams params;  // without a mount, no scan is localized
  Robot robot(params);
  Inbox inbox;
  const auto put = [&](std::int64_t arrival) {
    inbox.put({.input = Input::points, .arrival = arrival, .message = "broken"});
  };
  const std::int64_t began = now();
  put(began);
  auto taken = inbox.take(nanoseconds(0));
  CHECK(taken.until >= began);
  for (Received& one : taken.messages) robot.session.take(std::move(one));
  put(taken.until + 1);
  // However long the first one took, nothing is known of what came meanwhile.
  const auto idle = robot.session.idle(taken.until);
  REQUIRE(idle);
  CHECK(idle->message.find("no scan has come") == std::string::npos);
  CHECK(robot.session.idle(taken.until + 3 * kSecond)->message.find("no scan has come") !=
        std::string::npos);
}

}  // namespace
}  // namespace vantage::live
