#pragma once

#include <array>
#include <numbers>
#include <string_view>

namespace vantage {

/// A number that decides what is believed of a pose. docs/localization.md has a row for each.
struct VerdictConstant {
  std::string_view name;
  double value;
  std::string_view unit;     ///< empty: a number
  std::string_view meaning;  ///< with what it is used for
  std::string_view chosen_on;
  constexpr operator double() const noexcept { return value; }
};

// What a scan shows at a pose.
inline constexpr VerdictConstant kBasin{"basin", 2.0, "m",
                                        "a matcher comes back from less: sharpness and contrast "
                                        "look so far, and scans so far apart are independent",
                                        "street, demo"};
inline constexpr VerdictConstant kPointNoise{"point_noise", 0.3, "of the score",
                                             "deviation of the score of one point",
                                             "street, other day, 301, 303, 311"};
inline constexpr VerdictConstant kChange{"change", 0.15, "of the score",
                                         "what the map lacks may do to a share, a contrast or a "
                                         "score; a rival scores at most so much less than the best",
                                         "213, other day, 302, 303, 606"};

// The shares of right and of wrong poses.
inline constexpr VerdictConstant kLeastRight{
    "least_right", 0.08, "share", "the least share of a right pose", "street, demo, other day"};
inline constexpr VerdictConstant kFarScale{"far_scale", 0.015, "share",
                                           "the mean share of poses that are far off",
                                           "street, demo, other day"};
inline constexpr VerdictConstant kSimilarScale{
    "similar_scale", 0.06, "share", "the mean share of similar poses", "street, demo, other day"};
inline constexpr VerdictConstant kSimilar{"similar", 0.1, "of wrong poses",
                                          "are similar: they fit a little all along",
                                          "street, demo, other day"};
inline constexpr VerdictConstant kAlike{
    "alike", 1e-4, "of poses",
    "are wrong and fit like right ones, or are right and have a margin below 0; a pose becomes one "
    "of them once in so many independent scans",
    "street, other day, 301, 303, 311"};
inline constexpr VerdictConstant kOutlier{
    "outlier", 5e-4, "of measurements",
    "are off whatever their deviations say: priors, directions that point up, pulls of matching, "
    "contrasts, and poses in which matching settles beside the right one",
    "other day, 302, 303, a street of the tests"};

// Contrasts; where a place exists twice, their mean is 0.
inline constexpr VerdictConstant kContrast{
    "contrast", 0.5, "of the sharpness",
    "the mean contrast of right poses, half a spread more at summits and less on slopes; where a "
    "place exists twice, it is 0",
    "302, 303, a street of the tests"};
inline constexpr VerdictConstant kContrastSpread{"contrast_spread", 0.1, "of the sharpness",
                                                 "the deviation of contrasts, without their noise",
                                                 "302, 303"};

// What scans say together.
inline constexpr VerdictConstant kMostFar{
    "most_far", 40.0, "log odds", "all scans are worth so much against a pose far off, at the most",
    "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kMeanOf{"mean_of", 5.0, "scans",
                                         "so many independent scans are in a mean",
                                         "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kUnusual{
    "unusual", 6.0, "", "a fall of the score by so many times its usual change is a surprise",
    "not recorded"};
inline constexpr VerdictConstant kPreference{"preference", 15.0, "log odds",
                                             "a scan that has no sharpness at one pose, and some "
                                             "at another, says so much against the former",
                                             "not recorded"};
inline constexpr VerdictConstant kDoubt{
    "doubt", 0.05, "probability",
    "that a start is wrong, that a surprise was a kidnap, that a refuted pose is right after all, "
    "that a scan matches nothing at a right pose",
    "not recorded"};

// Poses and searches.
inline constexpr VerdictConstant kSameMetres{
    "same_metres", 0.3, "m",
    "poses that are nearer to each other are one; errors of matching in a changed world",
    "not recorded"};
inline constexpr VerdictConstant kSameDegrees{
    "same_degrees", 3.0, "deg", "the same for the angle between them", "not recorded"};
inline constexpr double kSameRadians = kSameDegrees * std::numbers::pi / 180.0;
inline constexpr VerdictConstant kRecall{"recall", 0.97, "probability",
                                         "that a search finds the place of the sensor",
                                         "lost_2, a street of the tests"};
inline constexpr VerdictConstant kNowhere{"nowhere", 0.01, "probability",
                                          "that the sensor is nowhere in the map",
                                          "other day, 301, lost_2, a street of the tests"};

/// All of them.
inline constexpr std::array kVerdictConstants{
    kBasin,      kPointNoise, kChange,     kLeastRight,     kFarScale, kSimilarScale, kSimilar,
    kAlike,      kOutlier,    kContrast,   kContrastSpread, kMostFar,  kMeanOf,       kUnusual,
    kPreference, kDoubt,      kSameMetres, kSameDegrees,    kRecall,   kNowhere};
static_assert(kVerdictConstants.size() <= 20);

}  // namespace vantage
