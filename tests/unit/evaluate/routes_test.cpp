#include "evaluate/route_options.hpp"

#include <doctest/doctest.h>

using namespace vantage;

TEST_CASE("routes are called by their folders, or by those these are in") {
  using Names = std::vector<std::string>;
  CHECK(route_names({"/data/monday", "/data/tuesday/"}).value() == Names{"monday", "tuesday"});
  CHECK(route_names({"/data/r0/scans", "/data/r1/scans"}).value() == Names{"r0", "r1"});
  CHECK(route_names({"/data/street/scans/"}).value() == Names{"street"});
  CHECK(route_names({"/data/street/one.pcd"}).value() == Names{"one"});
  CHECK_FALSE(route_names({"/a/x/scans", "/b/x/scans"}));
  CHECK_FALSE(route_names({"/data/x", "/data/x"}));
}

TEST_CASE("routes: as many references, odometries and names as scans") {
  RouteOptions options;
  options.scans = {"/a/s", "/b/t"};
  options.references = {"/a/ref.tum"};
  auto opened = options.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message.find("--reference is given 1 times for 2 --scans") !=
        std::string::npos);
  options.references = {"/a/ref.tum", "/b/ref.tum"};
  options.priors = {"/a/gnss.tum"};
  opened = options.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message.find("--prior is given 1 times for 2 --scans") != std::string::npos);
  options.priors = {};
  options.names = {"x", "x"};
  opened = options.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message.find("same name") != std::string::npos);
  options.names = {"x", "../y"};
  opened = options.open();
  REQUIRE_FALSE(opened);
}
