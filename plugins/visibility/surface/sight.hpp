#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "blocks.hpp"
#include "elements.hpp"
#include "image.hpp"
#include "optics.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::surface {

struct Settings {
  double min_size = 0.0;   ///< smallest visible size that counts as seen, for 0.09 m^2 [sr]
  double thickness = 0.0;  ///< of a surface's points; thicker shapes are clutter [m]
  double max_range = 0.0;  ///< [m]

  /// Nothing farther away is large enough [m].
  [[nodiscard]] double reach() const noexcept;
};

/// Looks at elements from one viewpoint after another. It reuses its memory: use one object per
/// thread.
class Sight {
 public:
  Sight(PointsView map, const Elements& elements, const Blocks& blocks, const Settings& settings);

  /// Finds what is seen of the map from one viewpoint.
  /// @param known  receives the elements whose points are all seen; those that it has are skipped
  /// @return       the points that are seen of elements that the range cuts, in no particular
  ///               order; valid until the next call
  [[nodiscard]] std::span<const std::uint32_t> look(const Point& viewpoint, Known& known);

 private:
  /// A block in reach of the viewpoint.
  struct Near {
    std::uint32_t block;
    std::uint32_t shift;             ///< of its row, in `Known`
    float distance, far;             ///< of its box, nearest and farthest [m]
    std::array<float, 3> low, high;  ///< its box, from the viewpoint [m]
  };
  /// How elements of a block appear from the viewpoint.
  struct Appearances;
  /// An element as seen from the viewpoint.
  struct Appearance {
    Footprint footprint;
    std::uint32_t place;  ///< in `Known`, or the index in `cut_` of a cut element
    bool is_cut;
    float size;   ///< if nothing is in front of it [sr]; 0 if the size does not matter
    float depth;  ///< optical depth for everything behind it
    std::uint32_t next_read, next_cast;  ///< of the same bin
  };
  struct Cut {
    std::uint32_t begin, end;  ///< of `cut_points_`
  };
  /// Appearances of one bin are a list, the last one added first.
  struct Bin {
    std::uint32_t read, cast;
  };

  void gather(const Point& viewpoint, const Known& known);
  void sort_by_distance();
  void sweep(const Point& viewpoint, Known& known);
  [[nodiscard]] bool is_hidden(const Near& near) const;
  void expand(const Near& near, const Point& viewpoint, const Known& known);
  void add(const Appearances& of, std::size_t lane, std::uint32_t place, bool is_cut);
  void cut(std::uint32_t element, const Point& viewpoint);
  [[nodiscard]] std::size_t bin_of(float distance) const noexcept;

  PointsView map_;
  const Elements& elements_;
  const Blocks& blocks_;
  Settings settings_;
  double radius_;  ///< of a cell, around its centre [m]
  double reach_;   ///< nothing farther away is large enough [m]
  float min_size_;

  Image image_;
  bool is_at_point_ = false;  ///< a point of the map is the viewpoint
  std::vector<Near> nears_;
  std::vector<std::uint32_t> order_, order_begin_;  ///< of `nears_`, by bin
  float nearest_ = 0.0F;                            ///< distance at which bins begin [m]
  std::size_t bin_ = 0;                             ///< that is being looked at
  std::vector<Bin> bins_;
  std::vector<Appearance> appearances_;
  std::vector<Cut> cut_;
  std::vector<std::uint32_t> cut_points_, seen_points_;
};

}  // namespace vantage::surface
