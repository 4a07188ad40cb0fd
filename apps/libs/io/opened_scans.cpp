#include "vantage/io/opened_scans.hpp"

#include <mutex>
#include <utility>

namespace vantage::io {

struct OpenedScans::State {
  ScanOptions options;
  ScanDescription description;
  std::mutex mutex;
  std::unique_ptr<ScanSource> source;  // null once it was taken; guarded by mutex
};

OpenedScans::OpenedScans(std::shared_ptr<State> state) noexcept : state_(std::move(state)) {}

Result<OpenedScans> OpenedScans::open(const ScanOptions& options) {
  VANTAGE_TRY(auto source, open_scans(options));
  auto state = std::make_shared<State>();
  state->options = options;
  state->description = source->describe();
  state->source = std::move(source);
  return OpenedScans(std::move(state));
}

const ScanOptions& OpenedScans::options() const noexcept { return state_->options; }
const ScanDescription& OpenedScans::describe() const noexcept { return state_->description; }

Result<std::unique_ptr<ScanSource>> OpenedScans::take() const {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->source) return std::move(state_->source);
  }
  return open_scans(state_->options);
}

}  // namespace vantage::io
