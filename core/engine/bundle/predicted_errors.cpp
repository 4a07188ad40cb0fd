#include "vantage/engine/predicted_errors.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>

#include "bundle/predicted_error_bytes.hpp"

namespace vantage {
namespace {

// The last two characters are the version.
constexpr std::string_view kErrorsFormat = "vpred_02";

}  // namespace

std::vector<std::byte> PredictedErrors::encode() const {
  ByteWriter to;
  to.raw(kErrorsFormat);
  to.number(std::uint64_t{regions.size()});
  for (const auto& region : regions) describe_errors(to, region);
  return std::move(to).take();
}

Result<PredictedErrors> PredictedErrors::decode(std::span<const std::byte> bytes,
                                                std::size_t regions) {
  ByteReader from(bytes);
  if (from.raw(kErrorsFormat.size()) != kErrorsFormat) {
    return fail(ErrorCode::corrupt_data,
                "the bundle's predicted errors are of another version: build the bundle again");
  }
  PredictedErrors errors;
  from.check(from.count(1) == regions);
  if (from.ok()) errors.regions.resize(regions);
  for (auto& region : errors.regions) describe_errors(from, region);
  if (from.ok() && from.left() == 0) return errors;
  return fail(ErrorCode::corrupt_data, "the bundle's predicted errors are not what a build writes");
}

Result<std::optional<PredictedErrors>> PredictedErrors::of_bundle(const Bundle& bundle) {
  VANTAGE_TRY(const auto bytes, bundle.attachment(kAttachment));
  if (!bytes) return std::optional<PredictedErrors>();
  VANTAGE_TRY(PredictedErrors errors, decode(*bytes, bundle.directory()->summary().regions));
  return std::optional<PredictedErrors>(std::move(errors));
}

std::optional<PredictedError> PredictedErrors::at(RegionId region, const Point& position) const {
  constexpr std::size_t kNearest = 4;
  std::vector<PredictedError> near = regions.at(region.value);
  if (near.empty()) return std::nullopt;
  const auto some = near.begin() + static_cast<std::ptrdiff_t>(std::min(kNearest, near.size()));
  std::ranges::partial_sort(near, some, {}, [&](const PredictedError& one) {
    const Point& p = one.place;
    return std::tuple((p - position).squaredNorm(), p.x(), p.y(), p.z());
  });
  near.erase(some, near.end());
  const auto mean = [&](float PredictedError::*which) {
    double squares = 0.0;
    for (const PredictedError& one : near) squares += std::pow(one.*which, 2.0);
    return static_cast<float>(std::sqrt(squares / static_cast<double>(near.size())));
  };
  return PredictedError{.place = position,
                        .expected = mean(&PredictedError::expected),
                        .error = mean(&PredictedError::error),
                        .whole = mean(&PredictedError::whole)};
}

double error_kept_by(double share, std::vector<float> errors) {
  std::ranges::sort(errors);
  const double rank = std::ceil(share * static_cast<double>(errors.size()));
  return static_cast<double>(errors[static_cast<std::size_t>(std::max(rank, 1.0)) - 1]);
}

}  // namespace vantage
