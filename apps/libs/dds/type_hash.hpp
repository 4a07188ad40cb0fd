#pragma once

#include <string>

#include "io/ros/schemas.hpp"
#include "vantage/result.hpp"

namespace vantage::dds {

/// The hash by which ROS 2 (Iron and later) tells definitions of a type apart (REP-2011): "RIHS01_"
/// and the SHA-256 of a description of the type and of all types in it.
/// Errors: `invalid_input` for a definition with a line that is neither a member nor a constant.
[[nodiscard]] Result<std::string> type_hash(const io::ros::MessageSchema& schema);

}  // namespace vantage::dds
