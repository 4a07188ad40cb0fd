#include "foxglove/page.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <initializer_list>

#include "foxglove/assets.hpp"

namespace vantage::foxglove {
namespace {

/// As a policy names what may run: 'sha256-...' in Base64.
std::string hash_of(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> hash{};
  unsigned size = 0;
  EVP_Digest(text.data(), text.size(), hash.data(), &size, EVP_sha256(), nullptr);
  std::array<unsigned char, 2 * EVP_MAX_MD_SIZE> base64{};
  const int length = EVP_EncodeBlock(base64.data(), hash.data(), static_cast<int>(size));
  return fmt::format("'sha256-{}'", std::string(base64.begin(), base64.begin() + length));
}

/// The files one after another, without indents and lines of comments: a tenth of the page.
std::string joined(std::initializer_list<const char*> names) {
  std::string text;
  for (const char* const name : names) {
    std::string_view rest = asset(name);
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find('\n'), rest.size() - 1) + 1;
      std::string_view line = rest.substr(0, end);
      rest.remove_prefix(end);
      line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
      if (!line.starts_with("//")) text += line;
    }
  }
  return text;
}

}  // namespace

Page make_page() {
  constexpr std::string_view kStyle = "@style@", kScript = "@script@";
  const std::string style = joined({"base.css", "live.css"});
  const std::string script = joined({"theme.js", "heights.js", "messages.js", "connection.js",
                                     "camera.js", "view.js", "live.js"});
  Page page{.html = std::string(asset("live.html")),
            .policy = fmt::format(
                "default-src 'none'; style-src {}; script-src {}; connect-src 'self'; img-src "
                "data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                hash_of(style), hash_of(script))};
  page.html.replace(page.html.find(kStyle), kStyle.size(), style);
  page.html.replace(page.html.find(kScript), kScript.size(), script);
  return page;
}

Answer answer_of(const Page& page, std::string_view method, std::string_view target) {
  constexpr std::pair<std::string_view, std::string_view> kPlain{"Content-Type",
                                                                 "text/plain; charset=utf-8"};
  if (method != "GET" && method != "HEAD") {
    return {405, {kPlain, {"Allow", "GET, HEAD"}}, "this server answers GET and HEAD only\n"};
  }
  if (target.substr(0, target.find('?')) != "/") {
    return {404, {kPlain}, "there is one page here, at /\n"};
  }
  return {200,
          {{"Content-Type", "text/html; charset=utf-8"},
           {"Content-Security-Policy", page.policy},
           {"X-Content-Type-Options", "nosniff"},
           {"Referrer-Policy", "no-referrer"},
           {"Cache-Control", "no-store"}},
          page.html};
}

}  // namespace vantage::foxglove
