#include "build/plan_file.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "vantage/kit/byte_io.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage {
namespace {

// The last two characters are the version.
constexpr std::string_view kPlanFormat = "vplan_03";

// Edges may be infinite, so they are read as they are; Partition::from checks them.
template <class Archive, class Place>
void describe_xy(Archive& archive, Place& xy) {
  archive.field(xy.x());
  archive.field(xy.y());
}

template <class Archive, class Box>
void describe_box(Archive& archive, Box& box) {
  describe_xy(archive, box.min);
  describe_xy(archive, box.max);
}

template <class Archive, class Shapes>
void describe_footprint(Archive& archive, Shapes& footprint) {
  auto kind = static_cast<std::uint8_t>(footprint.index());
  archive.field(kind);
  if constexpr (Archive::kReads) {
    if (kind == 1) footprint = ConvexPolygon{};
    if (kind == 2) footprint = BoxUnion{};
    archive.check(kind <= 2);
  }
  const auto xy = [&](auto& place) { describe_xy(archive, place); };
  const auto box = [&](auto& one) { describe_box(archive, one); };
  std::visit(
      [&](auto& shape) {
        if constexpr (requires { shape.corners; }) {
          archive.list(shape.corners, 16, xy);
        } else if constexpr (requires { shape.boxes; }) {
          archive.list(shape.boxes, 32, box);
        } else {
          box(shape);
        }
      },
      footprint);
}

template <class Archive, class Identity>
void describe_identity(Archive& archive, Identity& identity) {
  archive.list(identity.parts, 16, [&](auto& part) {
    archive.field(part.first);
    archive.field(part.second);
  });
}

/// @param regions  of the plan's partition
template <class Archive, class Plan, class Regions>
void describe_plan(Archive& archive, Plan& plan, Regions& regions) {
  archive.field(plan.limits.map_bounds.min);
  archive.field(plan.limits.map_bounds.max);
  archive.field(plan.limits.max_range);
  archive.field(plan.map_points);
  archive.field(plan.ground_points);
  archive.field(plan.unreachable_voxels);
  archive.field(plan.places_outside);
  std::size_t r = 0;
  archive.list(regions, 49, [&](auto& region) {
    archive.field(region.label);
    describe_footprint(archive, region.footprint);
    archive.field(region.height.min);
    archive.field(region.height.max);
    if constexpr (Archive::kReads) {
      plan.owned.emplace_back();
      plan.viewpoints.emplace_back();
    }
    archive.field(plan.owned[r]);
    archive.list(plan.viewpoints[r++], 24, [&](auto& point) { archive.field(point); });
  });
  archive.field(plan.place_index);
}

tl::unexpected<Error> no_plan(const char* reason) {
  return fail(ErrorCode::corrupt_data, std::string("the plan of the build ") + reason +
                                           ": remove this file, and it is made again");
}

}  // namespace

std::vector<std::byte> encode_plan(const BuildPlan& plan, const BuildIdentity& identity) {
  ByteWriter to;
  to.raw(kPlanFormat);
  describe_identity(to, identity);
  describe_plan(to, plan, plan.partition.regions());
  auto bytes = std::move(to).take();
  ByteWriter sum;
  sum.number(checksum_of(bytes));
  const auto last = std::move(sum).take();
  bytes.insert(bytes.end(), last.begin(), last.end());
  return bytes;
}

Result<BuildPlan> decode_plan(std::span<const std::byte> bytes, const BuildIdentity& identity) {
  if (bytes.size() < 2 * sizeof(std::uint64_t)) return no_plan("is cut short");
  const auto body = bytes.first(bytes.size() - sizeof(std::uint64_t));
  if (ByteReader(bytes.last(sizeof(std::uint64_t))).number<std::uint64_t>() != checksum_of(body)) {
    return no_plan("is damaged");
  }
  ByteReader from(body);
  if (from.raw(kPlanFormat.size()) != kPlanFormat) return no_plan("is of another version");
  BuildIdentity of_plan;
  describe_identity(from, of_plan);
  if (!from.ok()) return no_plan("is malformed");
  if (of_plan != identity) {
    return fail(ErrorCode::already_exists,
                "this is the plan of another build, with " + difference(identity, of_plan) +
                    ": keep the parts of this build in another folder, or finish or remove those "
                    "of the other one");
  }
  BuildPlan plan;
  std::vector<Region> regions;
  describe_plan(from, plan, regions);
  if (!from.ok() || from.left() != 0) return no_plan("is malformed");
  VANTAGE_TRY(plan.partition, Partition::from(std::move(regions)));
  return plan;
}

}  // namespace vantage
