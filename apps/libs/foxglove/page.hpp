#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vantage::foxglove {

/// The page that a browser shows a live session with: a client of the hub, in one file that asks
/// for nothing else.
struct Page {
  std::string html;
  /// Content-Security-Policy: its own style and script by their hashes, and a connection to where
  /// it came from. No other page may frame it: a click in a frame could move the localizer.
  std::string policy;
};
[[nodiscard]] Page make_page();

/// What a request that is no upgrade to WebSocket gets.
struct Answer {
  unsigned status;  ///< of HTTP
  std::vector<std::pair<std::string_view, std::string_view>> fields;
  std::string_view body;  ///< the header tells its length; it is not sent if the method is HEAD
};

/// The page for GET and HEAD of "/", whatever query follows; 404 for other targets, 405 for other
/// methods. The answer borrows from the page.
/// @param target  of the request line
[[nodiscard]] Answer answer_of(const Page& page, std::string_view method, std::string_view target);

}  // namespace vantage::foxglove
