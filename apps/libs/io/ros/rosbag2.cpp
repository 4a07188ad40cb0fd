#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <unordered_map>

#include "io/ros/bag_readers.hpp"
#include "io/ros/decompress.hpp"
#include "io/text.hpp"

// The tables of rosbag2_storage_sqlite3: topics(id, name, type, serialization_format, ...),
// messages(id, topic_id, timestamp, data).

namespace vantage::io::ros {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const noexcept { sqlite3_close_v2(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

/// A URI with which SQLite writes nothing, looks for no other file and takes no lock.
std::string immutable_uri(const std::string& path) {
  // An absolute path follows an empty authority: one that begins with two slashes would itself be
  // taken for an authority. A relative one has none.
  std::string uri = path.starts_with('/') ? "file://" : "file:";
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri + "?mode=ro&immutable=1";
}

std::string_view text_of(sqlite3_stmt* row, int column) {
  const auto* text = sqlite3_column_text(row, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, column));
  if (text == nullptr) return {};
  return {reinterpret_cast<const char*>(text), size};  // NOLINT: SQLite's text is unsigned char
}

class Rosbag2Reader final : public MessageReader {
 public:
  explicit Rosbag2Reader(InputFile file) noexcept : file_(std::move(file)) {}

  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] const std::string& file() const override { return file_.name(); }
  [[nodiscard]] const std::vector<Topic>& topics() const override { return topics_; }
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> span() const override {
    return span_;
  }

  [[nodiscard]] Result<void> open() {
    VANTAGE_CHECK(check_size());
    VANTAGE_CHECK(check_beside());
    VANTAGE_CHECK(open_database());
    VANTAGE_CHECK(check_table("topics", {"id", "name", "type", "serialization_format"}));
    VANTAGE_CHECK(check_table("messages", {"id", "topic_id", "timestamp", "data"}));
    VANTAGE_CHECK(read_topics());
    VANTAGE_CHECK(count_messages());
    VANTAGE_TRY(order_, prepare("SELECT rowid, topic_id, timestamp FROM messages "
                                "WHERE timestamp >= ? ORDER BY timestamp, rowid"));
    VANTAGE_TRY(data_, prepare("SELECT data FROM messages WHERE rowid = ?"));
    selected_.assign(topics_.size(), true);
    return seek(kEarliest);
  }

  [[nodiscard]] Result<void> select(const std::vector<std::size_t>& topics) override {
    VANTAGE_TRY(selected_, selection(*this, topics));
    return seek(kEarliest);
  }

  [[nodiscard]] Result<void> seek(std::int64_t log_time) override {
    sqlite3_reset(data_.get());
    sqlite3_reset(order_.get());
    sqlite3_bind_int64(order_.get(), 1, log_time);
    failure_.reset();
    grown_ = 0;
    begin_work();
    return {};
  }

  [[nodiscard]] Result<std::optional<BagMessage>> next() override {
    if (failure_) return fail(*failure_);
    auto message = find_next();
    if (!message) failure_ = message.error();
    return message;
  }

 private:
  static constexpr std::int64_t kEarliest = std::numeric_limits<std::int64_t>::min();

  [[nodiscard]] tl::unexpected<Error> damaged(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file(), 0, 0});
  }
  [[nodiscard]] tl::unexpected<Error> refused(std::string_view activity) const {
    const int code = sqlite3_errcode(database_.get()) & 0xFF;
    std::string reason = std::string(sqlite3_errmsg(database_.get())).substr(0, 120);
    // The message holds names from the file.
    std::replace_if(
        reason.begin(), reason.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    if (code == SQLITE_INTERRUPT) {
      return damaged(fmt::format("{} does not end, the tables refer to themselves", activity));
    }
    const bool is_system = code == SQLITE_IOERR || code == SQLITE_NOMEM;
    return fail(is_system ? ErrorCode::io_failure : ErrorCode::corrupt_data,
                fmt::format("{} failed, SQLite says: {}", activity, reason),
                SourceLocation{file(), 0, 0});
  }

  /// Checks the size, because SQLite itself reads the missing part of the last page as zeros.
  /// The header: https://www.sqlite.org/fileformat.html, section 1.3.
  [[nodiscard]] Result<void> check_size() const {
    std::array<char, 100> header{};
    if (file_.size() < header.size()) {
      return damaged(
          fmt::format("the file ends at byte {}, expected the {} bytes of SQLite's header",
                      file_.size(), header.size()));
    }
    VANTAGE_CHECK(file_.read(0, header));
    const auto big_endian = [&header](std::size_t at, std::size_t size) {
      std::uint64_t value = 0;
      for (std::size_t i = 0; i < size; ++i) {
        value = value << 8 | static_cast<unsigned char>(header[at + i]);
      }
      return value;
    };
    if (!looks_like_sqlite({header.data(), header.size()})) {
      return damaged("the file begins like no SQLite database, expected 'SQLite format 3'");
    }
    const std::uint64_t page = big_endian(16, 2) == 1 ? 65536 : big_endian(16, 2);
    if (page < 512 || !std::has_single_bit(page)) {
      return damaged(
          fmt::format("the pages have {} bytes (byte 16), expected a power of two from "
                      "512 to 65536",
                      page));
    }
    // The number of pages is valid only if the writer updates it.
    const bool is_counted = big_endian(24, 4) == big_endian(92, 4);
    const std::uint64_t pages = is_counted ? big_endian(28, 4) : 0;
    if (file_.size() % page != 0 || pages * page > file_.size()) {
      return damaged(fmt::format("the file ends at byte {}, expected {} pages of {} bytes",
                                 file_.size(), is_counted ? fmt::to_string(pages) : "whole", page));
    }
    return {};
  }

  /// Checks for files that an interrupted recorder leaves and without which the database is not
  /// complete.
  [[nodiscard]] Result<void> check_beside() const {
    if (file_.in_memory()) return {};
    for (const std::string_view suffix : {"-wal", "-journal"}) {
      std::error_code absent;
      const auto size = std::filesystem::file_size(file() + std::string(suffix), absent);
      if (absent || size == 0) continue;
      return fail(
          ErrorCode::unsupported,
          fmt::format("{} bytes of it are in a file of the same name and {}, expected none; "
                      "`sqlite3 BAG 'PRAGMA journal_mode=DELETE'` takes them in",
                      size, suffix),
          SourceLocation{file(), 0, 0});
    }
    return {};
  }

  [[nodiscard]] Result<void> open_database() {
    sqlite3* database = nullptr;
    const std::string uri = file_.in_memory() ? ":memory:" : immutable_uri(file());
    const int opened =
        sqlite3_open_v2(uri.c_str(), &database,
                        SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    database_.reset(database);
    if (opened != SQLITE_OK) return refused("opening");
    if (file_.in_memory()) {
      VANTAGE_TRY(content_, file_.content());
      const auto size = static_cast<sqlite3_int64>(content_.size);
      // NOLINTNEXTLINE: SQLite's bytes are unsigned char
      auto* const bytes = reinterpret_cast<unsigned char*>(content_.bytes.get());
      if (sqlite3_deserialize(database, "main", bytes, size, size, SQLITE_DESERIALIZE_READONLY) !=
          SQLITE_OK) {
        return refused("opening");
      }
    }
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestChunk));
    sqlite3_progress_handler(database, kStepsAtOnce, &Rosbag2Reader::is_endless, this);
    VANTAGE_TRY(const Statement no_files, prepare("PRAGMA temp_store = MEMORY"));
    sqlite3_step(no_files.get());
    VANTAGE_TRY(const Statement checks, prepare("PRAGMA cell_size_check = ON"));
    sqlite3_step(checks.get());
    return {};
  }

  // A damaged tree can lead to the same page again and again. A row takes some bytes of the file
  // and some steps of SQLite's machine, so the number of bytes limits the number of steps.
  static constexpr int kStepsAtOnce = 10000;
  static int is_endless(void* reader) noexcept {
    auto& self = *static_cast<Rosbag2Reader*>(reader);
    constexpr std::uint64_t kStepsOfByte = 32;
    self.steps_ += kStepsAtOnce;
    return self.steps_ > 1'000'000 + kStepsOfByte * self.file_.size() ? 1 : 0;
  }
  void begin_work() noexcept { steps_ = 0; }

  [[nodiscard]] Result<Statement> prepare(const std::string& query) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      return refused("reading the tables of a rosbag2");
    }
    return Statement(statement);
  }
  /// Whether there is one more row.
  [[nodiscard]] Result<bool> step(const Statement& statement, std::string_view activity) const {
    const int status = sqlite3_step(statement.get());
    if (status == SQLITE_ROW) return true;
    if (status == SQLITE_DONE) return false;
    return refused(activity);
  }

  /// Checks that this is an ordinary table with these columns: a view or a virtual table could run
  /// code.
  [[nodiscard]] Result<void> check_table(const std::string& table,
                                         const std::vector<std::string>& columns) {
    VANTAGE_TRY(const Statement kind,
                prepare("SELECT type, sql FROM sqlite_master WHERE name = '" + table + "'"));
    VANTAGE_TRY(const bool is_there, step(kind, "reading the list of tables"));
    if (!is_there) {
      return damaged(
          fmt::format("there is no table '{}', expected a rosbag2 (topics, messages)", table));
    }
    if (text_of(kind.get(), 0) != "table" || !text_of(kind.get(), 1).starts_with("CREATE TABLE")) {
      return damaged(fmt::format("'{}' is {}, expected an ordinary table", table,
                                 io::quoted(text_of(kind.get(), 0))));
    }
    VANTAGE_TRY(const Statement found, prepare("PRAGMA table_xinfo('" + table + "')"));
    std::vector<std::string> stored;
    for (;;) {
      VANTAGE_TRY(const bool is_column, step(found, "reading the list of columns"));
      if (!is_column) break;
      if (sqlite3_column_int(found.get(), 6) == 0) stored.emplace_back(text_of(found.get(), 1));
    }
    for (const std::string& column : columns) {
      if (std::find(stored.begin(), stored.end(), column) != stored.end()) continue;
      return damaged(fmt::format("table '{}' has no stored column '{}', expected {}", table, column,
                                 fmt::join(columns, ", ")));
    }
    return {};
  }

  [[nodiscard]] Result<void> read_topics() {
    begin_work();
    VANTAGE_TRY(const Statement rows, prepare("SELECT id, name, type, serialization_format "
                                              "FROM topics ORDER BY id"));
    for (;;) {
      VANTAGE_TRY(const bool is_topic, step(rows, "reading the topics"));
      if (!is_topic) return {};
      sqlite3_stmt* const row = rows.get();
      if (sqlite3_column_type(row, 0) != SQLITE_INTEGER ||
          sqlite3_column_type(row, 1) != SQLITE_TEXT ||
          sqlite3_column_type(row, 2) != SQLITE_TEXT ||
          sqlite3_column_type(row, 3) != SQLITE_TEXT) {
        return damaged(fmt::format("row {} of table 'topics' is not a whole number and three texts",
                                   topics_by_id_.size() + 1));
      }
      VANTAGE_CHECK(add_topic(row));
    }
  }

  [[nodiscard]] Result<void> add_topic(sqlite3_stmt* row) {
    Topic topic;
    topic.name = text_of(row, 1);
    topic.type = ros1_spelling(text_of(row, 2));
    topic.encoding = Encoding::cdr;
    topic.encoding_name = "cdr";
    topic.messages = 0;
    if (text_of(row, 3) != "cdr") {
      return fail(ErrorCode::unsupported,
                  fmt::format("the messages of {} are serialized as {}, expected 'cdr'",
                              io::quoted(topic.name), io::quoted(text_of(row, 3))),
                  SourceLocation{file(), 0, 0});
    }
    const auto [known, is_new] = indices_.emplace(topic.name + '\n' + topic.type, topics_.size());
    if (is_new) topics_.push_back(std::move(topic));
    if (!topics_by_id_.emplace(sqlite3_column_int64(row, 0), known->second).second) {
      return damaged(
          fmt::format("table 'topics' has the id {} twice", sqlite3_column_int64(row, 0)));
    }
    return {};
  }

  /// Reads no blob: large values are not stored among the other columns.
  [[nodiscard]] Result<void> count_messages() {
    begin_work();
    VANTAGE_TRY(const Statement rows, prepare("SELECT rowid, topic_id, timestamp FROM messages"));
    for (;;) {
      VANTAGE_TRY(const bool is_message, step(rows, "counting the messages"));
      if (!is_message) return {};
      VANTAGE_TRY(const BagMessage message, message_of(rows.get()));
      ++*topics_[message.topic].messages;
      if (!span_) span_ = {message.log_time, message.log_time};
      span_->first = std::min(span_->first, message.log_time);
      span_->second = std::max(span_->second, message.log_time);
    }
  }

  /// Makes a message from rowid, topic_id and timestamp.
  [[nodiscard]] Result<BagMessage> message_of(sqlite3_stmt* row) const {
    const auto id = sqlite3_column_int64(row, 0);
    if (sqlite3_column_type(row, 1) != SQLITE_INTEGER ||
        sqlite3_column_type(row, 2) != SQLITE_INTEGER) {
      return damaged(
          fmt::format("message {} has a topic_id or a timestamp that is not a whole number", id));
    }
    const auto topic = topics_by_id_.find(sqlite3_column_int64(row, 1));
    if (topic == topics_by_id_.end()) {
      return damaged(
          fmt::format("message {} has the topic_id {}, which table 'topics' does not "
                      "have",
                      id, sqlite3_column_int64(row, 1)));
    }
    BagMessage message;
    message.topic = topic->second;
    message.log_time = sqlite3_column_int64(row, 2);
    return message;
  }

  [[nodiscard]] Result<std::optional<BagMessage>> find_next() {
    for (;;) {
      VANTAGE_TRY(const bool is_message, step(order_, "ordering the messages"));
      if (!is_message) return std::nullopt;
      VANTAGE_TRY(BagMessage message, message_of(order_.get()));
      if (!selected_[message.topic]) continue;
      VANTAGE_TRY(message.bytes, bytes_of(sqlite3_column_int64(order_.get(), 0)));
      return message;
    }
  }

  [[nodiscard]] Result<std::string_view> bytes_of(sqlite3_int64 id) {
    const std::string activity = fmt::format("reading message {}", id);
    sqlite3_reset(data_.get());
    sqlite3_bind_int64(data_.get(), 1, id);
    VANTAGE_TRY(const bool is_there, step(data_, activity));
    if (!is_there) return damaged(fmt::format("message {} is in an index only", id));
    if (sqlite3_column_type(data_.get(), 0) != SQLITE_BLOB) {
      return damaged(fmt::format("message {} has data that is not a blob", id));
    }
    const auto* const blob = static_cast<const char*>(sqlite3_column_blob(data_.get(), 0));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(data_.get(), 0));
    if (blob == nullptr && size != 0) return refused(activity);
    const std::string_view bytes(blob, blob == nullptr ? 0 : size);
    if (!bytes.starts_with(kZstdMagic)) return bytes;
    const Decompressed done = decompress(Compression::zstd, bytes, kLargestChunk, message_);
    if (!done.problem.empty()) {
      return damaged(fmt::format("message {} cannot be decompressed: {}", id, done.problem));
    }
    grown_ += done.size;
    if (grown_ <= largest_total(file_.size())) return message_.view(done.size);
    return damaged(
        fmt::format("the messages to {} give {} bytes, expected at most {} of a file of "
                    "{}",
                    id, grown_, largest_total(file_.size()), file_.size()));
  }

  InputFile file_;
  FileContent content_;
  std::string format_ = "rosbag2 (SQLite)";
  std::vector<Topic> topics_;
  std::unordered_map<std::string, std::size_t> indices_;  // of name and type
  std::unordered_map<std::int64_t, std::size_t> topics_by_id_;
  std::optional<std::pair<std::int64_t, std::int64_t>> span_;
  std::vector<bool> selected_;
  std::optional<Error> failure_;
  std::uint64_t steps_ = 0;
  Buffer message_;           // decompressed
  std::uint64_t grown_ = 0;  // in this pass [bytes]
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  Statement order_, data_;
};

}  // namespace

Result<std::unique_ptr<MessageReader>> read_rosbag2_sqlite(InputFile file) {
  return opened<Rosbag2Reader>(std::move(file));
}

}  // namespace vantage::io::ros
