#include "live/kept_state.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::live {

Result<std::optional<KeptState>> read_state(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  const auto refuse = [&](const char* what) {
    return fail(ErrorCode::corrupt_data, fmt::format("{}; delete the file to begin anew", what),
                SourceLocation{file.string(), 0, 0});
  };
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object()) return refuse("not the state of a session: expected a JSON object");
  std::array<double, 8> x{};
  constexpr std::array kKeys{"stamp", "x", "y", "z", "qx", "qy", "qz", "qw"};
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto found = json.find(kKeys[i]);
    if (found == json.end() || !found->is_number()) {
      return refuse("not the state of a session: expected stamp, x, y, z, qx, qy, qz and qw");
    }
    x[i] = found->get<double>();
  }
  KeptState state{.stamp = x[0], .T_map_sensor = {}};
  state.T_map_sensor.translation = {x[1], x[2], x[3]};
  state.T_map_sensor.rotation.coeffs() = Eigen::Vector4d(x[4], x[5], x[6], x[7]);
  if (!is_valid(state.T_map_sensor)) return refuse("the pose is not a rigid transform");
  return state;
}

Result<void> write_state(const std::filesystem::path& file, const KeptState& state) {
  const Eigen::Vector3d& t = state.T_map_sensor.translation;
  const auto& q = state.T_map_sensor.rotation;
  const nlohmann::json json{{"stamp", state.stamp}, {"x", t.x()},  {"y", t.y()},  {"z", t.z()},
                            {"qx", q.x()},          {"qy", q.y()}, {"qz", q.z()}, {"qw", q.w()}};
  VANTAGE_TRY(auto out, io::OutputFile::create(file));
  VANTAGE_CHECK(out.write(json_text(json)));
  return out.commit();
}

}  // namespace vantage::live
