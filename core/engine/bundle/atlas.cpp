#include "vantage/engine/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "vantage/kit/byte_io.hpp"

namespace vantage {
namespace {

// The last character is the version.
constexpr std::string_view kAtlasFormat = "vatlas02";

tl::unexpected<Error> no_atlas(const char* reason) {
  return fail(ErrorCode::corrupt_data, std::string("the bundle's atlas ") + reason);
}

template <class Archive, class Precision>
void describe_precision(Archive& archive, Precision& precision) {
  archive.field(precision.expected_error, 0.0);
  archive.field(precision.sigma_strong, 0.0);
  archive.field(precision.sigma_weak, precision.sigma_strong);
  archive.field(precision.weak_direction, 0.0);
  archive.check(precision.weak_direction < std::numbers::pi);
  archive.field(precision.basin, 0.0);
}

// Of a site without precision and alike places.
constexpr std::size_t kLeastSiteBytes =
    sizeof(std::uint32_t) + 3 * sizeof(double) + 1 + sizeof(std::uint64_t);
constexpr std::size_t kAlikeBytes = 8 * sizeof(double);

template <class Archive, class OneSite>
void describe_site(Archive& archive, OneSite& site) {
  archive.field(site.region.value);
  archive.field(site.position);
  std::uint8_t measured = site.precision ? 1 : 0;
  archive.field(measured);
  archive.check(measured <= 1);
  if constexpr (Archive::kReads) {
    if (measured == 1) site.precision.emplace();
  }
  if (site.precision) describe_precision(archive, *site.precision);
  double likest = std::numeric_limits<double>::infinity();
  archive.list(site.alike, kAlikeBytes, [&](auto& place) {
    archive.field(place.T_map_scan);
    archive.field(place.likeness, 0.0);
    archive.check(place.likeness > 0.0 && place.likeness <= likest);
    likest = place.likeness;
  });
}

template <class Archive, class Whole>
void describe_atlas(Archive& archive, Whole& atlas) {
  archive.field(atlas.matcher.plugin);
  archive.field(atlas.matcher.params);
  RegionId before;
  archive.list(atlas.sites, kLeastSiteBytes, [&](auto& site) {
    describe_site(archive, site);
    archive.check(before <= site.region);
    before = site.region;
  });
}

}  // namespace

std::vector<std::byte> Atlas::encode() const {
  ByteWriter to;
  to.raw(kAtlasFormat);
  describe_atlas(to, *this);
  return std::move(to).take();
}

Result<Atlas> Atlas::decode(std::span<const std::byte> bytes) {
  ByteReader from(bytes);
  const std::string_view format = from.raw(kAtlasFormat.size());
  if (!from.ok()) return no_atlas("is cut off");
  if (format != kAtlasFormat) return no_atlas("is of another version");
  Atlas atlas;
  describe_atlas(from, atlas);
  if (!from.ok() || from.left() != 0) return no_atlas("is damaged");
  return atlas;
}

Result<std::optional<Atlas>> Atlas::of_bundle(const Bundle& bundle) {
  VANTAGE_TRY(const auto stored, bundle.attachment(kAttachment));
  if (!stored) return std::optional<Atlas>();
  VANTAGE_TRY(Atlas atlas, decode(*stored));
  if (!atlas.sites.empty() &&
      atlas.sites.back().region.value >= bundle.directory()->summary().regions) {
    return no_atlas("has a site in a region that the bundle does not have");
  }
  return std::optional<Atlas>(std::move(atlas));
}

const Site* Atlas::nearest(const Point& place) const noexcept {
  const Site* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Site& site : sites) {
    const double away = (site.position - place).squaredNorm();
    if (away >= least) continue;
    least = away;
    nearest = &site;
  }
  return nearest;
}

}  // namespace vantage
