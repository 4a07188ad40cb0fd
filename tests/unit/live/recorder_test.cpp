#include "live/recorder.hpp"

#include <doctest/doctest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <csignal>
#include <random>

#include "io/ros/message_reader.hpp"
#include "io/ros/message_writers.hpp"
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

/// Files cannot be longer, as on a disk that is full and whose file system keeps no room.
class LongestFile {
 public:
  explicit LongestFile(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit now{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &now);
  }
  ~LongestFile() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  LongestFile(const LongestFile&) = delete;
  LongestFile& operator=(const LongestFile&) = delete;

 private:
  rlimit before_{};
};

/// Records messages of 1 MiB that cannot be compressed, until all are given. Returns how many the
/// file holds, which are the first.
std::uint64_t recorded(const std::filesystem::path& path, int given) {
  std::mt19937 random(1);
  const auto message = [&] {
    std::string text(1U << 20U, ' ');
    for (char& c : text) c = static_cast<char>(random());
    return text;
  };
  std::vector<std::string> messages;
  auto recorder = Recorder::create(path);
  REQUIRE(recorder);
  for (int i = 0; i < given; ++i) {
    messages.push_back(io::ros::write_string(message()).value());
    (*recorder)->see({.name = "/a", .type = "std_msgs/String"}, 1 + i, messages.back());
  }
  const auto done = (*recorder)->commit();
  REQUIRE_FALSE(done);
  CHECK((*recorder)->complaint().value().find("writing failed") != std::string::npos);
  auto reader = io::ros::open_bag(path);
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  std::uint64_t held = 0;
  while (true) {
    const auto read = (*reader)->next();
    REQUIRE_MESSAGE(read, to_string(read.error()));
    if (!*read) break;
    CHECK((*read)->bytes == messages.at(held));
    ++held;
  }
  CHECK((*recorder)->left_out() == static_cast<std::uint64_t>(given) - held);
  for (const auto& one : std::filesystem::directory_iterator(path.parent_path())) {
    CHECK(one.path() == path);
  }
  return held;
}

TEST_CASE("a recording whose writes fail holds its whole chunks") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "r.mcap";
  {
    const LongestFile limit(10U << 20U);
    CHECK(recorded(path, 20) == 8);  // chunks of 4 messages
  }
  const auto size = std::filesystem::file_size(path);
  const LongestFile limit(size - 1);  // no place for the summary
  CHECK(recorded(path, 20) == 8);
  CHECK(std::filesystem::file_size(path) < size);
}

TEST_CASE("a recording on a full disk ends with a summary") {
  const test::TemporaryFolder folder;
  const std::string place = folder.path().string();
  if (::unshare(CLONE_NEWNS) != 0 ||
      ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      ::mount("none", place.c_str(), "tmpfs", 0, "size=11m") != 0) {
    MESSAGE("no disk can be made small here");
    return;
  }
  const auto path = folder.path() / "r.mcap";
  CHECK(recorded(path, 20) == 8);
  CHECK(test::read_text(path).ends_with("MCAP0\r\n"));
  CHECK(std::filesystem::space(folder.path()).available > (2U << 20U));  // the room is freed
  CHECK(::umount(place.c_str()) == 0);
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
