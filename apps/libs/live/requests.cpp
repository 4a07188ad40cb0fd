#include "live/requests.hpp"

#include <fmt/format.h>

#include <utility>

#include "io/ros/message_writers.hpp"
#include "live/publisher.hpp"

namespace vantage::live {
namespace {

using io::ros::Encoding;

// A request to look for the vehicle is answered after this many scans, or this time [ns].
constexpr int kMostScans = 20;
constexpr std::int64_t kLongest = 5'000'000'000;

}  // namespace

Result<void> Requests::trigger(const Received& received) {
  VANTAGE_TRY(const bool on, io::ros::parse_set_bool(received.message, Encoding::cdr, {}));
  if (on != is_on_) {
    notices_.say(on ? "switched on by its service"
                    : "switched off by its service: scans are left out");
  }
  is_on_ = on;
  answer(Input::trigger, *received.request,
         io::ros::write_set_bool_answer(true, on ? "scans are localized" : "scans are left out"));
  return {};
}

void Requests::align(const Received& received) {
  if (align_) refuse(Input::align, align_->id, "another request came");
  align_ = Align{.id = *received.request, .arrival = received.arrival};
}

void Requests::refuse(Input input, const dds::RequestId& id, const std::string& why) {
  notices_.say(fmt::format("a request to the service '{}' is refused: {}", name_of(input), why));
  if (input == Input::trigger) return answer(input, id, io::ros::write_set_bool_answer(false, why));
  answer(input, id,
         io::ros::write_align_answer(false, false, {.stamp = 0.0, .frame = map_frame_}, {},
                                     io::ros::PoseCovariance::Zero()));
}

void Requests::see(const Localized& scan) {
  if (!align_) return;
  const ScanReport& report = scan.report;
  const bool is_tracked = report.tracking == Tracking::tracked;
  if (!is_tracked && ++align_->scans < kMostScans) return;
  const Align asked = *std::exchange(align_, std::nullopt);
  if (!report.has_pose) {
    return refuse(Input::align, asked.id, fmt::format("no pose in {} scans", kMostScans));
  }
  const RobotPose found = robot_pose(scan);
  answer(Input::align, asked.id,
         io::ros::write_align_answer(true, is_tracked, {.stamp = scan.stamp, .frame = map_frame_},
                                     found.T_map_base, found.covariance));
}

std::vector<Answer> Requests::take_answers(std::int64_t now) {
  if (align_ && now - align_->arrival > kLongest) {
    const Align asked = *std::exchange(align_, std::nullopt);
    refuse(Input::align, asked.id, fmt::format("no pose in {} s", kLongest / 1'000'000'000));
  }
  return std::exchange(answers_, {});
}

void Requests::answer(Input input, const dds::RequestId& id, Result<std::string> message) {
  if (message) {
    answers_.push_back({input, id, *std::move(message)});
  } else {
    notices_.say(fmt::format("an answer of the service '{}' cannot be written: {}", name_of(input),
                             message.error().message));
  }
}

}  // namespace vantage::live
