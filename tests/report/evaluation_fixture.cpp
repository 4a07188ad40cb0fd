#include "report/evaluation_fixture.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace vantage::test {
namespace {

/// A ground of 120 m by 80 m and two rows of fronts along y = 30 and y = 50.
PointCloud street(std::size_t points) {
  std::mt19937 random(1);
  const auto next = [&] { return static_cast<double>(random() >> 8U) / 16777216.0; };
  PointCloud map;
  for (std::size_t i = 0; i < points; ++i) {
    const double x = 120.0 * next();
    if (i % 2 == 0) {
      map.emplace_back(x, 80.0 * next(), 0.03 * next());
    } else {
      map.emplace_back(x, (i % 4 == 1 ? 30.0 : 50.0) + 0.05 * next(), 9.0 * next());
    }
  }
  return map;
}

MapIndex grid_index(const Bounds3& box, double width, std::uint64_t map_points) {
  MapIndex index;
  std::vector<Region> regions;
  const Eigen::Vector2d first = box.min.head<2>(), extent = (box.max - box.min).head<2>();
  const int columns = static_cast<int>(extent.x() / width) + 1;
  const int rows = static_cast<int>(extent.y() / width) + 1;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d low = first + Eigen::Vector2d(column * width, row * width);
      regions.push_back({"x" + std::to_string(column) + "_y" + std::to_string(row),
                         HalfOpenBox{low, low + Eigen::Vector2d(width, width)},
                         {}});
      const std::uint64_t points =
          columns * rows == 1 ? map_points : map_points / 10 + 7 * index.regions.size();
      index.regions.push_back({.points = points, .viewpoints = 20, .bytes = 12 * points});
    }
  }
  index.partition = *Partition::from(std::move(regions));
  index.map_bounds = box;
  index.map_points = map_points;
  index.config = "schema = 1\n[partitioner]\ncell_width = " + std::to_string(width) + "\n";
  return index;
}

RouteRun made_run(const MapIndex& index, const io::Trajectory& reference, double error,
                  unsigned seed) {
  std::mt19937 random(seed);
  const auto next = [&] { return static_cast<double>(random() >> 8U) / 16777216.0; };
  Run run;
  run.config = "made.toml";
  run.stamp_rule = "stamps from file names";
  run.map_points = index.map_points;
  run.regions = index.regions.size();
  RegionId last{};
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const Pose& truth = reference[i].pose;
    RunScan scan;
    scan.reference = truth;
    ScanReport& r = scan.report;
    r.stamp = reference[i].stamp;
    r.tracking = i == reference.size() / 3 ? Tracking::lost : Tracking::tracked;
    if (i == 2 * reference.size() / 3) r.tracking = Tracking::uncertain;
    if (r.tracking != Tracking::tracked) r.reason = "the fit is <poor> & \"odd\"";
    const double risk = r.tracking == Tracking::tracked     ? 1e-6
                        : r.tracking == Tracking::uncertain ? 0.02
                                                            : 0.7;
    r.risk = risk * (1.0 + 0.3 * static_cast<double>(i % 2));
    const double off = error * (0.4 + 1.2 * next());
    r.T_map_scan = truth;
    r.T_map_scan.translation.y() += off;
    r.T_map_scan_predicted = r.T_map_scan;
    scan.error = PoseError{.metres = off, .degrees = 2.0 * off};
    scan.prediction_error = PoseError{.metres = 3.0 * off, .degrees = 4.0 * off};
    r.region = index.partition.locate(truth.translation).value_or(RegionId{});
    r.switched = i == 0 || r.region != last;
    last = r.region;
    r.map_points = index.regions[r.region.value].points;
    scan.region = index.partition[r.region].label;
    scan.map = index.regions[r.region.value];
    scan.wide_area_points = index.map_points;
    r.held_bytes = 40 * r.map_points;
    r.scan_points = 900;
    r.seconds_align = 0.004 + 0.003 * next();
    r.seconds_stall = r.switched ? 0.01 * next() : 0.0;
    Alignment alignment;
    alignment.T_map_scan = r.T_map_scan;
    alignment.termination = Termination::converged;
    alignment.iterations = 5;
    alignment.score = {.fitness = 1.2 - 5.0 * off + 0.05 * next(),
                       .nvtl = 2.5 + 0.3 * next(),
                       .coverage = 0.8 + 0.2 * next()};
    r.lcp = alignment.score.fitness / static_cast<double>(r.map_points);
    r.alignment = alignment;
    r.confidence = PoseConfidence{};
    run.scans.push_back(std::move(scan));
  }
  RunSummary summary = summarize(run);
  return {std::move(run), std::move(summary)};
}

Specimen specimen_of(const PointCloud& map, const RouteRun& run) {
  Specimen specimen{run.run.scans[run.run.scans.size() / 2].report.region, {}, {}};
  const Point middle = run.run.scans[run.run.scans.size() / 2].report.T_map_scan.translation;
  const double reach = run.run.regions == 1 ? 1e9 : 35.0;
  for (const Point& p : map) {
    if ((p - middle).norm() < reach) specimen.points.push_back(p);
  }
  for (int i = 0; i < 20; ++i) specimen.viewpoints.push_back(middle + Point(i % 5, i / 5, 0.0));
  return specimen;
}

}  // namespace

Evaluation made_evaluation(const Made& made) {
  io::Trajectory reference;
  for (std::size_t i = 0; i < 2 * made.scans; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(2 * made.scans);
    reference.push_back(
        {0.1 * static_cast<double>(i),
         pose_from_xyz_rpy({5.0 + 110.0 * share, 40.0 + 4.0 * std::sin(7.0 * share), 1.0},
                           Point::Zero())});
  }
  return made_evaluation(made, street(made.map_points), reference);
}

Evaluation made_evaluation(const Made& made, PointCloud map, const io::Trajectory& reference) {
  Evaluation e;
  e.map = std::move(map);
  for (std::size_t route = 0; route < made.routes.size(); ++route) {
    const std::size_t spare = reference.size() - std::min(reference.size(), made.scans);
    const std::size_t first = spare * route / std::max<std::size_t>(1, made.routes.size());
    const auto begin = reference.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(std::min(made.scans, reference.size()));
    e.routes.push_back({made.routes[route], io::Trajectory(begin, end)});
  }
  const Bounds3 box = bounds_of(e.map);
  unsigned seed = 1;
  for (std::size_t c = 0; c < made.configs.size(); ++c) {
    EvaluatedConfig config;
    config.name = made.configs[c];
    config.index = grid_index(box, c == 0 ? 1e5 : 10.0 * static_cast<double>(c), e.map.size());
    std::vector<double> points;
    for (const RegionSummary& region : config.index.regions) {
      points.push_back(static_cast<double>(region.points));
      config.bundle_bytes += region.bytes;
    }
    config.region_points = statistics_of(points);
    const auto runs = [&](double error) {
      std::vector<RouteRun> all;
      for (const Route& route : e.routes) {
        all.push_back(made_run(config.index, route.reference, error, ++seed));
      }
      return all;
    };
    config.routes = runs(0.02 + 0.005 * static_cast<double>(c));
    if (c == 0) {
      config.no_baselines = "its region maps hold every point within reach";
    } else if (made.baselines) {
      config.baselines = {{"random", runs(0.022)}, {"voxel", runs(0.021)}, {"radius", runs(0.08)}};
    }
    config.specimen = specimen_of(e.map, config.routes.front());
    e.configs.push_back(std::move(config));
  }
  return e;
}

}  // namespace vantage::test
