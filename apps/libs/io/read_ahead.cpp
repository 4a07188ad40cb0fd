#include "vantage/io/read_ahead.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

namespace vantage::io {
namespace {

constexpr std::size_t kAhead = 1;  // scans that wait; the thread holds one more

class ReadAhead final : public ScanSource {
 public:
  explicit ReadAhead(std::unique_ptr<ScanSource> source) : source_(std::move(source)) { start(); }
  ~ReadAhead() override { stop(); }

  Result<std::optional<StampedScan>> next() override {
    if (ended_) return std::optional<StampedScan>();
    Item item = take();
    ended_ = !item.scan || !*item.scan;
    skipped_ = item.skipped;
    return std::move(item.scan);
  }

  Result<void> seek(double stamp) override {
    stop();
    skipped_ = {};
    auto done = source_->seek(stamp);
    ended_ = !done;
    if (done) start();
    return done;
  }

  const ScanDescription& describe() const override { return source_->describe(); }
  SkippedScans skipped() const override { return skipped_; }

 private:
  struct Item {
    Result<std::optional<StampedScan>> scan;
    SkippedScans skipped;  // up to this scan, so that the caller sees nothing of later scans
  };

  void start() {
    stopped_ = false;
    reader_ = std::thread([this] { read(); });
  }

  void stop() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    if (reader_.joinable()) reader_.join();
    items_.clear();
  }

  void read() {
    for (bool last = false; !last;) {
      Item item{next_scan(), {}};
      item.skipped = source_->skipped();
      last = !item.scan || !*item.scan;
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stopped_ || items_.size() < kAhead; });
      if (stopped_) return;
      items_.push_back(std::move(item));
      changed_.notify_all();
    }
  }

  /// An exception must not leave the thread.
  Result<std::optional<StampedScan>> next_scan() {
    try {
      return source_->next();
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::io_failure, "not enough memory for the next scan of the recording");
    }
  }

  Item take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !items_.empty(); });
    Item item = std::move(items_.front());
    items_.pop_front();
    changed_.notify_all();
    return item;
  }

  std::unique_ptr<ScanSource> source_;
  std::thread reader_;  // the only thread that reads from source_ while it runs
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> items_;  // guarded by mutex_
  bool stopped_ = false;    // guarded by mutex_
  bool ended_ = false;
  SkippedScans skipped_;
};

}  // namespace

std::unique_ptr<ScanSource> read_ahead(std::unique_ptr<ScanSource> source) {
  return std::make_unique<ReadAhead>(std::move(source));
}

}  // namespace vantage::io
