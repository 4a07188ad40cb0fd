#include "dds/endpoints.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "dds/names.hpp"

namespace vantage::dds {
namespace {

const Endpoints::Own kPoints{"rt/points", true};
const std::string kCloud = name_of_type("sensor_msgs/PointCloud2");
const std::string kLivox = name_of_type("livox_ros_driver2/CustomMsg");

Endpoints::Guid guid(std::uint8_t number) { return {number}; }

/// "/points: RELIABILITY" or "/points: my_msgs/Own".
std::string line(const Misfit& one) {
  return one.topic + ": " + (one.policy.empty() ? one.other_type : one.policy);
}

struct Found {
  std::vector<std::string> told;
  Endpoints endpoints{[this](const Misfit& one) { told.push_back(line(one)); }};

  [[nodiscard]] std::vector<std::string> now() const {
    std::vector<std::string> lines;
    for (const Misfit& one : endpoints.misfits()) lines.push_back(line(one));
    return lines;
  }
};

using Lines = std::vector<std::string>;

TEST_CASE("types have the names of ROS 2, whatever they are on the wire") {
  CHECK(type_of_name(kCloud) == "sensor_msgs/PointCloud2");
  CHECK(type_of_name(name_of_type("std_srvs/SetBool", "srv", "_Request")) ==
        "std_srvs/SetBool_Request");
  for (const char* foreign : {"", "Cloud", "a::msg::dds_::B", "a::b::C_"}) {
    CHECK(type_of_name(foreign) == foreign);
  }
}

TEST_CASE("an endpoint of another type does not fit, whichever was there first") {
  for (const bool is_first : {true, false}) {
    Found found;
    if (!is_first) found.endpoints.add(kPoints, "/points", kCloud);
    found.endpoints.find(guid(1), "rt/points", kLivox, true);
    found.endpoints.find(guid(1), "rt/points", kLivox, true);   // its QoS changed
    found.endpoints.find(guid(2), "rt/points", kLivox, false);  // reads, as this node does
    found.endpoints.find(guid(3), "rt/other", kLivox, true);
    found.endpoints.find(guid(4), "rt/points", kCloud, true);
    found.endpoints.match(guid(4));
    if (is_first) found.endpoints.add(kPoints, "/points", kCloud);
    CHECK(found.told == Lines{"/points: livox_ros_driver2/CustomMsg"});
    CHECK(found.now() == Lines{"/points: livox_ros_driver2/CustomMsg"});
    REQUIRE(found.endpoints.misfits().size() == 1);
    CHECK(found.endpoints.misfits()[0].own_type == "sensor_msgs/PointCloud2");
    CHECK(found.endpoints.misfits()[0].is_read);
    found.endpoints.lose(guid(1));
    CHECK(found.now().empty());
  }
}

TEST_CASE("all policies by which endpoints do not fit are told, each time") {
  Found found;
  found.endpoints.add(kPoints, "/points", kCloud);
  found.endpoints.find(guid(1), "rt/points", kCloud, true);
  CHECK(found.now().empty());
  found.endpoints.refuse(kPoints, {{"DURABILITY", 1}, {"RELIABILITY", 1}});
  const Lines both{"/points: DURABILITY", "/points: RELIABILITY"};
  CHECK(found.told == both);
  CHECK(found.now() == both);
  found.endpoints.find(guid(2), "rt/points", kCloud, true);
  found.endpoints.refuse(kPoints, {{"DURABILITY", 1}, {"RELIABILITY", 2}});
  CHECK(found.told.size() == 3);
  CHECK(found.told.back() == "/points: RELIABILITY");

  found.endpoints.find(guid(3), "rt/points", kCloud, true);
  found.endpoints.match(guid(3));
  found.endpoints.lose(guid(1));
  CHECK(found.now() == Lines{"/points: RELIABILITY"});  // the other one is still there
  found.endpoints.lose(guid(2));
  CHECK(found.now().empty());
  found.endpoints.unmatch(guid(3));
  CHECK(found.now().empty());  // its policies are not those of the ones that went
}

}  // namespace
}  // namespace vantage::dds
