#pragma once

#include <string>

#include "vantage/evaluation/evaluation.hpp"
#include "vantage/result.hpp"

namespace vantage::page {

/// Fig. 9: the specimen of each configuration from above, over the wide-area map, all at one scale.
/// Errors: those of report::density_picture.
[[nodiscard]] Result<std::string> region_maps(const Evaluation& evaluation);

/// The trajectory of each configuration on each route over the map, coloured by error.
/// Errors: as above.
[[nodiscard]] Result<std::string> trajectories(const Evaluation& evaluation);

/// The sites of each configuration's atlas over the map, coloured by expected error, with the
/// routes; empty if no bundle has an atlas. Errors: as above.
[[nodiscard]] Result<std::string> localizability(const Evaluation& evaluation);

/// Map, region maps and trajectories that can be turned in the browser: the body of the section,
/// and the scripts that the page needs for it.
struct View3d {
  std::string body, scripts;
};
[[nodiscard]] View3d view_3d(const Evaluation& evaluation);

}  // namespace vantage::page
