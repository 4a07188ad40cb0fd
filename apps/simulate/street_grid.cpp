#include "simulate/street_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

int number_of_streets(double size, double spacing) {
  return std::max(2, static_cast<int>(size / spacing + 1e-9));
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                           const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

}  // namespace

StreetGrid::StreetGrid(const CampusParams& params, std::uint64_t seed)
    : count_{number_of_streets(params.size_x, params.street_spacing),
             number_of_streets(params.size_y, params.street_spacing)},
      spacing_(params.size_x / count_[0], params.size_y / count_[1]) {
  const Eigen::Vector2d half(params.size_x / 2.0, params.size_y / 2.0);
  const auto coordinate = [](int i, double spacing, double half_size) {
    return std::clamp((i + 0.5) * spacing - half_size, -half_size, half_size);
  };
  for (int j = -1; j <= count_[1]; ++j) {
    for (int i = -1; i <= count_[0]; ++i) {
      // The end of a street on the border continues straight from the last crossing.
      const int ii = std::clamp(i, 0, count_[0] - 1), jj = std::clamp(j, 0, count_[1] - 1);
      Random random(hash(seed, Purpose::streets, ii, jj));
      const Eigen::Vector2d jitter = params.street_jitter * random.vector<2>(&Random::symmetric);
      nodes_.emplace_back(
          coordinate(i, spacing_.x(), half.x()) + (is_border_x(i) ? 0.0 : jitter.x()),
          coordinate(j, spacing_.y(), half.y()) + (is_border_y(j) ? 0.0 : jitter.y()));
    }
  }
}

const Eigen::Vector2d& StreetGrid::node(int i, int j) const noexcept {
  return nodes_[static_cast<std::size_t>((j + 1) * (count_[0] + 2) + i + 1)];
}

Result<std::vector<Eigen::Vector2d>> StreetGrid::route(int number) const {
  const int nx = count_[0], ny = count_[1];
  std::vector<std::array<int, 2>> turns;
  if (number == 0) {
    const int ax = nx / 6, ay = ny / 6;
    turns = {{ax, ay}, {nx - 1 - ax, ay}, {nx - 1 - ax, ny - 1 - ay}, {ax, ny - 1 - ay}};
  } else if (number == 1) {
    // Up and down one set of streets and back along the first street of the other set. Only an even
    // number of streets leads back to that street; an odd one out is left out.
    const bool is_turned = nx % 2 != 0 && ny % 2 == 0;
    const int columns = is_turned ? ny : nx - nx % 2, rows = is_turned ? nx : ny;
    const auto add = [&](int column, int row) {
      turns.push_back(is_turned ? std::array{row, column} : std::array{column, row});
    };
    for (int column = 0; column < columns; ++column) {
      const int near = column == 0 || column == columns - 1 ? 0 : 1;
      add(column, column % 2 == 0 ? near : rows - 1);
      add(column, column % 2 == 0 ? rows - 1 : near);
    }
  } else {
    if (nx < 3 || ny < 3) {
      return fail_at({"drive.route"},
                     "drive.route = 2 needs at least 3 streets each way, but this campus has " +
                         std::to_string(nx) + " and " + std::to_string(ny) +
                         ": lower campus.street_spacing or enlarge the campus");
    }
    const int mx = nx / 2, my = ny / 2;
    turns = {{0, 0}, {mx, 0}, {mx, ny - 1}, {nx - 1, ny - 1}, {nx - 1, my}, {0, my}};
  }
  std::vector<Eigen::Vector2d> crossings;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const auto [i0, j0] = turns[k];
    const auto [i1, j1] = turns[(k + 1) % turns.size()];
    const int steps = std::max(std::abs(i1 - i0), std::abs(j1 - j0));
    for (int s = 0; s < steps; ++s) {
      crossings.push_back(node(i0 + (i1 - i0) / steps * s, j0 + (j1 - j0) / steps * s));
    }
  }
  return crossings;
}

std::vector<std::vector<Eigen::Vector2d>> StreetGrid::routes() const {
  std::vector<std::vector<Eigen::Vector2d>> all;
  for (int number = 0; number < 3; ++number) {
    if (auto found = route(number)) all.push_back(*std::move(found));
  }
  return all;
}

double StreetGrid::distance_to_street(const Eigen::Vector2d& p) const noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  for (int j = -1; j <= count_[1]; ++j) {
    for (int i = -1; i <= count_[0]; ++i) {
      if (i < count_[0] && !is_border_y(j)) {
        nearest = std::min(nearest, distance_to_segment(p, node(i, j), node(i + 1, j)));
      }
      if (j < count_[1] && !is_border_x(i)) {
        nearest = std::min(nearest, distance_to_segment(p, node(i, j), node(i, j + 1)));
      }
    }
  }
  return nearest;
}

}  // namespace vantage::simulation
