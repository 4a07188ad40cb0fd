#include "live/requests.hpp"

#include <doctest/doctest.h>

#include "io/ros/wire_reader.hpp"
#include "robot.hpp"

namespace vantage::live {
namespace {

using namespace test_world;

/// The answer of Autoware's service, read.
struct AlignAnswer {
  bool success, reliable;
  io::ros::Header header;
  Pose pose;
};
AlignAnswer read_align(const std::string& message) {
  const SourceLocation where;
  auto reader = io::ros::WireReader::open(message, io::ros::Encoding::cdr, where).value();
  AlignAnswer answer{};
  answer.success = reader.number<std::uint8_t>("success").value() != 0;
  answer.reliable = reader.number<std::uint8_t>("reliable").value() != 0;
  answer.header = reader.header().value();
  for (double& x : answer.pose.translation) x = reader.number<double>("position").value();
  for (double& x : answer.pose.rotation.coeffs()) x = reader.number<double>("quaternion").value();
  for (int i = 0; i < 36; ++i) REQUIRE(reader.number<double>("covariance"));
  CHECK(reader.offset() == message.size());
  return answer;
}

struct Autoware {
  Robot robot{Robot::with_mount(), std::nullopt};
  double stamp = kStart;

  void ask(Input input, const std::string& message, std::int64_t number) {
    robot.session.take({.input = input,
                        .arrival = ns(stamp),
                        .message = message,
                        .request = dds::RequestId{.client = {}, .number = number}});
  }
  void align(double x, std::int64_t number, const char* frame = "map") {
    io::ros::PoseCovariance covariance = io::ros::PoseCovariance::Identity();
    ask(Input::align,
        io::ros::write_pose_with_covariance({.stamp = stamp, .frame = frame}, test::at_x(x),
                                            covariance)
            .value(),
        number);
  }
  std::optional<Localized> scan() {
    stamp += 0.1;
    robot.scan(stamp);
    return robot.localize();
  }
  std::vector<Answer> answers() { return robot.session.take_answers(ns(stamp)); }
};

TEST_CASE("Autoware switches the localizer off, has the vehicle looked for, and switches it on") {
  Autoware autoware;
  CHECK(autoware.scan());
  CHECK(autoware.answers().empty());
  autoware.ask(Input::trigger, set_bool(false), 7);
  auto answers = autoware.answers();
  REQUIRE(answers.size() == 1);
  CHECK(answers[0].input == Input::trigger);
  CHECK(answers[0].id.number == 7);
  CHECK(answers[0].message[4] == 1);
  CHECK_FALSE(autoware.scan());
  CHECK(autoware.robot.notices.count_of("scans_while_off") == 1);
  CHECK(autoware.robot.session.idle(ns(autoware.stamp))->message == "switched off by its service");

  autoware.align(5.6, 8);
  while (answers = autoware.answers(), answers.empty()) {
    CHECK_FALSE(autoware.scan());  // what is found is not published
    REQUIRE(autoware.stamp < kStart + 3.0);
  }
  REQUIRE(answers.size() == 1);
  CHECK(answers[0].id.number == 8);
  const AlignAnswer found = read_align(answers[0].message);
  CHECK(found.success);
  CHECK(found.reliable);
  CHECK(found.header.frame == "map");
  CHECK(double(found.header.stamp) == doctest::Approx(autoware.stamp).epsilon(1e-15));
  CHECK(found.pose.translation.x() == doctest::Approx(5.0 + autoware.stamp - kStart).epsilon(1e-2));
  CHECK(found.pose.translation.z() == doctest::Approx(-1.0).epsilon(1e-2));  // of the base
  CHECK_FALSE(autoware.scan());

  autoware.ask(Input::trigger, set_bool(true), 9);
  CHECK(autoware.answers().size() == 1);
  for (int i = 0; i < 5; ++i) {
    const auto scan = autoware.scan();
    REQUIRE(scan);
    CHECK(scan->report.T_map_scan.translation.x() ==
          doctest::Approx(5.0 + autoware.stamp - kStart).epsilon(1e-2));
    CHECK(scan->report.risk < 0.02);
  }
}

TEST_CASE("a request that cannot be met is answered all the same") {
  Autoware autoware;
  const auto refused = [&](std::int64_t number, const std::string& why) {
    const auto answers = autoware.answers();
    REQUIRE(answers.size() == 1);
    CHECK(answers[0].id.number == number);
    CHECK(answers[0].message[4] == 0);
    CHECK_MESSAGE(autoware.robot.was_told(why), why);
  };
  autoware.align(5.0, 1, "odom");
  refused(1, "its pose is not in the map's frame");
  autoware.ask(Input::align, "xx", 2);
  refused(2, "'align' is refused");
  autoware.ask(Input::trigger, "", 3);
  refused(3, "'trigger' is refused");
  autoware.align(5.0, 4);
  autoware.align(5.0, 5);
  refused(4, "another request came");
  autoware.stamp += 5.1;  // without a scan
  refused(5, "no pose in 5 s");
  CHECK(autoware.scan());
}

}  // namespace
}  // namespace vantage::live
