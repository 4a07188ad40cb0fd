#include "foxglove/layout.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "vantage/kit/json_text.hpp"

namespace vantage::foxglove {
namespace {

using Json = nlohmann::ordered_json;

Json path(const std::string& value, const std::string& label) {
  return {
      {"value", value}, {"enabled", true}, {"timestampMethod", "receiveTime"}, {"label", label}};
}

Json plot(const std::string& diagnostics, const Plot& plot) {
  Json paths = Json::array();
  for (const std::string& key : plot.keys) paths.push_back(path(value_of(diagnostics, key), key));
  return {{"title", plot.title},
          {"paths", std::move(paths)},
          {"showXAxisLabels", true},
          {"showYAxisLabels", true},
          {"showLegend", true},
          {"legendDisplay", "floating"},
          {"showPlotValuesInLegend", true},
          {"isSynced", true},
          {"xAxisVal", "timestamp"}};
}

Json view(const LayoutNames& names) {
  Json shown;
  if (!names.map.empty()) {
    shown[names.map] = {{"visible", true},
                        {"pointSize", 1.5},
                        {"colorMode", "colormap"},
                        {"colorField", "z"},
                        {"colorMap", "turbo"}};
  }
  shown[names.scan] = {
      {"visible", true}, {"pointSize", 2.5}, {"colorMode", "flat"}, {"flatColor", "#ffffffff"}};
  shown[names.pose] = {{"visible", true}, {"type", "axis"}, {"axisScale", 2.0}};
  if (!names.path.empty()) shown[names.path] = {{"visible", true}};
  return {{"followMode", "follow-position"},
          {"followTf", names.follow},
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
          {"transforms", {{fmt::format("frame:{}", names.map_frame), {{"visible", false}}}}},
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

std::string value_of(const std::string& diagnostics, const std::string& key) {
  return fmt::format("{}.status[0].values[:]{{key==\"{}\"}}.value", diagnostics, key);
}

std::string layout(const LayoutNames& names) {
  const Json states{
      {"paths",
       {path(value_of(names.diagnostics, "tracking"), "tracking"), path(names.region, "region")}},
      {"isSynced", true}};
  const Json status{{"topicToRender", names.diagnostics},
                    {"selectedHardwareId", ""},
                    {"selectedName", names.status},
                    {"collapsedSections", Json::array()}};
  const Json layout{
      {"configById",
       {{"3D!view", view(names)},
        {"StateTransitions!states", states},
        {"Plot!risk", plot(names.diagnostics, names.plots[0])},
        {"Plot!fit", plot(names.diagnostics, names.plots[1])},
        {"Plot!times", plot(names.diagnostics, names.plots[2])},
        {"DiagnosticStatusPanel!status", status}}},
      {"globalVariables", Json::object()},
      {"userNodes", Json::object()},
      {"playbackConfig", {{"speed", 1}}},
      {"layout", split("row", 60.0, split("column", 78.0, "3D!view", "StateTransitions!states"),
                       split("column", 72.0,
                             split("column", 34.0, "Plot!risk",
                                   split("column", 50.0, "Plot!fit", "Plot!times")),
                             "DiagnosticStatusPanel!status"))}};
  return json_text(layout);
}

}  // namespace vantage::foxglove
