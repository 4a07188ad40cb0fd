#include "io/folder_scans.hpp"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "io/file_suffix.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::io {
namespace {

class FolderScans final : public ScanSource {
 public:
  explicit FolderScans(ScanSequence sequence) : sequence_(std::move(sequence)) {
    std::set<std::string> suffixes;
    for (std::size_t i = 0; i < sequence_.size(); ++i) {
      suffixes.insert(lower_case_suffix(sequence_.file(i)));
    }
    std::string kinds;
    for (const std::string& suffix : suffixes) {
      kinds += (kinds.empty() ? "" : ", ") + (suffix.empty() ? "no suffix" : suffix);
    }
    description_.format = fmt::format("files ({})", kinds);
    // Errors in the first file are reported when it is read.
    if (auto layout = read_cloud_layout(sequence_.file(0))) {
      description_.fields = std::move(layout->fields);
    }
    description_.stamp_rule = sequence_.stamp_rule();
    description_.scans = sequence_.size();
    description_.last_stamp = sequence_.stamp(sequence_.size() - 1);
  }

  Result<std::optional<StampedScan>> next() override {
    if (next_ == sequence_.size()) return std::optional<StampedScan>();
    auto scan = sequence_.read(next_);
    if (!scan) {
      next_ = sequence_.size();
      return fail(std::move(scan).error());
    }
    ++next_;
    return std::optional(*std::move(scan));
  }

  Result<void> seek(double stamp) override {
    next_ = 0;
    while (next_ < sequence_.size() && sequence_.stamp(next_) < stamp) ++next_;
    return {};
  }

  const ScanDescription& describe() const override { return description_; }
  SkippedScans skipped() const override { return {}; }

 private:
  ScanSequence sequence_;
  std::size_t next_ = 0;
  ScanDescription description_;
};

}  // namespace

std::unique_ptr<ScanSource> folder_scans(ScanSequence sequence) {
  return std::make_unique<FolderScans>(std::move(sequence));
}

}  // namespace vantage::io
