#include <sqlite3.h>

#include <map>
#include <stdexcept>

#include "support/bags/bags.hpp"

namespace vantage::test {
namespace {

std::string hexadecimal(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    const auto value = static_cast<unsigned char>(c);
    text += kDigits[value >> 4];
    text += kDigits[value & 15];
  }
  return text;
}

}  // namespace

std::string sqlite_file(const std::string& statements) {
  sqlite3* database = nullptr;
  sqlite3_open(":memory:", &database);
  char* message = nullptr;
  if (sqlite3_exec(database, statements.c_str(), nullptr, nullptr, &message) != SQLITE_OK) {
    throw std::runtime_error(message);
  }
  sqlite3_int64 size = 0;
  unsigned char* bytes = sqlite3_serialize(database, "main", &size, 0);
  const std::string file(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size));
  sqlite3_free(bytes);
  sqlite3_close(database);
  return file;
}

std::string rosbag2(const std::vector<TestMessage>& messages, const Rosbag2Options& options) {
  std::string statements =
      "BEGIN;"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
      " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
      " timestamp INTEGER NOT NULL, data BLOB NOT NULL);";
  if (options.timestamp_index) {
    statements += "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
  }
  std::map<std::string, std::size_t> numbers;
  for (const TestMessage& message : messages) {
    const auto [known, is_new] = numbers.emplace(message.topic, numbers.size() + 1);
    if (is_new) {
      statements += "INSERT INTO topics VALUES(" + std::to_string(known->second) + ",'" +
                    message.topic + "','" + message.type + "','" + options.serialization + "','');";
    }
    statements += "INSERT INTO messages(topic_id, timestamp, data) VALUES(" +
                  std::to_string(known->second) + "," + std::to_string(message.log_time) + ",x'" +
                  hexadecimal(options.zstd ? zstd_of(message.bytes) : message.bytes) + "');";
  }
  return sqlite_file(statements + "COMMIT;");
}

}  // namespace vantage::test
