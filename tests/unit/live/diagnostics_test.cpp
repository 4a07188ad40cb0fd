#include "live/diagnostics.hpp"

#include <doctest/doctest.h>

namespace vantage {
namespace {

TEST_CASE("diagnostics: the level is that of the state, and the message says why") {
  using Level = io::ros::Diagnostic::Level;
  ScanReport report;
  report.tracking = Tracking::tracked;
  CHECK(level_of(report) == Level::ok);
  CHECK(message_of(report) == "tracked");

  report.tracking = Tracking::uncertain;
  CHECK(level_of(report) == Level::warn);
  CHECK(message_of(report) == "uncertain");
  report.reason = "the match is ambiguous";
  CHECK(message_of(report) == "uncertain: the match is ambiguous");

  report.tracking = Tracking::lost;
  for (const bool has_pose : {true, false}) {
    report.has_pose = has_pose;
    CHECK(level_of(report) == Level::error);
  }
  CHECK(message_of(report) == "lost: the match is ambiguous");
}

}  // namespace
}  // namespace vantage
