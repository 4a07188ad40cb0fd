#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

#include "support/plugins.hpp"
#include "vantage/visibility.hpp"

namespace vantage::test {
namespace {

std::string error_of(const std::string& plugin_name, const std::string& params) {
  try {
    (void)plugin<VisibilityOperator>(plugin_name, params);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

TEST_CASE("parameters of hpr") {
  CHECK(error_of("hpr", "").empty());
  CHECK(error_of("hpr", "alpha = 100").empty());
  CHECK(error_of("hpr", "gap = 0.3\nangular_spacing = 0.4").empty());
  CHECK(error_of("hpr", "kernel = \"inversion\"\nalpha = 100.0").empty());

  const auto mentions = [](const std::string& text, const std::string& word) {
    return text.find(word) != std::string::npos;
  };
  CHECK(mentions(error_of("hpr", "alpha = 100.0\ngap = 0.3\nangular_spacing = 0.4"), "only one"));
  CHECK(mentions(error_of("hpr", "gap = 0.3"), "angular_spacing"));
  CHECK(mentions(error_of("hpr", "angular_spacing = 0.3"), "gap"));
  CHECK(mentions(error_of("hpr", "alpha = 0.5"), "alpha"));
  CHECK(mentions(error_of("hpr", "alpha = 1e7"), "alpha"));
  CHECK(mentions(error_of("hpr", "gap = 0.0\nangular_spacing = 0.4"), "gap"));
  CHECK(mentions(error_of("hpr", "gap = 0.3\nangular_spacing = 90.0"), "angular_spacing"));
  CHECK(mentions(error_of("hpr", "kernel = \"spherical\""), "spherical_flip"));
  CHECK(mentions(error_of("hpr", "alhpa = 3.0"), "alpha"));
}

TEST_CASE("keep_all has no parameters") {
  CHECK(error_of("keep_all", "").empty());
  CHECK(!error_of("keep_all", "max_range = 3.0").empty());
}

}  // namespace
}  // namespace vantage::test
