#include "info/region_list.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <variant>

#include "terminal/table.hpp"

namespace vantage {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Eigen::Vector2d& xy) { return Json::array({xy.x(), xy.y()}); }
Json json_of(const HalfOpenBox& box) {
  return {{"min", json_of(box.min)}, {"max", json_of(box.max)}};
}

Json json_of(const Footprint& footprint) {
  if (const auto* box = std::get_if<HalfOpenBox>(&footprint)) return {{"box", json_of(*box)}};
  Json list = Json::array();
  if (const auto* polygon = std::get_if<ConvexPolygon>(&footprint)) {
    for (const Eigen::Vector2d& corner : polygon->corners) list.push_back(json_of(corner));
    return {{"polygon", list}};
  }
  for (const HalfOpenBox& box : std::get<BoxUnion>(footprint).boxes) list.push_back(json_of(box));
  return {{"boxes", list}};
}

std::string text_of(const Footprint& footprint) {
  if (const auto* polygon = std::get_if<ConvexPolygon>(&footprint)) {
    return cli::counted(polygon->corners.size(), "corner");
  }
  const auto* all = std::get_if<BoxUnion>(&footprint);
  return all == nullptr ? "box" : cli::counted(all->boxes.size(), "box", "boxes");
}

std::string range(double from, double to) { return fmt::format("{:.2f} to {:.2f}", from, to); }

std::string text_of(const HeightInterval& height) {
  const bool from = std::isfinite(height.min), to = std::isfinite(height.max);
  if (from && to) return range(height.min, height.max);
  if (from) return fmt::format("from {:.2f}", height.min);
  return to ? fmt::format("below {:.2f}", height.max) : "any";
}

}  // namespace

std::string to_text(std::span<const DirectoryEntry> regions, const cli::Style& style) {
  cli::TextTable table({"region", "footprint", "number", "x [m]", "y [m]", "z [m]", "points",
                        "viewpoints", "elements", "most views", "bytes"},
                       2);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const auto& [region, summary] = regions[r];
    const Bounds2 box = bounds_of(region.footprint);
    table.add({cli::one_line(region.label), text_of(region.footprint), std::to_string(r),
               range(box.min.x(), box.max.x()), range(box.min.y(), box.max.y()),
               text_of(region.height), cli::grouped(summary.points),
               cli::grouped(summary.viewpoints), cli::grouped(summary.elements),
               summary.max_views > 0 ? cli::grouped(summary.max_views) : "-",
               cli::grouped(summary.bytes)});
  }
  return table.to_string(style);
}

Json to_json(std::span<const DirectoryEntry> regions) {
  const auto end = [](double z) { return std::isfinite(z) ? Json(z) : Json(nullptr); };
  Json list = Json::array();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const auto& [region, summary] = regions[r];
    list.push_back({{"number", r},
                    {"label", region.label},
                    {"footprint", json_of(region.footprint)},
                    {"height", {end(region.height.min), end(region.height.max)}},
                    {"points", summary.points},
                    {"viewpoints", summary.viewpoints},
                    {"elements", summary.elements},
                    {"max_views", summary.max_views},
                    {"bytes", summary.bytes}});
  }
  return list;
}

}  // namespace vantage
