#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/params.hpp"
#include "vantage/result.hpp"

/// The contract of every plugin kind as numbered clauses (docs/contracts.md). Plugin authors run
/// them with the program `vantage-conformance`, or in a doctest program of their own:
///
///     TEST_CASE("my_split keeps the contract of a partitioner") {
///       vantage::conformance::check(
///           vantage::conformance::Subject::from(MY_SPLIT_SO, "params.toml").value());
///     }
namespace vantage::conformance {

/// What a plugin promises beyond its interface, or does not promise: [claims] of PARAMS.toml. The
/// suite holds the plugin to its claims.
struct PartitionerClaims {
  bool needs_trajectory = false;
  static constexpr auto schema() {
    return std::tuple{optional("needs_trajectory", &PartitionerClaims::needs_trajectory, "",
                               "without a trajectory it reports invalid_input")};
  }
};
struct GroundClaims {
  double box_width = 3.0, box_height = 1.5, cell = 0.25;
  static constexpr auto schema() {
    return std::tuple{
        optional("box_width", &GroundClaims::box_width, "m",
                 "a box of this width on the ground is distinguished from the ground", positive),
        optional("box_height", &GroundClaims::box_height, "m", "the height of that box", positive),
        optional("cell", &GroundClaims::cell, "m", "distance between the points in this test",
                 positive)};
  }
  [[nodiscard]] Result<void> validate() const {
    if (4.0 * cell <= box_width) return {};
    return fail_at({"cell", "box_width"}, "'cell' must be at most a quarter of 'box_width'");
  }
};
struct VisibilityClaims {
  bool occlusion = true;
  double gap = 4.0;
  static constexpr auto schema() {
    return std::tuple{
        optional("occlusion", &VisibilityClaims::occlusion, "",
                 "false for an operator that sees through walls, as the baseline keep_all does"),
        optional("gap", &VisibilityClaims::gap, "m",
                 "a wall this far behind another, sampled every 10 cm at 5 m, is hidden",
                 positive)};
  }
};
struct StoreClaims {
  double precision = 0.0;
  std::filesystem::path bundle;
  static constexpr auto schema() {
    return std::tuple{
        optional("precision", &StoreClaims::precision, "m",
                 "coordinates of a region of 100 m come back within this", non_negative),
        optional("bundle", &StoreClaims::bundle, "",
                 "of a store that only reads: a folder of three regions or more that "
                 "it reads, which is copied into {folder}")};
  }
};
struct MatcherClaims {
  double offset = 0.3, rotation = 2.0, accuracy = 0.02, accuracy_rotation = 0.2;
  static constexpr auto schema() {
    return std::tuple{optional("offset", &MatcherClaims::offset, "m",
                               "a guess displaced by this is corrected", positive),
                      optional("rotation", &MatcherClaims::rotation, "deg",
                               "a guess rotated by this is corrected", positive),
                      optional("accuracy", &MatcherClaims::accuracy, "m",
                               "the corrected position is within this", positive),
                      optional("accuracy_rotation", &MatcherClaims::accuracy_rotation, "deg",
                               "the corrected rotation is within this", positive)};
  }
  /// A matcher that only returns the guess must fail.
  [[nodiscard]] Result<void> validate() const {
    if (2.0 * accuracy > offset) {
      return fail_at({"accuracy", "offset"}, "'accuracy' must be at most half of 'offset'");
    }
    if (2.0 * accuracy_rotation > rotation) {
      return fail_at({"accuracy_rotation", "rotation"},
                     "'accuracy_rotation' must be at most half of 'rotation'");
    }
    return {};
  }
};
struct SelectorClaims {
  static constexpr auto schema() { return std::tuple{}; }
};
struct RelocalizerClaims {
  double accuracy = 2.0, accuracy_rotation = 6.0, tilt = 0.0;
  static constexpr auto schema() {
    return std::tuple{
        optional("accuracy", &RelocalizerClaims::accuracy, "m",
                 "a candidate is within this of the sensor", positive),
        optional("accuracy_rotation", &RelocalizerClaims::accuracy_rotation, "deg",
                 "and turned by no more than this", positive),
        optional("tilt", &RelocalizerClaims::tilt, "deg",
                 "a sensor at this tilt is found without being told where up is", between(0, 90))};
  }
};
/// The index is the kind.
using Claims = std::variant<PartitionerClaims, GroundClaims, VisibilityClaims, StoreClaims,
                            MatcherClaims, SelectorClaims, RelocalizerClaims>;

inline constexpr std::uint32_t kDefaultSeed = 20260101;

/// The plugin under test: its file, its parameters, its claims, and the seed of all random cases.
class Subject {
 public:
  /// @param params_file  TOML with the tables [params] and [claims], each optional. In strings of
  ///                     [params], "{folder}" stands for a new folder, which a store needs.
  /// Errors: a file that is not a plugin (see PluginLoader); a params file that is wrong.
  [[nodiscard]] static Result<Subject> from(const std::filesystem::path& library,
                                            const std::filesystem::path& params_file,
                                            std::uint32_t seed = kDefaultSeed);

  [[nodiscard]] const PluginInfo& info() const noexcept { return info_; }
  [[nodiscard]] std::uint32_t seed() const noexcept { return seed_; }
  /// As written in the params file.
  [[nodiscard]] const Table& params() const noexcept { return params_; }
  /// Precondition: T is the type of the claims for the plugin's kind.
  template <class T>
  [[nodiscard]] const T& claims() const {
    return std::get<T>(claims_);
  }

  /// Makes an object of the plugin with other parameters.
  template <class Interface>
  [[nodiscard]] Result<PluginPtr<Interface>> create(const Table& params) const {
    return PluginLoader({}).load<Interface>(choice(params));
  }
  /// Makes an object of the plugin. A failure fails the clause and ends it.
  template <class Interface>
  [[nodiscard]] PluginPtr<Interface> make() const {
    auto object = create<Interface>(params_);
    if (!object) FAIL("cannot make the plugin: " << to_string(object.error()));
    return *std::move(object);
  }
  [[nodiscard]] Result<Table> effective_params(const Table& params) const {
    return PluginLoader({}).effective_params(info_.kind, choice(params));
  }
  /// The params with "{folder}" replaced.
  [[nodiscard]] Table params_in(const std::filesystem::path& folder) const;

 private:
  Subject() = default;
  [[nodiscard]] PluginChoice choice(const Table& params) const {
    return {info_.name, info_.path, params, {}};
  }

  PluginInfo info_;
  Table params_;
  Claims claims_;
  std::uint32_t seed_ = kDefaultSeed;
};

/// One promise that every plugin of a kind makes.
struct Clause {
  std::string_view id;            ///< "P2"
  std::string_view text;          ///< what must hold
  void (*check)(const Subject&);  ///< fails doctest assertions; see conformance::check
};

/// The clauses of a kind; those of all kinds (C1, ...) come first.
[[nodiscard]] std::vector<Clause> clauses_of(PluginKind kind);

/// The name of a clause's SUBCASE: "P2: every map point ...".
[[nodiscard]] std::string subcase_name(const Clause& clause);

/// Checks one clause in a SUBCASE of its name. Call it in a TEST_CASE.
/// @return why the clause, or the rest of it, does not apply to the plugin; "" if all was checked
std::string check(const Subject& subject, const Clause& clause);
/// Checks every clause of the plugin's kind.
void check(const Subject& subject);

}  // namespace vantage::conformance
