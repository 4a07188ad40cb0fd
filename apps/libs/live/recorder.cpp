#include "live/recorder.hpp"

#include <utility>

#include "io/ros/messages.hpp"
#include "io/ros/schemas.hpp"

namespace vantage::live {
namespace {

// What may wait for the disk [bytes]: a minute of a large sensor.
constexpr std::size_t kMostWaiting = 256U << 20U;

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::create(const std::filesystem::path& path) {
  VANTAGE_TRY(auto writer, io::ros::McapWriter::create(path));
  return std::unique_ptr<Recorder>(new Recorder(std::move(writer)));
}

Recorder::Recorder(io::ros::McapWriter writer)
    : writer_(std::move(writer)), thread_([this] { work(); }) {}

Recorder::~Recorder() {
  {
    const std::scoped_lock lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Recorder::see(const dds::Topic& topic, std::int64_t time, std::string_view message) {
  {
    const std::scoped_lock lock(mutex_);
    if (failure_ || ends_ || waiting_bytes_ + message.size() > kMostWaiting) {
      ++left_out_;
      return;
    }
    waiting_bytes_ += message.size();
    waiting_.push_back({topic.name, topic.type, time, std::string(message)});
  }
  changed_.notify_one();
}

Result<void> Recorder::write(const Message& message) {
  auto channel = channels_.find(message.topic);
  if (channel == channels_.end()) {
    VANTAGE_TRY(const auto schema, io::ros::schema_of(message.type));
    VANTAGE_TRY(const auto id, writer_.add_channel(message.topic, schema));
    channel = channels_.emplace(message.topic, id).first;
  }
  return writer_.write(channel->second, io::ros::seconds_from(message.time), message.bytes);
}

void Recorder::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ends_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Message message = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= message.bytes.size();
    lock.unlock();
    auto written = write(message);
    if (written) {
      ++written_;
    } else if (const auto kept = writer_.keep(); !kept) {
      written.error().message += "; nothing of it is kept: " + kept.error().message;
    }
    lock.lock();
    if (!written) {
      failure_ = std::move(written).error();
      left_out_ += 1 + waiting_.size() + (written_ - writer_.messages());
      waiting_.clear();
      waiting_bytes_ = 0;
    }
  }
}

std::optional<std::string> Recorder::complaint() {
  const std::scoped_lock lock(mutex_);
  if (failure_ && !std::exchange(told_failure_, true)) {
    return "the recording has ended, localization goes on: " + failure_->message;
  }
  if (!failure_ && left_out_ > 0 && !std::exchange(told_left_out_, true)) {
    return "the disk is too slow for the recording: messages are left out of it";
  }
  return std::nullopt;
}

std::uint64_t Recorder::left_out() const {
  const std::scoped_lock lock(mutex_);
  return left_out_;
}

Result<void> Recorder::commit() {
  {
    const std::scoped_lock lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
  if (failure_) return fail(*failure_);
  auto done = writer_.commit();
  if (!done) (void)writer_.keep();
  return done;
}

}  // namespace vantage::live
