#include "simulate/changes.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulate/block.hpp"
#include "simulate/objects.hpp"
#include "simulate/random.hpp"
#include "vantage/params.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

constexpr int kPlacesTried = 3000;

/// What random numbers of a change are for.
enum class Change : std::uint64_t {
  cars_gone,
  cars_new,
  buildings_gone,
  buildings_new,
  leaves_gone,
  fences_new,
  rebuilt_half
};

template <class... Numbers>
Random random_of(const WorldParams& params, Change change, Numbers... numbers) {
  return Random(hash(params.seed, Purpose::change, change, numbers...));
}

/// The indices below `size` in random order.
std::vector<std::size_t> shuffled(std::size_t size, Random random) {
  std::vector<std::pair<std::uint64_t, std::size_t>> keys;
  for (std::size_t k = 0; k < size; ++k) keys.emplace_back(random.next(), k);
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> order;
  for (const auto& [key, k] : keys) order.push_back(k);
  return order;
}

class Changer {
 public:
  Changer(const Campus& campus, const WorldParams& params, const StreetGrid& streets,
          const Terrain& terrain)
      : campus_(campus),
        params_(params),
        changes_(params.changes),
        terrain_(terrain),
        gone_(campus.things.size(), false) {
    for (int j = 0; j <= streets.streets_y(); ++j) {
      for (int i = 0; i <= streets.streets_x(); ++i) {
        if (auto block = block_between(streets, params.campus.street_width, i, j)) {
          blocks_.push_back(*block);
        }
      }
    }
  }

  [[nodiscard]] Result<Campus> change() && {
    move_cars();
    VANTAGE_CHECK(remove_buildings());
    VANTAGE_CHECK(add_buildings());
    VANTAGE_CHECK(add_fences());
    if (changes_.rebuilt_half) rebuild_half();
    Campus result = without(with_fewer_leaves(), gone_);
    result.add(std::move(new_));
    return result;
  }

 private:
  [[nodiscard]] std::vector<std::size_t> things(Surface kind) const {
    std::vector<std::size_t> found;
    for (std::size_t k = 0; k < campus_.things.size(); ++k) {
      if (campus_.things[k].kind == kind) found.push_back(k);
    }
    return found;
  }

  [[nodiscard]] std::vector<Plot> plots(std::initializer_list<Surface> kinds) const {
    std::vector<Plot> found;
    for (const auto* things : {&campus_.things, &new_.things}) {
      for (const Thing& thing : *things) {
        if (std::ranges::find(kinds, thing.kind) != kinds.end()) found.push_back(thing.plot);
      }
    }
    return found;
  }

  void move_cars() {
    const auto cars = things(Surface::car);
    const auto moved = static_cast<std::size_t>(
        std::lround(changes_.moved_cars * static_cast<double>(cars.size())));
    const auto leaving = shuffled(cars.size(), random_of(params_, Change::cars_gone));
    for (std::size_t k = 0; k < moved; ++k) gone_[cars[leaving[k]]] = true;

    const auto& places = campus_.free_parking;
    const auto taken = shuffled(places.size(), random_of(params_, Change::cars_new));
    for (std::size_t k = 0; k < std::min(moved, taken.size()); ++k) {
      const ParkingPlace& place = places[taken[k]];
      Random random = random_of(params_, Change::cars_new, k);
      const double direction = random.chance(0.8) ? 1.0 : -1.0;
      const Vector2d centre = place.middle + random.uniform(-0.5, 0.5) * place.along;
      new_.add(Surface::car, {centre, place.along, {2.4, 0.95}},
               make_car(centre, direction * place.along, terrain_, random));
    }
  }

  [[nodiscard]] Result<void> remove_buildings() {
    const auto buildings = things(Surface::building);
    const auto count = static_cast<std::size_t>(changes_.buildings_gone);
    if (count > buildings.size()) {
      return fail_at({"changes.buildings_gone"},
                     "changes.buildings_gone = " + std::to_string(count) +
                         ", but the campus has only " + std::to_string(buildings.size()) +
                         " buildings");
    }
    const auto order = shuffled(buildings.size(), random_of(params_, Change::buildings_gone));
    for (std::size_t k = 0; k < count; ++k) gone_[buildings[order[k]]] = true;
    return {};
  }

  /// The first place of many that suits. `draw` proposes one, or nothing.
  template <class Draw>
  [[nodiscard]] Result<Plot> find_place(Draw draw, const char* key, const char* what) const {
    for (int k = 0; k < kPlacesTried; ++k) {
      if (const std::optional<Plot> plot = draw(k)) return *plot;
    }
    return fail_at({key}, std::string(key) + ": the campus has no place left for " + what);
  }

  /// @param suits  whether a building may stand there
  template <class Suits>
  [[nodiscard]] Result<void> add_building(Random random, const char* key, Suits suits) {
    constexpr double kMargin = 2.2;  // from the border of the block, as for the others
    const auto taken = plots({Surface::building, Surface::wall, Surface::overpass});
    const auto draw = [&](int tries) -> std::optional<Plot> {
      const Block& block = blocks_[random.next() % blocks_.size()];
      const double largest = std::lerp(6.0, 2.8, static_cast<double>(tries) / kPlacesTried);
      const double half_x = random.uniform(2.8, largest), half_y = random.uniform(2.8, largest);
      const double u = random.uniform(), v = random.uniform();
      const Plot plot{block.corners[0] + u * (block.corners[1] - block.corners[0]) +
                          v * (block.corners[3] - block.corners[0]),
                      block.along(0),
                      {half_x, half_y}};
      if (!block.contains(plot, kMargin) || !is_free(plot.grown(kGap), taken) || !suits(plot)) {
        return std::nullopt;
      }
      return plot;
    };
    VANTAGE_TRY(const Plot plot, find_place(draw, key, "a building"));
    new_.add(Surface::building, plot, make_building(BuildingShape::box, plot, terrain_, random));
    for (const std::size_t plant : things(Surface::vegetation)) {
      if (overlap(plot.grown(2.0), campus_.things[plant].plot)) gone_[plant] = true;
    }
    return {};
  }

  [[nodiscard]] Result<void> add_buildings() {
    for (int k = 0; k < changes_.buildings_new; ++k) {
      VANTAGE_CHECK(add_building(random_of(params_, Change::buildings_new, k),
                                 "changes.buildings_new", [](const Plot&) { return true; }));
    }
    return {};
  }

  void rebuild_half() {
    const auto is_there = [](const Plot& plot) { return plot.centre.x() > 0.0; };
    int count = 0;
    for (const std::size_t building : things(Surface::building)) {
      if (!is_there(campus_.things[building].plot)) continue;
      gone_[building] = true;
      ++count;
    }
    for (int k = 0; k < count; ++k) {
      const auto added = add_building(random_of(params_, Change::rebuilt_half, k),
                                      "changes.rebuilt_half", is_there);
      if (!added) break;  // there is no place left
    }
  }

  /// On the line between a verge and its block, where nothing else stands.
  [[nodiscard]] Result<void> add_fences() {
    constexpr double kHalfThickness = 0.08, kFromCorner = 1.0;
    std::vector<Plot> taken = plots({Surface::overpass});
    for (int k = 0; k < changes_.fences_new; ++k) {
      Random random = random_of(params_, Change::fences_new, k);
      const auto draw = [&](int tries) -> std::optional<Plot> {
        const Block& block = blocks_[random.next() % blocks_.size()];
        const std::size_t side = random.next() % 4;
        const double longest = std::lerp(20.0, 6.0, static_cast<double>(tries) / kPlacesTried);
        const double half = random.uniform(2.5, longest / 2.0), at = random.uniform();
        const double room = block.length(side) - 2.0 * (half + kFromCorner);
        if (!block.has_street[side] || room < 0.0) return std::nullopt;
        const Plot plot{block.corner(side) + (kFromCorner + half + at * room) * block.along(side),
                        block.along(side),
                        {half, kHalfThickness}};
        return is_free(plot.grown(0.3), taken) ? std::optional(plot) : std::nullopt;
      };
      VANTAGE_TRY(const Plot plot, find_place(draw, "changes.fences_new", "a fence"));
      taken.push_back(plot);
      new_.add(Surface::wall, plot, make_wall(plot, terrain_, random));
    }
    return {};
  }

  [[nodiscard]] Campus with_fewer_leaves() const {
    Campus result = campus_;
    if (changes_.leaves_gone == 0.0) return result;
    result.leaves.clear();
    for (Thing& thing : result.things) {
      const std::size_t first = result.leaves.size();
      for (std::size_t k = thing.first_leaf; k < thing.end_leaf; ++k) {
        if (random_of(params_, Change::leaves_gone, k).chance(changes_.leaves_gone)) continue;
        result.leaves.push_back(campus_.leaves[k]);
      }
      thing.first_leaf = first;
      thing.end_leaf = result.leaves.size();
    }
    return result;
  }

  const Campus& campus_;
  const WorldParams& params_;
  const ChangesParams& changes_;
  const Terrain& terrain_;
  std::vector<Block> blocks_;
  std::vector<bool> gone_;
  Campus new_;
};

}  // namespace

Result<Campus> changed(const Campus& campus, const WorldParams& params, const StreetGrid& streets,
                       const Terrain& terrain) {
  return Changer(campus, params, streets, terrain).change();
}

}  // namespace vantage::simulation
