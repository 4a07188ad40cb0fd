#include "io/ros/topic_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "io/ros/messages.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

bool is_among(std::string_view type, std::span<const std::string_view> types) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

bool serves(const Topic& topic, std::span<const std::string_view> types) {
  return topic.encoding.has_value() && is_among(topic.type, types);
}

/// "/points_raw (sensor_msgs/PointCloud2)" for each suitable topic, or for all; each once.
std::vector<std::string> names_of(const std::vector<Topic>& topics,
                                  std::span<const std::string_view> types) {
  std::vector<std::string> names;
  for (const Topic& topic : topics) {
    if (!types.empty() && !serves(topic, types)) continue;
    names.push_back(fmt::format("{} ({})", topic.name, topic.type));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::vector<std::string_view> all_types(const TopicNeed& need) {
  std::vector<std::string_view> types = need.by_name;
  for (const auto& choice : need.choices) types.insert(types.end(), choice.begin(), choice.end());
  return types;
}

/// What a message says about the suitable topics, or about all if there is none.
std::string choice_of(const MessageReader& reader, const TopicNeed& need) {
  const auto serving = names_of(reader.topics(), all_types(need));
  if (!serving.empty()) return fmt::format("topics with {}: {}", need.what, short_list(serving));
  return fmt::format("no topic has {}; there are: {}", need.what,
                     short_list(names_of(reader.topics(), {})));
}

}  // namespace

std::vector<std::size_t> find_topics(const MessageReader& reader, std::string_view name,
                                     std::span<const std::string_view> types) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < reader.topics().size(); ++i) {
    const Topic& topic = reader.topics()[i];
    if (topic.name == name && serves(topic, types)) found.push_back(i);
  }
  return found;
}

Result<std::vector<std::size_t>> choose_topic(const MessageReader& reader, std::string_view name,
                                              const TopicNeed& need) {
  const auto error = [&](std::string message) {
    return fail(ErrorCode::invalid_input, std::move(message), SourceLocation{reader.file(), 0, 0});
  };
  const std::vector<Topic>& topics = reader.topics();
  if (!name.empty()) {
    auto found = find_topics(reader, name, all_types(need));
    if (!found.empty()) return found;
    const auto other = std::find_if(topics.begin(), topics.end(),
                                    [&](const Topic& topic) { return topic.name == name; });
    if (other == topics.end()) {
      return error(fmt::format("there is no topic {}; {}", quoted(name), choice_of(reader, need)));
    }
    const std::string encoding =
        other->encoding
            ? ""
            : fmt::format(" in the encoding {}", quoted(std::string_view(other->encoding_name)));
    return error(fmt::format("topic {} is of type {}{}; {}", quoted(name),
                             quoted(std::string_view(other->type)), encoding,
                             choice_of(reader, need)));
  }
  for (const auto& types : need.choices) {
    const auto candidates = names_of(topics, types);
    if (candidates.empty()) continue;
    if (candidates.size() > 1) {
      return error(fmt::format("{} topics have {}, choose one with {}: {}", candidates.size(),
                               need.what, need.option, short_list(candidates)));
    }
    const auto only = std::find_if(topics.begin(), topics.end(),
                                   [&](const Topic& topic) { return serves(topic, types); });
    return find_topics(reader, only->name, types);
  }
  return error(choice_of(reader, need));
}

std::string short_list(const std::vector<std::string>& items) {
  constexpr std::size_t kLongestItem = 80, kLongest = 200;
  std::string list;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0 && list.size() + std::min(items[i].size(), kLongestItem) > kLongest) {
      return list + fmt::format(" and {} more", items.size() - i);
    }
    if (i > 0) list += ", ";
    for (const char c : items[i].substr(0, kLongestItem)) list += c >= ' ' && c <= '~' ? c : '?';
    if (items[i].size() > kLongestItem) list += "...";
  }
  return items.empty() ? "none" : list;
}

std::string place_of(const MessageReader& reader, const BagMessage& message) {
  const std::string topic = short_list({reader.topics()[message.topic].name});
  if (message.offset > 0) return fmt::format("message at byte {} of {}", message.offset, topic);
  return fmt::format("message recorded at {} ns of {}", message.log_time, topic);
}

tl::unexpected<Error> in_message(Error error, const MessageReader& reader,
                                 const BagMessage& message) {
  return fail(std::move(error).during("reading the " + place_of(reader, message)));
}

Result<bool> lacks_stamps(MessageReader& reader, const std::vector<std::size_t>& topics) {
  constexpr double kLongestStart = 10.0;  // [s]
  VANTAGE_CHECK(reader.select(topics));
  // An error is left to those who read the messages.
  const auto stamp_of_next = [&reader]() -> std::optional<double> {
    const auto message = reader.next();
    if (!message || !*message) return std::nullopt;
    const Topic& topic = reader.topics()[(*message)->topic];
    const auto header = parse_header((*message)->bytes, *topic.encoding, {reader.file(), 0, 0});
    return header ? std::optional(header->stamp.seconds()) : std::nullopt;
  };
  if (stamp_of_next() != 0.0) return false;
  return stamp_of_next().value_or(0.0) <= kLongestStart;
}

}  // namespace vantage::io::ros
