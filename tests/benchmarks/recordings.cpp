#include <benchmark/benchmark.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "recordings_peers.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"

// Times how fast recorded scans are read from files of every format, from the page cache, by one
// thread: HDL-64E scans of 123,000 points, but for the captures, and an airborne survey in LAS.
namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
  return *std::move(result);
}

void check(const Result<void>& result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
}

std::vector<io::StampedScan> scans_of(const fs::path& path) {
  const auto source = value_or_throw(io::open_scans({.path = path, .topic = {}}));
  std::vector<io::StampedScan> scans;
  while (auto scan = value_or_throw(source->next())) scans.push_back(*std::move(scan));
  return scans;
}

/// How much was read.
struct Amount {
  std::size_t scans = 0, points = 0;
};

Amount read_scans(const fs::path& path) {
  const auto source = value_or_throw(io::open_scans({.path = path, .topic = {}}));
  Amount amount;
  while (const auto scan = value_or_throw(source->next())) {
    ++amount.scans;
    amount.points += scan->points.size();
  }
  return amount;
}

Amount read_cloud(const fs::path& path) {
  return {.scans = 1, .points = value_or_throw(io::read_point_cloud(path)).points.size()};
}

Amount read_folder_by_pcl(const fs::path& folder) {
  Amount amount;
  for (const auto& file : fs::directory_iterator(folder)) {
    ++amount.scans;
    amount.points += read_by_pcl(file.path());
  }
  return amount;
}

double megabytes(const fs::path& path) {
  if (!fs::is_directory(path)) return static_cast<double>(fs::file_size(path)) * 1e-6;
  double all = 0.0;
  for (const auto& file : fs::directory_iterator(path)) all += megabytes(file.path());
  return all;
}

using Read = Amount (*)(const fs::path&);

void time_reading(benchmark::State& state, Read read, const fs::path& path) {
  const double size = megabytes(path);
  Amount amount;
  for (auto _ : state) amount = read(path);
  using benchmark::Counter;
  const auto rate = Counter::kIsIterationInvariantRate;
  state.counters["MB/s"] = Counter(size, rate);
  state.counters["scans/s"] = Counter(static_cast<double>(amount.scans), rate);
  state.counters["points/s"] = Counter(static_cast<double>(amount.points), rate);
}

void add(const std::string& name, Read read, const fs::path& path) {
  benchmark::RegisterBenchmark(name.c_str(), time_reading, read, path)
      ->Unit(benchmark::kMillisecond);
}

void write_bin(const fs::path& path, PointsView points) {
  std::ofstream out(path, std::ios::binary);
  for (const Point& p : points) {
    const Eigen::Vector4f values(p.cast<float>().x(), p.cast<float>().y(), p.cast<float>().z(),
                                 0.F);
    out.write(reinterpret_cast<const char*>(values.data()), sizeof(float) * 4);
  }
}

/// A folder of one file a scan.
fs::path written(const std::vector<io::StampedScan>& scans, const fs::path& folder,
                 const std::string& suffix,
                 const std::function<void(const fs::path&, PointsView)>& write) {
  fs::create_directory(folder);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    write(folder / (std::to_string(i) + suffix), scans[i].points);
  }
  return folder;
}

void add_files(const std::vector<io::StampedScan>& scans, const fs::path& folder) {
  using io::Precision;
  const auto pcd = written(scans, folder / "binary", ".pcd", [](const auto& path, auto points) {
    check(io::write_pcd(path, points, Precision::float32));
  });
  const auto compressed = written(scans, folder / "compressed", ".pcd", write_compressed_pcd);
  const auto ply = written(scans, folder / "ply", ".ply", [](const auto& path, auto points) {
    check(io::write_ply(path, points, Precision::float32));
  });
  add("pcd_binary", read_scans, pcd);
  add("pcd_binary/PCL", read_folder_by_pcl, pcd);
  add("pcd_binary_compressed", read_scans, compressed);
  add("pcd_binary_compressed/PCL", read_folder_by_pcl, compressed);
  add("ply_binary", read_scans, ply);
  add("ply_binary/PCL", read_folder_by_pcl, ply);
  add("kitti_bin", read_scans, written(scans, folder / "bin", ".bin", write_bin));
}

void add_recordings(const fs::path& formats) {
  add("rosbag1", read_scans, formats / "rosbag1/kitti0005_5frames_none.bag");
  add("rosbag1_lz4", read_scans, formats / "rosbag1/kitti0005_3frames_lz4.bag");
  add("rosbag1_bz2", read_scans, formats / "rosbag1/kitti0005_2frames_bz2.bag");
  add("rosbag2", read_scans, formats / "rosbag2/kitti0005_3frames");
  add("mcap", read_scans, formats / "mcap/kitti0005_4frames_none.mcap");
  add("mcap_lz4", read_scans, formats / "mcap/kitti0005_2frames_lz4.mcap");
  add("mcap_zstd", read_scans, formats / "mcap/kitti0005_2frames_zstd.mcap");
  add("rosbag2_packets/VLP-16", read_scans, formats / "rosbag2/nebula_vlp16");
  add("pcap/VLP-16", read_scans, formats / "pcap/velodyne_vlp16_gps.pcap");
  add("pcap/HDL-32E", read_scans, formats / "pcap/velodyne_hdl32.pcap");
  add("las", read_cloud, formats / "las/autzen_trim.las");
}

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) {
  using namespace vantage;
  benchmark::Initialize(&argc, argv);
  const test::TemporaryFolder folder;
  if (const auto formats = test::real_data("formats")) {
    const auto bag = *formats / "rosbag1/kitti0005_5frames_none.bag";
    benchmarks::add_files(benchmarks::scans_of(bag), folder.path());
    benchmarks::add_recordings(*formats);
  }
  benchmark::RunSpecifiedBenchmarks();
}
