#include "view/controls.hpp"

#include <doctest/doctest.h>

using namespace vantage;
using namespace vantage::view;

TEST_CASE("colours take turns") {
  Controls controls;
  const Shown bundle{3, true};
  for (const Coloring next : {Coloring::region, Coloring::views, Coloring::height}) {
    CHECK(press('C', controls, bundle) == Reaction::points);
    CHECK(controls.coloring == next);
  }
  const Shown with_atlas{3, true, true};
  for (const Coloring next :
       {Coloring::region, Coloring::views, Coloring::localizability, Coloring::height}) {
    CHECK(press('C', controls, with_atlas) == Reaction::points);
    CHECK(controls.coloring == next);
  }
  const Shown elements{3, true, true, true};  // nothing counts views of them
  for (const Coloring next :
       {Coloring::region, Coloring::localizability, Coloring::contribution, Coloring::height}) {
    CHECK(press('C', controls, elements) == Reaction::points);
    CHECK(controls.coloring == next);
  }
}

TEST_CASE("regions take turns, and all come back") {
  Controls controls;
  const Shown bundle{2, false};
  for (const std::uint32_t next : {0u, 1u, 0u}) {
    CHECK(press('R', controls, bundle) == Reaction::points);
    CHECK(controls.region == RegionId{next});
  }
  CHECK(press('A', controls, bundle) == Reaction::points);
  CHECK_FALSE(controls.region);
  CHECK(press('A', controls, bundle) == Reaction::none);
}

TEST_CASE("points grow and shrink within bounds") {
  Controls controls;
  controls.point_size = 1;
  CHECK(press('-', controls, {}) == Reaction::none);
  CHECK(press('+', controls, {}) == Reaction::point_size);
  CHECK(controls.point_size == 2);
  for (int i = 0; i < 100; ++i) static_cast<void>(press('+', controls, {}));
  CHECK(controls.point_size == 15);
}

TEST_CASE("keys for what is not there do nothing, and are not in the help") {
  Controls controls;
  const Shown cloud{};
  for (const char key : {'A', 'B', 'C', 'L', 'R', 'T', 'V', 'P', 'D', 'O'}) {
    CHECK(press(key, controls, cloud) == Reaction::none);
  }
  const std::string help = key_help(cloud);
  for (const char* line : {"\nC ", "\nR, A", "\nB ", "\nV ", "\nT "}) {
    CHECK(help.find(line) == std::string::npos);
    CHECK(key_help({2, true}).find(line) != std::string::npos);
  }
  CHECK(key_help({2, true}).find("localizability") == std::string::npos);
  const std::string with_atlas = key_help({2, true, true});
  CHECK(with_atlas.find("views, localizability\n") != std::string::npos);
  CHECK(with_atlas.find("\nL ") != std::string::npos);
  const std::string elements = key_help({2, true, false, true});
  CHECK(elements.find("height, region, contribution\n") != std::string::npos);
}

TEST_CASE("every other key does what the help says") {
  Controls controls;
  const Shown bundle{2, true};
  CHECK(press('B', controls, bundle) == Reaction::lines);
  CHECK_FALSE(controls.borders);
  CHECK(press('T', controls, bundle) == Reaction::lines);
  CHECK_FALSE(controls.trajectory);
  CHECK(press('V', controls, bundle) == Reaction::none);  // all regions: no viewpoints
  controls.region = RegionId{1};
  CHECK(press('V', controls, bundle) == Reaction::lines);
  CHECK_FALSE(controls.viewpoints);
  CHECK(press('L', controls, {2, true, true}) == Reaction::none);  // another colour
  controls.coloring = Coloring::localizability;
  CHECK(press('L', controls, {2, true, true}) == Reaction::lines);
  CHECK_FALSE(controls.sites);
  CHECK(press('F', controls, bundle) == Reaction::fit);
  CHECK(press('S', controls, bundle) == Reaction::picture);
  CHECK(press('H', controls, bundle) == Reaction::help);
  CHECK(press('Q', controls, bundle) == Reaction::quit);
}
