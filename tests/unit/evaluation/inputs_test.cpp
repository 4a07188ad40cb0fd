// What a run is fed with.
#include <doctest/doctest.h>
#include <array>

#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "support/bags/cloud_bags.hpp"
#include "support/bags/imu_messages.hpp"
#include "support/bags/nav_sat_fix.hpp"
#include "support/fakes.hpp"
#include "support/real_data.hpp"
#include "terminal/input_options.hpp"

using namespace vantage;

namespace {

std::vector<test::FloatScan> three_scans() {
  std::vector<test::FloatScan> scans;
  for (const std::int64_t second : {1, 2, 3}) {
    scans.push_back({second * 1'000'000'000, {{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}}});
  }
  return scans;
}

/// Of a map with one region, in which every scan is where it was thought to be.
Localizer localizer(const LocalizerParams& params = {}) {
  auto memory = std::make_shared<test::Memory>();
  const auto partition = Partition::from({Region{"all", HalfOpenBox{{-50, -50}, {50, 50}}, {}}});
  REQUIRE(partition);
  memory->index.partition = *partition;
  memory->maps[0] = {.points = {{0.0, 0.0, 0.0}}, .viewpoints = {}, .prepared = {}};
  REQUIRE(test::MemoryWriter(memory).commit());
  auto opened = Localizer::open(
      test::bundle_in(memory).value(),
      test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>()), {},
      params);
  REQUIRE_MESSAGE(opened, to_string(opened.error()));
  return *std::move(opened);
}

/// A bag of three scans, from the origin.
RunInputs inputs_in(const test::TemporaryFolder& folder) {
  const auto path = folder.path() / "scans";
  std::ofstream(path, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  auto inputs = InputOptions{.scans = path}.open();
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  inputs->initial_pose = Pose{};
  return *std::move(inputs);
}

Result<Run> run(const RunInputs& inputs) { return localize_scans(localizer(), "c.toml", inputs); }

}  // namespace

TEST_CASE("a recording is opened once: the run reads what was opened to look at it") {
  for (const test::CloudBag& bag : test::cloud_bags()) {
    CAPTURE(bag.name);
    const test::TemporaryFolder folder;
    const auto path = folder.path() / "scans";
    std::ofstream(path, std::ios::binary) << bag.write(three_scans(), test::PointLayout::packed);
    auto inputs = InputOptions{.scans = path}.open();
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    inputs->initial_pose = Pose{};
    std::filesystem::remove(path);  // an open file can still be read
    const auto first = run(*inputs);
    REQUIRE_MESSAGE(first, to_string(first.error()));
    CHECK(first->scans.size() == 3);
    const auto second = run(*inputs);  // only the first run gets what was open
    REQUIRE_FALSE(second);
    CHECK(second.error().code == ErrorCode::not_found);
  }
}

TEST_CASE("a map that is given as the scans is refused") {
  const test::TemporaryFolder folder;
  const auto cloud = [](const std::filesystem::path& path) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n1 2 3\n";
    return path;
  };
  const auto map = cloud(folder.path() / "map" / "map.pcd");
  const auto scan = cloud(folder.path() / "scans" / "0.pcd");
  const auto message_of = [&](const std::filesystem::path& scans,
                              const std::filesystem::path& pattern) {
    const auto inputs = InputOptions{.scans = scans}.open(std::vector{pattern});
    return inputs ? std::string() : to_string(inputs.error());
  };
  CHECK(message_of(map, map) == map.string() + ": error: is the map, expected the recorded scans");
  for (const auto& pattern : {map, map.parent_path(), map.parent_path() / "*.pcd"}) {
    CHECK(message_of(map.parent_path(), pattern) ==
          map.parent_path().string() +
              ": error: the folder holds the map (map.pcd), expected recorded scans only");
    CHECK(message_of(scan.parent_path(), pattern).empty());
  }
  CHECK(message_of(map.parent_path(), folder.path() / "none.pcd").empty());
}

TEST_CASE("damage of inputs is kept once, and is that of the scans or of another file") {
  const auto damage = [](const std::string& file) {
    return Error{
        ErrorCode::corrupt_data, "the file ends at byte 7", SourceLocation{file, 0, 0}, {}};
  };
  RunInputs inputs;
  inputs.scans.path = "/data/run";
  add_damage(inputs, std::nullopt);
  for (const char* file : {"/data/run/run_1.mcap", "/data/imu.bag", "/data/imu.bag"}) {
    add_damage(inputs, damage(file));
  }
  CHECK(inputs.damaged.size() == 2);
  const auto others = damaged_besides_scans(inputs);
  REQUIRE(others.size() == 1);
  CHECK(others.front().where->file == "/data/imu.bag");
}

TEST_CASE("a run and each of its scans have the alert limit of the localizer") {
  const test::TemporaryFolder folder;
  const RunInputs inputs = inputs_in(folder);
  LocalizerParams params;
  params.alert_limit = 0.2;
  params.alert_limit_deg = 1.5;
  const auto done = localize_scans(localizer(params), "c.toml", inputs);
  REQUIRE_MESSAGE(done, to_string(done.error()));
  CHECK(done->alert_limit.metres == 0.2);
  CHECK(done->alert_limit.degrees == 1.5);
  for (const RunScan& scan : done->scans) {
    CHECK(scan.alert_limit.metres == 0.2);
    CHECK(scan.alert_limit.degrees == 1.5);
  }
}

TEST_CASE("every run reads the recording from its beginning") {
  const test::TemporaryFolder folder;
  const RunInputs inputs = inputs_in(folder);
  for (int i = 0; i < 3; ++i) {
    const auto done = run(inputs);
    REQUIRE_MESSAGE(done, to_string(done.error()));
    REQUIRE(done->scans.size() == 3);
    CHECK(done->scans.front().report.stamp == 1.0);
  }
}

TEST_CASE("priors: every scan gets the one at its stamp, and the run starts with a search") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "scans", prior = folder.path() / "gnss.tum",
             reference = folder.path() / "reference.tum";
  std::ofstream(scans, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  std::ofstream(prior) << "1 10 20 3 0 0 0 1\n2 12 20 3 0 0 0 1\n";
  std::ofstream(reference) << "3 0 0 0 0 0 0 1\n";  // no pose at the first scan
  const auto opened = [&](const std::string& sigma) {
    return InputOptions{
        .scans = scans, .reference = reference, .prior = prior.string(), .prior_sigma = sigma}
        .open();
  };
  SUBCASE("with the default sigmas") {
    const auto inputs = opened("");
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    REQUIRE(inputs->priors);
    REQUIRE(inputs->priors->priors.size() == 2);
    const PosePrior& first = inputs->priors->priors.front().prior;
    CHECK(first.T_map_sensor.translation == Eigen::Vector3d(10.0, 20.0, 3.0));
    CHECK(first.sigma_translation == Eigen::Vector3d(5.0, 5.0, 1.0));
    CHECK(first.sigma_heading == doctest::Approx(10.0 * M_PI / 180.0));
    const auto done = run(*inputs);
    REQUIRE_MESSAGE(done, to_string(done.error()));
    CHECK(done->scans.size() == 3);
    REQUIRE(done->prior);
    CHECK(done->prior->scans == 2);  // none at 3 s
    CHECK(done->prior->source == prior.string());
  }
  SUBCASE("with the user's") {
    const auto inputs = opened("2,inf,30");
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    const PosePrior& first = inputs->priors->priors.front().prior;
    CHECK(first.sigma_translation.head<2>() == Eigen::Vector2d(2.0, 2.0));
    CHECK(std::isinf(first.sigma_translation.z()));
    CHECK(first.sigma_heading == doctest::Approx(30.0 * M_PI / 180.0));
  }
  SUBCASE("sigmas that are none are wrong usage") {
    for (const char* wrong : {"5", "5,1", "5,1,10,2", "5,1,", "0,1,10", "-5,1,10", "nan,1,10",
                              "inf,inf,inf", "5 1 10"}) {
      CAPTURE(wrong);
      const auto inputs = opened(wrong);
      REQUIRE_FALSE(inputs);
      CHECK(inputs.error().message.find("--prior-sigma takes three numbers") != std::string::npos);
    }
  }
  SUBCASE("options of the prior need a prior") {
    const auto inputs = InputOptions{.scans = scans, .prior_sigma = "5,1,10"}.open();
    REQUIRE_FALSE(inputs);
    CHECK(inputs.error().message == "--prior-sigma is given without --prior");
  }
}

TEST_CASE("a mount is for poses of a bag") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "run.mcap", text = folder.path() / "poses.tum";
  constexpr auto kLayout = test::MessageWriter::Layout::cdr_little;
  std::vector<test::TestMessage> messages;
  for (const test::FloatScan& scan : three_scans()) {
    messages.push_back({"/points", "sensor_msgs/msg/PointCloud2", scan.stamp,
                        test::point_cloud2(scan, kLayout, test::PointLayout::packed)});
    test::MessageWriter message(kLayout);
    message.header(static_cast<std::uint32_t>(scan.stamp / 1'000'000'000), 0, "map");
    message.numbers(std::array{10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
    messages.push_back({"/pose", "geometry_msgs/msg/PoseStamped", scan.stamp, message.bytes()});
  }
  std::ofstream(scans, std::ios::binary) << test::mcap(messages);
  std::ofstream(text) << "1 10 0 0 0 0 0 1\n2 10 0 0 0 0 0 1\n";
  const std::string mount = "0.5,0,0,0,0,0";
  const auto message_of = [](const InputOptions& options) {
    const auto inputs = options.open();
    REQUIRE_FALSE(inputs);
    return inputs.error().message;
  };
  CHECK(message_of({.scans = scans, .mount = mount}) ==
        "--mount is given without --reference, --odometry and --prior");
  CHECK(message_of({.scans = scans, .reference = text, .prior = text.string(), .mount = mount})
            .starts_with("--mount converts the poses of bags, and those given are in text files"));
  // The poses name no frame: the user says where the sensor is on what they describe.
  const auto inputs =
      InputOptions{.scans = scans, .reference = text, .odometry = "/pose", .mount = mount}.open();
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  CHECK(inputs->reference->front().pose.translation.x() == 10.0);
  CHECK(inputs->odometry->front().pose.translation.x() == 10.5);
}

TEST_CASE("priors that have nothing in common with the scans are an error") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "scans", prior = folder.path() / "gnss.tum";
  std::ofstream(scans, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  const auto error_with = [&](const std::string& poses, std::optional<double> duration) {
    std::ofstream(prior) << poses;
    const auto inputs =
        InputOptions{
            .scans = scans, .prior = prior.string(), .window = {.start = 0.0, .duration = duration}}
            .open();
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    const auto done = run(*inputs);
    REQUIRE_FALSE(done);
    REQUIRE(done.error().where);
    CHECK(done.error().where->file == prior.string());
    return done.error().message;
  };
  CHECK(error_with("0.25 0 0 0 0 0 0 1\n0.5 0 0 0 0 0 0 1\n", {}) ==
        "no scan has a prior: the prior has poses from 0.25 to 0.5 s, the scans begin at 1 s; "
        "stamps are those of the messages' headers");
  CHECK(error_with("8 0 0 0 0 0 0 1\n", 2.0) ==
        "no scan has a prior: the prior has poses from 8 to 8 s, the scans begin at 1 s; "
        "stamps are those of the messages' headers");
  CHECK(error_with("8 0 0 0 0 0 0 1\n", {}) ==
        "no scan has a prior: the prior has poses from 8 to 8 s, the scans run from 1 to 3 s; "
        "stamps are those of the messages' headers");
}

TEST_CASE("an input that was recorded at another time is an error that says when") {
  const test::TemporaryFolder folder;
  const RunInputs plain = inputs_in(folder);
  const auto error_with = [&](const auto& change) {
    RunInputs inputs = plain;
    change(inputs);
    const auto done = run(inputs);
    REQUIRE_FALSE(done);
    return done.error().message;
  };
  const io::Trajectory before{{.stamp = 0.25, .pose = {}}, {.stamp = 0.5, .pose = {}}};
  const io::Trajectory after{{.stamp = 8e9, .pose = {}}};
  CHECK(
      error_with([&](RunInputs& inputs) { inputs.reference = before; })
          .find("no scan has a pose of the reference: the reference has poses from 0.25 to 0.5 s, "
                "the scans begin at 1 s") == 0);
  CHECK(error_with([&](RunInputs& inputs) { inputs.odometry = after; })
            .find("no scan has a pose of the odometry: the odometry has poses from 8000000000 to "
                  "8000000000 s, the scans") == 0);
  CHECK(error_with([&](RunInputs& inputs) {
          inputs.imu = io::ImuRecording{};
          inputs.imu->samples = {ImuSample{.stamp = 1e6}};
        }).find("no scan has samples of the IMU: the IMU has samples from 1000000 to") == 0);
}

TEST_CASE("stamps of another unit or clock are named before a scan is localized") {
  const test::TemporaryFolder folder;
  const RunInputs plain = inputs_in(folder);
  REQUIRE(plain.opened->describe().last_stamp == 3.0);
  const auto said = [&](double begin, double end, std::optional<double> duration = {}) {
    RunInputs inputs = plain;
    inputs.odometry = {{.stamp = begin, .pose = {}}, {.stamp = end, .pose = {}}};
    inputs.window.duration = duration;
    const auto checked = check_stamps(inputs, 1.0, plain.opened->describe());
    return checked ? std::string() : checked.error().message;
  };
  CHECK(said(0.5, 1.5).empty());
  CHECK(said(2.0, 9.0).empty());
  CHECK(said(50.0, 90.0).empty());  // a bag's last stamp is a guess
  CHECK_FALSE(said(50.0, 90.0, 5.0).empty());
  CHECK(said(1e6, 3e6) ==
        "no scan has a pose of the odometry: the odometry has poses from 1000000 to 3000000 s, the "
        "scans begin at 1 s; stamps are those of the messages' headers; its stamps seem to be in "
        "microseconds, and stamps are in seconds");
  CHECK(said(1e9, 3e9).ends_with("seem to be in nanoseconds, and stamps are in seconds"));
  CHECK(said(1.7e9, 1.7e9 + 2.0).find("the two have different clocks") != std::string::npos);
  CHECK(said(1.7e11, 1.8e11).find("the two have different clocks") != std::string::npos);
  const auto late = check_stamps(plain, 1.7e12, {});
  CHECK(late);  // there is no other input
  RunInputs other = plain;
  other.odometry = {{.stamp = 1.7e9, .pose = {}}, {.stamp = 1.7e9 + 60.0, .pose = {}}};
  io::ScanDescription recording;
  recording.last_stamp = 1.7e12 + 6e4;
  const auto milliseconds = check_stamps(other, 1.7e12, recording);
  REQUIRE_FALSE(milliseconds);
  io::ScanDescription folder_of_files;  // its last stamp is exact
  folder_of_files.last_stamp = 15.3;
  other.odometry = {{.stamp = 100.0, .pose = {}}, {.stamp = 15300.0, .pose = {}}};
  CHECK_FALSE(check_stamps(other, 0.1, folder_of_files));
  CHECK(
      milliseconds.error().message.ends_with("the stamps of the scans seem to be in "
                                             "milliseconds, and stamps are in seconds"));
}

TEST_CASE("a prior that is no file must be a topic of the scans' bag") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "scans";
  std::ofstream(scans, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  const auto message_of = [](const InputOptions& options) {
    const auto inputs = options.open();
    REQUIRE_FALSE(inputs);
    return inputs.error().message;
  };
  const auto no_topic = InputOptions{.scans = scans, .prior = "/fix"}.open();
  REQUIRE_FALSE(no_topic);
  CHECK(no_topic.error().message.find("there is no topic '/fix'") == 0);
  CHECK(to_string(no_topic.error())
            .find("looking for /fix, which is not a file, among the topics of the scans") !=
        std::string::npos);
  CHECK(message_of({.scans = scans, .prior = "/fix", .prior_topic = "/pose"})
            .find("--prior /fix is not a file but a topic of the scans") == 0);
  CHECK(message_of({.scans = scans, .prior = (folder.path() / "none.tum").string()})
            .find("there is no topic") == 0);
  const auto no_file = InputOptions{.scans = scans, .prior = "none.tum"}.open();
  REQUIRE_FALSE(no_file);
  CHECK(no_file.error().code == ErrorCode::not_found);
}

TEST_CASE("GNSS in the bag of the scans, placed by the projection beside the map") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "run.mcap", map = folder.path() / "map";
  constexpr auto kLayout = test::MessageWriter::Layout::cdr_little;
  std::vector<test::TestMessage> messages;
  for (const test::FloatScan& scan : three_scans()) {
    messages.push_back({"/points", "sensor_msgs/msg/PointCloud2", scan.stamp,
                        test::point_cloud2(scan, kLayout, test::PointLayout::packed)});
    const auto second = static_cast<std::uint32_t>(scan.stamp / 1'000'000'000);
    messages.push_back({"/fix", "sensor_msgs/msg/NavSatFix", scan.stamp,
                        test::nav_sat_fix({.seconds = second, .frame = ""}, kLayout)});
  }
  std::ofstream(scans, std::ios::binary) << test::mcap(messages);
  std::filesystem::create_directory(map);
  std::ofstream(map / "map_projector_info.yaml")
      << "projector_type: LocalCartesianUTM\nvertical_datum: WGS84\n"
         "map_origin: {latitude: 35.6586, longitude: 139.7454}\n";
  const std::vector<std::filesystem::path> map_files{map / "*.pcd"};
  const auto inputs = InputOptions{.scans = scans, .prior = "/fix"}.open(map_files);
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  REQUIRE(inputs->priors);
  CHECK(inputs->priors->source == scans.string() + " /fix");
  const PosePrior& first = inputs->priors->priors.front().prior;
  CHECK((first.T_map_sensor.translation - Eigen::Vector3d(0.0, 0.0, 50.0)).norm() < 1e-6);
  const auto done = run(*inputs);
  REQUIRE_MESSAGE(done, to_string(done.error()));
  CHECK(done->prior.value().scans == 2);  // the fixes are stamped half a second after the scans
  const auto nowhere = InputOptions{.scans = scans, .prior = "/fix"}.open();
  REQUIRE_FALSE(nowhere);
  CHECK(nowhere.error().message.find("name one with --map-projector") != std::string::npos);
}

TEST_CASE("reference and odometry from topics of the scans' bag") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "run.mcap";
  constexpr auto kLayout = test::MessageWriter::Layout::cdr_little;
  std::vector<test::TestMessage> messages;
  for (const test::FloatScan& scan : three_scans()) {
    messages.push_back({"/points", "sensor_msgs/msg/PointCloud2", scan.stamp,
                        test::point_cloud2(scan, kLayout, test::PointLayout::packed)});
    const auto second = static_cast<std::uint32_t>(scan.stamp / 1'000'000'000);
    for (const double x : {10.0, 20.0}) {
      test::MessageWriter message(kLayout);
      message.header(second, 0, "map").numbers(std::array{x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
      messages.push_back({x == 10.0 ? "/truth" : "/odom", "geometry_msgs/msg/PoseStamped",
                          scan.stamp, message.bytes()});
    }
  }
  std::ofstream(scans, std::ios::binary) << test::mcap(messages);

  const auto inputs =
      InputOptions{.scans = scans, .reference = "/truth", .odometry = "/odom"}.open();
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  REQUIRE(inputs->reference.value().size() == 3);
  REQUIRE(inputs->odometry.value().size() == 3);
  CHECK(inputs->reference->front().pose.translation.x() == 10.0);
  CHECK(inputs->odometry->front().pose.translation.x() == 20.0);

  const auto none = InputOptions{.scans = scans, .odometry = "/wheel"}.open();
  REQUIRE_FALSE(none);
  CHECK(to_string(none.error())
            .find("looking for /wheel, which is not a file, among the topics of the scans") !=
        std::string::npos);
  const auto two =
      InputOptions{.scans = scans, .reference = "/truth", .reference_topic = "/odom"}.open();
  REQUIRE_FALSE(two);
  CHECK(two.error().message.find("--reference /truth is not a file but a topic of the scans") == 0);
}

TEST_CASE("inertial samples from a file, or from the bag of the scans") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "run.mcap", csv = folder.path() / "imu.csv";
  constexpr auto kLayout = test::MessageWriter::Layout::cdr_little;
  std::vector<test::TestMessage> messages;
  for (const test::FloatScan& scan : three_scans()) {
    messages.push_back({"/points", "sensor_msgs/msg/PointCloud2", scan.stamp,
                        test::point_cloud2(scan, kLayout, test::PointLayout::packed)});
    const auto second = static_cast<std::uint32_t>(scan.stamp / 1'000'000'000);
    for (const char* topic : {"/imu", "/other"}) {
      messages.push_back({topic, "sensor_msgs/msg/Imu", scan.stamp,
                          test::imu_message({.seconds = second, .frame = topic}, kLayout)});
    }
  }
  std::ofstream(scans, std::ios::binary) << test::mcap(messages);
  std::ofstream(csv) << "t,wx,wy,wz,ax,ay,az\n1,0,0,0,0,0,1\n";
  const auto opened = [&](const InputOptions& options) {
    auto inputs = options.open();
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    return inputs->imu;
  };
  CHECK_FALSE(opened({.scans = scans}).has_value());
  CHECK(opened({.scans = scans, .imu = csv.string()}).value().samples.size() == 1);
  CHECK(opened({.scans = scans, .imu = "/imu"}).value().source == scans.string() + " /imu");
  CHECK(opened({.scans = scans, .imu = scans.string(), .imu_topic = "/other"}).value().frame ==
        "other");
  const auto oxts = folder.path() / "oxts";
  std::filesystem::create_directories(oxts / "data");
  std::ofstream(oxts / "dataformat.txt") << "lat: latitude\n";
  std::ofstream(oxts / "data" / "0000000008.txt")
      << "0 0 0 0 0 0 0 0 0 0 0 0 0 9.8 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n";
  const auto by_frame =
      opened({.scans = scans, .imu = oxts.string(), .imu_by_frame = true, .rate_hz = 20.0});
  CHECK(by_frame.value().samples.front().stamp == 0.4);

  const auto message_of = [](const InputOptions& options) {
    const auto inputs = options.open();
    REQUIRE_FALSE(inputs);
    return to_string(inputs.error());
  };
  const auto has = [](const std::string& text, const std::string& part) {
    CAPTURE(text);
    CHECK(text.find(part) != std::string::npos);
  };
  has(message_of({.scans = scans, .imu = scans.string()}), "choose one with --imu-topic: /imu");
  has(message_of({.scans = scans, .imu = "/none"}),
      "looking for /none, which is not a file, among the topics of the scans");
  has(message_of({.scans = scans, .imu = "/imu", .imu_topic = "/other"}),
      "--imu /imu is not a file but a topic of the scans, so --imu-topic cannot name another one");
  has(message_of({.scans = scans, .imu_topic = "/imu"}), "--imu-topic is given without --imu");
  has(message_of({.scans = scans, .imu_by_frame = true}), "--imu-by-frame is given without --imu");
  has(message_of({.scans = scans, .imu = csv.string(), .imu_by_frame = true}),
      "has stamps of its own");
}

TEST_CASE("which point has the stamp, and which points of a Livox are used, are options") {
  const auto parsed = [](std::vector<std::string> words) {
    InputOptions options;
    CLI::App app;
    options.add_to(app, false);
    words.insert(words.end(), {"a.mcap", "--scans"});  // CLI11 takes them from the end
    app.parse(words);
    return options.choice;
  };
  CHECK_FALSE(parsed({}).stamped.has_value());
  CHECK(parsed({}).tags == io::Tags::all);
  CHECK(parsed({"first", "--stamp"}).stamped == io::StampedPoint::first);
  CHECK(parsed({"middle", "--stamp"}).stamped == io::StampedPoint::middle);
  CHECK(parsed({"last", "--stamp"}).stamped == io::StampedPoint::last);
  CHECK(parsed({"normal", "--livox-tags"}).tags == io::Tags::normal);
  CHECK_THROWS_AS(parsed({"end", "--stamp"}), CLI::ValidationError);

  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "scans";
  std::ofstream(scans, std::ios::binary)
      << test::cloud_bags().front().write(three_scans(), test::PointLayout::packed);
  const auto inputs =
      InputOptions{.scans = scans, .choice = {.stamped = io::StampedPoint::last}}.open();
  REQUIRE(inputs);
  CHECK(inputs->scans.stamped == io::StampedPoint::last);
  const auto refused = InputOptions{.scans = scans, .choice = {.tags = io::Tags::normal}}.open();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("have no field tag of uint8") != std::string::npos);
}
