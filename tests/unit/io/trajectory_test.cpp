#include "vantage/io/trajectory_io.hpp"

#include <cmath>
#include <limits>
#include <random>

#include "files.hpp"

namespace vantage {
namespace {

using io::Trajectory;
using test::check_clear;
using test::content_of;
using test::put;

Trajectory random_trajectory(std::size_t size) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> metres(-5e6, 5e6);
  std::uniform_real_distribution<double> radians(-3.1, 3.1);
  std::uniform_real_distribution<double> seconds(0.05, 0.15);
  Trajectory trajectory;
  double stamp = 1673400472.138016708;
  for (std::size_t i = 0; i < size; ++i) {
    stamp += seconds(random);
    const Eigen::Vector3d position(metres(random), metres(random), metres(random));
    const Eigen::Vector3d angles(radians(random), radians(random), radians(random));
    trajectory.push_back({stamp, pose_from_xyz_rpy(position, angles)});
  }
  return trajectory;
}

void check_refused(const std::string& content, const std::string& expected) {
  CAPTURE(content);
  const test::TemporaryFolder folder;
  const auto read = io::read_trajectory(put(folder.path() / "poses.txt", content));
  REQUIRE_FALSE(read.has_value());
  check_clear(read.error(), ErrorCode::corrupt_data, "poses.txt", expected);
  REQUIRE(read.error().where.has_value());
}

Result<Trajectory> read_text(const std::string& content, double rate_hz = 10.0) {
  const test::TemporaryFolder folder;
  return io::read_trajectory(put(folder.path() / "poses.txt", content), rate_hz);
}

TEST_CASE("TUM: every double of a trajectory reads back bit for bit") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "trajectory.tum";
  const Trajectory trajectory = random_trajectory(1000);
  REQUIRE(io::write_tum(path, trajectory).has_value());
  const auto back = io::read_trajectory(path);
  REQUIRE_MESSAGE(back, to_string(back.error()));
  REQUIRE(back->size() == trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    CHECK((*back)[i].stamp == trajectory[i].stamp);
    CHECK((*back)[i].pose.translation == trajectory[i].pose.translation);
    CHECK((*back)[i].pose.rotation.coeffs() == trajectory[i].pose.rotation.coeffs());
  }
  const std::string first = content_of(path);
  REQUIRE(io::write_tum(path, *back).has_value());
  CHECK(content_of(path) == first);
}

TEST_CASE("KITTI: translations read back bit for bit, rotations to rounding") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "poses.txt";
  const Trajectory trajectory = random_trajectory(1000);
  REQUIRE(io::write_kitti(path, trajectory).has_value());
  const auto back = io::read_trajectory(path, 4.0);
  REQUIRE_MESSAGE(back, to_string(back.error()));
  REQUIRE(back->size() == trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    CHECK((*back)[i].stamp == static_cast<double>(i) / 4.0);
    CHECK((*back)[i].pose.translation == trajectory[i].pose.translation);
    CHECK(rotation_between((*back)[i].pose, trajectory[i].pose) < 1e-14);
  }
}

TEST_CASE("TUM: columns, comments, blank lines, normalization") {
  const auto read = read_text(
      "# t x y z qx qy qz qw\n\n0.5 1 2 3 0 0 0.7071 0.7071\r\n   \n\t1.5 4 5 6 1 0 0 0\n");
  REQUIRE_MESSAGE(read, to_string(read.error()));
  REQUIRE(read->size() == 2);
  CHECK((*read)[0].stamp == 0.5);
  CHECK((*read)[0].pose.translation == Point(1, 2, 3));
  CHECK(is_valid((*read)[0].pose));
  CHECK(((*read)[0].pose * Point(1, 0, 0) - Point(1, 3, 3)).norm() < 1e-12);
  CHECK(((*read)[1].pose * Point(0, 1, 0) - Point(4, 4, 6)).norm() < 1e-12);
}

TEST_CASE("KITTI: 12 columns are stamped by row, 13 by frame") {
  const std::string turn = "0 -1 0 7 1 0 0 8 0 0 1 9\n";
  const auto rows = read_text(turn + "\n# note\n" + turn, 4.0);
  REQUIRE_MESSAGE(rows, to_string(rows.error()));
  REQUIRE(rows->size() == 2);
  CHECK((*rows)[0].stamp == 0.0);
  CHECK((*rows)[1].stamp == 0.25);
  CHECK(((*rows)[1].pose * Point(1, 0, 0) - Point(7, 9, 9)).norm() < 1e-12);

  const auto frames = read_text("3 " + turn + "151 " + turn);
  REQUIRE_MESSAGE(frames, to_string(frames.error()));
  REQUIRE(frames->size() == 2);
  CHECK((*frames)[0].stamp == 0.3);
  CHECK((*frames)[1].stamp == 15.1);
  CHECK(((*frames)[1].pose * Point(1, 0, 0) - Point(7, 9, 9)).norm() < 1e-12);
}

TEST_CASE("trajectories that are refused, with the line") {
  const std::string good = "0 1 2 3 0 0 0 1\n";
  REQUIRE(read_text(good).has_value());
  check_refused("# only a comment\n", "no pose in the file");
  check_refused("1 2 3\n", "poses.txt:1: error: expected 8 (TUM), 12 (KITTI) or 13");
  check_refused(good + "1 1 2 3 0 0 0\n", "poses.txt:2: error: expected 8 columns");
  check_refused(good + "0 -1 0 7 1 0 0 8 0 0 1 9\n", "poses.txt:2: error: expected 8 columns");
  check_refused(good + "\n1 one 2 3 0 0 0 1\n",
                "poses.txt:3: error: expected a finite number in "
                "column 2, found 'one'");
  check_refused(good + "1 nan 2 3 0 0 0 1\n", "found 'nan'");
  check_refused("0,1,2,3,0,0,0,1\n", "found 1");
  check_refused(good + "1 1 2 3 0 0 0 1.002\n", "poses.txt:2: error: the quaternion has length");
  check_refused("0 1 2 3 0 0 0 0\n", "the quaternion has length 0");
  check_refused("0 1 2 3 1e200 1e200 0 1\n", "the quaternion has length");
  check_refused(good + good, "poses.txt:2: error: stamp 0 s does not follow 0 s");
  check_refused("1 1 2 3 0 0 0 1\n" + good, "strictly increasing");
  check_refused(good + "1600000000000000000 1 2 3 0 0 0 1\n",
                "poses.txt:2: error: 1.6e+18 is no stamp in seconds");
  check_refused("1 0 0 0 0 1 0 0 0 0 1.002 0\n", "not orthonormal");
  check_refused("1 0.002 0 0 0 1 0 0 0 0 1 0\n", "not orthonormal");
  check_refused("1 0 0 0 0 1 0 0 0 0 -1 0\n", "reflection");
  check_refused("0 0 0 0 0 0 0 0 0 0 0 0\n", "not orthonormal");
  check_refused("1e200 0 0 0 0 1 0 0 0 0 1 0\n", "not orthonormal");
  check_refused("0.5 1 0 0 0 0 1 0 0 0 0 1 0\n", "expected a frame number");
  check_refused("-1 1 0 0 0 0 1 0 0 0 0 1 0\n", "expected a frame number");
  check_refused("", "the file is empty");
  CHECK(read_text("1 0.0009 0 0 0 1 0 0 0 0 1 0\n").has_value());
  CHECK(read_text("0 1 2 3 0 0 0 1.0009\n").has_value());

  for (const double rate : {0.0, -10.0, std::numeric_limits<double>::quiet_NaN()}) {
    const auto read = read_text(good, rate);
    REQUIRE_FALSE(read.has_value());
    CHECK(read.error().code == ErrorCode::invalid_input);
  }
  const test::TemporaryFolder folder;
  const auto absent = io::read_trajectory(folder.path() / "absent.tum");
  REQUIRE_FALSE(absent.has_value());
  check_clear(absent.error(), ErrorCode::not_found, "absent.tum", "expected a trajectory");
  const auto directory = io::read_trajectory(folder.path());
  REQUIRE_FALSE(directory.has_value());
  check_clear(directory.error(), ErrorCode::io_failure, folder.path().string(), "is a directory");
}

TEST_CASE("trajectories that could not be read back are not written") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "trajectory.tum";
  const auto refused = [&](const Trajectory& trajectory, const std::string& expected) {
    for (const auto write : {io::write_tum, io::write_kitti}) {
      const auto written = write(path, trajectory);
      REQUIRE_FALSE(written.has_value());
      check_clear(written.error(), ErrorCode::invalid_input, "trajectory.tum", expected);
    }
    CHECK(std::filesystem::is_empty(folder.path()));
  };
  Trajectory trajectory = random_trajectory(3);
  trajectory[1].stamp = trajectory[0].stamp;
  refused(trajectory, "pose 1 of 3 has a stamp that is not after");
  trajectory[1].stamp = std::numeric_limits<double>::quiet_NaN();
  refused(trajectory, "not finite");
  trajectory = random_trajectory(3);
  trajectory[2].pose.translation.y() = std::numeric_limits<double>::infinity();
  refused(trajectory, "pose 2 of 3");
  trajectory = random_trajectory(3);
  trajectory[0].pose.rotation.coeffs() *= 1.1;
  refused(trajectory, "pose 0 of 3");
}

TEST_CASE("pose_at: exact, between neighbours, at the ends, in gaps") {
  const auto at = [](double stamp, double x, double yaw) {
    return io::StampedPose{stamp, pose_from_xyz_rpy({x, 0, 0}, {0, 0, yaw})};
  };
  const Trajectory trajectory{at(1.0, 10, 0.0), at(1.5, 20, 0.2), at(4.0, 30, 0.4)};
  const auto close = [](const std::optional<Pose>& pose, const io::StampedPose& expected) {
    return pose && (pose->translation - expected.pose.translation).norm() < 1e-9 &&
           rotation_between(*pose, expected.pose) < 1e-9;
  };
  for (const auto& pose : trajectory) CHECK(close(io::pose_at(trajectory, pose.stamp), pose));
  CHECK(close(io::pose_at(trajectory, 1.25), at(0, 15, 0.1)));
  CHECK(close(io::pose_at(trajectory, 1.1), at(0, 12, 0.04)));

  CHECK_FALSE(io::pose_at(trajectory, 2.0).has_value());
  CHECK(close(io::pose_at(trajectory, 2.0, 2.5), at(0, 22, 0.24)));
  CHECK_FALSE(io::pose_at(trajectory, 1.25, 0.4).has_value());
  CHECK(close(io::pose_at(trajectory, 1.5009), trajectory[1]));
  CHECK(close(io::pose_at(trajectory, 3.9991), trajectory[2]));
  CHECK_FALSE(io::pose_at(trajectory, 1.502).has_value());
  CHECK_FALSE(io::pose_at(trajectory, 3.998).has_value());

  CHECK(close(io::pose_at(trajectory, 0.9991), trajectory[0]));
  CHECK(close(io::pose_at(trajectory, 4.0009), trajectory[2]));
  CHECK_FALSE(io::pose_at(trajectory, 0.998).has_value());
  CHECK_FALSE(io::pose_at(trajectory, 4.002).has_value());
  CHECK_FALSE(io::pose_at(trajectory, std::numeric_limits<double>::quiet_NaN()).has_value());
  CHECK_FALSE(io::pose_at({}, 1.0).has_value());
}

}  // namespace
}  // namespace vantage
