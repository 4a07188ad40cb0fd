#include "vantage/io/read_ahead.hpp"

#include <condition_variable>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>

namespace vantage::io {
namespace {

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
    next_.reset();
  }

  void read() {
    std::unique_lock lock(mutex_);
    for (bool last = false; !last;) {
      changed_.wait(lock, [this] { return stopped_ || !next_; });
      if (stopped_) return;
      lock.unlock();
      Item item{next_scan(), {}};
      item.skipped = source_->skipped();
      last = !item.scan || !*item.scan;
      lock.lock();
      next_ = std::move(item);
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
    changed_.wait(lock, [this] { return next_.has_value(); });
    Item item = *std::move(next_);
    next_.reset();
    changed_.notify_all();
    return item;
  }

  std::unique_ptr<ScanSource> source_;
  std::thread reader_;  // the only thread that reads from source_ while it runs
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Item> next_;  // guarded by mutex_
  bool stopped_ = false;      // guarded by mutex_
  bool ended_ = false;
  SkippedScans skipped_;
};

}  // namespace

std::unique_ptr<ScanSource> read_ahead(std::unique_ptr<ScanSource> source) {
  return std::make_unique<ReadAhead>(std::move(source));
}

}  // namespace vantage::io
