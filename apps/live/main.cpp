// vantage-live: localizes scans that a robot's sensors publish, as they come.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "delays.hpp"
#include "foxglove/viewer.hpp"
#include "live/clock.hpp"
#include "live/connection.hpp"
#include "live/inbox.hpp"
#include "live/kept_state.hpp"
#include "live/live_params.hpp"
#include "live/publisher.hpp"
#include "live/recorder.hpp"
#include "live/session.hpp"
#include "live/worker.hpp"
#include "serve_maps.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/freed_memory.hpp"
#include "terminal/option_values.hpp"
#include "vantage/engine/bundle.hpp"
#include "wiring.hpp"

namespace vantage {
namespace {

using live::Input;
using live::now;
using live::Output;
using live::time_of_day;

struct Options {
  std::string config, initial_pose;
  std::optional<std::filesystem::path> record;
  std::optional<double> seconds;
  cli::CommonOptions common;
};

volatile std::sig_atomic_t g_signal = 0;  // the one way that a signal reaches a program
extern "C" void on_signal(int number) { g_signal = number; }

/// A lost terminal ends the program in order, unless nohup has said that it does not matter. A
/// message to a lost terminal does not end the program.
void catch_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (std::signal(SIGHUP, on_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

/// What a session is connected to, and what it says.
class Node {
 public:
  Node(const live::LiveParams& params, Bundle bundle, live::Notices& notices,
       std::unique_ptr<live::Recorder> recorder)
      : params_(params),
        notices_(notices),
        bundle_(std::move(bundle)),
        recorder_(std::move(recorder)),
        publisher_(params),
        connection_([this] { return connect_dds(); }, [this] { disconnect_dds(); }, notices) {
    if (recorder_) observers_.push_back(recorder_.get());
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  /// After an exception, too, no job may run once the participant is gone that it writes to.
  ~Node() { worker_.stop(); }

  /// Errors: those of Participant.
  [[nodiscard]] Result<void> connect() {
    if (params_.foxglove.port) {
      const auto put = [this](std::string&& message) {
        inbox_.put(received_now(Input::initial_pose, std::move(message)));
      };
      VANTAGE_TRY(viewer_, foxglove::Viewer::open(params_, put, say));
      observers_.push_back(viewer_.get());
    }
    if (!params_.topics.map.empty() && !bundle_.has_points()) {
      say("note: the bundle holds prepared maps only, no points: no map is published");
    }
    return connection_.open();
  }

  /// Connects again once the first network is up.
  void follow_network() { connection_.follow(std::chrono::steady_clock::now()); }

  [[nodiscard]] std::deque<live::Received> take(std::chrono::nanoseconds longest) {
    auto taken = inbox_.take(longest);
    taken_until_ = taken.until;
    const auto dropped = inbox_.take_dropped();
    notices_.tell_dropped_scans(dropped.scans);
    notices_.tell("samples_dropped",
                  "samples come faster than they are read: the oldest is dropped", dropped.others);
    return std::move(taken.messages);
  }

  /// Shows observers a message that the session gets.
  void show(const live::Received& received) {
    const auto topic = topics_.find(received.input);
    if (topic == topics_.end()) return;  // a request
    for (live::Observer* const one : observers_) {
      one->see(topic->second, received.time, received.message);
    }
  }

  /// Answers a request, once its client is there to hear it. Clients wait side by side: one that
  /// went away delays the others by a second at most.
  void reply(live::Answer&& answer) {
    constexpr std::chrono::seconds kLongestWait(1);
    constexpr std::size_t kMostWaiting = 100;
    const auto until = std::chrono::steady_clock::now() + kLongestWait;
    const std::size_t left_out = worker_.run_latest(
        "answer",
        [this, until, answer = std::move(answer)] {
          const auto replier = repliers_.find(answer.input);
          if (replier == repliers_.end()) return;  // its client went with the connection
          const auto sent = replier->second.reply(answer.id, answer.message, until);
          if (!sent) notices_.tell("answers_not_heard", sent.error().message);
        },
        kMostWaiting);
    notices_.tell("answers_dropped",
                  "requests come faster than their clients hear the answers: the oldest is dropped",
                  left_out);
  }

  /// Publishes what was found, and tells of changes.
  void answer(const live::Localized& scan) {
    const auto& report = scan.report;
    std::string label;
    if (const auto entry = bundle_.directory()->entry(report.region)) label = entry->region.label;
    const auto messages = publisher_.messages(scan, label, counts());
    if (!messages) return say(messages.error().message);
    diagnosed_ = std::chrono::steady_clock::now();
    for (const live::Publication& one : *messages) publish(one.output, one.message);
    if (viewer_) {
      if (const auto shown = viewer_->show(scan, time_of_day()); !shown) say(shown.error().message);
    }
    if (report.has_pose && shown_ != report.region) {
      shown_ = report.region;
      worker_.run_latest("map", [this, region = report.region] { publish_map(region); });
    }
    const double delay = static_cast<double>(now() - scan.received.arrival) * 1e-9;
    delays_.add(delay);
    ++scans_;
    if (report.tracking == Tracking::tracked) {
      ++tracked_;
      keep(scan);
    }
    tell(report);
    if (recorder_) {
      if (const auto complaint = recorder_->complaint()) say(*complaint);
    }
  }

  /// Publishes why no scan is localized, once a second.
  void tell_idle(const live::Session& session) {
    constexpr std::chrono::seconds kPeriod(1);
    const auto time = std::chrono::steady_clock::now();
    if (diagnosed_ && time - *diagnosed_ < kPeriod) return;
    const auto idle = session.idle(taken_until_, obstacles());
    if (!idle) return;
    diagnosed_ = time;
    const auto message =
        publisher_.diagnostics(*idle, io::ros::seconds_from(time_of_day()), counts());
    if (!message) return say(message.error().message);
    publish(Output::diagnostics, *message);
  }

  /// Publishes the motion between scans.
  void move(const live::Moved& moved) {
    const auto message = live::odometry_message(params_.frames, moved);
    if (message) publish(Output::odometry, *message);
  }

  /// Ends in order. Errors: those of the recording.
  [[nodiscard]] Result<void> finish(bool json) {
    worker_.stop();  // before what its jobs write to
    participant_.reset();
    const std::uint64_t dropped = notices_.count_of("scans_dropped");
    if (kept_) save(*kept_);
    if (json) {
      std::cout
          << fmt::format(
                 R"({{"scans": {}, "tracked": {}, "dropped": {}, "delay_ms": {{"median": {:.1f}, "p99": {:.1f}}}}})",
                 scans_, tracked_, dropped, delays_.quantile(0.5), delays_.quantile(0.99))
          << '\n';
      return recorder_ ? recorder_->commit() : Result<void>();
    }
    std::cout << fmt::format("{}: {} tracked", cli::counted(scans_, "scan"),
                             cli::grouped(tracked_));
    if (dropped > 0) std::cout << fmt::format(", {} dropped before", cli::grouped(dropped));
    if (scans_ > 0) {
      std::cout << fmt::format(
          "; from a scan's arrival to its pose {:.1f} ms at the median, {:.1f} "
          "ms at 99 %",
          delays_.quantile(0.5), delays_.quantile(0.99));
    }
    std::cout << '\n';
    return recorder_ ? recorder_->commit() : Result<void>();
  }

 private:
  [[nodiscard]] Result<void> connect_dds() {
    VANTAGE_TRY(participant_,
                dds::Participant::open(live::participant_options(params_, params_.node, notices_)));
    for (const live::OutputTopic& output : live::output_topics(params_)) {
      if (output.output == Output::map && !bundle_.has_points()) continue;
      VANTAGE_TRY(auto writer, participant_->advertise(output.topic));
      outputs_.insert_or_assign(output.output, Outgoing{output.topic, std::move(writer)});
    }
    VANTAGE_TRY(topics_, subscribe(*participant_, params_, inbox_));
    VANTAGE_TRY(repliers_, serve(*participant_, params_.services, inbox_));
    return participant_->announce();
  }

  /// Observers still see what is published.
  void disconnect_dds() {
    worker_.finish();  // its jobs write to what goes
    for (auto& [output, one] : outputs_) one.writer.reset();
    repliers_.clear();
    participant_.reset();
    shown_.reset();  // who comes later gets the map from the new writer
  }

  struct Outgoing {
    dds::Topic topic;
    std::optional<dds::Participant::Writer> writer;  // while it is connected
  };

  /// Why messages do not come.
  [[nodiscard]] std::vector<std::string> obstacles() const {
    if (connection_.trouble()) return {*connection_.trouble()};
    return participant_ ? live::obstacles_of(participant_->misfits()) : std::vector<std::string>();
  }

  /// What went wrong so far, by kind.
  [[nodiscard]] std::map<std::string, std::uint64_t> counts() const {
    auto counts = notices_.counts();
    if (recorder_ && recorder_->left_out() > 0) counts["not_recorded"] = recorder_->left_out();
    return counts;
  }

  void publish(Output output, const std::string& message) {
    const auto found = outputs_.find(output);
    if (found == outputs_.end()) return;
    for (live::Observer* const one : observers_)
      one->see(found->second.topic, time_of_day(), message);
    if (!found->second.writer) return;
    if (const auto sent = found->second.writer->write(message); !sent) {
      notices_.tell("not_sent", sent.error().message);
    }
  }

  /// In the worker's thread.
  void publish_map(RegionId region) {
    if (!outputs_.contains(Output::map)) return;
    const auto map = bundle_.get(region);
    if (!map) return say("a region's map cannot be published: " + map.error().message);
    const auto message = live::map_message(params_.frames, map->points, notices_);
    if (!message) return say("a region's map cannot be published: " + message.error().message);
    publish(Output::map, *message);
  }

  /// Keeps a tracked pose; writes it once a second.
  void keep(const live::Localized& scan) {
    if (!params_.state_file) return;
    kept_ = live::KeptState{.stamp = scan.scan.stamp, .T_map_sensor = scan.report.T_map_scan};
    const auto time = std::chrono::steady_clock::now();
    if (saved_ && time - *saved_ < std::chrono::seconds(1)) return;
    saved_ = time;
    worker_.run_latest("state", [this, state = *kept_] { save(state); });
  }

  void save(const live::KeptState& state) {
    const std::scoped_lock lock(state_mutex_);
    const auto written = live::write_state(*params_.state_file, state);
    if (!written && !std::exchange(told_state_, true)) {
      say("the state cannot be kept: " + written.error().message);
    }
  }

  void tell(const ScanReport& report) {
    if (told_ == report.tracking) return;
    told_ = report.tracking;
    const Eigen::Vector3d& at = report.T_map_scan.translation;
    std::string line = fmt::format("{:.3f} s: {}", report.stamp, to_string(report.tracking));
    if (report.has_pose)
      line += fmt::format(" at x {:.2f}, y {:.2f}, z {:.2f}", at.x(), at.y(), at.z());
    if (!report.reason.empty()) line += ", " + report.reason;
    say(line);
  }

  const live::LiveParams& params_;
  live::Notices& notices_;
  Bundle bundle_;
  std::unique_ptr<live::Recorder> recorder_;
  std::vector<live::Observer*> observers_;
  live::Publisher publisher_;
  live::Inbox inbox_;
  std::map<Output, Outgoing> outputs_;
  std::map<Input, dds::Topic> topics_;
  std::map<Input, dds::Participant::Replier> repliers_;
  std::int64_t taken_until_ = now();  // see Inbox::Taken
  std::optional<RegionId> shown_;
  std::optional<Tracking> told_;
  std::optional<std::chrono::steady_clock::time_point> diagnosed_;
  std::uint64_t scans_ = 0, tracked_ = 0;
  Delays delays_;
  std::optional<live::KeptState> kept_;
  std::optional<std::chrono::steady_clock::time_point> saved_;
  std::mutex state_mutex_;
  bool told_state_ = false;
  std::unique_ptr<foxglove::Viewer> viewer_;  // before the worker, which shows it maps
  live::Worker worker_;                       // after what its jobs use
  live::Connection connection_;
  std::optional<dds::Participant> participant_;  // last: its threads use what is above
};

/// The pose to begin at: the user's, else the one that was kept.
Result<std::optional<Pose>> first_pose(const Options& options, const live::LiveParams& params) {
  if (!options.initial_pose.empty()) {
    VANTAGE_TRY(const Pose pose, cli::parse_pose("--initial-pose", options.initial_pose));
    return pose;
  }
  if (!params.state_file) return std::nullopt;
  VANTAGE_TRY(const auto kept, live::read_state(*params.state_file));
  if (!kept) return std::nullopt;
  say(fmt::format("begins where the last session ended, from {}", params.state_file->string()));
  return kept->T_map_sensor;
}

Result<void> localize_until_told(live::Session& session, Node& node, const live::LiveParams& params,
                                 live::Notices& notices, const std::function<bool()>& is_over) {
  using std::chrono::milliseconds;
  constexpr auto kLongestWait = milliseconds(50), kWhileScanWaits = milliseconds(2);
  const bool moves = !params.topics.filtered_odometry.empty();
  const auto move = [&] {
    if (!moves) return;
    if (const auto moved = session.moved()) node.move(*moved);
  };
  const auto answer = [&] {
    const auto done = session.localize();
    if (!done) return notices.tell("scans_failed", to_string(done.error()));
    if (!*done) return;
    node.show((*done)->received);
    node.answer(**done);
    move();
  };
  while (!is_over()) {
    for (live::Received& received :
         node.take(session.has_scan() ? kWhileScanWaits : kLongestWait)) {
      if (received.input != Input::points && received.input != Input::transforms) {
        node.show(received);
      }
      session.take(std::move(received));
      if (session.is_ready(now())) answer();
      move();
    }
    if (session.is_ready(now())) answer();
    for (live::Answer& one : session.take_answers(now())) node.reply(std::move(one));
    node.tell_idle(session);
    node.follow_network();
  }
  return {};
}

Result<void> run(const CLI::App& app, const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const Config config, load_config(options.config, options.common.overrides));
  VANTAGE_CHECK(cli::check_outputs(app, config));
  VANTAGE_TRY(const live::LiveParams params,
              parse<live::LiveParams>(config.live.value_or(Table{})));
  const PluginLoader plugins = options.common.loader();
  catch_signals();
  const std::int64_t end = options.seconds
                               ? now() + static_cast<std::int64_t>(*options.seconds * 1e9)
                               : std::numeric_limits<std::int64_t>::max();
  const auto is_over = [&] { return g_signal != 0 || now() >= end; };
  live::Notices notices([](const std::string& text) { say(text); });
  if (const auto note = dds::Participant::note_on_buffers(
          live::participant_options(params, params.node, notices))) {
    say("note: " + *note);
  }
  if (!params.topics.followed_pose.empty()) {
    VANTAGE_TRY(const Bundle bundle, Bundle::open(config, plugins, "serving maps"));
    return serve_maps(params, bundle, config.localizer.value_or(LocalizerParams{}).switch_margin,
                      notices, is_over);
  }
  std::optional<io::MapProjection> projection;
  if (params.map_projector) {
    VANTAGE_TRY(projection, io::MapProjection::read(*params.map_projector));
  }
  VANTAGE_TRY(const auto kept, first_pose(options, params));
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, plugins, "localization"));
  VANTAGE_TRY(auto localizer, Localizer::open(bundle, config, plugins));
  std::unique_ptr<live::Recorder> recorder;
  if (options.record) {
    VANTAGE_TRY(recorder, live::Recorder::create(*options.record));
  }
  live::Session session(std::move(localizer), params, kept, notices, std::move(projection));
  Node node(params, bundle, notices, std::move(recorder));
  VANTAGE_CHECK(node.connect());
  say(fmt::format("ready in domain {}: scans of {}", params.domain, params.topics.points));
  const auto localized = localize_until_told(session, node, params, notices, is_over);
  const auto finished = node.finish(options.common.json);
  VANTAGE_CHECK(localized);
  return finished;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Localizes the scans of a robot as they come, over DDS, as a node of ROS 2.",
               "vantage live");
  vantage::Options options;
  app.add_option("CONFIG", options.config, "configuration (TOML); its table [live] may be left out")
      ->required();
  app.add_option("--initial-pose", options.initial_pose,
                 "pose of the LiDAR at the first scan, x,y,z,roll,pitch,yaw [m, rad], instead of "
                 "the one that was kept")
      ->type_name("POSE");
  app.add_option("--record", options.record,
                 "record all that was localized, and the answers, as an MCAP file")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "end after this time; without it, when told to")
      ->check(vantage::cli::positive_number());
  options.common.add_to(app);
  vantage::cli::keep_only_scan_buffers();
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(app, options); });
}
