#include "localize/foxglove_layout.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string_view>

#include "localize/run_topics.hpp"

namespace vantage {
namespace {

using Json = nlohmann::ordered_json;

/// Foxglove's path to a value of the diagnostics. The values are strings; Foxglove plots those that
/// are numbers.
std::string diagnostic(std::string_view key) {
  return fmt::format("{}.status[0].values[:]{{key==\"{}\"}}.value", topics::kDiagnostics, key);
}

Json path(const std::string& value, std::string_view label) {
  return {{"value", value},
          {"enabled", true},
          {"timestampMethod", "receiveTime"},
          {"label", std::string(label)}};
}

Json plot(const char* title, std::initializer_list<std::string_view> keys) {
  Json paths = Json::array();
  for (const std::string_view key : keys) paths.push_back(path(diagnostic(key), key));
  return {{"title", title},
          {"paths", std::move(paths)},
          {"showXAxisLabels", true},
          {"showYAxisLabels", true},
          {"showLegend", true},
          {"legendDisplay", "floating"},
          {"showPlotValuesInLegend", true},
          {"isSynced", true},
          {"xAxisVal", "timestamp"}};
}

Json view(bool has_map) {
  Json shown;
  if (has_map) {
    shown[topics::kMap] = {{"visible", true},
                           {"pointSize", 1.5},
                           {"colorMode", "colormap"},
                           {"colorField", "z"},
                           {"colorMap", "turbo"}};
  }
  shown[topics::kScan] = {
      {"visible", true}, {"pointSize", 2.5}, {"colorMode", "flat"}, {"flatColor", "#ffffffff"}};
  shown[topics::kPose] = {{"visible", true}, {"type", "axis"}, {"axisScale", 2.0}};
  return {{"followMode", "follow-position"},
          {"followTf", kScanFrame},
          {"cameraState",
           {{"distance", 80.0},
            {"perspective", true},
            {"phi", 50.0},
            {"thetaOffset", 45.0},
            {"target", {0.0, 0.0, 0.0}},
            {"targetOffset", {0.0, 0.0, 0.0}},
            {"targetOrientation", {0.0, 0.0, 0.0, 1.0}},
            {"fovy", 45.0},
            {"near", 0.5},
            {"far", 5000.0}}},
          {"scene", {{"backgroundColor", "#101418"}}},
          {"transforms", {{fmt::format("frame:{}", kMapFrame), {{"visible", false}}}}},
          {"topics", std::move(shown)},
          {"layers", Json::object()},
          {"imageMode", Json::object()}};
}

/// Two parts of the window, beside or below each other.
Json split(const char* direction, double percent, Json first, Json second) {
  return {{"direction", direction},
          {"first", std::move(first)},
          {"second", std::move(second)},
          {"splitPercentage", percent}};
}

}  // namespace

std::string foxglove_layout(bool has_map) {
  const Json states{{"paths",
                     {path(diagnostic("tracking"), "tracking"),
                      path(fmt::format("{}.data", topics::kRegion), "region")}},
                    {"isSynced", true}};
  const Json status{{"topicToRender", topics::kDiagnostics},
                    {"selectedHardwareId", ""},
                    {"selectedName", kStatusName},
                    {"collapsedSections", Json::array()}};
  const Json layout{
      {"configById",
       {{"3D!view", view(has_map)},
        {"StateTransitions!states", states},
        {"Plot!risk", plot("Integrity risk", {"risk"})},
        {"Plot!fit", plot("Fit", {"coverage", "nvtl", "fitness"})},
        {"Plot!times", plot("Times [ms]", {"scan_ms", "align_ms", "stall_ms", "search_ms"})},
        {"DiagnosticStatusPanel!status", status}}},
      {"globalVariables", Json::object()},
      {"userNodes", Json::object()},
      {"playbackConfig", {{"speed", 1}}},
      {"layout", split("row", 60.0, split("column", 78.0, "3D!view", "StateTransitions!states"),
                       split("column", 72.0,
                             split("column", 34.0, "Plot!risk",
                                   split("column", 50.0, "Plot!fit", "Plot!times")),
                             "DiagnosticStatusPanel!status"))}};
  return layout.dump(2) + "\n";
}

}  // namespace vantage
