// Localizes scans one at a time, as a robot's driver hands them over. Here they come from files of
// float32 x y z.
#include <cstdio>
#include <fstream>
#include <vantage/engine/localizer.hpp>

using namespace vantage;

PointCloud read_scan(const char* file) {
  PointCloud points;
  std::ifstream in(file, std::ios::binary);
  for (float xyz[3]; in.read(reinterpret_cast<char*>(xyz), sizeof xyz);)
    points.emplace_back(xyz[0], xyz[1], xyz[2]);
  return points;
}

Result<void> run(int argc, char** argv) {
  VANTAGE_TRY(const Config config, load_config(argv[1]));
  const auto plugins = PluginLoader::with_default_folders({});
  VANTAGE_TRY(Localizer localizer, Localizer::open(config, plugins));
  localizer.start_anywhere();  // or start(pose), where it is known
  for (int i = 2; i < argc; ++i) {
    const PointCloud points = read_scan(argv[i]);
    VANTAGE_TRY(const ScanReport report, localizer.localize({.stamp = 0.1 * i, .points = points}));
    const auto& t = report.T_map_scan.translation;
    if (report.tracking == Tracking::tracked)
      std::printf("%s %.3f %.3f %.3f\n", argv[i], t.x(), t.y(), t.z());
    if (report.tracking == Tracking::lost)
      std::printf("%s lost: %s\n", argv[i], report.reason.c_str());
  }
  return {};
}

int main(int argc, char** argv) {
  if (argc < 3) return std::puts("usage: live_localization CONFIG.toml SCAN..."), 2;
  if (const auto outcome = run(argc, argv); !outcome)
    return std::puts(to_string(outcome.error()).c_str()), 1;
}
