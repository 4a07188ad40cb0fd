#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "io/ros/mcap_writer.hpp"
#include "live/observer.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// Records messages in an MCAP file, in a thread of its own, so that nobody waits for a disk. If
/// the disk is slower than what comes, messages are left out and counted; if it is full, the
/// recording ends and what it holds is put in place: all but the messages of the last chunk, about
/// 4 MiB of them.
class Recorder final : public Observer {
 public:
  /// Errors: those of McapWriter::create.
  [[nodiscard]] static Result<std::unique_ptr<Recorder>> create(const std::filesystem::path& path);
  ~Recorder() override;

  void see(const dds::Topic& topic, std::int64_t time, std::string_view message) override;
  /// What is wrong since the last call, told once.
  [[nodiscard]] std::optional<std::string> complaint();
  /// Messages that were left out.
  [[nodiscard]] std::uint64_t left_out() const;
  /// Writes what waits and puts the file in place, unless it is there; call once, at the end.
  /// Errors: those of McapWriter, the earliest.
  [[nodiscard]] Result<void> commit();

 private:
  struct Message {
    std::string topic, type;
    std::int64_t time;
    std::string bytes;
  };
  explicit Recorder(io::ros::McapWriter writer);
  void work();
  [[nodiscard]] Result<void> write(const Message& message);

  io::ros::McapWriter writer_;  // of the thread
  std::map<std::string, io::ros::McapWriter::ChannelId> channels_;
  std::uint64_t written_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::uint64_t left_out_ = 0;
  bool ends_ = false;
  std::optional<Error> failure_;
  bool told_failure_ = false, told_left_out_ = false;
  std::thread thread_;  // last: works with what is above
};

}  // namespace vantage::live
