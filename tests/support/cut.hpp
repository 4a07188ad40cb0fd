#pragma once

#include "vantage/conformance/range_survey.hpp"
#include "vantage/engine/plugin_loader.hpp"

namespace vantage::test {

/// What a partitioner makes of a map in which a viewpoint sees what is within `range` [m].
[[nodiscard]] inline Result<Partition> cut(const PluginPtr<Partitioner>& partitioner,
                                           PointsView map, PointsView trajectory = {},
                                           double range = 15.0) {
  return partitioner->partition(map, trajectory, conformance::RangeSurvey(map, range));
}

}  // namespace vantage::test
