// A sound ground filter; what is wrong with it comes from its compile options and its file name.
#include "vantage/plugin.hpp"

#if defined(CALL_WHAT_IS_NOWHERE)
int defined_nowhere();
#endif

namespace {

class NoGround final : public vantage::GroundFilter {
 public:
  using Params = vantage::NoParams;
  static vantage::Result<std::unique_ptr<vantage::GroundFilter>> create(const Params&) {
    return std::make_unique<NoGround>();
  }
  [[nodiscard]] vantage::Result<vantage::IndexList> ground(
      vantage::PointsView) const noexcept override {
#if defined(CALL_WHAT_IS_NOWHERE)
    return vantage::IndexList(static_cast<std::size_t>(defined_nowhere()));
#else
    return vantage::IndexList{};
#endif
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::GroundFilter, NoGround, PLUGIN_NAME, "finds nothing");
