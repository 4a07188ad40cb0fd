#include "vantage/kit/file_system.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <iterator>

#include "support/real_data.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

void put(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string content_of(const fs::path& path) {
  std::ifstream in(path);
  REQUIRE(in);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_CASE("an open file is closed once, by the object that owns it last") {
  const test::TemporaryFolder folder;
  put(folder.path() / "a", "text");
  CHECK_FALSE(Descriptor::of(folder.path() / "none", O_RDONLY).open());
  int number = -1;
  {
    Descriptor first = Descriptor::of(folder.path() / "a", O_RDONLY);
    REQUIRE(first.open());
    number = first.get();
    Descriptor second(std::move(first));
    CHECK(second.get() == number);
    CHECK(::fcntl(number, F_GETFD) == FD_CLOEXEC);
  }
  CHECK(::fcntl(number, F_GETFD) == -1);
}

TEST_CASE("all is written, or the reason is given") {
  const test::TemporaryFolder folder;
  const std::string text(3'000'000, 'x');
  const Descriptor file = Descriptor::of(folder.path() / "a", O_WRONLY | O_CREAT);
  CHECK(write_all(file, text) == 0);
  CHECK(write_all(file, "") == 0);
  CHECK(content_of(folder.path() / "a") == text);
  CHECK(write_all(Descriptor{}, "x") == EBADF);
  const auto error = system_error("/some/where", "it cannot be", ENOSPC).value();
  CHECK(error.code == ErrorCode::io_failure);
  CHECK(to_string(error).find("/some/where") != std::string::npos);
  CHECK(error.message == "it cannot be (No space left on device)");
}

TEST_CASE("a rename never replaces, an exchange swaps") {
  const test::TemporaryFolder folder;
  const fs::path a = folder.path() / "a", b = folder.path() / "b", c = folder.path() / "c";
  fs::create_directory(a);
  fs::create_directory(b);
  put(a / "name", "a");
  put(b / "name", "b");
  const auto refused = rename_to_new(a, b);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::already_exists);
  CHECK(exchange(a, b));
  CHECK(content_of(a / "name") == "b");
  CHECK(content_of(b / "name") == "a");
  CHECK(rename_to_new(a, c));
  CHECK(content_of(c / "name") == "b");
  CHECK_FALSE(fs::exists(a));
  CHECK(flush_folder(folder.path()));
  const auto nowhere = rename_to_new(a, folder.path() / "d");
  REQUIRE_FALSE(nowhere);
  CHECK(nowhere.error().code == ErrorCode::io_failure);
  CHECK_FALSE(flush_folder(a));
}

TEST_CASE("an empty file is refused unless it may be empty; what is no file always is") {
  const test::TemporaryFolder folder;
  const fs::path empty = folder.path() / "empty", pipe = folder.path() / "pipe";
  put(empty, "");
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const auto refused = read_file(empty, "a letter");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::corrupt_data);
  CHECK(refused.error().message == "the file is empty, expected a letter");
  const auto accepted = read_file(empty, "a letter", InputFile::Empty::accept);
  REQUIRE(accepted);
  CHECK(accepted->view().empty());
  for (const auto& path : {pipe, folder.path()}) {
    const auto none = read_file(path, "a letter", InputFile::Empty::accept);
    REQUIRE_FALSE(none);
    CHECK(none.error().code == ErrorCode::io_failure);
  }
  const auto absent = read_file(folder.path() / "none", "a letter");
  REQUIRE_FALSE(absent);
  CHECK(absent.error().code == ErrorCode::not_found);
}

}  // namespace
}  // namespace vantage::io
