#include "common/bundle_head.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/packed_index.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::bundle_folder {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kChecksum = "checksum";
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr auto kAnyCount = std::numeric_limits<std::uint64_t>::max();

std::string format_of(const BundleFormat& format) { return "vantage " + std::string(format.store); }

/// JSON has no infinity. Numbers are written in their shortest form and read back bit for bit.
Json numbers(const Point& p) {
  Json list = Json::array();
  for (const double x : p) {
    list.push_back(std::isinf(x) ? Json(x < 0 ? "-inf" : "inf") : Json(x));
  }
  return list;
}

std::string hexadecimal(std::uint64_t x) {
  char text[16];
  const auto length = static_cast<std::size_t>(std::to_chars(text, text + 16, x, 16).ptr - text);
  return std::string(16 - length, '0') + std::string(text, length);
}

/// Of everything in an index except its checksum, whatever the layout.
/// Precondition: valid UTF-8 throughout.
std::uint64_t generation_of(Json index) {
  index.erase(kChecksum);
  return checksum_of(index.dump());
}

/// A text from outside, for a message: in quotes, and with escapes for what is not printable.
std::string shown(const std::string& text) {
  const std::string quoted =
      Json(text.substr(0, 250)).dump(-1, ' ', true, Json::error_handler_t::replace);
  return "'" + quoted.substr(1, quoted.size() - 2) + "'";
}

/// Reads member by member, to the first error. It knows the name of the value at hand.
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
  void numbers(const char* key, Point& p) {
    member(key, [&] {
      if (!at_->is_array() || at_->size() != 3) return refuse(" must be an array of 3 numbers");
      const Json& array = *at_;
      for (std::size_t i = 0; i < 3; ++i) {
        visit_at(array[i], name_ + "[" + std::to_string(i) + "]",
                 [&] { p[static_cast<Eigen::Index>(i)] = read_number(); });
      }
    });
  }
  void text(const char* key, std::string& text) {
    member(key, [&] {
      if (!at_->is_string()) return expected("a string");
      text = at_->get<std::string>();
    });
  }
  void text_is(const char* key, const std::string& only) {
    std::string said;
    text(key, said);
    member(key, [&] {
      if (said != only) refuse(" must be '" + only + "', not " + shown(said));
    });
  }
  void count(const char* key, std::uint64_t& value, std::uint64_t least, std::uint64_t most) {
    member(key, [&] {
      if (at_->is_number_unsigned()) value = at_->get<std::uint64_t>();
      if (!at_->is_number_unsigned() || value < least || value > most) {
        refuse(" must be an integer from " + std::to_string(least) + " to " + std::to_string(most));
      }
    });
  }
  void checksum(const char* key, std::uint64_t& value) {
    std::string digits;
    text(key, digits);
    member(key, [&] {
      const char* const last = digits.data() + digits.size();
      const auto [end, error] = std::from_chars(digits.data(), last, value, 16);
      if (error != std::errc() || end != last || digits.size() != 16) {
        refuse(" must be 16 hexadecimal digits, not " + shown(digits));
      }
    });
  }
  void version(std::uint64_t needed) {
    member("version", [&] {
      if (*at_ == needed) return;
      const std::string is = at_->dump(-1, ' ', true, Json::error_handler_t::replace);
      const std::string here = std::to_string(needed);
      if (!at_->is_number_unsigned() || *at_ == 0U) {
        return refuse(" must be " + here + ", not " + is);
      }
      const bool older = at_->get<std::uint64_t>() < needed;
      refuse(" is " + is + ", and " + here + " is needed: the bundle was built by " +
             (older ? "an older" : "a newer") + " version; remove it and build it again");
    });
  }
  /// Refuses the value at hand.
  void refuse(const std::string& reason) {
    if (error_) return;
    error_ = Error{.code = ErrorCode::corrupt_data,
                   .message = (name_.empty() ? "the index" : "'" + name_ + "'") + reason,
                   .where = SourceLocation{file_, 0, 0},
                   .context = {}};
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
  void expected(const std::string& what) {
    refuse(" must be " + what + ", found " + at_->type_name());
  }

  const Json* at_;
  std::string name_;
  const std::string& file_;
  std::optional<Error> error_;
};

}  // namespace

Result<std::string> to_json(const BundleFormat& format, const BundleHead& head) {
  if (head.map_bounds.min.hasNaN() || head.map_bounds.max.hasNaN()) {
    return fail(ErrorCode::invalid_input, "the bounds of the map are NaN");
  }
  Json json{{"format", format_of(format)},
            {"version", format.version},
            {"map",
             {{"points", head.map_points},
              {"bounds",
               {{"min", numbers(head.map_bounds.min)}, {"max", numbers(head.map_bounds.max)}}}}},
            {"regions",
             {{"file", kRegionsFile},
              {"count", head.regions.count},
              {"bytes", head.regions.bytes},
              {kChecksum, hexadecimal(head.regions.checksum)}}},
            {"config", head.config}};
  std::string text;
  try {
    json[kChecksum] = hexadecimal(generation_of(json));
    text = json.dump(1) + "\n";
  } catch (const Json::type_error&) {
    return fail(ErrorCode::invalid_input, "the configuration text is not valid UTF-8");
  }
  if (text.size() <= kMostHeadBytes) return text;
  return fail(ErrorCode::invalid_input,
              "the configuration text has " + std::to_string(head.config.size()) +
                  " bytes: with it, the index would have more than the " +
                  std::to_string(kMostHeadBytes) + " bytes that are read");
}

Result<BundleHead> from_json(const BundleFormat& format, std::string_view text,
                             const std::string& file) {
  VANTAGE_TRY(const Json json, parse_json<Json>(text, file, "the index is damaged or cut short"));
  Reader reader(json, file);
  BundleHead head;
  reader.text_is("format", format_of(format));
  reader.version(format.version);
  reader.member("map", [&] {
    reader.count("points", head.map_points, 0, kAnyCount);
    reader.member("bounds", [&] {
      reader.numbers("min", head.map_bounds.min);
      reader.numbers("max", head.map_bounds.max);
    });
  });
  reader.member("regions", [&] {
    reader.text_is("file", kRegionsFile);
    reader.count("count", head.regions.count, 1, kMostRegions);
    reader.count("bytes", head.regions.bytes, 0, kAnyCount);
    reader.checksum(kChecksum, head.regions.checksum);
  });
  reader.text("config", head.config);
  // Last: what is wrong by itself has a message that says more.
  reader.checksum(kChecksum, head.generation);
  reader.member(kChecksum, [&] {
    if (head.generation == generation_of(json)) return;
    reader.refuse(" is not that of the rest: the index is damaged or was edited");
  });
  if (reader.error()) return fail(*reader.error());
  return head;
}

}  // namespace vantage::bundle_folder
