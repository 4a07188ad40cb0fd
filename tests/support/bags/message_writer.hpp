#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "support/bags/bags.hpp"

namespace vantage::test {

/// Writes messages, independently of what reads them.
class MessageWriter {
 public:
  enum class Layout { ros1, cdr_little, cdr_big };

  explicit MessageWriter(Layout layout) : layout_(layout) {
    if (layout == Layout::cdr_little) bytes_ = std::string("\0\1\0\0", 4);
    if (layout == Layout::cdr_big) bytes_ = std::string("\0\0\0\0", 4);
  }

  template <class T>
  MessageWriter& number(T value) {
    if (layout_ != Layout::ros1) {
      while (bytes_.size() % sizeof(T) != 4 % sizeof(T)) bytes_ += '\0';
    }
    const std::string bytes = little(value);
    if (layout_ == Layout::cdr_big) return append({bytes.rbegin(), bytes.rend()});
    return append(bytes);
  }
  MessageWriter& text(const std::string& value) {
    const std::string stored = layout_ == Layout::ros1 ? value : value + '\0';
    number(static_cast<std::uint32_t>(stored.size()));
    return append(stored);
  }
  MessageWriter& append(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  MessageWriter& time(std::uint32_t seconds, std::uint32_t nanoseconds) {
    return number(seconds).number(nanoseconds);
  }
  MessageWriter& header(std::uint32_t seconds, std::uint32_t nanoseconds,
                        const std::string& frame) {
    if (layout_ == Layout::ros1) number(std::uint32_t{4711});  // seq
    return time(seconds, nanoseconds).text(frame);
  }
  template <std::size_t n>
  MessageWriter& numbers(const std::array<double, n>& values) {
    for (const double value : values) number(value);
    return *this;
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] Layout layout() const { return layout_; }

 private:
  Layout layout_;
  std::string bytes_;
};

/// The types of all messages that hold poses.
inline constexpr const char* kPoseTypes[] = {
    "nav_msgs/Odometry",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped",
    "tf2_msgs/TFMessage",
    "tf/tfMessage",
};

}  // namespace vantage::test
