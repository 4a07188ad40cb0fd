#include "io/ros/schemas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

namespace vantage::io::ros {
namespace {

struct Definition {
  std::string_view type, text;
};

constexpr std::string_view kAlignRequest =
    "geometry_msgs/PoseWithCovarianceStamped pose_with_covariance\n";
constexpr std::string_view kAlignResponse =
    "bool success\nbool reliable\ngeometry_msgs/PoseWithCovarianceStamped pose_with_covariance\n";

constexpr auto kDefinitions = std::to_array<Definition>({
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/String", "string data\n"},
    {"std_msgs/Float64", "float64 data\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
     "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
     "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
     "float64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/NavSatStatus",
     "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 STATUS_SBAS_FIX=1\nint8 STATUS_GBAS_FIX=2\n"
     "uint16 SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\nuint16 SERVICE_COMPASS=4\n"
     "uint16 SERVICE_GALILEO=8\nint8 status -2\nuint16 service\n"},
    {"sensor_msgs/NavSatFix",
     "uint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\n"
     "uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3\n"
     "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\n"
     "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
     "uint8 position_covariance_type\n"},
    {"rosgraph_msgs/Clock", "builtin_interfaces/Time clock\n"},
    {"rmw_dds_common/Gid", "uint8[16] data\n"},
    {"rmw_dds_common/NodeEntitiesInfo",
     "string<=256 node_namespace\nstring<=256 node_name\nrmw_dds_common/Gid[] reader_gid_seq\n"
     "rmw_dds_common/Gid[] writer_gid_seq\n"},
    {"rmw_dds_common/ParticipantEntitiesInfo",
     "rmw_dds_common/Gid gid\nrmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq\n"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"sensor_msgs/PointField",
     "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
     "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\n"
     "uint32 count\n"},
    {"sensor_msgs/PointCloud2",
     "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
     "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
    {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    {"diagnostic_msgs/DiagnosticStatus",
     "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
     "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
    {"diagnostic_msgs/DiagnosticArray",
     "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    {"service_msgs/ServiceEventInfo",
     "uint8 REQUEST_SENT=0\nuint8 REQUEST_RECEIVED=1\nuint8 RESPONSE_SENT=2\n"
     "uint8 RESPONSE_RECEIVED=3\nuint8 event_type\nbuiltin_interfaces/Time stamp\n"
     "char[16] client_gid\nint64 sequence_number\n"},
    {"std_srvs/srv/SetBool_Request", "bool data\n"},
    {"std_srvs/srv/SetBool_Response", "bool success\nstring message\n"},
    // Autoware's; before version 0.45 in another package.
    {"autoware_internal_localization_msgs/srv/PoseWithCovarianceStamped_Request", kAlignRequest},
    {"autoware_internal_localization_msgs/srv/PoseWithCovarianceStamped_Response", kAlignResponse},
    {"tier4_localization_msgs/srv/PoseWithCovarianceStamped_Request", kAlignRequest},
    {"tier4_localization_msgs/srv/PoseWithCovarianceStamped_Response", kAlignResponse},
});

const Definition* find_definition(std::string_view type) {
  const auto* const found = std::ranges::find(kDefinitions, type, &Definition::type);
  return found == kDefinitions.end() ? nullptr : found;
}

/// The types that a definition's lines begin with, as far as they are messages.
std::vector<const Definition*> members_of(const Definition& definition) {
  std::vector<const Definition*> members;
  std::string_view rest = definition.text;
  while (!rest.empty()) {
    const std::string_view type = rest.substr(0, rest.find_first_of(" ["));
    if (const Definition* const found = find_definition(type)) members.push_back(found);
    rest.remove_prefix(rest.find('\n') + 1);
  }
  return members;
}

/// The first definition, then the others and those of all types in them.
MessageSchema schema_with_members(std::string name, std::vector<const Definition*> all) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const Definition* member : members_of(*all[i])) {
      if (std::ranges::find(all, member) == all.end()) all.push_back(member);
    }
  }
  MessageSchema schema{.name = std::move(name), .text = std::string(all.front()->text)};
  for (std::size_t i = 1; i < all.size(); ++i) {
    schema.text += fmt::format("{:=<80}\nMSG: {}\n{}", "", all[i]->type, all[i]->text);
  }
  return schema;
}

tl::unexpected<Error> unknown(std::string_view type) {
  return fail(ErrorCode::invalid_input, fmt::format("no definition of '{}' is known", type));
}

/// "std_srvs/srv/SetBool" of "std_srvs/SetBool".
std::string full_name(std::string_view type, std::string_view kind) {
  const std::size_t slash = std::min(type.find('/'), type.size());
  return fmt::format("{}/{}{}", type.substr(0, slash), kind, type.substr(slash));
}

}  // namespace

Result<MessageSchema> schema_of(std::string_view type) {
  const Definition* const found = find_definition(type);
  if (found == nullptr) return unknown(type);
  return schema_with_members(full_name(type, "msg"), {found});
}

Result<MessageSchema> service_schema_of(std::string_view type) {
  std::string name = full_name(type, "srv");
  const std::string request = name + "_Request", response = name + "_Response";
  if (find_definition(request) == nullptr) return unknown(type);
  const std::string event = name + "_Event";
  const std::string members = fmt::format(
      "{} request_message\n{} response_message\n{} event_message\n", request, response, event);
  const std::string event_members = fmt::format(
      "service_msgs/ServiceEventInfo info\n{}[<=1] request\n{}[<=1] response\n", request, response);
  const Definition whole{.type = name, .text = members};
  const Definition of_event{.type = event, .text = event_members};
  return schema_with_members(name, {&whole, &of_event});
}

}  // namespace vantage::io::ros
