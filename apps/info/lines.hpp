#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "terminal/style.hpp"

namespace vantage {

/// Names and their values, to be printed below each other.
using Lines = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] std::string to_text(const Lines& lines, const cli::Style& style);

/// "x 0.00 to 9.00, y ...", or "none".
[[nodiscard]] std::string box_text(const Eigen::AlignedBox3d& extent);

/// [x, y, z].
[[nodiscard]] nlohmann::ordered_json vector_json(const Eigen::Vector3d& v);

}  // namespace vantage
