#include "live/worker.hpp"

#include <doctest/doctest.h>

#include <future>
#include <string>

namespace vantage::live {
namespace {

TEST_CASE("of the jobs of a kind that wait for a slow disk, the latest is run") {
  std::promise<void> disk;
  std::string done;
  Worker worker;
  worker.run([&, written = disk.get_future().share()] { written.wait(); });
  for (char region = 'a'; region < 'g'; ++region) {
    worker.run_latest("map", [&done, region] { done += region; });
    if (region == 'c') worker.run([&] { done += '1'; });
    if (region == 'd') worker.run([&] { done += '2'; });
    worker.run_latest("state", [&] { done += 's'; });
  }
  disk.set_value();
  worker.stop();
  CHECK(done == "fs12");
}

TEST_CASE("so many jobs of a kind wait at most, and the oldest is left out") {
  std::promise<void> gone;
  std::string done;
  Worker worker;
  worker.run([&, answered = gone.get_future().share()] { answered.wait(); });
  std::size_t left_out = 0;
  for (char answer = 'a'; answer < 'h'; ++answer) {
    left_out += worker.run_latest(
        "answer", [&done, answer] { done += answer; }, 3);
    if (answer == 'b') worker.run([&] { done += '1'; });
  }
  CHECK(left_out == 4);
  gone.set_value();
  worker.stop();
  CHECK(done == "ef1g");
}

TEST_CASE("a worker that has finished takes more jobs") {
  std::string done;
  Worker worker;
  for (const char job : {'a', 'b'}) {
    worker.run([&done, job] { done += job; });
    worker.finish();
    CHECK(done.back() == job);
  }
}

}  // namespace
}  // namespace vantage::live
