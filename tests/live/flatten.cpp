// Writes a recording as one plain file that programs without any library can read.
//
// Little endian. Records in order of time: a char that says what it is, its stamp (float64 [s]),
// and
//   P: uint32 points, uint8 whether they have times, for each x, y, z and perhaps seconds (float32)
//   I: angular velocity, specific force (6 float64)
//   O: T_odom_base (7 float64: x, y, z, qx, qy, qz, qw)
//   T: T_map_sensor, the truth (7 float64, the same)
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstring>
#include <fstream>
#include <iostream>
#include <vector>

#include "terminal/command_line.hpp"
#include "vantage/io/imu_io.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace {

using namespace vantage;

struct Record {
  char kind;
  double stamp;
  std::string bytes;
};

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Options {
  std::filesystem::path scans, imu, odometry, truth, out;
};

Result<void> run(const Options& options) {
  std::vector<Record> records;
  VANTAGE_TRY(const auto source, io::open_scans({.path = options.scans, .topic = {}}));
  while (true) {
    VANTAGE_TRY(const auto scan, source->next());
    if (!scan) break;
    Record record{'P', scan->stamp, {}};
    append(record.bytes, static_cast<std::uint32_t>(scan->points.size()));
    append(record.bytes, static_cast<std::uint8_t>(!scan->seconds.empty()));
    for (std::size_t i = 0; i < scan->points.size(); ++i) {
      for (const double x : scan->points[i]) append(record.bytes, static_cast<float>(x));
      if (!scan->seconds.empty()) append(record.bytes, scan->seconds[i]);
    }
    records.push_back(std::move(record));
  }
  if (!options.imu.empty()) {
    VANTAGE_TRY(const auto imu, io::read_imu(io::ImuSource{.path = options.imu}));
    for (const ImuSample& sample : imu.samples) {
      Record record{'I', sample.stamp, {}};
      for (const double x : sample.angular_velocity) append(record.bytes, x);
      for (const double x : sample.specific_force) append(record.bytes, x);
      records.push_back(std::move(record));
    }
  }
  const auto add_poses = [&](char kind, const std::filesystem::path& file) -> Result<void> {
    if (file.empty()) return {};
    VANTAGE_TRY(const auto poses, io::read_trajectory(file));
    for (const io::StampedPose& one : poses) {
      Record record{kind, one.stamp, {}};
      for (const double x : one.pose.translation) append(record.bytes, x);
      for (const double x : one.pose.rotation.coeffs()) append(record.bytes, x);
      records.push_back(std::move(record));
    }
    return {};
  };
  VANTAGE_CHECK(add_poses('O', options.odometry));
  VANTAGE_CHECK(add_poses('T', options.truth));
  std::stable_sort(records.begin(), records.end(),
                   [](const Record& a, const Record& b) { return a.stamp < b.stamp; });
  std::ofstream out(options.out, std::ios::binary);
  for (const Record& record : records) {
    out.put(record.kind);
    out.write(reinterpret_cast<const char*>(&record.stamp), sizeof record.stamp);
    out.write(record.bytes.data(), static_cast<std::streamsize>(record.bytes.size()));
  }
  if (!out) return fail(ErrorCode::io_failure, "cannot write", {options.out.string(), 0, 0});
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes a recording as one plain file.", "flatten");
  Options options;
  app.add_option("SCANS", options.scans)->required();
  app.add_option("OUT", options.out)->required();
  app.add_option("--imu", options.imu);
  app.add_option("--odometry", options.odometry);
  app.add_option("--truth", options.truth);
  return vantage::cli::run_program(app, argc, argv, [&] { return run(options); });
}
