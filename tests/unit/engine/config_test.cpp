#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;

namespace {

enum class Shape : std::uint8_t { ball, cube };
constexpr auto enum_names(Shape) {
  return std::array{std::pair{std::string_view("ball"), Shape::ball},
                    std::pair{std::string_view("cube"), Shape::cube}};
}

struct Inner {
  double depth = 2.5;
  static constexpr auto schema() {
    return std::tuple{optional("depth", &Inner::depth, "m", "depth")};
  }
};

struct Everything {
  double width{};
  int count = 3;
  std::uint8_t small = 1;
  bool flag = false;
  std::string name = "x";
  Shape shape = Shape::ball;
  std::optional<double> limit;
  std::vector<double> list;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  Inner inner;
  std::filesystem::path file;

  static constexpr auto schema() {
    return std::tuple{required("width", &Everything::width, "m", "how wide", positive,
                               Source{"Eq. 2", "Somebody 2026"}),
                      optional("count", &Everything::count, "", "how many", between(1, 10)),
                      optional("small", &Everything::small, "", "a byte"),
                      optional("flag", &Everything::flag, "", "whether"),
                      optional("name", &Everything::name, "", "what"),
                      optional("shape", &Everything::shape, "", "which", Source{"Eq. 8"}),
                      optional("limit", &Everything::limit, "m", "at most", non_negative),
                      optional("list", &Everything::list, "", "numbers"),
                      optional("corner", &Everything::corner, "m", "where"),
                      optional("inner", &Everything::inner, "", "nested"),
                      optional("file", &Everything::file, "", "path")};
  }
  [[nodiscard]] Result<void> validate() const {
    if (limit && *limit < width) return fail_at({"limit"}, "limit below width");
    return {};
  }
};

std::string error_of(const std::string& toml) {
  const auto parsed = parse<Everything>(test::table(toml));
  REQUIRE_FALSE(parsed.has_value());
  return to_string(parsed.error());
}

}  // namespace

TEST_CASE("a schema reads every type it can describe") {
  const auto p = parse<Everything>(test::table(R"(
width = 2            # an integer is a number
count = 10
flag = true
name = "a b"
shape = "cube"
limit = 7.5
list = [1, 2.5]
corner = [3, -4.0]
inner = { depth = 1 }
file = "maps/a.pcd"
)"));
  REQUIRE_MESSAGE(p, to_string(p.error()));
  CHECK(p->width == 2.0);
  CHECK(p->count == 10);
  CHECK(p->flag);
  CHECK(p->name == "a b");
  CHECK(p->shape == Shape::cube);
  CHECK(p->limit == 7.5);
  CHECK(p->list == std::vector{1.0, 2.5});
  CHECK(p->corner == Eigen::Vector2d(3, -4));
  CHECK(p->inner.depth == 1.0);
  CHECK(p->file == "maps/a.pcd");  // beside test.toml, which has no folder
}

TEST_CASE("what is left out keeps its default, and a table written back reads the same") {
  const auto p = parse<Everything>(test::table("width = 1.5"));
  REQUIRE(p);
  CHECK(p->count == 3);
  CHECK_FALSE(p->limit);
  const std::string toml = to_toml(to_table(*p));
  const auto again = parse<Everything>(test::table(toml));
  REQUIRE_MESSAGE(again, to_string(again.error()));
  CHECK(to_toml(to_table(*again)) == toml);
  CHECK(toml.find("limit") == std::string::npos);
}

TEST_CASE("wrong parameters are errors that say what, where and what was expected") {
  CHECK(error_of("") == "test.toml:1:1: error: missing key 'width' (how wide)");
  CHECK(error_of("width = 1\nwitdh = 2") ==
        "test.toml:2:1: error: unknown key 'witdh'; did you mean 'width'?");
  CHECK(error_of("width = '1'") == "test.toml:1:9: error: 'width' must be a number, not a string");
  CHECK(error_of("width = -1") == "test.toml:1:9: error: 'width' must be > 0 m, not -1");
  CHECK(error_of("width = nan") ==
        "test.toml:1:9: error: 'width' must be finite and > 0 m, not nan");
  CHECK(error_of("width = inf") ==
        "test.toml:1:9: error: 'width' must be finite and > 0 m, not inf");
  CHECK(error_of("width = 1\ncount = 11") ==
        "test.toml:2:9: error: 'count' must be in [1, 10], not 11");
  CHECK(error_of("width = 1\ncount = 2.0") ==
        "test.toml:2:9: error: 'count' must be an integer, not a number");
  CHECK(error_of("width = 1\nsmall = 256") ==
        "test.toml:2:9: error: 'small' must be in [0, 255], not 256");
  CHECK(error_of("width = 1\nshape = 'cub'") ==
        "test.toml:2:9: error: 'shape' must be one of 'ball', 'cube', not 'cub'; did you mean "
        "'cube'?");
  CHECK(error_of("width = 1\ncorner = [1, 2, 3]") ==
        "test.toml:2:10: error: 'corner' must be an array of 2 numbers, not of 3");
  CHECK(error_of("width = 1\ninner = { dept = 1 }") ==
        "test.toml:2:11: error: unknown key 'dept'; did you mean 'depth'?");
  CHECK(error_of("width = 1\ncorner = [1, 'b']") ==
        "test.toml:2:14: error: 'corner[1]' must be a number, not a string");
  CHECK(error_of("width = 1\nlist = 2") ==
        "test.toml:2:8: error: 'list' must be an array of numbers, not an integer");
  CHECK(error_of("width = 3\n\nlimit = 1") == "test.toml:3:9: error: limit below width");
}

TEST_CASE("describe tells type, unit, range, default and source") {
  const auto docs = describe<Everything>();
  REQUIRE(docs.size() == 11);
  const auto doc = [&](std::string_view key) {
    const auto found = std::find_if(docs.begin(), docs.end(), [&](const ParameterDoc& candidate) {
      return candidate.key == key;
    });
    REQUIRE(found != docs.end());
    return *found;
  };
  CHECK(doc("width").required);
  CHECK_FALSE(doc("width").default_value);
  CHECK(doc("width").range.to_string() == "> 0");
  CHECK(doc("width").unit == "m");
  CHECK(doc("width").equation == "Eq. 2");
  CHECK(doc("width").citation == "Somebody 2026");
  CHECK(doc("count").kind == ValueKind::integer);
  CHECK(std::get<std::int64_t>(doc("count").default_value->data) == 3);
  CHECK(doc("small").range.to_string() == "in [0, 255]");
  CHECK(doc("shape").choices == std::vector<std::string>{"ball", "cube"});
  CHECK(doc("shape").equation == "Eq. 8");
  CHECK(doc("shape").citation.empty());
  CHECK(doc("limit").kind == ValueKind::number);
  CHECK_FALSE(doc("limit").array);
  CHECK_FALSE(doc("limit").default_value);
  CHECK(doc("list").array);
  CHECK_FALSE(doc("list").length);
  CHECK(doc("list").type == "array of numbers");
  CHECK(doc("corner").length == 2);
  CHECK(doc("corner").type == "array of 2 numbers");
  CHECK(doc("inner").kind == ValueKind::table);
  REQUIRE(doc("inner").fields.size() == 1);
  CHECK(doc("inner").fields[0].key == "depth");
  CHECK(doc("file").kind == ValueKind::path);
}

namespace {

struct Outer {
  Inner inner;
  static constexpr auto schema() {
    return std::tuple{optional("inner", &Outer::inner, "", "nested")};
  }
  [[nodiscard]] Result<void> validate() const {
    return fail_at({"inner.depth", "inner"}, "too deep");
  }
};

}  // namespace

TEST_CASE("what validate refuses has the place of the first of its keys that is written") {
  const auto place = [](const std::string& toml) {
    const auto outer = parse<Outer>(test::table(toml));
    REQUIRE_FALSE(outer.has_value());
    CHECK(outer.error().keys.empty());
    return to_string(outer.error());
  };
  CHECK(place("\ninner = { depth = 2 }") == "test.toml:2:19: error: too deep");
  CHECK(place("\n[inner]\n\ndepth = 2").starts_with("test.toml:4:9: "));
  CHECK(place("\ninner = {}").starts_with("test.toml:2:9: "));
  CHECK(place("").starts_with("test.toml:1:1: "));
}

TEST_CASE("TOML mistakes are errors with a place") {
  for (const char* text : {"a = ", "a = 1\na = 2", "[t\nb = 1", "a = \"open", "= 1", "\xff\xfe"}) {
    const auto parsed = parse_toml(text, "bad.toml");
    REQUIRE_FALSE(parsed.has_value());
    CHECK(parsed.error().code == ErrorCode::invalid_config);
    CHECK(parsed.error().where->line >= 1);
  }
  CHECK(parse_toml("day = 2026-11-21", "d.toml").error().message ==
        "dates and times have no meaning here");
}

TEST_CASE("a key of very many parts is an error, in a file and on the command line") {
  std::string key = "a";
  for (int i = 1; i < 100'000; ++i) key += i % 2 == 0 ? ".a" : " . \"a\"";
  for (const std::string& text : {key + " = 1", "[" + key + "]\n", "x = { " + key + " = 1 }"}) {
    const auto parsed = parse_toml(text, "deep.toml");
    REQUIRE_FALSE(parsed);
    CHECK(to_string(parsed.error()).find("deep.toml:1:") == 0);
    CHECK(parsed.error().message == "expected a key of at most 256 parts");
  }
  const auto set = with_overrides({}, {key + "=1"});
  REQUIRE_FALSE(set);
  CHECK(set.error().message == "expected a key of at most 256 parts");
  std::string numbers = "x = [0.5";
  for (int i = 0; i < 1000; ++i) numbers += ", 0.5";
  CHECK(parse_toml(numbers + "]", "long.toml"));
}

TEST_CASE("did_you_mean offers only what is near") {
  const std::vector<std::string> words{"cell_width", "origin"};
  CHECK(did_you_mean("cel_width", words) == "; did you mean 'cell_width'?");
  CHECK(did_you_mean("orgin", words) == "; did you mean 'origin'?");
  CHECK(did_you_mean("banana", words).empty());
  CHECK(did_you_mean("CELL_WIDTH", words) == "; did you mean 'cell_width'?");
  CHECK(did_you_mean("oirgin", words) == "; did you mean 'origin'?");
  CHECK(did_you_mean("", words).empty());
  CHECK(did_you_mean("mpa", {"map"}) == "; did you mean 'map'?");
}

TEST_CASE("did_you_mean: of words equally near, those not written yet; all of them if need be") {
  const std::vector<std::string> words{"size_x", "size_y"};
  CHECK(did_you_mean("size_", words) == "; did you mean 'size_x' or 'size_y'?");
  CHECK(did_you_mean("size_", words, {"size_x"}) == "; did you mean 'size_y'?");
  CHECK(did_you_mean("size_xx", words, {"size_x"}) == "; did you mean 'size_x'?");
  CHECK(did_you_mean("d", {"d1", "d2", "d3"}) == "; did you mean 'd1', 'd2' or 'd3'?");
}

TEST_CASE("numbers and strings survive being written as TOML") {
  for (const double x : {0.1, 1e300, -5e6, 1.0 / 3.0, 5e-324}) {
    const auto read = test::table("x = " + to_toml(Value{x, {}}));
    CHECK(std::get<double>(read.find("x")->data) == x);
  }
  for (const std::string text : {"", "a\"b\\c", "line\nbreak\ttab", "\x01"}) {
    const auto read = test::table("x = " + to_toml(Value{text, {}}));
    CHECK(std::get<std::string>(read.find("x")->data) == text);
  }
}

TEST_CASE("a path that is not UTF-8 is used, but not written down: TOML cannot hold it") {
  Config config;
  config.file = "m\xe9/c.toml";
  const PluginLoader plugins = test::built_plugins();
  const auto with_map = [&](const std::string& path) {
    config.map = MapSource{.files = {path}, .trajectory = {}};
    const auto used = with_plugin_defaults(config, plugins);
    REQUIRE_MESSAGE(used, to_string(used.error()));
    CHECK(used->map->files == config.map->files);
    return effective_config(config, plugins);
  };
  for (const char* path :
       {"m\xe9/a.pcd", "\xc0\x80", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf4\x90\x80\x80",
        "\xf5\x80\x80\x80", "\x80", "\xe2\x82", "\xf0\x8f\xbf\xbf"}) {
    const auto refused = with_map(path);
    REQUIRE_FALSE(refused);
    CHECK(to_string(refused.error()).starts_with("m\xe9/c.toml: error: a path is not UTF-8"));
  }
  for (const char* path :
       {"a", "\xc3\xa9", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xf0\x9f\x98\x80", "\xf4\x8f\xbf\xbf"}) {
    const auto written = with_map(path);
    REQUIRE_MESSAGE(written, to_string(written.error()));
    CHECK(parse_toml(*written, ""));
  }
}

TEST_CASE("a configuration: overrides, relative paths, missing files and tables") {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "c.toml";
  test::write_text(file, R"(schema = 1
[map]
files = ["maps/a.pcd", "/b.pcd"]
[store]
plugin = "pcd_tiles"
params = { root = "out" }
)");
  const auto config =
      load_config(file, {"localizer.scan_voxel_size=0.25", "store.params.root=elsewhere"});
  REQUIRE_MESSAGE(config, to_string(config.error()));
  CHECK(config->map->files[0] == folder.path() / "maps/a.pcd");
  CHECK(config->map->files[1] == "/b.pcd");
  CHECK(config->localizer->scan_voxel_size == 0.25);
  CHECK(std::get<std::string>(config->store->params.find("root")->data) == "elsewhere");
  CHECK(config->store->where.line == 5);

  CHECK(to_string(config->need(config->matcher, "matcher", "localization").error()) ==
        file.string() + ": error: missing table [matcher], which localization needs");
  CHECK(to_string(load_config(file, {"localizer.scan_voxl_size=1"}).error()) ==
        "--set localizer.scan_voxl_size=1: error: unknown key 'scan_voxl_size'; did you mean "
        "'scan_voxel_size'?");
  CHECK(load_config(file, {"schema"}).error().message == "expected key.path=value");
  CHECK(load_config(file, {"schema.x=1"}).error().message == "'schema' is not a table");
  CHECK(load_config(file, {"schema=2"}).error().message == "'schema' must be 1, not 2");
  CHECK(load_config(folder.path() / "none.toml").error().code == ErrorCode::not_found);
  CHECK(load_config(folder.path()).error().message == "expected a TOML file, found a folder");
}
