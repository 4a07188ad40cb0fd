// Whether the atlas of a bundle is right: simulated drives through worlds that no constant was
// chosen on, their errors beside those that the atlas predicts, and the direction of a tunnel.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "integrity_worlds.hpp"
#include "simulate/layouts.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle_build.hpp"
#include "vantage/engine/localizer.hpp"

namespace vantage::benchmarks {
namespace {

struct AtlasOptions {
  std::vector<std::uint64_t> seeds{211, 212};
  std::string matcher = "ndt";
  std::vector<std::string> worlds;
  bool sites = false;
  std::size_t jobs = 1;
};

/// Worlds whose places differ: an empty square among streets, and streets with few buildings.
const std::vector<NamedWorld>& worlds_of_atlas() {
  static const std::vector<NamedWorld> worlds{
      {.name = "square",
       .overrides = {"campus.layout=square", "campus.size_x=180.0", "campus.size_y=180.0",
                     "campus.street_spacing=60.0", "campus.square_radius=45.0",
                     "lidar.max_range=45.0", "drive.route=2", "drive.length=600.0",
                     "drive.scan_every=6"}},
      {.name = "streets",
       .overrides = {"campus.size_x=200.0", "campus.size_y=200.0", "campus.street_spacing=60.0",
                     "campus.building_density=0.08", "campus.trees_per_hectare=30.0",
                     "campus.wall_share=0.15", "lidar.max_range=45.0", "drive.route=1",
                     "drive.length=600.0", "drive.scan_every=6"}},
      {.name = "tunnel",
       .overrides = {"campus.layout=tunnel", "campus.size_x=80.0", "campus.size_y=240.0",
                     "campus.street_spacing=120.0", "campus.street_jitter=0.0",
                     "campus.ground_relief=0.0", "drive.length=200.0", "drive.scan_every=6"}}};
  return worlds;
}

Result<Config> config_for(const std::string& matcher, const std::filesystem::path& bundle) {
  VANTAGE_TRY(const Table table, parse_toml(fmt::format(R"(schema = 1
[map]
files = ["map.pcd"]
trajectory = "mapping.tum"
[partitioner]
plugin = "uniform_grid"
params = {{ cell_width = 20.0 }}
[viewpoints]
source = "trajectory"
voxel_size = 1.0
lateral_offsets = [0.0, -1.0, 1.0]
[visibility]
plugin = "keep_all"
max_range = 60.0
[store]
plugin = "pcd_tiles"
params = {{ root = "{}", overwrite = true }}
[matcher]
plugin = "{}"
[localizer]
scan_min_range = 1.0
prefetch = false
[atlas]
site_spacing = 10.0
)",
                                                        bundle.string(), matcher),
                                            "atlas"));
  return parse_config(table);
}

/// A site, and the drive's errors around it.
struct Visited {
  const Site* site;
  std::vector<double> metres;  // horizontal errors
  [[nodiscard]] double measured() const {
    double squares = 0.0;
    for (const double m : metres) squares += m * m;
    return std::sqrt(squares / static_cast<double>(metres.size()));
  }
};

/// Ranks from 1; equal values share the mean of theirs.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t k) { return values[k]; });
  std::vector<double> ranks(values.size());
  for (std::size_t i = 0, j = 0; i < order.size(); i = j) {
    while (j < order.size() && values[order[j]] == values[order[i]]) ++j;
    for (std::size_t k = i; k < j; ++k) ranks[order[k]] = 0.5 * static_cast<double>(i + j + 1);
  }
  return ranks;
}

/// Spearman's rank correlation.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double mean = 0.5 * static_cast<double>(a.size() + 1);
  double xy = 0.0, xx = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xy += (x[k] - mean) * (y[k] - mean);
    xx += (x[k] - mean) * (x[k] - mean);
    yy += (y[k] - mean) * (y[k] - mean);
  }
  return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx * yy) : 0.0;
}

/// Localizes the drive, and sorts its horizontal errors to the nearest sites.
Result<std::vector<Visited>> visited(const Atlas& atlas, Localizer localizer,
                                     const SimulatedDrive& drive) {
  constexpr std::size_t kFewestScans = 5;
  VANTAGE_CHECK(localizer.start(drive.reference.front().pose));
  std::map<const Site*, std::vector<double>> errors;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const Pose& truth = drive.reference[i].pose;
    VANTAGE_TRY(const ScanReport report, localizer.localize({.stamp = drive.reference[i].stamp,
                                                             .points = drive.scans[i],
                                                             .odometry = drive.odometry[i].pose}));
    if (!report.has_pose) continue;
    errors[atlas.nearest(truth.translation)].push_back(
        (report.T_map_scan.translation - truth.translation).head<2>().norm());
  }
  std::vector<Visited> result;
  for (const Site& site : atlas.sites) {
    const auto found = errors.find(&site);
    if (found == errors.end() || found->second.size() < kFewestScans || !site.precision) continue;
    result.push_back({&site, found->second});
  }
  return result;
}

/// The angles between the weak directions of the sites in a tunnel and its axis [deg].
std::vector<double> tunnel_angles(const Atlas& atlas, const simulation::WorldParams& params) {
  constexpr double kMouth = 10.0;  // [m]; nearer to its ends, things outside are seen
  const auto street = simulation::tunnel_street(simulation::StreetGrid(params.campus, params.seed));
  const Eigen::Vector2d origin(params.campus.origin_x, params.campus.origin_y);
  const Eigen::Vector2d middle = 0.5 * (street.from + street.to) + origin;
  const Eigen::Vector2d axis = (street.to - street.from).normalized();
  const double direction = std::atan2(axis.y(), axis.x());
  std::vector<double> angles;
  for (const Site& site : atlas.sites) {
    const Eigen::Vector2d from_middle = site.position.head<2>() - middle;
    if (std::abs(from_middle.dot(axis)) > 0.5 * params.campus.tunnel_length - kMouth) continue;
    if ((from_middle - from_middle.dot(axis) * axis).norm() > 3.0 || !site.precision) continue;
    const double off = std::remainder(site.precision->weak_direction - direction, std::numbers::pi);
    angles.push_back(std::abs(off) * 180.0 / std::numbers::pi);
  }
  return angles;
}

struct Row {
  std::string name;
  std::vector<double> measured = {}, predicted = {}, sigma = {}, basin = {};
};

std::string centimetres(const std::vector<double>& metres, double quantile) {
  if (metres.empty()) return "-";
  std::vector<double> sorted = metres;
  std::ranges::sort(sorted);
  const auto k = static_cast<std::size_t>(quantile * static_cast<double>(sorted.size() - 1));
  return fmt::format("{:.2f}", 100.0 * sorted[k]);
}

Result<Row> measure(const NamedWorld& world, std::uint64_t seed, const AtlasOptions& options) {
  VANTAGE_TRY(const auto params, params_of(world, seed, 0));
  VANTAGE_TRY(const SimulatedDrive drive, simulated_drive(params, 0));
  VANTAGE_TRY(const PointCloud map, simulated_map(params));
  PointCloud trajectory;
  for (const auto& moment : drive.reference) trajectory.push_back(moment.pose.translation);
  const test::TemporaryFolder folder;
  const PluginLoader plugins = test::built_plugins();
  VANTAGE_TRY(const Config config, config_for(options.matcher, folder.path() / "bundle"));
  VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
  VANTAGE_CHECK(build.run(map, trajectory));
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, plugins, "the benchmark"));
  VANTAGE_TRY(const auto atlas, Atlas::of_bundle(bundle));
  if (!atlas) return fail(ErrorCode::internal, "the bundle has no atlas");
  VANTAGE_TRY(Localizer localizer, Localizer::open(bundle, config, plugins));
  VANTAGE_TRY(const auto places, visited(*atlas, std::move(localizer), drive));

  Row row{.name = fmt::format("{}, seed {}", world.name, seed)};
  if (options.sites) {
    print_head("Places of " + row.name, {"x", "y", "scans", "measured [cm]", "predicted [cm]",
                                         "sigma [cm]", "direction [deg]", "basin [m]", "alike"});
  }
  for (const Visited& place : places) {
    const SitePrecision& p = *place.site->precision;
    row.measured.push_back(place.measured());
    row.predicted.push_back(p.expected_error);
    row.sigma.push_back(std::hypot(p.sigma_weak, p.sigma_strong));
    row.basin.push_back(-p.basin);
    if (!options.sites) continue;
    print_row({fmt::format("{:.1f}", place.site->position.x()),
               fmt::format("{:.1f}", place.site->position.y()),
               fmt::format("{}", place.metres.size()),
               fmt::format("{:.2f}", 1e2 * place.measured()),
               fmt::format("{:.2f}", 1e2 * p.expected_error),
               fmt::format("{:.2f} / {:.2f}", 1e2 * p.sigma_strong, 1e2 * p.sigma_weak),
               fmt::format("{:.0f}", p.weak_direction * 180.0 / std::numbers::pi),
               fmt::format("{:.1f}", p.basin), fmt::format("{}", place.site->alike.size())});
  }
  const Calibration& c = atlas->calibration;
  const auto quantile = [](const std::vector<double>& shares, std::size_t k) {
    return shares.empty() ? std::string("-") : fmt::format("{:.3f}", shares[k]);
  };
  std::size_t alike = 0;
  for (const Site& site : atlas->sites) alike += site.alike.empty() ? 0 : 1;
  std::cerr << fmt::format(
      "{}: {} sites, {} with alike places; {} right shares {} / {} / {}, {} wrong ones {} / {} / "
      "{}\n",
      row.name, atlas->sites.size(), alike, c.right_samples, quantile(c.right, 1),
      quantile(c.right, 16), quantile(c.right, 31), c.wrong_samples, quantile(c.wrong, 1),
      quantile(c.wrong, 16), quantile(c.wrong, 31));
  if (world.name == "tunnel") {
    const std::vector<double> angles = tunnel_angles(*atlas, params);
    if (angles.empty()) return fail(ErrorCode::internal, "no site is in the tunnel");
    std::cout << fmt::format(
        "\n{}: {} sites in the tunnel, weak directions off its axis by {:.2f} deg at most\n",
        row.name, angles.size(), *std::ranges::max_element(angles));
  }
  return row;
}

Result<void> run_atlas(const AtlasOptions& options) {
  const cli::ThreadLimit threads(options.jobs);
  std::vector<Row> rows;
  for (const NamedWorld& world : worlds_of_atlas()) {
    if (!options.worlds.empty() &&
        std::ranges::find(options.worlds, world.name) == options.worlds.end())
      continue;
    for (const std::uint64_t seed : options.seeds) {
      VANTAGE_TRY(rows.emplace_back(), measure(world, seed, options));
    }
  }
  print_head("Predicted and measured errors with " + options.matcher,
             {"world", "places", "measured [cm], 10 % / 50 % / 90 %", "predicted [cm]",
              "rank correlation", "of sigma", "of basin"});
  for (const Row& row : rows) {
    const auto three = [](const std::vector<double>& metres) {
      return centimetres(metres, 0.1) + " / " + centimetres(metres, 0.5) + " / " +
             centimetres(metres, 0.9);
    };
    print_row({row.name, fmt::format("{}", row.measured.size()), three(row.measured),
               three(row.predicted),
               fmt::format("{:.2f}", rank_correlation(row.predicted, row.measured)),
               fmt::format("{:.2f}", rank_correlation(row.sigma, row.measured)),
               fmt::format("{:.2f}", rank_correlation(row.basin, row.measured))});
  }
  return {};
}

void declare_atlas(Arguments& arguments, AtlasOptions& options) {
  arguments.program("./dev bench atlas",
                    "Whether the atlas of a bundle is right: predicted errors beside measured "
                    "ones, and the weak direction in a tunnel; markdown tables.");
  std::vector<std::string> names;
  for (const NamedWorld& world : worlds_of_atlas()) names.push_back(world.name);
  arguments.shown("--seeds", options.seeds, "of the worlds, none of configs/simulate", "N,N,...")
      ->delimiter(',');
  arguments.add("--worlds", options.worlds, "all if left out", "NAME,...", CLI::IsMember(names))
      ->delimiter(',');
  arguments.shown("--matcher", options.matcher, "which", "NAME",
                  CLI::IsMember({"ndt", "icp", "gicp"}));
  arguments.flag("--sites", options.sites, "print every place");
  arguments.shown("-j,--jobs", options.jobs, "threads; results do not depend on it; 0: all", "N");
}

const auto program = table(declare_atlas, run_atlas);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
