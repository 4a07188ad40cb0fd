#include "vantage/evaluation/run_files.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "support/process.hpp"
#include "support/real_data.hpp"

using namespace vantage;

namespace {

Run run_of(std::size_t scans) {
  Run run;
  run.index.partition = *Partition::from({Region{"all", HalfOpenBox{{-1, -1}, {1, 1}}, {}}});
  for (std::size_t i = 0; i < scans; ++i) {
    RunScan scan;
    scan.report.stamp = static_cast<double>(i);
    scan.report.tracking = Tracking::tracked;
    run.scans.push_back(scan);
  }
  return run;
}

/// No file may grow beyond so many bytes, as `ulimit -f` says.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace

TEST_CASE("a run that cannot be written leaves the files of the one before, all three of them") {
  const test::TemporaryFolder folder;
  const Run before = run_of(2), after = run_of(100);
  REQUIRE(write_run(before, summarize(before), folder.path()));
  const auto content = [&](const char* file) { return test::read_text(folder.path() / file); };
  const std::string trajectory = content("trajectory.tum"), scans = content("scans.csv"),
                    summary = content("summary.json");
  const std::size_t room = content("scans.csv").size() + 4000;
  REQUIRE(to_csv(after).size() > room);  // and the trajectory is smaller
  {
    const FileSizeLimit limit(room);
    CHECK_FALSE(write_run(after, summarize(after), folder.path()));
  }
  CHECK(content("trajectory.tum") == trajectory);
  CHECK(content("scans.csv") == scans);
  CHECK(content("summary.json") == summary);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 3);
  REQUIRE(write_run(after, summarize(after), folder.path()));
  CHECK(content("scans.csv") == to_csv(after));
}
