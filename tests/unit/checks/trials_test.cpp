#include "checks/trials.hpp"

#include <doctest/doctest.h>

namespace vantage::checks {
namespace {

Fit fit(double goodness, std::size_t tracked, std::size_t found) {
  Fit fit;
  fit.scans = 10;
  fit.tracked = tracked;
  fit.found = found;
  fit.coverage = goodness;
  fit.nvtl = 1.0;
  return fit;
}

TEST_CASE("a change is named if the scans fit clearly better with it") {
  constexpr std::size_t kHalf = 5;
  CHECK(fits_better(fit(1.25, 10, 10), fit(0.1, 0, 0), kHalf));
  CHECK(fits_better(fit(0.5, 0, 6), fit(0.4, 0, 3), kHalf));
  // Sparse scans in feet: some are found at wrong poses, which fit badly.
  CHECK(fits_better(fit(0.51, 0, 6), fit(0.09, 2, 4), kHalf));
}

TEST_CASE("a change is not named if scans fit as well without it, or if few are found with it") {
  constexpr std::size_t kHalf = 5;
  CHECK_FALSE(fits_better(fit(0.5, 0, 6), fit(0.4, 2, 4), kHalf));
  CHECK_FALSE(fits_better(fit(0.5, 0, 4), fit(0.09, 2, 4), kHalf));
  CHECK_FALSE(fits_better(fit(1.0, 0, 0), fit(0.09, 2, 4), kHalf));
  CHECK_FALSE(fits_better(fit(0.51, 0, 4), fit(0.09, 0, 2), kHalf));
}

TEST_CASE("scans that are not found may lie outside the map, or only begin there") {
  const auto note = note_on_place(fit(0.0, 0, 1));
  REQUIRE(note);
  CHECK(note->what.starts_with("one of the first 10 scans is found in the map"));
  CHECK(note->advice ==
        "is it the map of this place? If the recording only begins outside it, skip that part with "
        "`--start SECONDS`");
  CHECK_FALSE(note_on_place(fit(0.0, 0, 2)));
}

}  // namespace
}  // namespace vantage::checks
