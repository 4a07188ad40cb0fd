#include "build/plan_file.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "vantage/kit/byte_io.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/overloaded.hpp"

namespace vantage {
namespace {

// The last two characters are the version.
constexpr std::string_view kPlanFormat = "vplan_03";

void write(ByteWriter& to, const Eigen::Vector2d& xy) { to.numbers({xy.data(), 2}); }

void write(ByteWriter& to, const HalfOpenBox& box) {
  write(to, box.min);
  write(to, box.max);
}

void write(ByteWriter& to, const Footprint& footprint) {
  to.number(static_cast<std::uint8_t>(footprint.index()));
  std::visit(Overloaded{[&](const HalfOpenBox& box) { write(to, box); },
                        [&](const ConvexPolygon& polygon) {
                          to.number(std::uint64_t{polygon.corners.size()});
                          for (const auto& corner : polygon.corners) write(to, corner);
                        },
                        [&](const BoxUnion& all) {
                          to.number(std::uint64_t{all.boxes.size()});
                          for (const auto& box : all.boxes) write(to, box);
                        }},
             footprint);
}

// Edges may be infinite, so they are read as they are; Partition::from checks them.
Eigen::Vector2d read_xy(ByteReader& from) {
  const auto x = from.number<double>(), y = from.number<double>();
  return {x, y};
}

HalfOpenBox read_box(ByteReader& from) {
  const Eigen::Vector2d min = read_xy(from), max = read_xy(from);
  return {min, max};
}

Footprint read_footprint(ByteReader& from) {
  switch (from.number<std::uint8_t>()) {
    case 0: return read_box(from);
    case 1: {
      ConvexPolygon polygon;
      for (std::size_t n = from.count(16); n > 0; --n) polygon.corners.push_back(read_xy(from));
      return polygon;
    }
    case 2: {
      BoxUnion all;
      for (std::size_t n = from.count(32); n > 0; --n) all.boxes.push_back(read_box(from));
      return all;
    }
    default: from.check(false); return BoxUnion{};
  }
}

void write(ByteWriter& to, const PointCloud& points) {
  to.number(std::uint64_t{points.size()});
  for (const Point& p : points) to.point(p);
}

PointCloud read_points(ByteReader& from) {
  PointCloud points(from.count(24));
  for (Point& p : points) p = from.point();
  return points;
}

tl::unexpected<Error> no_plan(const char* reason) {
  return fail(ErrorCode::corrupt_data, std::string("the plan of the build ") + reason +
                                           ": remove this file, and it is made again");
}

}  // namespace

std::vector<std::byte> encode_plan(const BuildPlan& plan, const BuildIdentity& identity) {
  ByteWriter to;
  to.raw(kPlanFormat);
  to.number(std::uint64_t{identity.parts.size()});
  for (const auto& [name, value] : identity.parts) {
    to.text(name);
    to.number(value);
  }
  to.point(plan.limits.map_bounds.min);
  to.point(plan.limits.map_bounds.max);
  to.number(plan.limits.max_range);
  for (const std::uint64_t count :
       {plan.map_points, plan.ground_points, plan.unreachable_voxels, plan.places_outside}) {
    to.number(count);
  }
  to.number(std::uint64_t{plan.partition.size()});
  for (std::uint32_t r = 0; r < plan.partition.size(); ++r) {
    const Region& region = plan.partition[RegionId{r}];
    to.text(region.label);
    write(to, region.footprint);
    to.numbers(std::array{region.height.min, region.height.max});
    to.number(plan.owned[r]);
    write(to, plan.viewpoints[r]);
  }
  to.text({reinterpret_cast<const char*>(plan.place_index.data()), plan.place_index.size()});
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
  of_plan.parts.resize(from.count(16));
  for (auto& [name, value] : of_plan.parts) {
    name = from.text();
    value = from.number<std::uint64_t>();
  }
  if (!from.ok()) return no_plan("is malformed");
  if (of_plan != identity) {
    return fail(ErrorCode::already_exists,
                "this is the plan of another build, with " + difference(identity, of_plan) +
                    ": keep the parts of this build in another folder, or finish or remove those "
                    "of the other one");
  }
  BuildPlan plan;
  plan.limits.map_bounds.min = from.point();
  plan.limits.map_bounds.max = from.point();
  plan.limits.max_range = from.number<double>();
  plan.map_points = from.number<std::uint64_t>();
  plan.ground_points = from.number<std::uint64_t>();
  plan.unreachable_voxels = from.number<std::uint64_t>();
  plan.places_outside = from.number<std::uint64_t>();
  std::vector<Region> regions(from.count(49));
  for (Region& region : regions) {
    region.label = from.text();
    region.footprint = read_footprint(from);
    region.height.min = from.number<double>();
    region.height.max = from.number<double>();
    plan.owned.push_back(from.number<std::uint64_t>());
    plan.viewpoints.push_back(read_points(from));
    if (!from.ok()) return no_plan("is malformed");
  }
  const auto place_index = from.bytes(from.count(1));
  if (!from.ok() || from.left() != 0) return no_plan("is malformed");
  VANTAGE_TRY(plan.partition, Partition::from(std::move(regions)));
  plan.place_index.assign(place_index.begin(), place_index.end());
  return plan;
}

}  // namespace vantage
