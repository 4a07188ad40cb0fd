#include "view/contributions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "localizability/localizability.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/io/read_ahead.hpp"
#include "view/leverage.hpp"
#include "view/posed_scan.hpp"

namespace vantage::view {
namespace {

/// What is known of the elements of one region's map.
struct Sums {
  struct Element {
    double leverage = 0.0;
    std::optional<Point> middle;
  };
  std::size_t scans = 0;
  std::unordered_map<std::uint32_t, Element> elements;

  [[nodiscard]] Contributions::Part part(RegionId region) const {
    Contributions::Part part{.region = region, .scans = scans, .elements = {}};
    for (const auto& [number, element] : elements) {
      if (element.middle) {
        part.elements.push_back({*element.middle, element.leverage});
      } else {
        part.elsewhere += element.leverage;
      }
    }
    return part;
  }
};

/// False if the map does not fix the scan's pose.
Result<bool> add(const PosedScan& scan, const MatchTarget& target, Sums& sums) {
  if (scan.points.empty()) return false;
  VANTAGE_TRY(const auto pulls, target.pulls(scan.points, scan.T_map_scan));
  const std::vector<double> leverages = leverages_of(pulls);
  if (leverages.empty()) return false;
  PointCloud there;
  there.reserve(scan.points.size());
  const Eigen::Matrix3d R = scan.T_map_scan.rotation.toRotationMatrix();
  for (const Point& p : scan.points) there.push_back(R * p + scan.T_map_scan.translation);
  VANTAGE_TRY(const auto met, target.elements_at(there));
  for (const MapElement& element : met) sums.elements[element.number].middle = element.middle;
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    sums.elements[pulls[i].element].leverage += leverages[i];
  }
  ++sums.scans;
  return true;
}

/// The scans of a recording.
struct Stamps {
  std::size_t scans = 0;
  double first = 0.0, last = 0.0;  // [s]

  void add(double stamp) {
    if (scans++ == 0) first = stamp;
    last = stamp;
  }
};

/// Names the matcher in the error of one that does not tell what its elements do.
Error explained(Error error, const std::string& matcher, const std::string& bundle) {
  if (error.code != ErrorCode::unsupported) return error;
  error.message = "the bundle is for " + matcher + ", and " + error.message + " to a pose";
  error.where = SourceLocation{bundle, 0, 0};
  return error;
}

Error no_scan_counts(const Contributions& found, const Stamps& stamps, const RunInputs& inputs) {
  return {.code = ErrorCode::invalid_input,
          .message = fmt::format(
              "none of the {} scans counts: {} without a pose, {} in no region with a map, {} not "
              "fixed by the map; the scans are stamped {:.3f} to {:.3f} s, the reference has poses "
              "from {:.3f} to {:.3f} s",
              stamps.scans, found.without_pose, found.outside, found.loose, stamps.first,
              stamps.last, inputs.reference->front().stamp, inputs.reference->back().stamp),
          .where = SourceLocation{inputs.scans.path.string(), 0, 0},
          .context = {}};
}

}  // namespace

std::size_t Contributions::scans(const std::optional<RegionId>& region) const {
  std::size_t sum = 0;
  for (const Part& part : parts) sum += !region || part.region == *region ? part.scans : 0;
  return sum;
}

double Contributions::elsewhere(const std::optional<RegionId>& region) const {
  double sum = 0.0;
  for (const Part& part : parts) sum += !region || part.region == *region ? part.elsewhere : 0.0;
  return sum;
}

std::vector<Contribution> Contributions::elements(const std::optional<RegionId>& region) const {
  constexpr double kCubes = 100.0;  // along a metre
  std::vector<std::pair<std::array<std::int64_t, 3>, Contribution>> placed;
  for (const Part& part : parts) {
    if (region && part.region != *region) continue;
    for (const Contribution& element : part.elements) {
      const Point cube = kCubes * element.middle;
      placed.push_back(
          {{std::llround(cube.x()), std::llround(cube.y()), std::llround(cube.z())}, element});
    }
  }
  std::ranges::stable_sort(placed, {}, &decltype(placed)::value_type::first);
  std::vector<Contribution> elements;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (i > 0 && placed[i].first == placed[i - 1].first) {
      elements.back().leverage += placed[i].second.leverage;
    } else {
      elements.push_back(placed[i].second);
    }
  }
  return elements;
}

Result<PluginChoice> matcher_of(const Bundle& bundle, const std::optional<Atlas>& atlas) {
  const auto& built = bundle.built_with();
  if (built && built->matcher) return *built->matcher;
  if (!atlas) {
    return fail(ErrorCode::not_found,
                std::string("the bundle does not say its matcher, because it holds points and no "
                            "atlas: ") +
                    kHowToGetAnAtlas,
                SourceLocation{bundle.name(), 0, 0});
  }
  const MatcherChoice& measured = atlas->matcher;
  VANTAGE_TRY(Table params, parse_toml(measured.params, bundle.name()));
  return PluginChoice{
      .plugin = measured.plugin, .library = {}, .params = std::move(params), .where = {}};
}

Result<Contributions> contributions_to(const RunInputs& inputs, const Bundle& bundle,
                                       const PluginChoice& matcher, const PluginLoader& plugins,
                                       const ScanProgress& progress) {
  VANTAGE_TRY(auto opened, inputs.opened ? inputs.opened->take() : io::open_scans(inputs.scans));
  const auto source = io::read_ahead(std::move(opened));
  VANTAGE_TRY(const auto index, bundle.index());
  VANTAGE_TRY(const auto plugin, plugins.load<ScanMatcher>(matcher));
  Contributions found{.matcher = matcher.plugin, .parts = {}};
  std::map<RegionId, Sums> sums;
  std::optional<RegionId> here;
  std::shared_ptr<const ReadyRegion> map;  // of that region
  Stamps stamps;
  while (true) {
    VANTAGE_TRY(const auto recorded, source->next());
    if (!recorded) break;
    stamps.add(recorded->stamp);
    if (progress) progress(stamps.scans, source->describe().scans.value_or(0));
    VANTAGE_TRY(const auto scan, posed_scan(*recorded, *inputs.reference));
    if (!scan) {
      ++found.without_pose;
      continue;
    }
    const auto region = index->partition.locate(scan->T_map_scan.translation);
    if (!region || index->regions[region->value].empty()) {
      ++found.outside;
      continue;
    }
    if (here != region) {
      map.reset();
      VANTAGE_TRY(map, make_ready(bundle.reader(), plugin, *region));
      here = region;
    }
    const auto counts = add(*scan, *map->target, sums[*region]);
    if (!counts) return fail(explained(counts.error(), matcher.plugin, bundle.name()));
    if (!*counts) ++found.loose;
  }
  for (const auto& [region, of_region] : sums) {
    if (of_region.scans > 0) found.parts.push_back(of_region.part(region));
  }
  if (found.parts.empty()) return fail(no_scan_counts(found, stamps, inputs));
  return found;
}

double strongest(std::span<const Contribution> elements, double part) {
  std::vector<double> leverages;
  for (const Contribution& element : elements) leverages.push_back(element.leverage);
  const auto some =
      static_cast<std::ptrdiff_t>(std::ceil(part * static_cast<double>(leverages.size())));
  std::ranges::nth_element(leverages, leverages.begin() + some, std::greater());
  return std::accumulate(leverages.begin(), leverages.begin() + some, 0.0);
}

}  // namespace vantage::view
