// A sound ground filter; what is wrong with it comes from its compile options and its file name.
#include <cstdio>
#include <stdexcept>

#include "vantage/plugin.hpp"

#if defined(CALL_WHAT_IS_NOWHERE)
int defined_nowhere();
#endif

namespace {

#if defined(COMPLAINS_WHEN_LOADED)
const int complaint = std::puts("a refused plugin's code has run");
#endif

class NoGround final : public vantage::GroundFilter {
 public:
  using Params = vantage::NoParams;
  static vantage::Result<std::unique_ptr<vantage::GroundFilter>> create(const Params&) {
    return std::make_unique<NoGround>();
  }
  [[nodiscard]] vantage::Result<vantage::IndexList> ground(
      vantage::PointsView) const noexcept override {
#if defined(THROWS)
    throw std::runtime_error("out of ground");
#elif defined(CALL_WHAT_IS_NOWHERE)
    return vantage::IndexList(static_cast<std::size_t>(defined_nowhere()));
#else
    return vantage::IndexList{};
#endif
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::GroundFilter, NoGround, PLUGIN_NAME, "finds nothing");
