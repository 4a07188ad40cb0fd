#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <atomic>
#include <cstdlib>
#include <new>
#include <random>

#include "scenes.hpp"
#include "support/plugins.hpp"

namespace {
std::atomic<std::size_t> allocations = 0;

void* counted(std::size_t size, std::size_t alignment) noexcept {
  ++allocations;
  if (alignment == 0) return std::malloc(size == 0 ? 1 : size);
  return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

void* counted_or_throw(std::size_t size, std::size_t alignment) {
  void* memory = counted(size, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
}  // namespace

// Replaces the operators of the whole program, loaded plugins included.
void* operator new(std::size_t size) { return counted_or_throw(size, 0); }
void* operator new[](std::size_t size) { return counted_or_throw(size, 0); }
void* operator new(std::size_t size, const std::nothrow_t& /*unused*/) noexcept {
  return counted(size, 0);
}
void* operator new[](std::size_t size, const std::nothrow_t& /*unused*/) noexcept {
  return counted(size, 0);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted_or_throw(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*unused*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*unused*/) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t& /*unused*/) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t& /*unused*/) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t /*unused*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t /*unused*/) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*unused*/, std::align_val_t /*unused*/) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t /*unused*/, std::align_val_t /*unused*/) noexcept {
  std::free(memory);
}

namespace vantage {

TEST_CASE("an alignment allocates nothing after the first of its size") {
  // With more threads TBB itself allocates.
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const PointCloud map = test::yard(31);
  const Pose truth = pose_from_xyz_rpy({0.0, 0.0, 1.0}, {0.0, 0.0, 0.3});
  const PointCloud scan = test::seen_from(test::yard(32), truth, 15.0, 3000, 1);
  std::mt19937 random(1);
  const Pose guess = test::disturbed(truth, 0.3, 2.0, random);
  Pose far = truth;  // for the coarse levels
  far.translation.x() += 2.0;
  far.rotation = rotation_from_vector({0.0, 0.0, 0.2}) * far.rotation;
  for (const char* mode : {"direct7", "direct26", "direct1", "kdtree"}) {
    CAPTURE(mode);
    const auto target = test::prepared(map, std::string("neighbours = \"") + mode + "\"");
    std::size_t before = allocations;
    REQUIRE(target->align(scan, far));
    CHECK(allocations > before);  // the counter works across the plugin's border
    before = allocations;
    const auto again = target->align(scan, far);
    const auto near = target->align(scan, guess);
    const auto smaller = target->align(PointsView(scan).first(2000), guess);
    const auto score = target->score(scan, guess);
    CHECK(allocations == before);
    CHECK(again);
    CHECK(near);
    CHECK(smaller);
    CHECK(score);
  }
}

TEST_CASE("the maps of one matcher share scratch memory") {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const PointCloud map = test::yard(31);
  const Pose truth = pose_from_xyz_rpy({0.0, 0.0, 1.0}, {0.0, 0.0, 0.3});
  const PointCloud scan = test::seen_from(test::yard(32), truth, 15.0, 3000, 1);
  const auto matcher = test::plugin<ScanMatcher>("ndt");
  const auto first = matcher->prepare(map).value(), second = matcher->prepare(map).value();
  REQUIRE(first->align(scan, truth));
  const std::size_t before = allocations;
  CHECK(second->align(scan, truth));
  CHECK(allocations == before);
}

}  // namespace vantage
