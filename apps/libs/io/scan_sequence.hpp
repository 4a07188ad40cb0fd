#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Recorded scans as files, in the order in which they were taken.
/// Thread safety: const methods may run on one object from many threads at once.
class ScanSequence {
 public:
  /// @param path     a directory, whose .pcd, .ply and .bin files are taken in the order of their
  ///                 names (`sort_scans`) and whose other files are ignored; or one such file
  /// @param rate_hz  scans per second, for the rules that need it; > 0
  /// @param stamped  see ScanOptions
  ///
  /// Stamps come from the first rule that applies:
  /// 1. `times.txt` in the directory, else in its parent: one stamp [s] per line, one line per scan
  /// 2. the names, if they are numbers (`stamps_from_names`)
  /// 3. index / rate_hz
  /// A single file does not use `times.txt`; the other rules apply.
  /// Errors: `invalid_input` for a bad rate; `not_found` for a missing path or a directory without
  /// scans; `corrupt_data` for stamps that are malformed, too few, too many or not strictly
  /// increasing; `io_failure`.
  [[nodiscard]] static Result<ScanSequence> open(const std::filesystem::path& path, double rate_hz,
                                                 std::optional<StampedPoint> stamped = {});

  [[nodiscard]] std::size_t size() const noexcept { return names_.size(); }
  /// A sentence that says where the stamps come from.
  [[nodiscard]] const std::string& stamp_rule() const noexcept { return stamp_rule_; }
  /// [s]; strictly increasing. Precondition: i < size().
  [[nodiscard]] double stamp(std::size_t i) const noexcept { return stamps_[i]; }
  /// Precondition: i < size().
  [[nodiscard]] std::filesystem::path file(std::size_t i) const { return folder_ / names_[i]; }
  /// Errors: `invalid_input` for i >= size(); those of read_point_cloud and seconds_after.
  [[nodiscard]] Result<StampedScan> read(std::size_t i) const;

 private:
  ScanSequence() = default;

  std::filesystem::path folder_;
  std::vector<std::string> names_;
  std::vector<double> stamps_;
  std::string stamp_rule_;
  std::optional<StampedPoint> stamped_;
};

/// A strict total order in which runs of digits compare by value: "a2" < "a10", "1" < "01".
[[nodiscard]] bool less_by_natural_order(std::string_view a, std::string_view b) noexcept;

}  // namespace vantage::io
