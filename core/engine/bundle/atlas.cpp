#include "vantage/engine/atlas.hpp"

#include <algorithm>
#include <array>
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
constexpr std::string_view kAtlasFormat = "vatlas01";

tl::unexpected<Error> no_atlas(const char* reason) {
  return fail(ErrorCode::corrupt_data, std::string("the bundle's atlas ") + reason);
}

void write(ByteWriter& to, const Calibration& calibration) {
  to.text(calibration.matcher.plugin);
  to.text(calibration.matcher.params);
  to.number(calibration.right_samples);
  to.number(calibration.wrong_samples);
  to.numbers(calibration.right);
  to.numbers(calibration.wrong);
}

Calibration read_calibration(ByteReader& from) {
  Calibration calibration;
  calibration.matcher.plugin = from.text();
  calibration.matcher.params = from.text();
  calibration.right_samples = from.number<std::uint64_t>();
  calibration.wrong_samples = from.number<std::uint64_t>();
  const auto quantiles = [&](std::uint64_t samples) {
    std::vector<double> shares;
    if (samples == 0 || !from.ok()) return shares;
    for (std::size_t k = 0; k < Calibration::kQuantiles; ++k) shares.push_back(from.real());
    from.check(std::is_sorted(shares.begin(), shares.end()));
    return shares;
  };
  calibration.right = quantiles(calibration.right_samples);
  calibration.wrong = quantiles(calibration.wrong_samples);
  return calibration;
}

void write(ByteWriter& to, const Site& site) {
  to.number(site.region.value);
  to.numbers({site.position.data(), 3});
  to.number(static_cast<std::uint8_t>(site.precision ? 1 : 0));
  if (site.precision) {
    const SitePrecision& p = *site.precision;
    to.numbers(
        std::array{p.expected_error, p.sigma_strong, p.sigma_weak, p.weak_direction, p.basin});
  }
  to.number(static_cast<std::uint64_t>(site.alike.size()));
  for (const AlikePlace& place : site.alike) {
    to.pose(place.T_map_scan);
    to.number(place.likeness);
  }
}

// Of a site without precision and alike places.
constexpr std::size_t kLeastSiteBytes =
    sizeof(std::uint32_t) + 3 * sizeof(double) + 1 + sizeof(std::uint64_t);
constexpr std::size_t kAlikeBytes = 8 * sizeof(double);

Site read_site(ByteReader& from) {
  Site site;
  site.region = RegionId{from.number<std::uint32_t>()};
  site.position = from.point();
  const auto measured = from.number<std::uint8_t>();
  from.check(measured <= 1);
  if (measured == 1) {
    SitePrecision p;
    p.expected_error = from.real(0.0);
    p.sigma_strong = from.real(0.0);
    p.sigma_weak = from.real(p.sigma_strong);
    p.weak_direction = from.real(0.0);
    from.check(p.weak_direction < std::numbers::pi);
    p.basin = from.real(0.0);
    site.precision = p;
  }
  const std::size_t alike = from.count(kAlikeBytes);
  for (std::size_t k = 0; k < alike && from.ok(); ++k) {
    AlikePlace place{.T_map_scan = from.pose()};
    place.likeness = from.real(0.0);
    from.check(place.likeness > 0.0 &&
               (site.alike.empty() || site.alike.back().likeness >= place.likeness));
    site.alike.push_back(place);
  }
  return site;
}

}  // namespace

std::vector<std::byte> Atlas::encode() const {
  ByteWriter to;
  to.raw(kAtlasFormat);
  write(to, calibration);
  to.number(static_cast<std::uint64_t>(sites.size()));
  for (const Site& site : sites) write(to, site);
  return std::move(to).take();
}

Result<Atlas> Atlas::decode(std::span<const std::byte> bytes) {
  ByteReader from(bytes);
  const std::string_view format = from.raw(kAtlasFormat.size());
  if (!from.ok()) return no_atlas("is cut off");
  if (format != kAtlasFormat) return no_atlas("is of another version");
  Atlas atlas;
  atlas.calibration = read_calibration(from);
  const std::size_t sites = from.count(kLeastSiteBytes);
  for (std::size_t k = 0; k < sites && from.ok(); ++k) {
    atlas.sites.push_back(read_site(from));
    from.check(k == 0 || atlas.sites[k - 1].region <= atlas.sites[k].region);
  }
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
