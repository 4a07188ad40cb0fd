#include "simulate/terrain.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

struct Octave {
  double wavelength;  // [m]
  double weight;
};
constexpr std::array kOctaves{Octave{120.0, 0.75}, Octave{40.0, 0.2}, Octave{12.0, 0.05}};

double lattice_value(std::uint64_t seed, std::size_t octave, std::int64_t x, std::int64_t y) {
  return Random(hash(seed, Purpose::terrain, octave, x, y)).symmetric();
}

/// Value noise in [-1, 1] with continuous second derivatives.
double value_noise(std::uint64_t seed, std::size_t octave, double x, double y) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy);
  const auto ease = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
  const double u = ease(x - fx), v = ease(y - fy);
  const double low =
      std::lerp(lattice_value(seed, octave, ix, iy), lattice_value(seed, octave, ix + 1, iy), u);
  const double high = std::lerp(lattice_value(seed, octave, ix, iy + 1),
                                lattice_value(seed, octave, ix + 1, iy + 1), u);
  return std::lerp(low, high, v);
}

}  // namespace

Terrain::Terrain(const CampusParams& params, std::uint64_t seed)
    : half_size_(params.size_x / 2.0, params.size_y / 2.0),
      columns_(static_cast<int>(std::ceil(params.size_x / params.ground_cell)) + 1),
      rows_(static_cast<int>(std::ceil(params.size_y / params.ground_cell)) + 1) {
  cell_ = (2.0 * half_size_).cwiseQuotient(Eigen::Vector2d(columns_ - 1, rows_ - 1));
  heights_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const double x = i * cell_.x() - half_size_.x(), y = j * cell_.y() - half_size_.y();
      double height = 0.0;
      for (std::size_t k = 0; k < kOctaves.size(); ++k) {
        height += kOctaves[k].weight *
                  value_noise(seed, k, x / kOctaves[k].wavelength, y / kOctaves[k].wavelength);
      }
      heights_.push_back(height);
    }
  }
  const auto [low, high] = std::minmax_element(heights_.begin(), heights_.end());
  const double middle = (*low + *high) / 2.0, scale = params.ground_relief / (*high - *low);
  for (double& height : heights_) height = (height - middle) * scale;
  if (params.layout == Layout::square) flatten(params.square_radius);
}

void Terrain::flatten(double radius) {
  constexpr double kSlope = 10.0;  // from the plane to the hills around it [m]
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const double beyond = (vertex(i, j).head<2>().norm() - radius) / kSlope;
      const double t = std::clamp(beyond, 0.0, 1.0);
      heights_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(i)] *= t * t * (3.0 - 2.0 * t);
    }
  }
}

Eigen::Vector3d Terrain::vertex(int i, int j) const noexcept {
  const auto index = static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                     static_cast<std::size_t>(i);
  return {i * cell_.x() - half_size_.x(), j * cell_.y() - half_size_.y(), heights_[index]};
}

double Terrain::height(double x, double y) const noexcept {
  const double u = std::clamp((x + half_size_.x()) / cell_.x(), 0.0, columns_ - 1.0);
  const double v = std::clamp((y + half_size_.y()) / cell_.y(), 0.0, rows_ - 1.0);
  const int i = std::min(static_cast<int>(u), columns_ - 2);
  const int j = std::min(static_cast<int>(v), rows_ - 2);
  const double fu = u - i, fv = v - j;
  const double h00 = vertex(i, j).z(), h11 = vertex(i + 1, j + 1).z();
  // Every cell is cut from its lower left to its upper right corner.
  if (fu >= fv) {
    const double h10 = vertex(i + 1, j).z();
    return h00 + fu * (h10 - h00) + fv * (h11 - h10);
  }
  const double h01 = vertex(i, j + 1).z();
  return h00 + fu * (h11 - h01) + fv * (h01 - h00);
}

Eigen::Vector3d Terrain::normal(const Eigen::Vector2d& p) const noexcept {
  constexpr double kReach = 0.6;
  const double dx = (height(p.x() + kReach, p.y()) - height(p.x() - kReach, p.y())) / (2 * kReach);
  const double dy = (height(p.x(), p.y() + kReach) - height(p.x(), p.y() - kReach)) / (2 * kReach);
  return Eigen::Vector3d(-dx, -dy, 1.0).normalized();
}

}  // namespace vantage::simulation
