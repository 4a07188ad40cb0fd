#include "localize/share_model.hpp"

#include <doctest/doctest.h>

using namespace vantage;

namespace {

/// Right shares from 0.6 to 0.9, and wrong ones that are exponential.
Calibration calibration_of(std::uint64_t samples, double wrong_mean) {
  Calibration calibration;
  calibration.right_samples = calibration.wrong_samples = samples;
  for (std::size_t k = 0; k < Calibration::kQuantiles; ++k) {
    const double part =
        (static_cast<double>(k) + 0.5) / static_cast<double>(Calibration::kQuantiles);
    calibration.right.push_back(0.6 + 0.3 * part);
    calibration.wrong.push_back(-wrong_mean * std::log(1.0 - part));
  }
  return calibration;
}

}  // namespace

TEST_CASE("without samples the model is the default, and a few change little") {
  const ShareModel usual, none = fitted_model({});
  CHECK(none.wrong_scale == usual.wrong_scale);
  CHECK(none.alike == usual.alike);
  const ShareModel few = fitted_model(calibration_of(5, 0.1));
  CHECK(few.wrong_scale == doctest::Approx(usual.wrong_scale).epsilon(0.1));
  CHECK(few.similar == doctest::Approx(usual.similar).epsilon(0.3));
  CHECK(few.alike < 1e-3);
  CHECK(few.least_right == usual.least_right);
}

TEST_CASE("where wrong poses fit better, the same share speaks less for a pose") {
  const ShareModel usual, clear = fitted_model(calibration_of(2000, 0.01)),
                          vague = fitted_model(calibration_of(2000, 0.08));
  CHECK(clear.similar < usual.similar);
  CHECK(vague.similar > usual.similar);
  CHECK(vague.similar_scale > usual.similar_scale);
  const auto ratio = [](const ShareModel& model) {
    return log_likelihood_ratio({.share = 0.3, .noise = 0.0}, model);
  };
  CHECK(ratio(clear) >= ratio(usual));
  CHECK(ratio(vague) < ratio(usual) - 0.5);
}

TEST_CASE("a map with places that are alike makes no pose certain by its fit") {
  Calibration calibration = calibration_of(10000, 0.01);
  for (std::size_t k = 24; k < Calibration::kQuantiles; ++k) calibration.wrong[k] = 0.7;
  const ShareModel alike = fitted_model(calibration);
  CHECK(alike.alike > 0.1);
  CHECK(log_likelihood_ratio({.share = 0.8, .noise = 0.0}, alike) < 2.5);
}

TEST_CASE("right poses may be less sharp than usual, and shares of thin scans are scaled") {
  Calibration calibration = calibration_of(20000, 0.01);
  for (double& share : calibration.right) share *= 0.05;
  CHECK(fitted_model(calibration).least_right < 0.03);
  calibration = calibration_of(20000, 0.01);
  Calibration thin = calibration;
  for (double& share : thin.right) share *= 2.0;
  for (double& share : thin.wrong) share *= 2.0;
  CHECK(fitted_model(thin).wrong_scale ==
        doctest::Approx(fitted_model(calibration).wrong_scale).epsilon(0.02));
}
