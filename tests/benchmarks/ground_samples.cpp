#include "ground_samples.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <stdexcept>

#include "support/process.hpp"

namespace vantage::benchmarks {

LabelledCloud read_labelled(const std::filesystem::path& file) {
  const std::string content = test::read_text(file);
  const auto require = [&](bool right, const char* what) {
    if (!right) throw std::runtime_error(file.string() + ": " + what);
  };
  const auto field = [&](const std::string& name) {
    const std::size_t at = content.find("\n" + name + " ");
    require(at != std::string::npos, "expected the header of a PCD file");
    const std::size_t begin = at + name.size() + 2;
    return content.substr(begin, content.find('\n', begin) - begin);
  };
  const std::string fields = field("FIELDS"), mark = "DATA binary\n";
  const bool labels = fields == "x y z label";
  require(labels || fields == "x y z", "expected the fields x y z, or x y z label");
  const std::size_t step = labels ? 16 : 12, n = std::stoul(field("POINTS"));
  const std::size_t mark_at = content.find(mark);
  require(mark_at != std::string::npos, "expected DATA binary");
  const std::size_t data = mark_at + mark.size();
  require(data + n * step <= content.size(), "the file ends before its last point");
  LabelledCloud cloud;
  for (std::size_t k = 0; k < n; ++k) {
    std::array<float, 3> xyz{};
    std::uint32_t label = 0;
    std::memcpy(xyz.data(), content.data() + data + k * step, 12);
    if (labels) std::memcpy(&label, content.data() + data + k * step + 12, 4);
    cloud.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    cloud.is_ground.push_back(label == 1);
  }
  return cloud;
}

std::vector<LabelledCloud> ground_samples(const std::filesystem::path& folder) {
  std::vector<LabelledCloud> samples;
  for (const std::string& name : kGroundSamples) {
    samples.push_back(read_labelled(folder / ("samp" + name + ".pcd")));
  }
  return samples;
}

GroundErrors errors_of(const LabelledCloud& cloud, const IndexList& ground) {
  std::vector<bool> found(cloud.points.size());
  for (const std::uint32_t k : ground) found[k] = true;
  double a = 0, b = 0, c = 0, d = 0;  // ground kept and lost, objects kept and removed
  for (std::size_t k = 0; k < found.size(); ++k) {
    (cloud.is_ground[k] ? (found[k] ? a : b) : (found[k] ? c : d)) += 1.0;
  }
  const double n = a + b + c + d, agreement = (a + d) / n;
  const double chance = ((a + b) * (a + c) + (c + d) * (b + d)) / (n * n);
  return {.type_1 = 100.0 * b / (a + b),
          .type_2 = 100.0 * c / (c + d),
          .total = 100.0 * (1.0 - agreement),
          .kappa = 100.0 * (agreement - chance) / (1.0 - chance)};
}

LabelledCloud side_by_side(std::span<const LabelledCloud> clouds, std::size_t least) {
  constexpr double kGap = 40.0, kAway = 0.25;  // [m]
  std::size_t once = 0;
  for (const LabelledCloud& cloud : clouds) once += cloud.points.size();
  const std::size_t copies = (least + once - 1) / once;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> away(-kAway, kAway);
  LabelledCloud all;
  double x = 0.0;
  for (const LabelledCloud& cloud : clouds) {
    const Bounds3 bounds = bounds_of(cloud.points);
    const Point shift(x - std::floor(bounds.min.x()), -std::floor(bounds.min.y()), 0.0);
    for (std::size_t copy = 0; copy < copies; ++copy) {
      for (const Point& p : cloud.points) {
        Point moved = p + shift;
        if (copy > 0) moved += Point(away(random), away(random), 0.0);
        all.points.push_back(moved);
      }
      all.is_ground.insert(all.is_ground.end(), cloud.is_ground.begin(), cloud.is_ground.end());
    }
    x = std::ceil(bounds.max.x() + shift.x() + kGap);
  }
  return all;
}

}  // namespace vantage::benchmarks
