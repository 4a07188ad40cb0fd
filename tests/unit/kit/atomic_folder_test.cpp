#include "vantage/kit/atomic_folder.hpp"

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder, test::read_text, test::write_text;
using Existing = OutputFolder::Existing;

/// A folder with `head` is finished. It may hold texts, and `half` of texts while it is made.
FolderKind kind_of_texts(std::string progress = {}) {
  const auto is_text = [](std::string_view name) {
    return name == "head" || name == "state" || name == "more" || name.ends_with(".txt");
  };
  return {.what = "a folder of texts",
          .overwrite = "--overwrite",
          .check = [is_text](const fs::path& /*folder*/, auto names) -> Result<void> {
            for (const std::string& name : names) {
              if (!is_text(name)) return it_holds(name);
            }
            if (std::ranges::count(names, "head") > 0) return {};
            return fail(ErrorCode::already_exists, "it has no head");
          },
          .may_hold = is_text,
          .progress = std::move(progress)};
}

void fill(const OutputFolder& folder) {
  write_text(folder.path() / "head", "whole");
  fs::create_directory(folder.path() / "more");
  write_text(folder.path() / "more/a.txt", "a");
}

void make(const fs::path& path, Existing existing = Existing::refuse) {
  auto folder = OutputFolder::create(kind_of_texts(), path, existing);
  REQUIRE_MESSAGE(folder, to_string(folder.error()));
  fill(*folder);
  const auto done = folder->commit();
  REQUIRE_MESSAGE(done, to_string(done.error()));
}

void refused(const fs::path& path, Existing existing, const std::string& because,
             ErrorCode code = ErrorCode::already_exists) {
  CAPTURE(because);
  const auto folder = OutputFolder::create(kind_of_texts(), path, existing);
  REQUIRE_FALSE(folder);
  CHECK(folder.error().code == code);
  CHECK_MESSAGE(to_string(folder.error()).find(because) != std::string::npos,
                to_string(folder.error()));
}

std::vector<std::string> names_of(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().lexically_relative(folder).string());
  }
  std::ranges::sort(names);
  return names;
}
using Names = std::vector<std::string>;

/// What is left when a process that makes a folder is killed after `work`.
template <class Work>
void killed_after(const fs::path& path, const Work& work, FolderKind kind = kind_of_texts()) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    auto folder = OutputFolder::create(std::move(kind), path, Existing::replace);
    if (folder) work(*folder);
    ::_exit(folder ? 0 : 1);  // without destructors
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) == 0);
}

TEST_CASE("a folder appears whole, with the folders above it, or nothing of it is left") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "new" / "deep" / "out";
  {
    const auto folder = OutputFolder::create(kind_of_texts(), path, Existing::refuse);
    REQUIRE(folder);
    fill(*folder);
    CHECK_FALSE(fs::exists(path));
  }
  CHECK(names_of(scratch.path()).empty());
  make(path.string() + "/");
  CHECK(names_of(path) == Names{"head", "more", "more/a.txt"});
  CHECK(names_of(path.parent_path()).size() == 4);
}

TEST_CASE("a folder is replaced if that is asked for, and with all that it held") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out";
  make(path);
  write_text(path / "more/b.txt", "b");
  refused(path, Existing::refuse, "out: error: exists already; --overwrite replaces it");
  make(path, Existing::replace);
  CHECK(names_of(scratch.path()) == Names{"out", "out/head", "out/more", "out/more/a.txt"});
}

TEST_CASE("what is of another kind is left alone, whatever is asked for") {
  for (const Existing existing : {Existing::refuse, Existing::replace}) {
    const TemporaryFolder scratch;
    const fs::path path = scratch.path() / "out";
    SUBCASE("a file") {
      write_text(path, "mine");
      refused(path, existing, "it is not a folder");
    }
    SUBCASE("a folder of the user") {
      fs::create_directory(path);
      write_text(path / "thesis.tex", "mine");
      refused(path, existing, "it holds 'thesis.tex'");
    }
    SUBCASE("one that also holds something of the user, in a folder") {
      make(path);
      write_text(path / "more/thesis.tex", "mine");
      refused(path, existing, "it holds 'more/thesis.tex'");
    }
    SUBCASE("a link to nowhere") {
      fs::create_symlink(scratch.path() / "nowhere", path);
      refused(path, existing, "it is not a folder");
    }
    CHECK_FALSE(fs::exists(path.string() + ".partial"));
    CHECK(fs::exists(fs::symlink_status(path)));
  }
}

TEST_CASE("a file that comes into the old folder while the new one is made stays") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out";
  make(path);
  {
    auto folder = OutputFolder::create(kind_of_texts(), path, Existing::replace);
    REQUIRE(folder);
    fill(*folder);
    write_text(path / "notes.md", "mine");
    const auto done = folder->commit();
    REQUIRE_FALSE(done);
    CHECK(to_string(done.error()).find("notes.md") != std::string::npos);
  }
  CHECK(names_of(scratch.path()) ==
        Names{"out", "out/head", "out/more", "out/more/a.txt", "out/notes.md"});
}

TEST_CASE("behind a link, the folder is replaced and not the link") {
  const TemporaryFolder scratch;
  make(scratch.path() / "real");
  fs::create_directory_symlink("real", scratch.path() / "link");
  make(scratch.path() / "link", Existing::replace);
  CHECK(fs::is_symlink(scratch.path() / "link"));
  CHECK(read_text(scratch.path() / "real/head") == "whole");
}

TEST_CASE("what a killed run leaves is cleared by the next one, wherever it was killed") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out", partial = scratch.path() / "out.partial";
  SUBCASE("while it wrote") {
    killed_after(path, [](OutputFolder& folder) {
      fill(folder);
      write_text(folder.path() / ".vantage-17-0.tmp", "half");
    });
    CHECK(fs::exists(partial));
  }
  SUBCASE("before it had marked its folder") { fs::create_directory(partial); }
  SUBCASE("before it removed the folder that it has replaced") {
    make(partial);
    write_text(partial / ".vantage-partial", "");
  }
  SUBCASE("while it removed that") {
    fs::create_directory(partial);
    write_text(partial / ".vantage-partial", "");
    write_text(partial / "b.txt", "the head is gone");
  }
  make(path);
  CHECK(names_of(scratch.path()) == Names{"out", "out/head", "out/more", "out/more/a.txt"});
}

TEST_CASE("a killed run that had put its folder in place has left a folder that can be replaced") {
  const TemporaryFolder scratch;
  make(scratch.path() / "out");
  write_text(scratch.path() / "out/.vantage-partial", "");
  make(scratch.path() / "out", Existing::replace);
  CHECK(names_of(scratch.path() / "out") == Names{"head", "more", "more/a.txt"});
}

TEST_CASE("a folder of the user with the name of an unfinished one is left alone") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out", partial = scratch.path() / "out.partial";
  fs::create_directory(partial);
  const std::string name = "mine.md";
  std::string because = "it holds 'mine.md'";
  write_text(partial / name, "mine");
  SUBCASE("without a mark") {}
  SUBCASE("marked") { write_text(partial / ".vantage-partial", ""); }
  SUBCASE("a finished one of the kind") {
    fs::remove_all(partial);
    make(partial);
    because = "it has no .vantage-partial";
  }
  refused(path, Existing::replace, "not what an interrupted run leaves (" + because + ")");
  CHECK(fs::exists(partial / "head") == !fs::exists(partial / name));
}

TEST_CASE("a file of the user in an unfinished folder outlives it") {
  const TemporaryFolder scratch;
  {
    const auto folder =
        OutputFolder::create(kind_of_texts(), scratch.path() / "out", Existing::refuse);
    REQUIRE(folder);
    fill(*folder);
    write_text(folder->path() / "more/mine.md", "mine");
  }
  CHECK(read_text(scratch.path() / "out.partial/more/mine.md") == "mine");
  CHECK_FALSE(fs::exists(scratch.path() / "out.partial/head"));
}

TEST_CASE("one process works in a folder at a time") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out";
  const auto folder = OutputFolder::create(kind_of_texts(), path, Existing::refuse);
  REQUIRE(folder);
  write_text(folder->path() / "a.txt", "a");
  refused(path, Existing::refuse, "another program is writing a folder of texts here right now");
  CHECK(read_text(folder->path() / "a.txt") == "a");
}

TEST_CASE("a folder that records its progress stays, and the next run finds it") {
  const TemporaryFolder scratch;
  const fs::path path = scratch.path() / "out", partial = scratch.path() / "out.partial";
  const auto create = [&] {
    auto folder = OutputFolder::create(kind_of_texts("state"), path, Existing::refuse);
    REQUIRE_MESSAGE(folder, to_string(folder.error()));
    return *std::move(folder);
  };
  {
    const OutputFolder folder = create();
    write_text(folder.path() / "a.txt", "a");
  }
  CHECK_FALSE(fs::exists(partial));  // nothing to continue from
  {
    const OutputFolder folder = create();
    write_text(folder.path() / "a.txt", "a");
    write_text(folder.path() / "state", "1 of 2");
    write_text(folder.path() / ".vantage-17-0.tmp", "half");
  }
  CHECK(fs::exists(partial));
  OutputFolder folder = create();
  CHECK(names_of(partial) == Names{".vantage-partial", "a.txt", "state"});
  CHECK(folder.clear());
  CHECK(names_of(partial) == Names{".vantage-partial"});
  fill(folder);
  write_text(folder.path() / "state", "2 of 2");
  CHECK(folder.commit());
  CHECK(names_of(path) == Names{"head", "more", "more/a.txt"});
}

TEST_CASE("a path that names no folder, and one below a file, are errors") {
  const TemporaryFolder scratch;
  for (const char* path : {"", ".", "..", "/", "a/.."}) {
    refused(path, Existing::refuse, "does not name a folder to make", ErrorCode::invalid_input);
  }
  write_text(scratch.path() / "file", "x");
  refused(scratch.path() / "file/out", Existing::refuse, "cannot be created",
          ErrorCode::io_failure);
}

}  // namespace
}  // namespace vantage::io
