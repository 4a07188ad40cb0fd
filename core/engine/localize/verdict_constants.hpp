#pragma once

#include <array>
#include <numbers>
#include <string_view>

namespace vantage {

/// A number that decides what is believed of a pose. docs/localization.md has a row for each.
struct VerdictConstant {
  std::string_view name;
  double value;
  std::string_view unit;
  std::string_view meaning;
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
inline constexpr VerdictConstant kScoreNoise{"score_noise", 0.012, "of the score",
                                             "the same for the mean of 512 points of a share",
                                             "not recorded"};
inline constexpr VerdictConstant kChange{"change", 0.15, "of the score",
                                         "what the map lacks may do to a share or a contrast; a "
                                         "rival scores at most so much less than the best",
                                         "213, other day, 302, 303"};
inline constexpr VerdictConstant kAgainst{
    "against", -1.0, "log odds", "evidence below it speaks against a pose", "not recorded"};

// The shares of right and of wrong poses.
inline constexpr VerdictConstant kLeastRight{
    "least_right", 0.08, "share", "the least share of a right pose", "street, demo, other day"};
inline constexpr VerdictConstant kMostRight{
    "most_right", 1.2, "share", "the largest share of a right pose", "street, demo, other day"};
inline constexpr VerdictConstant kAnything{"anything", 0.2, "of right poses",
                                           "have any share up to the largest", "not recorded"};
inline constexpr VerdictConstant kShareSpread{
    "share_spread", 0.35, "of the log",
    "deviation of the share from the usual one, from scan to scan", "not recorded"};
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
    "are wrong and fit like right ones, or are right and have a margin below 0",
    "street, other day, 301, 303, 311"};
inline constexpr VerdictConstant kNear{"near", 5e-4, "of poses",
                                       "are beside the right one, where matching settled",
                                       "other day, 302, 303"};

// The margins of right poses.
inline constexpr VerdictConstant kUsualNoise{"usual_noise", 2.5, "deviations",
                                             "that a margin may be below 0 by noise",
                                             "street, other day, 301, 303, 311"};
inline constexpr VerdictConstant kNegativeMargin{"negative_margin", 0.1, "of the score",
                                                 "the mean of margins below 0 that are no noise",
                                                 "street, other day, 301, 303, 311"};

// Contrasts; where a place exists twice, their mean is 0.
inline constexpr VerdictConstant kUsualSummit{"usual_summit", 0.55, "of the sharpness",
                                              "the mean contrast of the summit at right poses",
                                              "other day, 302, 303"};
inline constexpr VerdictConstant kUsualSlope{"usual_slope", 0.45, "of the sharpness",
                                             "the same of the slope", "other day, 302, 303"};
inline constexpr VerdictConstant kRightSpread{
    "right_spread", 0.1, "of the sharpness",
    "the deviation of both at right poses, without their noise", "other day, 302, 303"};
inline constexpr VerdictConstant kTwinSpread{"twin_spread", 0.12, "of the sharpness",
                                             "the same where a place exists twice",
                                             "other day, 302, 303"};

// What is off whatever its deviations say.
inline constexpr VerdictConstant kOutlier{"outlier", 1e-3, "of measurements",
                                          "priors, and contrasts", "other day, 302, 303"};
inline constexpr VerdictConstant kUsualPull{"usual_pull", 6.0, "deviations²",
                                            "of a pose from its prediction or its prior are usual",
                                            "the pose has six degrees of freedom"};
inline constexpr VerdictConstant kMostPull{
    "most_pull", 6.0, "log odds", "a pull of matching says so much against a pose, at the most",
    "not recorded"};

// What scans say together.
inline constexpr VerdictConstant kMostFar{
    "most_far", 40.0, "log odds", "all scans are worth so much against a pose far off, at the most",
    "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kMeanOf{"mean_of", 5.0, "scans",
                                         "so many independent scans are in a mean",
                                         "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kLeastNews{
    "least_news", 0.1, "of a scan", "counts a scan at the place of the last one", "not recorded"};
inline constexpr VerdictConstant kToldChange{
    "told_change", 3.0, "log odds",
    "a scan that says so much more or less than the last one counts fully", "not recorded"};
inline constexpr VerdictConstant kBeyondDoubt{
    "beyond_doubt", 9.0, "log odds", "what says more counts as equal in that", "not recorded"};
inline constexpr VerdictConstant kPreference{"preference", 15.0, "log odds",
                                             "a scan that has no sharpness at one pose, and some "
                                             "at another, says so much against the former",
                                             "not recorded"};
inline constexpr VerdictConstant kNothingFits{
    "nothing_fits", -3.0, "log odds", "a scan that matches nothing; a refuted pose that fits again",
    "other day, 301, lost_2, a street of the tests"};

// What happened between scans.
inline constexpr VerdictConstant kDoubt{
    "doubt", 0.05, "probability",
    "that a surprise was a kidnap; that another place is alike, before a comparison",
    "not recorded"};
inline constexpr VerdictConstant kUnnoticed{
    "unnoticed", 3e-5, "per m", "the sensor is carried to a place alike unnoticed", "not recorded"};
inline constexpr VerdictConstant kMostDoubt{"most_doubt", 0.9, "probability",
                                            "that a vague prediction is wrong, at the most",
                                            "not recorded"};
inline constexpr VerdictConstant kUnusual{
    "unusual", 6.0, "mean changes", "a fall of the score by so many is a surprise", "not recorded"};
inline constexpr VerdictConstant kFirstChange{"first_change", 0.05, "of the log",
                                              "the mean change at first", "not recorded"};
inline constexpr VerdictConstant kLeastChange{"least_change", 0.01, "of the log",
                                              "the least mean change", "not recorded"};
inline constexpr VerdictConstant kMostJump{"most_jump", 4.0, "mean changes",
                                           "a jump counts in the mean change at the most",
                                           "not recorded"};
inline constexpr VerdictConstant kLearning{"learning", 0.1, "of a scan",
                                           "a new scan in what is usual", "not recorded"};
inline constexpr VerdictConstant kFall{"fall", 0.2, "of the score",
                                       "a score less than so much below the usual one is usual",
                                       "not recorded"};

// Poses, starts and searches.
inline constexpr VerdictConstant kSameMetres{
    "same_metres", 0.3, "m", "poses that are nearer to each other are one; the deviation of a find",
    "not recorded"};
inline constexpr VerdictConstant kSameDegrees{
    "same_degrees", 3.0, "deg",
    "the same for the angle between them; what matching errs by in a changed world",
    "not recorded"};
inline constexpr double kSameRadians = kSameDegrees * std::numbers::pi / 180.0;
inline constexpr VerdictConstant kChangedMetres{
    "changed_metres", 0.2, "m", "what matching errs by in a changed world", "not recorded"};
inline constexpr VerdictConstant kTrust{
    "trust", 0.97, "probability",
    "that a given start is right, or that a search of a narrow area finds the sensor",
    "not recorded"};
inline constexpr VerdictConstant kRecall{
    "recall", 0.9, "probability", "that a search finds the place of the sensor", "not recorded"};
inline constexpr VerdictConstant kInArea{
    "in_area", 0.5, "probability",
    "that the sensor is in the area of a search of a part of the map", "not recorded"};
inline constexpr VerdictConstant kNarrow{"narrow", 50.0, "m", "an area is narrow", "not recorded"};
inline constexpr VerdictConstant kNowhere{"nowhere", 0.01, "probability",
                                          "that the sensor is nowhere in the map",
                                          "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kMostFailed{"most_failed", 3.0, "searches",
                                             "that failed count, at the most",
                                             "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kExpected{
    "expected", 4.0, "places", "tried by a search, count as much as what the model expects of them",
    "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kSamePlace{
    "same_place", 5.0, "m", "what a search tried nearer to a pose does not count for it",
    "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kMostScale{"most_scale", 0.12, "share",
                                            "the mean share of what a search tried, at the most",
                                            "other day, 301, lost_2, a street of the tests"};
inline constexpr VerdictConstant kMostlyBelieved{"mostly_believed", 0.8, "probability",
                                                 "of a pose with less, others are looked for",
                                                 "not recorded"};

/// All of them.
inline constexpr std::array kVerdictConstants{
    kBasin,       kPointNoise, kScoreNoise,  kChange,         kAgainst,      kLeastRight,
    kMostRight,   kAnything,   kShareSpread, kFarScale,       kSimilarScale, kSimilar,
    kAlike,       kNear,       kUsualNoise,  kNegativeMargin, kUsualSummit,  kUsualSlope,
    kRightSpread, kTwinSpread, kOutlier,     kUsualPull,      kMostPull,     kMostFar,
    kMeanOf,      kLeastNews,  kToldChange,  kBeyondDoubt,    kPreference,   kNothingFits,
    kDoubt,       kUnnoticed,  kMostDoubt,   kUnusual,        kFirstChange,  kLeastChange,
    kMostJump,    kLearning,   kFall,        kSameMetres,     kSameDegrees,  kChangedMetres,
    kTrust,       kRecall,     kInArea,      kNarrow,         kNowhere,      kMostFailed,
    kExpected,    kSamePlace,  kMostScale,   kMostlyBelieved};

}  // namespace vantage
