// Reads a bag, localizes its scans, and scores the poses against a true trajectory.
#include <cstdio>
#include <vantage/engine/localizer.hpp>
#include <vantage/evaluation/run.hpp>
#include <vantage/evaluation/summary.hpp>
#include <vantage/io/sensor_trajectory.hpp>

using namespace vantage;

Result<void> run(const char* config_file, const char* bag, const char* topic, const char* truth) {
  VANTAGE_TRY(const Config config, load_config(config_file));
  const auto plugins = PluginLoader::with_default_folders({});
  VANTAGE_TRY(Localizer localizer, Localizer::open(config, plugins));
  RunInputs inputs{.scans = {.path = bag, .topic = topic}, .start_anywhere = true};
  VANTAGE_TRY(auto reference, io::read_sensor_trajectory({.path = truth, .topic = {}}, {}));
  inputs.reference = std::move(reference.poses);
  RunSummarizer summarizer;
  const auto print = [&](const io::StampedScan& scan, const RunScan& done) {
    const auto& t = done.report.T_map_scan.translation;
    std::printf("%.3f %s %.3f %.3f %.3f\n", scan.stamp, to_string(done.report.tracking), t.x(),
                t.y(), t.z());
    return summarizer.add(done);
  };
  VANTAGE_TRY(const RunInfo info, localize_each(std::move(localizer), config_file, inputs, print));
  if (info.failure) return fail(Error(*info.failure));
  VANTAGE_TRY(const RunSummary summary, summarizer.summary());
  std::printf("%zu of %zu scans tracked, error %.3f m (median)\n", summary.tracked, summary.scans,
              summary["error_m"].median);
  return {};
}

int main(int argc, char** argv) {
  if (argc != 5) return std::puts("usage: offline_localization CONFIG.toml BAG TOPIC TRUTH"), 2;
  if (const auto done = run(argv[1], argv[2], argv[3], argv[4]); !done)
    return std::puts(to_string(done.error()).c_str()), 1;
}
