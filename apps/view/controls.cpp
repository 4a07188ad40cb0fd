#include "view/controls.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace vantage::view {
namespace {

constexpr int kSmallestPoint = 1, kLargestPoint = 15;  // [pixels]

Reaction resized(Controls& controls, int by) {
  const int size = std::clamp(controls.point_size + by, kSmallestPoint, kLargestPoint);
  if (size == controls.point_size) return Reaction::none;
  controls.point_size = size;
  return Reaction::point_size;
}

Reaction toggled(bool& flag, bool there) {
  if (!there) return Reaction::none;
  flag = !flag;
  return Reaction::lines;
}

constexpr std::array kColorings{Coloring::height, Coloring::region, Coloring::views,
                                Coloring::localizability, Coloring::contribution};

bool has(const Shown& shown, Coloring coloring) {
  switch (coloring) {
    case Coloring::height:
    case Coloring::region: return true;
    case Coloring::views: return !shown.elements;
    case Coloring::localizability: return shown.atlas;
    case Coloring::contribution: return shown.elements;
  }
  return false;
}

Reaction next_coloring(Controls& controls, const Shown& shown) {
  auto next = static_cast<std::size_t>(controls.coloring);
  do {
    next = (next + 1) % kColorings.size();
  } while (!has(shown, kColorings[next]));
  controls.coloring = kColorings[next];
  return Reaction::points;
}

Reaction next_region(Controls& controls, std::uint32_t regions) {
  controls.region =
      RegionId{controls.region ? (controls.region->value + 1) % regions : std::uint32_t{0}};
  return Reaction::points;
}

}  // namespace

const char* to_string(Coloring coloring) noexcept {
  switch (coloring) {
    case Coloring::height: return "height";
    case Coloring::region: return "region";
    case Coloring::views: return "views";
    case Coloring::localizability: return "localizability";
    case Coloring::contribution: return "contribution";
  }
  return "";
}

Reaction press(char key, Controls& controls, const Shown& shown) {
  const bool bundle = shown.regions > 0;
  switch (key) {
    case 'H': return Reaction::help;
    case 'C': return bundle ? next_coloring(controls, shown) : Reaction::none;
    case 'R': return bundle ? next_region(controls, shown.regions) : Reaction::none;
    case 'A':
      if (!controls.region) return Reaction::none;
      controls.region.reset();
      return Reaction::points;
    case 'B': return toggled(controls.borders, bundle);
    case 'V': return toggled(controls.viewpoints, bundle && controls.region.has_value());
    case 'T': return toggled(controls.trajectory, shown.trajectory);
    case 'L': return toggled(controls.sites, controls.coloring == Coloring::localizability);
    case 'F': return Reaction::fit;
    case '+': return resized(controls, 1);
    case '-': return resized(controls, -1);
    case 'S': return Reaction::picture;
    case 'Q': return Reaction::quit;
    default: return Reaction::none;
  }
}

std::string key_help(const Shown& shown) {
  std::string text =
      "mouse  left: turn, wheel: zoom, Ctrl + left: move\n"
      "H      this help\n";
  if (shown.regions > 0) {
    text += "C      next colour:";
    for (const Coloring coloring : kColorings) {
      if (!has(shown, coloring)) continue;
      text += std::string(coloring == kColorings.front() ? " " : ", ") + to_string(coloring);
    }
    text +=
        "\nR, A   the map of the next region; all regions\n"
        "B      borders of the regions on and off\n"
        "V      viewpoints of the region on and off\n";
  }
  if (shown.atlas) text += "L      sites of the atlas on and off, with localizability\n";
  if (shown.trajectory) text += "T      trajectory on and off\n";
  return text +
         "F      fit the view to what is shown\n"
         "+, -   larger and smaller points\n"
         "S      save a picture here\n"
         "Q      quit\n";
}

}  // namespace vantage::view
