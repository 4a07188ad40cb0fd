#include "vantage/kit/atomic_file.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <utility>

#include "files.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::content_of;
using test::put;

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

// Files of this process cannot grow beyond this many bytes while it lives: a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before_) == 0);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST_CASE("OutputFile: the file appears whole, at the commit") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "scans.csv";
  auto file = io::OutputFile::create(path);
  REQUIRE_MESSAGE(file, to_string(file.error()));
  std::string expected;
  for (int i = 0; i < 100'000; ++i) {
    const std::string row = std::to_string(i) + ",7\n";
    expected += row;
    REQUIRE(file->write(row).has_value());
  }
  CHECK_FALSE(std::filesystem::exists(path));
  REQUIRE(file->commit().has_value());
  CHECK(content_of(path) == expected);
  CHECK(files_in(folder.path()) == 1);
  CHECK_FALSE(file->write("more").has_value());
  CHECK_FALSE(file->commit().has_value());
  CHECK(content_of(path) == expected);
}

TEST_CASE("OutputFile: one write larger than the buffer, and none at all") {
  const test::TemporaryFolder folder;
  const std::string large(3'000'001, 'x');
  REQUIRE(io::write_text_atomically(folder.path() / "large", large).has_value());
  CHECK(content_of(folder.path() / "large") == large);
  REQUIRE(io::write_text_atomically(folder.path() / "none", "").has_value());
  CHECK(content_of(folder.path() / "none").empty());
}

TEST_CASE("OutputFile: without a commit nothing is left and the old file stays") {
  const test::TemporaryFolder folder;
  const auto path = put(folder.path() / "result.txt", "old");
  {
    auto file = io::OutputFile::create(path);
    REQUIRE(file.has_value());
    REQUIRE(file->write(std::string(1'000'000, 'n')).has_value());
    CHECK(files_in(folder.path()) == 2);
  }
  CHECK(content_of(path) == "old");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("OutputFile: a file that is there is replaced") {
  const test::TemporaryFolder folder;
  const auto path = put(folder.path() / "result.txt", "old and longer");
  REQUIRE(io::write_text_atomically(path, "new").has_value());
  CHECK(content_of(path) == "new");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("OutputFile: several at once, moved about") {
  const test::TemporaryFolder folder;
  auto first = io::OutputFile::create(folder.path() / "first");
  auto second = io::OutputFile::create(folder.path() / "second");
  auto third = io::OutputFile::create(folder.path() / "third");
  REQUIRE(first.has_value());
  REQUIRE(second.has_value());
  REQUIRE(third.has_value());
  REQUIRE(first->write("1").has_value());
  REQUIRE(second->write("2").has_value());
  io::OutputFile moved = std::move(*first);
  *third = std::move(*second);  // drops what was the third
  CHECK(files_in(folder.path()) == 2);
  REQUIRE(moved.write("1").has_value());
  REQUIRE(moved.commit().has_value());
  REQUIRE(third->commit().has_value());
  CHECK(content_of(folder.path() / "first") == "11");
  CHECK(content_of(folder.path() / "second") == "2");
  CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("OutputFile: relative paths, and permissions as for any new file") {
  const test::TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const auto written = io::write_text_atomically("plain.txt", "text");
  std::filesystem::current_path(before);
  REQUIRE_MESSAGE(written, to_string(written.error()));
  CHECK(content_of(folder.path() / "plain.txt") == "text");
  put(folder.path() / "ordinary.txt", "text");
  CHECK(std::filesystem::status(folder.path() / "plain.txt").permissions() ==
        std::filesystem::status(folder.path() / "ordinary.txt").permissions());
}

TEST_CASE("OutputFile: places that cannot be written to") {
  const test::TemporaryFolder folder;
  const auto refused = [](const std::filesystem::path& path, ErrorCode code) {
    const auto written = io::write_text_atomically(path, "text");
    REQUIRE_FALSE(written.has_value());
    check_clear(written.error(), code, path.string(), "cannot be written");
  };
  refused(folder.path() / "absent" / "a.txt", ErrorCode::not_found);
  refused(put(folder.path() / "file", "x") / "a.txt", ErrorCode::not_found);
  refused(folder.path(), ErrorCode::io_failure);
  refused(folder.path() / "", ErrorCode::io_failure);
  refused("/dev/null", ErrorCode::io_failure);
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("OutputFile: a full disk is an error that stays, and leaves nothing") {
  const test::TemporaryFolder folder;
  const auto path = put(folder.path() / "result.txt", "old");
  auto file = io::OutputFile::create(path);
  REQUIRE(file.has_value());
  {
    const FileSizeLimit limit(100'000);
    const auto written = file->write(std::string(1'000'000, 'x'));
    REQUIRE_FALSE(written.has_value());
    check_clear(written.error(), ErrorCode::io_failure, "result.txt", "writing failed");
  }
  CHECK(files_in(folder.path()) == 1);
  CHECK_FALSE(file->write("x").has_value());
  const auto committed = file->commit();
  REQUIRE_FALSE(committed.has_value());
  CHECK(committed.error().code == ErrorCode::io_failure);
  CHECK(content_of(path) == "old");

  {
    const FileSizeLimit limit(100'000);
    const PointCloud cloud(20'000, Point(1, 2, 3));
    CHECK_FALSE(io::write_pcd(folder.path() / "cloud.pcd", cloud, io::Precision::float32));
  }
  CHECK(files_in(folder.path()) == 1);
}

}  // namespace
}  // namespace vantage
