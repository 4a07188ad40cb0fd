#include <fmt/format.h>

#include <algorithm>

#include "io/file_suffix.hpp"
#include "io/formats.hpp"
#include "io/ros/bag_readers.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

/// The parts of a recording, one after the other; only one part is open at a time.
class BagFolder final : public MessageReader {
 public:
  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] const std::string& file() const override { return file_; }
  [[nodiscard]] const std::vector<Topic>& topics() const override { return topics_; }
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> span() const override {
    return span_;
  }

  [[nodiscard]] Result<void> open(const std::vector<std::filesystem::path>& paths) {
    for (const auto& path : paths) {
      VANTAGE_TRY(const auto reader, read_bag_file(path));
      Part part;
      part.path = path;
      part.span = reader->span();
      for (const Topic& topic : reader->topics()) part.topics.push_back(merge(topic));
      if (part.span) add_span(*part.span);
      if (parts_.empty()) format_ = reader->format();
      is_counted_ &= std::all_of(reader->topics().begin(), reader->topics().end(),
                                 [](const Topic& topic) { return topic.messages.has_value(); });
      parts_.push_back(std::move(part));
    }
    if (!is_counted_) {
      for (Topic& topic : topics_) topic.messages.reset();
    }
    if (parts_.size() > 1) format_ += fmt::format(", {} parts", parts_.size());
    file_ = parts_.front().path.string();
    selected_.assign(topics_.size(), true);
    return {};
  }

  [[nodiscard]] Result<void> select(const std::vector<std::size_t>& topics) override {
    VANTAGE_TRY(selected_, selection(*this, topics));
    from_.reset();
    rewind();
    return {};
  }
  [[nodiscard]] Result<void> seek(std::int64_t log_time) override {
    from_ = log_time;
    rewind();
    return {};
  }

  [[nodiscard]] Result<std::optional<BagMessage>> next() override {
    if (failure_) return fail(*failure_);
    for (;;) {
      if (!reader_) {
        if (next_part_ == parts_.size()) return std::nullopt;
        auto opened = open_part();
        if (!opened) return give_up(std::move(opened).error());
        continue;
      }
      auto message = reader_->next();
      if (!message) return give_up(std::move(message).error());
      if (*message) {
        (*message)->topic = parts_[next_part_ - 1].topics[(*message)->topic];
        return message;
      }
      reader_.reset();
    }
  }

 private:
  struct Part {
    std::filesystem::path path;
    std::vector<std::size_t> topics;  // of its topics, in topics_
    std::optional<std::pair<std::int64_t, std::int64_t>> span;
  };

  [[nodiscard]] std::size_t merge(const Topic& topic) {
    const auto found = std::find_if(topics_.begin(), topics_.end(), [&topic](const Topic& other) {
      return other.name == topic.name && other.type == topic.type &&
             other.encoding_name == topic.encoding_name;
    });
    const auto index = static_cast<std::size_t>(found - topics_.begin());
    if (found == topics_.end()) {
      topics_.push_back(topic);
    } else if (found->messages && topic.messages) {
      *found->messages += *topic.messages;
    }
    return index;
  }
  void add_span(const std::pair<std::int64_t, std::int64_t>& span) {
    if (!span_) span_ = span;
    span_ = {std::min(span_->first, span.first), std::max(span_->second, span.second)};
  }

  void rewind() noexcept {
    reader_.reset();
    failure_.reset();
    next_part_ = 0;
  }
  [[nodiscard]] tl::unexpected<Error> give_up(Error error) {
    reader_.reset();
    failure_ = std::move(error);
    return fail(*failure_);
  }

  [[nodiscard]] Result<void> open_part() {
    const Part& part = parts_[next_part_++];
    file_ = part.path.string();
    VANTAGE_TRY(auto reader, read_bag_file(part.path));
    if (reader->topics().size() != part.topics.size()) {
      return fail(ErrorCode::io_failure, "the file changed while the bag was read",
                  SourceLocation{file_, 0, 0});
    }
    std::vector<std::size_t> selected;
    for (std::size_t i = 0; i < part.topics.size(); ++i) {
      if (selected_[part.topics[i]]) selected.push_back(i);
    }
    VANTAGE_CHECK(reader->select(selected));
    if (from_) VANTAGE_CHECK(reader->seek(*from_));
    reader_ = std::move(reader);
    return {};
  }

  std::vector<Part> parts_;
  std::vector<Topic> topics_;
  std::string format_, file_;
  bool is_counted_ = true;
  std::optional<std::pair<std::int64_t, std::int64_t>> span_;
  std::vector<bool> selected_;
  std::optional<std::int64_t> from_;
  std::optional<Error> failure_;
  std::unique_ptr<MessageReader> reader_;  // of the part before next_part_
  std::size_t next_part_ = 0;
};

}  // namespace

Result<std::unique_ptr<MessageReader>> read_parts(const std::filesystem::path& folder) {
  VANTAGE_TRY(const auto parts, bag_parts(folder));
  if (parts.empty()) {
    return fail(
        ErrorCode::not_found,
        fmt::format("the folder has no {} file, expected a rosbag2", extension_list(kBagPart)),
        SourceLocation{folder.string(), 0, 0});
  }
  for (const auto& part : parts) {
    const std::string suffix = lower_case_suffix(part);
    if (suffix != ".zstd" && suffix != ".zst") continue;
    return fail(ErrorCode::unsupported,
                fmt::format("the bag is compressed as a file, expected one that `zstd -d '{}'` has "
                            "decompressed",
                            part.filename().string()),
                SourceLocation{part.string(), 0, 0});
  }
  auto folder_reader = std::make_unique<BagFolder>();
  VANTAGE_CHECK(folder_reader->open(parts));
  return folder_reader;
}

}  // namespace vantage::io::ros
