#include "bundle_index.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "written_index.hpp"

namespace vantage::pcd_tiles {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kChecksum = "checksum";
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ---- writing

/// JSON has no infinity. Numbers are written in their shortest form and read back bit for bit.
Json number(double x) {
  if (std::isinf(x)) return x < 0 ? "-inf" : "inf";
  return x;
}

template <class Vector>
Json numbers(const Vector& v) {
  Json array = Json::array();
  for (const double x : v) array.push_back(number(x));
  return array;
}

Json footprint(const HalfOpenBox& box) {
  Json json = Json::object();
  json["box"] = {{"min", numbers(box.min)}, {"max", numbers(box.max)}};
  return json;
}

Json footprint(const ConvexPolygon& polygon) {
  Json corners = Json::array();
  for (const Eigen::Vector2d& corner : polygon.corners) corners.push_back(numbers(corner));
  Json json = Json::object();
  json["polygon"] = std::move(corners);
  return json;
}

Json footprint(const BoxUnion& shape) {
  Json boxes = Json::array();
  for (const HalfOpenBox& box : shape.boxes) boxes.push_back(footprint(box)["box"]);
  Json json = Json::object();
  json["boxes"] = std::move(boxes);
  return json;
}

std::string hexadecimal(std::uint64_t x) {
  char text[16];
  const auto length = static_cast<std::size_t>(std::to_chars(text, text + 16, x, 16).ptr - text);
  return std::string(16 - length, '0') + std::string(text, length);
}

/// FNV-1a, 64 bit, of everything in an index except its checksum, whatever the layout.
/// Precondition: valid UTF-8 throughout.
std::uint64_t checksum_of(Json index) {
  index.erase(kChecksum);
  Checksum sum;
  for (const char c : index.dump()) sum.add(c);
  return sum.value();
}

// ---- reading

/// A JSON value that knows its name and file, for error messages.
struct Node {
  const Json* value;
  std::string name;
  const std::string* file;

  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& reason) const {
    return fail(ErrorCode::corrupt_data, (name.empty() ? "the index" : "'" + name + "'") + reason,
                SourceLocation{*file, 0, 0});
  }
  [[nodiscard]] tl::unexpected<Error> expected(const std::string& what) const {
    return refuse(" must be " + what + ", found " + std::string(value->type_name()));
  }

  [[nodiscard]] Result<Node> operator[](const std::string& key) const {
    if (!value->is_object()) return expected("an object");
    const auto found = value->find(key);
    if (found == value->end()) return refuse(" has no member '" + key + "'");
    return Node{&*found, name.empty() ? key : name + "." + key, file};
  }
  [[nodiscard]] bool has(const std::string& key) const {
    return value->is_object() && value->contains(key);
  }
  [[nodiscard]] Node at(std::size_t i) const {
    return {&(*value)[i], name + "[" + std::to_string(i) + "]", file};
  }

  [[nodiscard]] Result<double> number() const {
    if (value->is_string() && *value == "inf") return kInfinity;
    if (value->is_string() && *value == "-inf") return -kInfinity;
    if (!value->is_number()) return expected("a number");
    return value->get<double>();
  }
  [[nodiscard]] Result<std::uint64_t> count(std::uint64_t max) const {
    if (!value->is_number_unsigned() || value->get<std::uint64_t>() > max) {
      return refuse(" must be an integer from 0 to " + std::to_string(max));
    }
    return value->get<std::uint64_t>();
  }
  [[nodiscard]] Result<std::string> text() const {
    if (!value->is_string()) return expected("a string");
    return value->get<std::string>();
  }
  template <int N>
  [[nodiscard]] Result<Eigen::Matrix<double, N, 1>> vector() const {
    if (!value->is_array() || value->size() != N) {
      return refuse(" must be an array of " + std::to_string(N) + " numbers");
    }
    Eigen::Matrix<double, N, 1> v;
    for (std::size_t i = 0; i < N; ++i) {
      VANTAGE_TRY(v[static_cast<Eigen::Index>(i)], at(i).number());
    }
    return v;
  }
};

Result<std::uint64_t> checksum(const Node& node) {
  VANTAGE_TRY(const std::string text, node.text());
  std::uint64_t x = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.size() != 16) {
    return node.refuse(" must be 16 hexadecimal digits, not '" + text + "'");
  }
  return x;
}

Result<HalfOpenBox> box(const Node& node) {
  VANTAGE_TRY(const Node min, node["min"]);
  VANTAGE_TRY(const Node max, node["max"]);
  HalfOpenBox result;
  VANTAGE_TRY(result.min, min.vector<2>());
  VANTAGE_TRY(result.max, max.vector<2>());
  return result;
}

Result<Footprint> footprint(const Node& node) {
  if (node.has("box")) {
    VANTAGE_TRY(const Node shape, node["box"]);
    return box(shape);
  }
  if (node.has("boxes")) {
    VANTAGE_TRY(const Node boxes, node["boxes"]);
    if (!boxes.value->is_array()) return boxes.expected("an array");
    BoxUnion shape;
    for (std::size_t i = 0; i < boxes.value->size(); ++i) {
      VANTAGE_TRY(shape.boxes.emplace_back(), box(boxes.at(i)));
    }
    return shape;
  }
  if (!node.has("polygon")) return node.refuse(" must have a member 'box', 'boxes' or 'polygon'");
  VANTAGE_TRY(const Node corners, node["polygon"]);
  if (!corners.value->is_array()) return corners.expected("an array");
  ConvexPolygon polygon;
  for (std::size_t i = 0; i < corners.value->size(); ++i) {
    VANTAGE_TRY(const Eigen::Vector2d corner, corners.at(i).vector<2>());
    polygon.corners.push_back(corner);
  }
  return polygon;
}

struct ReadRegion {
  Region region;
  TileInfo tile;
};

Result<ReadRegion> region(const Node& node) {
  ReadRegion result;
  VANTAGE_TRY(const Node label, node["label"]);
  VANTAGE_TRY(result.region.label, label.text());
  VANTAGE_TRY(const Node shape, node["footprint"]);
  VANTAGE_TRY(result.region.footprint, footprint(shape));
  VANTAGE_TRY(const Node height, node["height"]);
  VANTAGE_TRY(const Eigen::Vector2d interval, height.vector<2>());
  result.region.height = {interval[0], interval[1]};

  constexpr auto kAny = std::numeric_limits<std::uint64_t>::max();
  VANTAGE_TRY(const Node points, node["points"]);
  VANTAGE_TRY(result.tile.points, points.count(kMaxPoints));
  VANTAGE_TRY(const Node viewpoints, node["viewpoints"]);
  VANTAGE_TRY(result.tile.viewpoints, viewpoints.count(kMaxPoints));
  VANTAGE_TRY(const Node elements, node["elements"]);
  VANTAGE_TRY(result.tile.elements, elements.count(kAny));
  VANTAGE_TRY(const Node prepared_bytes, node["prepared_bytes"]);
  VANTAGE_TRY(result.tile.prepared_bytes, prepared_bytes.count(kMaxPreparedBytes));
  if (result.tile.elements > 0 && result.tile.prepared_bytes == 0) {
    return elements.refuse(" must be 0 without prepared bytes");
  }
  if (node.has("max_views")) {
    VANTAGE_TRY(const Node max_views, node["max_views"]);
    VANTAGE_TRY(const std::uint64_t most,
                max_views.count(std::numeric_limits<std::uint32_t>::max()));
    if (most == 0 || result.tile.points == 0) {
      return max_views.refuse(" must be above 0, and left out where no point is");
    }
    result.tile.max_views = static_cast<std::uint32_t>(most);
  }
  VANTAGE_TRY(const Node origin, node["origin"]);
  VANTAGE_TRY(result.tile.origin, origin.vector<3>());
  if (!result.tile.origin.allFinite()) return origin.refuse(" must be finite");
  VANTAGE_TRY(const Node bytes, node["bytes"]);
  VANTAGE_TRY(result.tile.bytes, bytes.count(kAny));
  const std::uint64_t expected = file_size(result.tile);
  if (result.tile.bytes != expected) {
    return bytes.refuse(" must be " + std::to_string(expected) + " for what the file holds, not " +
                        std::to_string(result.tile.bytes));
  }
  VANTAGE_TRY(const Node file, node["file"]);
  VANTAGE_TRY(const std::string file_name, file.text());
  if (file_name != tile_name(result.region)) {
    return file.refuse(" must be '" + tile_name(result.region) + "', not '" + file_name + "'");
  }
  VANTAGE_TRY(const Node sum, node["checksum"]);
  VANTAGE_TRY(result.tile.checksum, checksum(sum));
  return result;
}

/// Versions count up from 1.
Result<void> check_version(const Node& node) {
  if (*node.value == kVersion || *node.value == kVersionWithViews) return {};
  const std::string is = node.value->dump(-1, ' ', true, Json::error_handler_t::replace);
  const std::string here = std::to_string(kVersion) + " or " + std::to_string(kVersionWithViews);
  if (!node.value->is_number_unsigned() || *node.value == 0U) {
    return node.refuse(" must be " + here + ", not " + is);
  }
  const bool older = node.value->get<std::uint64_t>() < kVersion;
  return node.refuse(" is " + is + ", and " + here + " is needed: the bundle was built by " +
                     (older ? "an older" : "a newer") + " version; remove it and build it again");
}

SourceLocation place_of(std::string_view text, std::size_t byte, const std::string& file) {
  const std::string_view before = text.substr(0, std::min(byte == 0 ? 0 : byte - 1, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t last_line = before.rfind('\n');
  const std::size_t column =
      before.size() - (last_line == std::string_view::npos ? 0 : last_line + 1) + 1;
  return {file, static_cast<std::uint32_t>(line), static_cast<std::uint32_t>(column)};
}

}  // namespace

std::string tile_name(const Region& region) { return region.label + ".pcd"; }

Result<void> check_writable(const MapIndex& index) {
  for (const Region& region : index.partition.regions()) {
    if (std::isnan(region.height.min) || std::isnan(region.height.max)) {
      return fail(ErrorCode::invalid_input, "the height of region '" + region.label + "' is NaN");
    }
  }
  if (index.map_bounds.min.hasNaN() || index.map_bounds.max.hasNaN()) {
    return fail(ErrorCode::invalid_input, "the bounds of the map are NaN");
  }
  try {
    (void)Json(index.config).dump();
  } catch (const Json::type_error&) {
    return fail(ErrorCode::invalid_input, "the configuration text is not valid UTF-8");
  }
  return {};
}

Result<std::string> to_json(const BundleIndex& index) {
  const MapIndex& map = index.map;
  VANTAGE_CHECK(check_writable(map));
  Json regions = Json::array();
  for (std::size_t r = 0; r < map.partition.size(); ++r) {
    const Region& region = map.partition.regions()[r];
    const TileInfo& tile = index.tiles.at(r);
    Json one = {{"label", region.label},
                {"file", tile_name(region)},
                {"footprint",
                 std::visit([](const auto& shape) { return footprint(shape); }, region.footprint)},
                {"height", {number(region.height.min), number(region.height.max)}},
                {"points", tile.points},
                {"viewpoints", tile.viewpoints},
                {"elements", tile.elements},
                {"prepared_bytes", tile.prepared_bytes}};
    if (tile.max_views > 0) one["max_views"] = tile.max_views;
    one["bytes"] = tile.bytes;
    one["origin"] = numbers(tile.origin);
    one["checksum"] = hexadecimal(tile.checksum);
    regions.push_back(std::move(one));
  }
  const bool with_views = std::any_of(index.tiles.begin(), index.tiles.end(),
                                      [](const TileInfo& tile) { return tile.max_views > 0; });
  Json json = {
      {"format", kFormat},
      {"version", with_views ? kVersionWithViews : kVersion},
      {"map",
       {{"points", map.map_points},
        {"bounds", {{"min", numbers(map.map_bounds.min)}, {"max", numbers(map.map_bounds.max)}}}}},
      {"config", map.config},
      {"regions", std::move(regions)},
  };
  json[kChecksum] = hexadecimal(checksum_of(json));
  return json.dump(1) + "\n";
}

Result<BundleIndex> from_json(std::string_view text, const std::string& file) {
  if (auto index = read_as_written(text)) return *std::move(index);
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& e) {
    return fail(ErrorCode::corrupt_data, "the index is damaged or cut short: it is no JSON",
                place_of(text, e.byte, file));
  } catch (const Json::exception& e) {
    return fail(ErrorCode::corrupt_data, std::string("the index is damaged: ") + e.what(),
                SourceLocation{file, 0, 0});
  }

  const Node root{&json, "", &file};
  VANTAGE_TRY(const Node format, root["format"]);
  if (*format.value != kFormat) return format.refuse(" must be '" + std::string(kFormat) + "'");
  VANTAGE_TRY(const Node version, root["version"]);
  VANTAGE_CHECK(check_version(version));

  BundleIndex index;
  VANTAGE_TRY(const Node map, root["map"]);
  VANTAGE_TRY(const Node map_points, map["points"]);
  VANTAGE_TRY(index.map.map_points, map_points.count(std::numeric_limits<std::uint64_t>::max()));
  VANTAGE_TRY(const Node bounds, map["bounds"]);
  VANTAGE_TRY(const Node min, bounds["min"]);
  VANTAGE_TRY(const Node max, bounds["max"]);
  VANTAGE_TRY(index.map.map_bounds.min, min.vector<3>());
  VANTAGE_TRY(index.map.map_bounds.max, max.vector<3>());
  VANTAGE_TRY(const Node config, root["config"]);
  VANTAGE_TRY(index.map.config, config.text());

  VANTAGE_TRY(const Node list, root["regions"]);
  if (!list.value->is_array()) return list.expected("an array");
  std::vector<Region> regions;
  for (std::size_t r = 0; r < list.value->size(); ++r) {
    VANTAGE_TRY(ReadRegion one, region(list.at(r)));
    regions.push_back(std::move(one.region));
    index.map.regions.push_back(one.tile.summary());
    index.tiles.push_back(one.tile);
  }
  auto partition = Partition::from(std::move(regions));
  if (!partition) return list.refuse(" are no partition: " + partition.error().message);
  index.map.partition = *std::move(partition);

  // The checksum comes last, because a member that is wrong in itself has a message that says more.
  VANTAGE_TRY(const Node said, root[kChecksum]);
  VANTAGE_TRY(const std::uint64_t sum, checksum(said));
  if (sum != checksum_of(json)) {
    return said.refuse(" is not that of the rest: the index is damaged or was edited");
  }
  return index;
}

}  // namespace vantage::pcd_tiles
