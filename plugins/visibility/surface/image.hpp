#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

namespace vantage::surface {

/// A rectangle of directions [pixels]. Azimuths wrap around.
struct Footprint {
  float left, right;  ///< of the azimuth; left >= -columns / 2, right <= 3 / 2 columns
  float bottom, top;  ///< of the elevation
};

/// Optical depths in all directions. It remembers the pixels behind which nothing can be seen.
class Image {
 public:
  static constexpr int kColumns = 720, kRows = kColumns / 2;           // half a degree each
  static constexpr double kPixel = 2.0 * std::numbers::pi / kColumns;  // [rad]

  Image();

  /// Everything is clear, and no depth hides everything.
  void clear();
  void cast(const Footprint& of, float depth);
  /// The share of a footprint's size that the depths leave.
  [[nodiscard]] float passed(const Footprint& of) const;

  /// From now on, nothing can be seen behind this depth.
  /// @param bottom, top  of all footprints that will be asked about; [pixels]
  void hide_behind(float depth, float bottom, float top);
  /// Whether nothing can be seen in any pixel of a footprint.
  [[nodiscard]] bool hides(const Footprint& footprint) const;

 private:
  static constexpr std::size_t kWords = (kColumns + 63) / 64;  // of a row of `hidden_`

  template <class Visit>
  static void for_rows(const Footprint& of, const Visit& visit);
  [[nodiscard]] bool hides(std::size_t row, int first, int last) const;

  std::vector<float> depths_;          ///< row by row
  std::vector<std::uint64_t> hidden_;  ///< a bit for each pixel, row by row
  float hides_all_;                    ///< depth behind which nothing can be seen
};

}  // namespace vantage::surface
