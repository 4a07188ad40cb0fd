// Whether the atlas of a bundle is right: simulated drives through worlds that no constant was
// chosen on, their errors beside those that the atlas predicts, and the direction of a tunnel.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "atlas_places.hpp"
#include "drive.hpp"
#include "integrity_worlds.hpp"
#include "localizability/localizability.hpp"
#include "simulate/drive.hpp"
#include "simulate/layouts.hpp"
#include "simulate/odometry.hpp"
#include "simulate/world.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/build/assessment.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::benchmarks {
namespace {

struct AtlasOptions {
  std::vector<std::uint64_t> seeds{211, 212};
  std::string matcher = "ndt";
  std::vector<std::string> worlds;
  std::size_t drives = 6;
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
content = "points"
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

/// A site in a tunnel.
struct TunnelSite {
  double off;  // from the tunnel's axis to the weak direction [deg]
  bool clear;  // whether one direction is clearly weaker than the other
};

std::vector<TunnelSite> sites_in_tunnel(const Atlas& atlas, const simulation::WorldParams& params) {
  constexpr double kMouth = 10.0;  // [m]; nearer to its ends, things outside are seen
  const auto street = simulation::tunnel_street(simulation::StreetGrid(params.campus, params.seed));
  const Eigen::Vector2d origin(params.campus.origin_x, params.campus.origin_y);
  const Eigen::Vector2d middle = 0.5 * (street.from + street.to) + origin;
  const Eigen::Vector2d axis = (street.to - street.from).normalized();
  const double direction = std::atan2(axis.y(), axis.x());
  std::vector<TunnelSite> sites;
  for (const Site& site : atlas.sites) {
    const Eigen::Vector2d from_middle = site.position.head<2>() - middle;
    if (std::abs(from_middle.dot(axis)) > 0.5 * params.campus.tunnel_length - kMouth) continue;
    if ((from_middle - from_middle.dot(axis) * axis).norm() > 3.0 || !site.precision) continue;
    const double off = std::remainder(site.precision->weak_direction - direction, std::numbers::pi);
    sites.push_back(
        {.off = std::abs(off) * 180.0 / std::numbers::pi, .clear = is_weak(*site.precision)});
  }
  return sites;
}

struct Row {
  std::string name;
  std::uint64_t seed;
  std::vector<Place> places = {};
};

/// Three quantiles.
std::string centimetres(const Errors& errors) {
  std::vector<double> sorted;
  for (const auto& metres : errors) {
    if (metres) sorted.push_back(*metres);
  }
  if (sorted.empty()) return "-";
  std::ranges::sort(sorted);
  const auto at = [&](double share) {
    return 100.0 * sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  return fmt::format("{:.2f} / {:.2f} / {:.2f}", at(0.1), at(0.5), at(0.9));
}

void print_places(const Row& row) {
  print_head(fmt::format("Places of {}, seed {}", row.name, row.seed),
             {"x", "y", "measured [cm]", "beside [cm]", "predicted [cm]", "sigma [cm]",
              "direction [deg]", "basin [m]", "alike"});
  const auto or_dash = [](const std::optional<double>& metres) {
    return metres ? fmt::format("{:.2f}", 1e2 * *metres) : std::string("-");
  };
  for (const Place& place : row.places) {
    const Site& site = place.site;
    const SitePrecision& p = *site.precision;
    print_row({fmt::format("{:.1f}", site.position.x()), fmt::format("{:.1f}", site.position.y()),
               or_dash(place.on_lane), or_dash(place.beside),
               fmt::format("{:.2f}", 1e2 * p.expected_error),
               fmt::format("{:.2f} / {:.2f}", 1e2 * p.sigma_strong, 1e2 * p.sigma_weak),
               fmt::format("{:.0f}", p.weak_direction * 180.0 / std::numbers::pi),
               fmt::format("{:.1f}", p.basin), fmt::format("{}", site.alike.size())});
  }
}

/// Drives in the world of `params` on both lanes in turn. The first lane is that of the map's
/// trajectory. Each drive has noise of its own.
Result<std::vector<Localized>> driven(const simulation::WorldParams& params, const Atlas& atlas,
                                      const std::function<Result<Localizer>()>& localizer,
                                      std::size_t drives) {
  std::vector<Localized> scans;
  for (std::size_t k = 0; k < drives; ++k) {
    simulation::WorldParams here = params;
    if (k % 2 == 1) here.drive.lateral_offset = -here.drive.lateral_offset;
    VANTAGE_TRY(const SimulatedDrive drive, simulated_drive(here, 0, hash(params.seed, k)));
    VANTAGE_TRY(Localizer one, localizer());
    VANTAGE_TRY(const auto more, localized(atlas, std::move(one), drive, k));
    scans.insert(scans.end(), more.begin(), more.end());
  }
  return scans;
}

Result<Row> measure(const NamedWorld& named, std::uint64_t seed, const AtlasOptions& options) {
  VANTAGE_TRY(const auto params, params_of(named, seed, 0));
  VANTAGE_TRY(const auto world, simulation::World::create(params));
  VANTAGE_TRY(const auto mapping, simulation::Drive::create(world, params));
  VANTAGE_TRY(const PointCloud map, simulated_map(params));
  PointCloud trajectory;
  for (const auto& moment : simulation::reference_of(world, mapping)) {
    trajectory.push_back(moment.pose.translation);
  }
  const test::TemporaryFolder folder;
  const PluginLoader plugins = test::built_plugins();
  VANTAGE_TRY(const Config config, config_for(options.matcher, folder.path() / "bundle"));
  VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
  VANTAGE_CHECK(build.run(map, trajectory));
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, plugins, "the benchmark"));
  VANTAGE_TRY(Assessment assessment, Assessment::prepare(bundle, config, plugins));
  VANTAGE_TRY(const AssessmentReport assessed, assessment.run(map));
  const Atlas& atlas = assessed.atlas;
  VANTAGE_TRY(
      const auto scans,
      driven(
          params, atlas, [&] { return Localizer::open(bundle, config, plugins); }, options.drives));

  Row row{.name = named.name, .seed = seed, .places = places_of(atlas, scans)};
  if (options.sites) print_places(row);
  std::size_t alike = 0;
  for (const Site& site : atlas.sites) alike += site.alike.empty() ? 0 : 1;
  std::cerr << fmt::format("{}, seed {}: {} sites, {} with alike places\n", row.name, seed,
                           atlas.sites.size(), alike);
  if (named.name == "tunnel") {
    const std::vector<TunnelSite> sites = sites_in_tunnel(atlas, params);
    if (sites.empty()) return fail(ErrorCode::internal, "no site is in the tunnel");
    const auto worst = [&](bool clear) {
      double most = -1.0;
      for (const TunnelSite& site : sites) {
        if (site.clear == clear && site.off > most) most = site.off;
      }
      return most < 0.0 ? std::string("-") : fmt::format("{:.2f} deg", most);
    };
    std::cout << fmt::format(
        "\n{}, seed {}: {} sites in the tunnel; weak directions off its axis by {} at most at the "
        "{} that clearly have one, by {} at the others\n",
        row.name, seed, sites.size(), worst(true), std::ranges::count_if(sites, &TunnelSite::clear),
        worst(false));
  }
  return row;
}

/// The places of all worlds of a seed, as if they were districts of one.
std::vector<Row> districts(const std::vector<Row>& rows) {
  std::vector<Row> all;
  for (const Row& row : rows) {
    auto found = std::ranges::find(all, row.seed, &Row::seed);
    if (found == all.end()) found = all.insert(all.end(), {.name = "all", .seed = row.seed});
    found->places.insert(found->places.end(), row.places.begin(), row.places.end());
  }
  return all;
}

void print_table(const std::vector<Row>& rows, const std::string& matcher) {
  print_head(
      "Predicted and measured errors with " + matcher,
      {"world", "places", "measured [cm], 10 % / 50 % / 90 %", "predicted [cm]", "rank correlation",
       "on the other lane", "of two drives", "of real scans at the site with the rest"});
  for (const Row& row : rows) {
    const auto of = [&](auto which) { return errors_of(row.places, which); };
    const Errors on_lane = of(&Place::on_lane), predicted = of(&Place::predicted);
    const auto places = std::ranges::count_if(on_lane, [](const auto& e) { return e.has_value(); });
    print_row({fmt::format("{}, seed {}", row.name, row.seed), fmt::format("{}", places),
               centimetres(on_lane), centimetres(predicted), correlation(predicted, on_lane),
               correlation(predicted, of(&Place::beside)),
               correlation(of(&Place::first), of(&Place::again)),
               correlation(of(&Place::at_site), of(&Place::elsewhere))});
  }
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
  const std::vector<Row> all = districts(rows);
  rows.insert(rows.begin(), all.begin(), all.end());
  print_table(rows, options.matcher);
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
  arguments.shown("--drives", options.drives, "in each world, on both lanes in turn", "N",
                  CLI::Range(1, 100));
  arguments.flag("--sites", options.sites, "print every place");
  arguments.shown("-j,--jobs", options.jobs, "threads; results do not depend on it; 0: all", "N");
}

const auto program = table(declare_atlas, run_atlas);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
