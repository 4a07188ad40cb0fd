#pragma once

#include <atomic>
#include <chrono>
#include <string_view>
#include <thread>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/plugin.hpp"

/// Every plugin of this folder keeps the contract of its kind but for one clause. A kind is
/// compiled once; which.cpp, linked with it, says which clause is to be broken.
extern "C" const char vantage_broken_clause[];  // "P2"
extern "C" const char vantage_broken_name[];    // "breaks_P2"

namespace vantage::broken {

[[nodiscard]] inline bool breaks(std::string_view clause) noexcept {
  return clause == vantage_broken_clause;
}

/// A sound plugin of the project to break: what a method does not touch, that one does right.
template <class Interface>
[[nodiscard]] Result<PluginPtr<Interface>> sound(const std::string& name, const Table& params) {
  return PluginLoader({VANTAGE_PLUGIN_DIR}).load<Interface>({name, {}, params, {}});
}

/// Tells whether another call is under way on the same object, and stays long enough to be met.
class Crowded {
 public:
  explicit Crowded(std::atomic<int>& inside) : inside_(inside) {
    others_ = inside_.fetch_add(1) > 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    others_ = others_ || inside_.load() > 1;
  }
  ~Crowded() { --inside_; }
  Crowded(const Crowded&) = delete;
  Crowded& operator=(const Crowded&) = delete;
  explicit operator bool() const noexcept { return others_; }

 private:
  std::atomic<int>& inside_;
  bool others_ = false;
};

}  // namespace vantage::broken
