#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "view/colors.hpp"
#include "view/contributions.hpp"
#include "view/controls.hpp"
#include "view/thinning.hpp"

namespace vantage::view {

/// The points to draw, around the origin of their scene [m].
struct Drawing {
  PointCloud points;
  std::vector<std::uint32_t> regions;  ///< the region whose footprint contains each point,
                                       ///< otherwise the nearest; or empty
  /// How many viewpoints see each point if the bundle says so, otherwise how many region maps
  /// contain it; empty if not counted.
  std::vector<std::uint32_t> views;
  /// The expected error at the nearest site of the atlas [m]: infinite where a scan matches
  /// nothing. Empty without sites.
  std::vector<double> expected_errors;
  /// The sum of the leverages of each point, an element; empty for points of a map.
  std::vector<double> leverages;
  PointCloud viewpoints;  ///< of the one region that is drawn
  bool thinned = false;   ///< not all points are drawn
};

/// A bundle or a point cloud, and what is drawn of it: its points, or elements of its prepared maps
/// once it is known what they contribute. Coordinates may be large (UTM). What is
/// drawn lies around `origin()`, where the float32 of graphics is precise.
class Scene {
 public:
  /// Errors: those of Bundle::open.
  [[nodiscard]] static Result<Scene> open_bundle(const std::filesystem::path& folder,
                                                 const PluginLoader& plugins,
                                                 std::size_t max_points);
  /// Errors: those of io::read_point_cloud; `invalid_input` for no finite point.
  [[nodiscard]] static Result<Scene> open_cloud(const std::filesystem::path& file,
                                                std::size_t max_points);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// None for a cloud.
  [[nodiscard]] const std::optional<Bundle>& bundle() const noexcept { return bundle_; }
  /// Of the bundle. Precondition: there is one.
  [[nodiscard]] const MapIndex& index() const noexcept { return *index_; }
  /// Of the bundle; none if it was built without one, or if it cannot be read.
  [[nodiscard]] const std::optional<Atlas>& atlas() const noexcept { return atlas_; }
  /// Errors: those of Atlas::of_bundle; `not_found`, with what to do, if there is no site.
  [[nodiscard]] Result<void> need_atlas() const;
  /// Errors: `unsupported`, with what to do, for a bundle that contains no points, only what a
  /// matcher made of them.
  [[nodiscard]] Result<void> need_points() const;
  /// From now on, elements are drawn instead of points. Precondition: there is a bundle.
  void show(Contributions contributions) { contributions_ = std::move(contributions); }
  [[nodiscard]] const std::optional<Contributions>& contributions() const noexcept {
    return contributions_;
  }
  /// Whole metres, map frame.
  [[nodiscard]] const Point& origin() const noexcept { return origin_; }
  /// The number of points of the cloud or of the wide-area map.
  [[nodiscard]] std::uint64_t total_points() const noexcept { return total_; }
  [[nodiscard]] std::uint64_t dropped_points() const noexcept { return dropped_; }
  /// Hues by region id.
  [[nodiscard]] const std::vector<double>& hues() const noexcept { return hues_; }

  /// The points of all region maps, each place once (see PointTable), or of one region's map. If
  /// the bundle does not say how many viewpoints see a point, counting reads every region's map
  /// once. In that case, only those points of a region are drawn that are also drawn of the whole.
  /// Of elements, the strongest are drawn.
  /// Errors: those of the store; `unsupported` for a region without points; `not_found` for one
  /// that no scan counts in.
  [[nodiscard]] Result<Drawing> draw(const std::optional<RegionId>& region, bool count_views,
                                     const Bundle::Progress& progress = {});

 private:
  Scene() = default;
  [[nodiscard]] Result<void> read_all(const Bundle::Progress& progress);
  [[nodiscard]] Result<Drawing> draw_region(RegionId region, bool count_views,
                                            const Bundle::Progress& progress);
  [[nodiscard]] Result<Drawing> draw_elements(const std::optional<RegionId>& region) const;
  [[nodiscard]] Drawing around_origin(PointsView points) const;

  std::string name_;
  std::optional<Bundle> bundle_;
  std::shared_ptr<const MapIndex> index_;  // of the bundle
  std::optional<Atlas> atlas_;
  std::optional<Error> no_atlas_;  // why no localizability can be shown
  std::optional<Contributions> contributions_;
  std::optional<PointTable> table_;  // of everything, after it was read
  std::size_t max_points_ = 1;
  std::uint64_t total_ = 0, dropped_ = 0;
  Point origin_ = Point::Zero();
  std::vector<double> hues_;
};

/// The scales that colour a drawing.
struct Scales {
  Range height;        ///< [m] around the origin
  Range views;         ///< starts at 1 region map or viewpoint
  Range contribution;  ///< decimal logarithm of leverages, two decades
};
[[nodiscard]] Scales scales_of(const Drawing& drawing);

/// Where an expected error stands between these two, by its logarithm: 0 .. 1. The same in every
/// map, so that pictures compare.
inline constexpr double kLeastError = 0.01, kLargestError = 1.0;  // [m]
[[nodiscard]] double share_of_error(double expected_error) noexcept;

/// A colour for each point: height by `viridis`, views and contribution by `magma`, region by its
/// hue, expected error by `badness`; the latter two are darker for low points and lighter for high
/// ones.
[[nodiscard]] std::vector<Color> colors_of(const Drawing& drawing, Coloring coloring,
                                           const Scales& scales, const std::vector<double>& hues);

}  // namespace vantage::view
