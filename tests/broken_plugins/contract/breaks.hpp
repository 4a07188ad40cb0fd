#pragma once

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
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

/// Whether the plugin is the one that breaks no clause, and has nothing that its kind may lack.
[[nodiscard]] inline bool offers_least() noexcept { return breaks("least"); }

/// A sound plugin of the project to break: what a method does not touch, that one does right.
template <class Interface>
[[nodiscard]] Result<PluginPtr<Interface>> sound(const std::string& name, const Table& params) {
  return PluginLoader({VANTAGE_PLUGIN_DIR}).load<Interface>({name, {}, params, {}});
}

/// Whether another number of threads may compute than usual.
[[nodiscard]] inline bool threads_are_unusual() noexcept {
  return tbb::this_task_arena::max_concurrency() != tbb::info::default_concurrency();
}

/// For a kind that needs none: something that the clauses of every kind can ask for.
struct OneParam {
  double strength = 1.0;
  static constexpr auto schema() {
    return std::tuple{optional("strength", &OneParam::strength, "", "of nothing", positive)};
  }
};

/// Spoils what a sound factory says of parameters, if one of C2 to C4 is to be broken.
template <class Interface>
[[nodiscard]] Result<Table> spoilt_params(const Factory<Interface>& sound, Table params) {
  VANTAGE_TRY(const auto known, sound.describe());
  const auto is_unknown = [&](const Entry& entry) {
    return std::ranges::find(known, entry.key, &ParameterDoc::key) == known.end();
  };
  if (breaks("C2")) std::erase_if(params.entries, is_unknown);
  auto effective = sound.effective_params(params);
  if (breaks("C3") && !effective && std::ranges::none_of(params.entries, is_unknown)) {
    return fail(ErrorCode::invalid_config, "something is wrong");
  }
  if (breaks("C4") && effective) effective->entries.clear();
  if (breaks("C4_values") && effective) return sound.effective_params({});  // the defaults
  return effective;
}

/// What VANTAGE_PLUGIN would make, but for the clauses of every kind.
template <class Interface, class Implementation>
[[nodiscard]] constexpr Factory<Interface> factory_of() noexcept {
  return {.create = detail::factory_of<Interface, Implementation>().create,
          .effective_params = [](const Table& params) noexcept -> Result<Table> {
            return guarded([&] {
              return spoilt_params(detail::factory_of<Interface, Implementation>(), params);
            });
          },
          .describe = []() noexcept -> Result<std::vector<ParameterDoc>> {
            return guarded([]() -> Result<std::vector<ParameterDoc>> {
              auto docs = ::vantage::describe<typename Implementation::Params>();
              if (breaks("C1")) docs.front().doc.clear();
              return docs;
            });
          }};
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

/// The plugin of a file.
#define VANTAGE_BROKEN_PLUGIN(Interface)                                                      \
  extern "C" __attribute__((visibility("default"),                                            \
                            used)) constinit const ::vantage::PluginManifest vantage_plugin { \
    .name = vantage_broken_name, .summary = "a plugin that breaks one clause",                \
    .factory = ::vantage::broken::factory_of<Interface, ::vantage::broken::Broken>()          \
  }
