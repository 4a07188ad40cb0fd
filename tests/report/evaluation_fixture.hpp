#pragma once

#include <string>
#include <vector>

#include "vantage/evaluation/evaluation.hpp"

namespace vantage::test {

/// How large a made-up evaluation is.
struct Made {
  std::vector<std::string> configs{"wide", "L20"};
  std::vector<std::string> routes{"north"};
  std::size_t scans = 60, map_points = 20000;
  bool baselines = true;
};

/// An evaluation of configurations that were never run: a street with houses, a drive along it with
/// errors, a lost scan and switches, the same at every call. The first configuration is the
/// wide-area map, the others grids of 10 m, 20 m, ...
[[nodiscard]] Evaluation made_evaluation(const Made& made);

/// The same over a map and along a way of others: each route is as many poses of the reference as
/// `made` has scans, from another one on.
[[nodiscard]] Evaluation made_evaluation(const Made& made, PointCloud map,
                                         const io::Trajectory& reference);

}  // namespace vantage::test
