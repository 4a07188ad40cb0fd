// Localizes scans one at a time, as a robot's driver hands them over. Here they come from a
// recording: a folder of scans, a ROS bag, an MCAP file or a capture.
#include <cstdio>
#include <vantage/engine/localizer.hpp>
#include <vantage/io/scan_source.hpp>

using namespace vantage;

Result<void> run(const char* config_file, const io::ScanOptions& recording) {
  VANTAGE_TRY(Config config, load_config(config_file));
  auto& params = config.localizer ? *config.localizer : config.localizer.emplace();
  params.live = true, params.search_budget = 5e3;  // ms; this robot stands until it is found
  const auto plugins = PluginLoader::with_default_folders({});
  VANTAGE_TRY(Localizer localizer, Localizer::open(config, plugins));
  localizer.start_anywhere();  // or start(pose), where it is known
  VANTAGE_TRY(const auto scans, io::open_scans(recording));
  while (true) {
    VANTAGE_TRY(const auto scan, scans->next());
    if (!scan) return {};
    VANTAGE_TRY(const ScanReport report,
                localizer.localize(
                    {.stamp = scan->stamp, .points = scan->points, .seconds = scan->seconds}));
    const auto& t = report.T_map_scan.translation;
    if (report.tracking == Tracking::tracked)
      std::printf("%.3f %.3f %.3f %.3f\n", scan->stamp, t.x(), t.y(), t.z());
    if (report.tracking == Tracking::uncertain)
      std::printf("%.3f uncertain, risk %.1g: %s\n", scan->stamp, report.risk,
                  report.reason.c_str());
    if (report.tracking == Tracking::lost)
      std::printf("%.3f lost: %s\n", scan->stamp, report.reason.c_str());
  }
}

int main(int argc, char** argv) {
  if (argc < 3) return std::puts("usage: live_localization CONFIG.toml SCANS [TOPIC]"), 2;
  const io::ScanOptions recording{.path = argv[2], .topic = argc > 3 ? argv[3] : ""};
  if (const auto outcome = run(argv[1], recording); !outcome)
    return std::puts(to_string(outcome.error()).c_str()), 1;
}
