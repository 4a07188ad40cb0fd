#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test {

/// A street of 60 m between house fronts, with scans of everything near along its middle: small
/// enough for a test, rich enough to be localized in.
class Street {
 public:
  /// Its fronts are alike every 14 m, which is less than a scan sees; posts differ.
  /// @param with_kiosk  which no other place has
  explicit Street(bool with_kiosk = false);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder() / name).string();
  }

  /// A configuration whose bundle lies in `bundle`; `extra` is appended.
  std::string write_config(const std::string& name, double cell_width, const std::string& bundle,
                           const std::string& extra = {}) const;

  /// `vantage-localize CONFIG --scans ... --reference ... --out OUT MORE...`
  [[nodiscard]] Finished localize(const std::string& config, const std::string& out,
                                  std::vector<std::string> more = {}) const;

  static constexpr int kScans = 40;

 private:
  TemporaryFolder folder_;
};

}  // namespace vantage::test
