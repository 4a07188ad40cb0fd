#include "common/bundle_index.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/index_format.hpp"
#include "common/written_index.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::bundle_folder {
namespace {

using Json = nlohmann::ordered_json;

// ---- writing

/// JSON has no infinity. Numbers are written in their shortest form and read back bit for bit.
Json number(double x) {
  if (std::isinf(x)) return x < 0 ? "-inf" : "inf";
  return x;
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
  Fnv1a sum;
  sum.add(index.dump());
  return sum.value();
}

/// The writer. Values are put into the JSON at hand.
class Writer {
 public:
  explicit Writer(Json& at) noexcept : at_(&at) {}

  template <class Visit>
  void member(const char* key, const Visit& visit) {
    Json& object = *at_;
    Json value;
    at_ = &value;
    visit();
    at_ = &object;
    object[key] = std::move(value);
  }
  template <class Visit>
  bool member_if(const char* key, bool is_there, const Visit& visit) {
    if (is_there) member(key, visit);
    return is_there;
  }
  template <class Visit>
  void object(const Visit& visit) {
    *at_ = Json::object();
    visit();
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    Json& array = *at_;
    array = Json::array();
    for (Element& element : elements) {
      Json value;
      at_ = &value;
      visit(element);
      array.push_back(std::move(value));
    }
    at_ = &array;
  }
  template <class Vector>
  void numbers(const Vector& v) {
    *at_ = Json::array();
    for (const double x : v) at_->push_back(number(x));
  }
  void text(const std::string& text) { *at_ = text; }
  void count(std::uint64_t value, std::uint64_t /*max*/) { *at_ = value; }
  void checksum(std::uint64_t value) { *at_ = hexadecimal(value); }
  void version(const BundleFormat& format, bool with_views) {
    *at_ = with_views ? format.version_with_views() : format.version;
  }
  template <class Reason>
  void check(bool /*ok*/, const char* /*key*/, const Reason& /*reason*/) noexcept {}

 private:
  Json* at_;
};

// ---- reading

/// The reader of any JSON. It knows the name of the value at hand, for error messages.
class Reader {
 public:
  Reader(const Json& root, const std::string& file) : at_(&root), file_(file) {}

  [[nodiscard]] const std::optional<Error>& error() const noexcept { return error_; }

  template <class Visit>
  void member(const char* key, const Visit& visit) {
    if (error_) return;
    if (!at_->is_object()) return expected("an object");
    const auto found = at_->find(key);
    if (found == at_->end()) return refuse(std::string(" has no member '") + key + "'");
    visit_at(*found, name_.empty() ? key : name_ + "." + key, visit);
  }
  template <class Visit>
  bool member_if(const char* key, bool /*is_there*/, const Visit& visit) {
    if (error_) return true;  // whatever is missing is not the first error
    if (!at_->is_object() || !at_->contains(key)) return false;
    member(key, visit);
    return true;
  }
  template <class Visit>
  void object(const Visit& visit) {
    visit();  // the first member asks what it is a member of
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    if (error_) return;
    if (!at_->is_array()) return expected("an array");
    const Json& array = *at_;
    elements.reserve(array.size());
    for (std::size_t i = 0; i < array.size() && !error_; ++i) {
      Element& element = elements.emplace_back();
      visit_at(array[i], name_ + "[" + std::to_string(i) + "]", [&] { visit(element); });
    }
  }
  template <class Vector>
  void numbers(Vector& v) {
    if (error_) return;
    const auto size = static_cast<std::size_t>(v.size());
    if (!at_->is_array() || at_->size() != size) {
      return refuse(" must be an array of " + std::to_string(size) + " numbers");
    }
    const Json& array = *at_;
    for (std::size_t i = 0; i < size; ++i) {
      visit_at(array[i], name_ + "[" + std::to_string(i) + "]",
               [&] { v[static_cast<Eigen::Index>(i)] = read_number(); });
    }
  }
  void text(std::string& text) {
    if (error_) return;
    if (!at_->is_string()) return expected("a string");
    text = at_->get<std::string>();
  }
  void count(std::uint64_t& value, std::uint64_t max) {
    if (error_) return;
    if (!at_->is_number_unsigned() || at_->get<std::uint64_t>() > max) {
      return refuse(" must be an integer from 0 to " + std::to_string(max));
    }
    value = at_->get<std::uint64_t>();
  }
  void checksum(std::uint64_t& value) {
    std::string digits;
    text(digits);
    if (error_) return;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (error != std::errc() || end != digits.data() + digits.size() || digits.size() != 16) {
      refuse(" must be 16 hexadecimal digits, not " + shown(digits));
    }
  }
  /// Versions count up from 1.
  void version(const BundleFormat& format, bool /*with_views*/) {
    if (error_ || *at_ == format.version || *at_ == format.version_with_views()) return;
    const std::string is = at_->dump(-1, ' ', true, Json::error_handler_t::replace);
    const std::string here =
        std::to_string(format.version) + " or " + std::to_string(format.version_with_views());
    if (!at_->is_number_unsigned() || *at_ == 0U) {
      return refuse(" must be " + here + ", not " + is);
    }
    const bool older = at_->get<std::uint64_t>() < format.version;
    refuse(" is " + is + ", and " + here + " is needed: the bundle was built by " +
           (older ? "an older" : "a newer") + " version; remove it and build it again");
  }
  /// @param key  of the member that is wrong; nullptr for the value at hand
  template <class Reason>
  void check(bool ok, const char* key, const Reason& reason) {
    if (ok || error_) return;
    if (key != nullptr) {
      member(key, [&] { refuse(reason()); });
    } else {
      refuse(reason());
    }
  }

 private:
  template <class Visit>
  void visit_at(const Json& value, std::string name, const Visit& visit) {
    const Json* const before = std::exchange(at_, &value);
    name_.swap(name);
    visit();
    name_.swap(name);
    at_ = before;
  }
  [[nodiscard]] double read_number() {
    if (at_->is_string() && *at_ == "inf") return kInfinity;
    if (at_->is_string() && *at_ == "-inf") return -kInfinity;
    if (at_->is_number()) return at_->get<double>();
    expected("a number");
    return 0.0;
  }
  void refuse(const std::string& reason) {
    if (error_) return;
    error_ = Error{.code = ErrorCode::corrupt_data,
                   .message = (name_.empty() ? "the index" : "'" + name_ + "'") + reason,
                   .where = SourceLocation{file_, 0, 0},
                   .context = {}};
  }
  void expected(const std::string& what) {
    refuse(" must be " + what + ", found " + at_->type_name());
  }

  const Json* at_;
  std::string name_;
  const std::string& file_;
  std::optional<Error> error_;
};

}  // namespace

std::string shown(const std::string& text) {
  const std::string quoted =
      Json(text.substr(0, 250)).dump(-1, ' ', true, Json::error_handler_t::replace);
  return "'" + quoted.substr(1, quoted.size() - 2) + "'";
}

std::string region_file_name(const BundleFormat& format, const Region& region) {
  return region.label + std::string(format.extension);
}

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

Result<BundleIndex> bundle_of(IndexContent content) {
  BundleIndex index;
  index.map.map_points = content.map_points;
  index.map.map_bounds = content.map_bounds;
  index.map.config = std::move(content.config);
  index.packed = content.packed;
  if (index.packed.count > 0) return index;
  std::vector<Region> regions;
  regions.reserve(content.regions.size());
  for (IndexedRegion& one : content.regions) {
    regions.push_back(std::move(one.region));
    index.map.regions.push_back(one.file.summary());
    index.files.push_back(one.file);
  }
  VANTAGE_TRY(index.map.partition, Partition::from(std::move(regions)));
  return index;
}

Result<std::string> to_json(const BundleFormat& format, const BundleIndex& index) {
  const MapIndex& map = index.map;
  VANTAGE_CHECK(check_writable(map));
  IndexContent content{.map_points = map.map_points,
                       .map_bounds = map.map_bounds,
                       .config = map.config,
                       .regions = {},
                       .packed = index.packed};
  for (const RegionFile& file : index.files) content.with_views |= file.max_views > 0;
  for (std::size_t r = 0; index.packed.count == 0 && r < map.partition.size(); ++r) {
    content.regions.push_back({map.partition.regions()[r], index.files.at(r)});
  }
  Json json = Json::object();
  Writer writer(json);
  describe(writer, format, content);
  json[kChecksum] = hexadecimal(checksum_of(json));
  return json.dump(1) + "\n";
}

Result<BundleIndex> from_json(const BundleFormat& format, std::string_view text,
                              const std::string& file) {
  if (auto index = read_as_written(format, text)) return *std::move(index);
  VANTAGE_TRY(const Json json, parse_json<Json>(text, file, "the index is damaged or cut short"));
  Reader reader(json, file);
  IndexContent content;
  describe(reader, format, content);
  if (reader.error()) return fail(*reader.error());
  auto index = bundle_of(std::move(content));
  reader.check(index.has_value(), "regions",
               [&] { return " are not a partition: " + index.error().message; });
  // Last: what is wrong by itself has a message that says more.
  std::uint64_t said = 0;
  reader.member(kChecksum, [&] { reader.checksum(said); });
  reader.check(said == checksum_of(json), kChecksum,
               [] { return " is not that of the rest: the index is damaged or was edited"; });
  if (reader.error()) return fail(*reader.error());
  index->generation = said;
  return index;
}

}  // namespace vantage::bundle_folder
