#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "elements.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::surface {

struct Settings {
  double min_size = 0.0;   ///< smallest visible size that counts as seen, for 0.09 m^2 [sr]
  double thickness = 0.0;  ///< of a surface's points; thicker shapes are clutter [m]
  double max_range = 0.0;  ///< [m]
};

/// How a shape shows and hides, whatever the viewpoint.
struct Optics {
  float roughness = 1.0F;   ///< share of its face that it shows and hides when seen edge-on
  float brightness = 0.0F;  ///< visible size of 0.09 m^2 of it at 1 m, seen face on [sr]
  float depth = 0.0F;       ///< optical depth for everything behind it

  /// @param width      of the element's cell [m]
  /// @param thickness  of a surface's points [m]
  [[nodiscard]] static Optics of(const Shape& shape, double width, double thickness) noexcept;
};

/// Looks at elements from one viewpoint after another. It reuses its memory: use one object per
/// thread.
class Sight {
 public:
  /// @param optics  of the elements
  Sight(PointsView map, const Elements& elements, std::span<const Optics> optics,
        const Settings& settings);

  /// What is seen of the map from one viewpoint.
  struct Seen {
    std::span<const std::uint32_t> elements;  ///< elements whose points are all seen, in no
                                              ///< particular order
    std::span<const std::uint32_t> points;    ///< points of elements that the range cuts, in no
                                              ///< particular order
  };
  /// @param is_known  elements that need no answer and are skipped; may be empty
  /// @return          valid until the next call
  [[nodiscard]] Seen look(const Point& viewpoint,
                          const std::function<bool(std::uint32_t)>& is_known = {});

 private:
  /// An element as seen from the viewpoint.
  struct Appearance {
    std::uint32_t element;
    std::uint32_t cut;              ///< its index in `cut_`, or kWhole
    float azimuth, elevation;       ///< [pixels]
    float half_width, half_height;  ///< [pixels]
    float size;                     ///< if nothing is in front of it [sr]; 0 if the size does not
                                    ///< matter
    float depth;                    ///< optical depth for everything behind it
    float read_at, cast_at;         ///< the distances from which on it is decided, and hides others
                                    ///< [m]
  };
  struct Cut {
    std::uint32_t begin, end;  ///< of `cut_points_`
  };

  void appear(std::uint32_t element, const Shape& shape, const Optics& optics, Part part,
              std::uint32_t cut, const Point& viewpoint, bool is_wanted);
  void cut(std::uint32_t element, const Point& viewpoint);
  void sort_into_bins();
  [[nodiscard]] float passed(const Appearance& of) const;
  void cast(const Appearance& of);
  template <class Visit>
  void for_pixels(const Appearance& of, const Visit& visit) const;

  PointsView map_;
  const Elements& elements_;
  std::span<const Optics> optics_;
  Settings settings_;
  double reach_;  ///< nothing farther away is large enough [m]

  std::vector<float> image_;  ///< optical depth so far, row by row
  std::vector<Appearance> appearances_;
  std::vector<std::uint32_t> reads_, casts_;  ///< of `appearances_`, by bin
  std::vector<std::uint32_t> reads_begin_, casts_begin_;
  std::vector<Cut> cut_;
  std::vector<std::uint32_t> cut_points_;
  std::vector<std::uint32_t> seen_elements_, seen_points_;
};

}  // namespace vantage::surface
