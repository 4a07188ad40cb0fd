#include "shards/small_town.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test {

SmallTown::SmallTown() {
  PointCloud town;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-0.03, 0.03);
  const auto add = [&](double x, double y, double z) {
    town.emplace_back(x - 31.0 + noise(random), y + 12.0 + noise(random), z + noise(random));
  };
  const auto ground = [](double x, double y) { return 0.02 * x + 0.3 * std::sin(0.1 * y); };
  for (double x = 0.0; x < 120.0; x += 0.45) {
    for (double y = 0.0; y < 70.0; y += 0.45) add(x, y, ground(x, y));
  }
  for (int house = 0; house < 8; ++house) {
    const double x0 = 8.0 + 28.0 * (house % 4), y0 = 10.0 + 33.0 * (house / 4);
    for (double s = 0.0; s < 12.0; s += 0.3) {
      for (double z = 0.2; z < 5.0 + house; z += 0.3) {
        add(x0 + s, y0, ground(x0, y0) + z);
        add(x0, y0 + s, ground(x0, y0) + z);
      }
    }
  }
  std::shuffle(town.begin(), town.end(), random);
  REQUIRE(io::write_pcd(path("town.pcd"), town, io::Precision::float32));
  std::string trajectory;
  for (int k = 0; k < 100; ++k) {
    trajectory +=
        std::to_string(k) + " " + std::to_string(-29.0 + 1.15 * k) + " 40.0 1.8 0 0 0 1\n";
  }
  write_text(path("driven.tum"), trajectory);
  must_run("vantage-tile", {path("town.pcd"), "-o", path("tiles"), "-q"});
}

std::string SmallTown::config(const TownConfig& config) const {
  const std::string text =
      "schema = 1\n[map]\nfiles = [\"tiles\"]\ntrajectory = \"driven.tum\"\n[partitioner]\n" +
      config.partitioner + "\n[ground]\n" + config.ground + "\n[viewpoints]\n" + config.viewpoints +
      "\n[visibility]\n" + config.visibility + "\n[store]\n" + config.store +
      (config.store.find("content") == std::string::npos ? "\ncontent = \"points\"" : "") +
      "\nparams = { root = \"bundle\" }\n[matcher]\nplugin = \"ndt\"\nparams = { resolution = 2.0 "
      "}\n" +
      config.more;
  write_text(path("town.toml"), text);
  return path("town.toml");
}

std::map<std::string, std::string> bytes_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = read_text(entry.path());
  }
  return files;
}

std::vector<std::string> failing_disk(const std::string& words, const std::string& log) {
  std::vector<std::string> variables{std::string("LD_PRELOAD=") + VANTAGE_FAILING_DISK,
                                     "ASAN_OPTIONS=verify_asan_link_order=0",
                                     "VANTAGE_DISK=" + words};
  if (!log.empty()) variables.push_back("VANTAGE_DISK_LOG=" + log);
  return variables;
}

void must_run(const std::string& program, const std::vector<std::string>& arguments) {
  const Finished finished = run(program, arguments);
  REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
}

}  // namespace vantage::test
