// `vantage view --png` through the program, on a virtual display.
#include <doctest/doctest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "support/bundles.hpp"
#include "support/made_atlas.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "support/text.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace fs = std::filesystem;
using namespace vantage;

namespace {

using test::has;

using Pixel = std::array<std::uint8_t, 3>;

struct Image {
  unsigned width = 0, height = 0;
  std::vector<Pixel> pixels;

  [[nodiscard]] std::size_t colors() const {
    return std::set<Pixel>(pixels.begin(), pixels.end()).size();
  }
  /// Share of the pixels that are not as the corner at the top left.
  [[nodiscard]] double covered() const {
    const auto drawn = std::count_if(pixels.begin(), pixels.end(),
                                     [&](const Pixel& p) { return p != pixels.front(); });
    return static_cast<double>(drawn) / static_cast<double>(pixels.size());
  }
};

double difference(const Image& a, const Image& b) {
  REQUIRE(a.pixels.size() == b.pixels.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) different += a.pixels[i] != b.pixels[i] ? 1 : 0;
  return static_cast<double>(different) / static_cast<double>(a.pixels.size());
}

Image read_png(const fs::path& file) {
  const std::string content = test::read_text(file);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_memory(&png, content.data(), content.size()) != 0);
  png.format = PNG_FORMAT_RGB;
  Image image{png.width, png.height, std::vector<Pixel>(std::size_t{png.width} * png.height)};
  REQUIRE(png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) != 0);
  return image;
}

test::Finished view(std::vector<std::string> arguments) {
  const fs::path program = fs::path(VANTAGE_PROGRAM_DIR) / "vantage";
  std::vector<std::string> all{"-a", program.string(), "view"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return test::run(VANTAGE_XVFB_RUN, all);
}

/// A yard of 24 x 12 m with a wall across and one along it, at coordinates of a UTM zone, its
/// bundles, and scans of a drive through it.
class Yard {
 public:
  static constexpr double kEast = 561000.0, kNorth = 5932000.0;
  static constexpr std::size_t kScans = 6;

  Yard() {
    // Without it, the window library of Debian 13 writes a line to stderr.
    ::setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    PointCloud map;
    for (double x = 0; x < 24; x += 0.2) {
      for (double y = 0; y < 12; y += 0.2) map.emplace_back(kEast + x, kNorth + y, 30.0);
    }
    for (double y = 0; y < 9; y += 0.1) {
      for (double z = 0.1; z < 4; z += 0.1) map.emplace_back(kEast + 12, kNorth + y, 30.0 + z);
    }
    for (double x = 1; x < 10; x += 0.1) {
      for (double z = 0.1; z < 4; z += 0.1) map.emplace_back(kEast + x, kNorth + 2, 30.0 + z);
    }
    REQUIRE(io::write_pcd(path("map.pcd"), map, io::Precision::float64));
    io::Trajectory drive;
    for (int i = 0; i < 30; ++i) {
      Pose pose;
      pose.translation = {kEast + 1 + 0.7 * i, kNorth + 10, 31.5};
      drive.push_back({0.1 * i, pose});
    }
    REQUIRE(io::write_tum(path("drive.tum"), drive));
    write_scans(map, drive);
    build("points", "points");
    build("prepared", "prepared");
  }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }
  /// The options of contributions to the poses of the scans.
  [[nodiscard]] std::vector<std::string> contribution() const {
    return {"--color", "contribution", "--scans", path("scans"), "--reference", path("drive.tum")};
  }
  [[nodiscard]] bool holds_picture() const {
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      if (entry.path().string().find("png") != std::string::npos) return true;
    }
    return false;
  }

  void build(const std::string& content, const std::string& name,
             const std::string& matcher = "ndt") const {
    const std::string store =
        "content = \"" + content + "\"\nparams = { root = \"" + name + "\" }\n";
    test::write_text(path(name + ".toml"),
                     to_text(test::SmallConfig{.partitioner_params = "cell_width = 6.0",
                                               .visibility = "plugin = \"hpr\"\n",
                                               .store = store,
                                               .matcher = "plugin = \"" + matcher + "\"\n"}));
    const auto built = test::run("vantage-build", {path(name + ".toml"), "--quiet"});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  }
  /// Points do not say their matcher; an atlas does.
  void assess(const std::string& name) const {
    const auto assessed = test::run("vantage-assess", {path(name + ".toml"), "--quiet"});
    REQUIRE_MESSAGE(assessed.exit_code == 0, assessed.err);
  }

 private:
  /// All points within 12 m. The number of a scan says its stamp, in tenths of a second.
  void write_scans(const PointCloud& map, const io::Trajectory& drive) const {
    fs::create_directory(path("scans"));
    for (std::size_t k = 0; k < kScans; ++k) {
      const std::size_t i = 5 * k + 2;
      PointCloud scan;
      for (const Point& p : map) {
        const Point seen = drive[i].pose.inverse() * p;
        if (seen.norm() < 12.0) scan.push_back(seen);
      }
      const std::string number = std::to_string(1'000'000 + i).substr(1);
      REQUIRE(io::write_pcd(path("scans/" + number + ".pcd"), scan, io::Precision::float32));
    }
  }

  test::TemporaryFolder folder_;
};

const Yard& yard() {
  static const Yard one;
  return one;
}

/// A bundle of the same region maps, with an atlas or without.
void write_bundle(const std::string& name, const std::optional<Atlas>& atlas) {
  const auto store_at = [](const std::string& place) {
    return test::plugin<MapStore>("pcd_tiles", "root = \"" + yard().path(place) + "\"");
  };
  const auto from = test::opened(store_at("points"));
  const MapIndex index = from->index().value();
  auto to = test::begun(store_at(name), index);
  if (atlas) REQUIRE(to->attach(Atlas::kAttachment, atlas->encode()));
  std::vector<RegionMap> maps;
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    maps.push_back(from->get(RegionId{r}).value());
  }
  test::finish(std::move(to), maps);
}

/// Failed with exactly one line on stderr, and without a picture.
std::string failure(const test::Finished& finished, int exit_code) {
  CHECK_MESSAGE(finished.exit_code == exit_code, finished.err);
  CHECK(finished.out.empty());
  CHECK_MESSAGE(std::count(finished.err.begin(), finished.err.end(), '\n') == 1, finished.err);
  CHECK_FALSE(yard().holds_picture());
  return finished.err;
}

}  // namespace

TEST_CASE("a bundle as a picture in every colour, of the size that was asked for") {
  std::vector<Image> images;
  for (const std::string color : {"height", "region", "views"}) {
    CAPTURE(color);
    const std::string png = yard().path(color + ".png");
    const auto done = view({yard().path("points"), "--color", color, "--trajectory",
                            yard().path("drive.tum"), "--png", png, "--size", "480x320", "--json"});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    const auto json = nlohmann::json::parse(done.out);
    CHECK(json["color"] == color);
    CHECK(json["regions"].get<int>() >= 8);
    // Whole metres near the middle of the map.
    CHECK(json["origin"][0] == Yard::kEast + 12.0);
    CHECK(json["origin"][1] == Yard::kNorth + 6.0);
    CHECK(json["thinned"] == false);
    CHECK(json["drawn_points"] <= json["map_points"]);
    CHECK(json["drawn_points"] > 0.9 * json["map_points"].get<double>());
    CHECK(json["views"] > 2);
    CHECK(json["height"][0].get<double>() == doctest::Approx(30.0).epsilon(1e-4));
    images.push_back(read_png(png));
    fs::remove(png);
    CHECK(images.back().width == 480);
    CHECK(images.back().height == 320);
    CHECK(images.back().colors() > 100);
    CHECK(images.back().covered() > 0.2);
    CHECK(images.back().covered() < 0.9);
  }
  CHECK(difference(images[0], images[1]) > 0.1);
  CHECK(difference(images[0], images[2]) > 0.1);
  CHECK(difference(images[1], images[2]) > 0.1);
}

TEST_CASE("a bundle is coloured by how well a sensor can be localized, if it has an atlas") {
  Atlas atlas = test::made_atlas({Yard::kEast + 1, Yard::kNorth + 6, 31.5});
  write_bundle("measured", atlas);
  std::vector<Image> images;
  const std::string png = yard().path("localizability.png");
  const auto draw = [&](const std::string& bundle) {
    const auto done = view({yard().path(bundle), "--color", "localizability", "--png", png,
                            "--size", "480x320", "--json"});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    const auto json = nlohmann::json::parse(done.out);
    CHECK(json["color"] == "localizability");
    CHECK(json["sites"] == 4);
    images.push_back(read_png(png));
    fs::remove(png);
    CHECK(images.back().colors() > 100);
  };
  draw("measured");
  // Blue where the error is small, red where it is large.
  const auto share = [](const Image& image, const auto& is) {
    return static_cast<double>(std::count_if(image.pixels.begin(), image.pixels.end(), is)) /
           static_cast<double>(image.pixels.size());
  };
  const auto blue = [](const Pixel& p) { return p[2] > p[0] + 60; };
  const auto red = [](const Pixel& p) { return p[0] > p[2] + 60; };
  CHECK(share(images[0], blue) > 0.05);
  CHECK(share(images[0], red) > 0.05);
  for (Site& site : atlas.sites) {
    if (site.precision) site.precision->expected_error = 0.01;
  }
  atlas.sites.back() = atlas.sites.front();
  write_bundle("good", atlas);
  draw("good");
  CHECK(share(images[1], blue) > 0.15);
  CHECK(share(images[1], red) < 0.01);

  const auto told = view(
      {yard().path("measured"), "--color", "localizability", "--png", png, "--size", "320x240"});
  REQUIRE_MESSAGE(told.exit_code == 0, told.err);
  CHECK(has(told.out, "expected error at the nearest site, 0.01 m (blue) to 1 m and more"));
  CHECK(has(told.out, "sites      4 of the atlas for ndt"));
  fs::remove(png);
}

TEST_CASE("a bundle that tells from how many viewpoints points are seen is coloured by that") {
  const auto built = test::run(
      "vantage-build", {yard().path("points.toml"), "--quiet", "--set", "store.views=true", "--set",
                        "store.params.root=" + yard().path("seen")});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  const std::string png = yard().path("views.png");
  std::vector<nlohmann::json> regions;
  for (const std::string bundle : {"points", "seen"}) {
    const auto done = view({yard().path(bundle), "--region", "3", "--color", "views", "--png", png,
                            "--size", "320x240", "--json"});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    regions.push_back(nlohmann::json::parse(done.out));
  }
  CHECK(regions[0]["views"] <= regions[0]["regions"]);
  CHECK(regions[1]["views"] <= regions[1]["viewpoints"]);
  CHECK(regions[1]["views"] != regions[0]["views"]);
  CHECK(regions[1]["drawn_points"] == regions[0]["drawn_points"]);
  const auto whole =
      view({yard().path("seen"), "--color", "views", "--png", png, "--size", "320x240"});
  REQUIRE_MESSAGE(whole.exit_code == 0, whole.err);
  CHECK(has(whole.out, "viewpoints that see a point, 1 (dark) to"));
  fs::remove(png);
}

TEST_CASE("the elements of a map are coloured by what they contribute to the poses of scans") {
  const std::string png = yard().path("contribution.png");
  const auto draw = [&](std::vector<std::string> arguments) {
    const auto more = yard().contribution();
    arguments.insert(arguments.end(), more.begin(), more.end());
    arguments.insert(arguments.end(), {"--png", png, "--size", "480x320"});
    const auto done = view(arguments);
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    CHECK(read_png(png).colors() > 100);
    fs::remove(png);
    return done.out;
  };
  yard().assess("points");
  for (const std::string bundle : {"prepared", "points"}) {
    CAPTURE(bundle);
    const auto json = nlohmann::json::parse(draw({yard().path(bundle), "--json"}));
    CHECK(json["color"] == "contribution");
    const auto found = json["contribution"];
    CHECK(found["matcher"] == "ndt");
    CHECK(found["scans"] == Yard::kScans);
    CHECK(found["scans_without_pose"] == 0);
    CHECK(found["scans_outside"] == 0);
    CHECK(found["scans_not_fixed"] == 0);
    CHECK(found["regions"].get<int>() >= 3);
    CHECK(found["elements"] == json["drawn_points"]);
    CHECK(found["elements"].get<int>() > 100);
    // Each scan has six degrees of freedom to share out.
    CHECK(found["leverage"].get<double>() == doctest::Approx(6.0 * Yard::kScans));
    CHECK(std::abs(found["share_not_drawn"].get<double>()) < 0.2);
    const auto strongest = found["share_of_strongest"];
    CHECK(strongest["1%"] < strongest["10%"]);
    CHECK(strongest["10%"].get<double>() > 0.1);
    CHECK(strongest["10%"] < strongest["50%"]);
    CHECK(found["share_of_one"]["p50"] < found["share_of_one"]["p90"]);
    CHECK(found["share_of_one"]["p99"] < found["share_of_one"]["max"]);
  }
  const std::string label = "x+001_y+001";
  const auto one =
      nlohmann::json::parse(draw({yard().path("prepared"), "--region", label, "--json"}));
  CHECK(one["region"] == label);
  CHECK(one["viewpoints"] > 0);
  CHECK(one["contribution"]["scans"].get<std::size_t>() > 0);
  CHECK(one["contribution"]["scans"].get<std::size_t>() < Yard::kScans);
  CHECK(one["contribution"]["leverage"].get<double>() ==
        doctest::Approx(6.0 * one["contribution"]["scans"].get<double>()));

  yard().build("points", "icp", "icp");
  yard().assess("icp");
  CHECK(has(draw({yard().path("icp")}), "scans      6 matched by icp in "));

  const std::string told = draw({yard().path("prepared"), "--max-points", "50"});
  CHECK(has(told, "scans      6 matched by ndt in "));
  CHECK(has(told, "; the 50 strongest are drawn\n"));
  CHECK(has(told, "strongest  10 % of them do "));
  CHECK(has(told, "what an element has of all that fixes the poses"));
}

TEST_CASE("contributions need scans with poses, and a bundle that says its matcher") {
  const std::string png = yard().path("never.png");
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--png", png, "--quiet"});
    return view(arguments);
  };
  const auto of = [&](const std::string& bundle, const std::string& reference) {
    return with({yard().path(bundle), "--color", "contribution", "--scans", yard().path("scans"),
                 "--reference", yard().path(reference)});
  };
  CHECK(has(failure(with({yard().path("prepared")}), 1),
            "--color contribution with --scans and --reference shows"));
  const std::vector<std::string> alone{yard().path("prepared"), "--color", "contribution"};
  CHECK(has(failure(with(alone), 2), "give --scans and --reference"));
  CHECK(has(failure(with({yard().path("prepared"), "--color", "contribution", "--scans",
                          yard().path("scans")}),
                    2),
            "give --scans and --reference"));
  CHECK(has(failure(with({yard().path("points"), "--scans", yard().path("scans")}), 2),
            "--scans is given without --color contribution"));
  CHECK(has(failure(of("map.pcd", "drive.tum"), 2), "takes a bundle"));
  CHECK(has(failure(of("prepared", "none.tum"), 1), "none.tum"));

  write_bundle("silent", {});
  CHECK(has(failure(of("silent", "drive.tum"), 1), "the bundle does not say its matcher"));

  io::Trajectory late, far;
  for (int i = 0; i < 30; ++i) {
    Pose pose;
    pose.translation = {Yard::kEast + 500.0 + i, Yard::kNorth, 31.5};
    far.push_back({0.1 * i, pose});
    late.push_back({100.0 + 0.1 * i, pose});
  }
  REQUIRE(io::write_tum(yard().path("late.tum"), late));
  REQUIRE(io::write_tum(yard().path("far.tum"), far));
  CHECK(has(failure(of("prepared", "late.tum"), 1),
            "none of the 6 scans counts: 6 without a pose, 0 in no region with a map, 0 not fixed "
            "by the map; the scans are stamped 0.200 to 2.700 s, the reference has poses from "
            "100.000 to 102.900 s"));
  CHECK(has(failure(of("prepared", "far.tum"), 1), "0 without a pose, 6 in no region with a map"));
}

TEST_CASE("a region by its label and by its number is the same picture; a cloud is one too") {
  const auto info = test::run("vantage-info", {yard().path("points"), "--regions", "--json"});
  REQUIRE_MESSAGE(info.exit_code == 0, info.err);
  const std::string label = nlohmann::json::parse(info.out)["each_region"][3]["label"];
  std::vector<Image> images;
  for (const std::string& region : {label, std::string("3")}) {
    const std::string png = yard().path("region.png");
    const auto done = view({yard().path("points"), "--region", region, "--png", png, "--size",
                            "320x240", "--json", "--quiet"});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    CHECK(done.err.empty());
    const auto json = nlohmann::json::parse(done.out);
    CHECK(json["region"] == label);
    CHECK(json["viewpoints"] > 0);
    images.push_back(read_png(png));
    fs::remove(png);
  }
  CHECK(images[0].pixels == images[1].pixels);

  const std::string png = yard().path("cloud.png");
  const auto done =
      view({yard().path("map.pcd"), "--png", png, "--size", "320x240", "--max-points", "2000"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK(has(done.out, "thinned to --max-points 2,000"));
  CHECK(has(done.out, "origin     drawn around x 561012, y 5932006"));
  CHECK(read_png(png).colors() > 50);
  fs::remove(png);
}

TEST_CASE("bad input: one clear error, and no picture") {
  const std::string png = yard().path("never.png"), bundle = yard().path("points");
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--png", png});
    return view(arguments);
  };
  CHECK(has(failure(with({bundle, "--region", "x+00_y+0O"}), 1), "did you mean"));
  CHECK(has(failure(with({bundle, "--region", "99"}), 1), "no region '99'"));
  CHECK(has(failure(with({yard().path("prepared")}), 1), "prepared maps only"));
  CHECK(has(failure(with({fs::path(bundle).parent_path().string()}), 1), "no index.json"));
  CHECK(has(failure(with({yard().path("points.toml")}), 1), "points.toml"));
  CHECK(has(failure(with({yard().path("map.pcd"), "--color", "views"}), 2), "takes a bundle"));
  CHECK(has(failure(with({yard().path("map.pcd"), "--region", "1"}), 2), "takes a bundle"));
  CHECK(has(failure(with({yard().path("map.pcd"), "--color", "localizability"}), 2), "takes a"));
  // The folder of a tiled map.
  fs::create_directory(yard().path("tiled"));
  test::write_text(yard().path("tiled/index.vtiles"), "");
  for (const auto& [option, value] : {std::pair("--region", "1"), {"--color", "region"}}) {
    CHECK(has(failure(with({yard().path("tiled"), option, value}), 2),
              "takes a bundle of region maps, and " + yard().path("tiled") + " is not one"));
  }
  write_bundle("bare", {});
  CHECK(has(failure(with({yard().path("bare"), "--color", "localizability"}), 1),
            "the bundle has no atlas: `vantage assess` makes it"));
  CHECK(has(failure(with({bundle, "--size", "10x10"}), 2), "64 to 8192"));
  CHECK(has(failure(with({bundle, "--size", "640"}), 2), "WxH"));
  CHECK(has(failure(with({bundle, "--trajectory", yard().path("none.tum")}), 1), "none.tum"));
  CHECK(has(failure(view({bundle, "--png", yard().path("a.jpg")}), 2), "ends in .png"));
  CHECK(has(failure(view({bundle, "--png", yard().path("no/such/a.png")}), 1), "no/such"));
}

TEST_CASE("without a display the error says what to run it under") {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) ::unsetenv(name);
  const std::string png = yard().path("never.png");
  const auto done = test::run("vantage-view", {yard().path("points"), "--png", png});
  CHECK(has(failure(done, 1), "no display: run it under `xvfb-run"));
  ::setenv("DISPLAY", ":4711", 1);
  const auto dead = test::run("vantage-view", {yard().path("points"), "--png", png, "--quiet"});
  CHECK(has(failure(dead, 1), "no window can be opened on this display"));
  ::unsetenv("DISPLAY");
}

TEST_CASE("where the program was not built, `vantage view` says why") {
  const test::TemporaryFolder folder;
  fs::copy_file(fs::path(VANTAGE_PROGRAM_DIR) / "vantage", folder.path() / "vantage");
  ::setenv("PATH", "/usr/bin:/bin", 1);
  const auto done = test::run((folder.path() / "vantage").string(), {"view", "bundle"});
  CHECK(done.exit_code == 2);
  CHECK(has(done.err, "error: no job 'view' here: it is built only where Open3D is installed"));
}
