#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>

#include "common/guards.hpp"
#include "common/steps.hpp"
#include "vantage/params.hpp"

namespace vantage::matching {

/// Documentation of those shared parameters that each matcher words in its own way.
struct StepTexts {
  std::string_view max_iterations, min_matches, min_coverage;
};

/// Parameters of the steps, and of the least overlap that gives an answer. A matcher's Params
/// derive from this struct.
struct StepParams {
  std::uint32_t max_iterations = 30;
  double translation_epsilon = 1e-3;
  double rotation_epsilon = 1e-4;
  double max_step_translation = 0.5;
  double max_step_rotation = 0.1;
  std::uint32_t min_matches = 20;
  double min_coverage = 0.05;

  /// @tparam Params  the struct that derives from this one
  template <class Params>
  [[nodiscard]] static constexpr auto step_fields(const StepTexts& texts) {
    const auto of = []<class T>(T StepParams::*member) -> T Params::* { return member; };
    return std::tuple{
        optional("max_iterations", of(&StepParams::max_iterations), "", texts.max_iterations,
                 at_least(1)),
        optional("translation_epsilon", of(&StepParams::translation_epsilon), "m",
                 "matching ends after a step below both this and rotation_epsilon", positive),
        optional("rotation_epsilon", of(&StepParams::rotation_epsilon), "rad",
                 "matching ends after a step below both this and translation_epsilon", positive),
        optional("max_step_translation", of(&StepParams::max_step_translation), "m",
                 "longer steps are shortened to this", positive),
        optional("max_step_rotation", of(&StepParams::max_step_rotation), "rad",
                 "longer steps are shortened to this", positive),
        optional("min_matches", of(&StepParams::min_matches), "points", texts.min_matches,
                 at_least(1)),
        optional("min_coverage", of(&StepParams::min_coverage), "", texts.min_coverage,
                 between(0.0, 1.0))};
  }

  [[nodiscard]] StepOptions steps() const noexcept {
    return {.max_iterations = max_iterations,
            .translation_epsilon = translation_epsilon,
            .rotation_epsilon = rotation_epsilon,
            .max_step_translation = max_step_translation,
            .max_step_rotation = max_step_rotation};
  }
  [[nodiscard]] LeastOverlap least_overlap() const noexcept { return {min_matches, min_coverage}; }
};

}  // namespace vantage::matching
