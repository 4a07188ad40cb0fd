#include "foxglove/page.hpp"

#include <doctest/doctest.h>
#include <openssl/evp.h>

#include <string>

#include "foxglove/assets.hpp"

namespace vantage::foxglove {
namespace {

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const auto from = text.find(begin);
  REQUIRE(from != std::string::npos);
  const auto to = text.find(end, from + begin.size());
  REQUIRE(to != std::string::npos);
  return text.substr(from + begin.size(), to - from - begin.size());
}

/// As RFC 4648 and the specification of policies say, by other functions than the page's.
std::string sha256(const std::string& text) {
  unsigned char hash[32];
  EVP_MD_CTX* const context = EVP_MD_CTX_new();
  EVP_DigestInit_ex(context, EVP_sha256(), nullptr);
  EVP_DigestUpdate(context, text.data(), text.size());
  EVP_DigestFinal_ex(context, hash, nullptr);
  EVP_MD_CTX_free(context);
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string base64;
  for (std::size_t bit = 0; bit < 256; bit += 6) {
    unsigned value = 0;
    for (std::size_t i = bit; i < bit + 6; ++i) {
      value = value << 1U | (i < 256 ? hash[i / 8] >> (7 - i % 8) & 1U : 0U);
    }
    base64 += digits[value];
  }
  return base64 + "=";
}

std::string field(const Answer& answer, std::string_view name) {
  for (const auto& [key, value] : answer.fields) {
    if (key == name) return std::string(value);
  }
  return {};
}

TEST_CASE("page: it asks for nothing, and its policy names its own style and script") {
  const Page page = make_page();
  CHECK(page.html.starts_with("<!DOCTYPE html>"));
  CHECK(page.html.size() < 40'000);
  CHECK(page.policy.find("style-src 'sha256-" + sha256(between(page.html, "<style>", "</style>")) +
                         "'; ") != std::string::npos);
  CHECK(page.policy.find("script-src 'sha256-" +
                         sha256(between(page.html, "<script>", "</script>")) + "'; ") !=
        std::string::npos);
  CHECK(page.policy.starts_with("default-src 'none'; "));
  CHECK(page.policy.find("connect-src 'self'; ") != std::string::npos);
  CHECK(page.policy.find("frame-ancestors 'none'") != std::string::npos);
  for (const char* const word : {"http://", "https://", "src=", "@import", "fetch(", "import(",
                                 "XMLHttpRequest", "@style@", "@script@", " style="}) {
    CAPTURE(word);
    CHECK(page.html.find(word) == std::string::npos);
  }
  CHECK(asset("no such file").empty());
}

TEST_CASE("page: GET and HEAD of / get it, whatever query follows") {
  const Page page = make_page();
  for (const char* const method : {"GET", "HEAD"}) {
    for (const char* const target : {"/", "/?", "/?a=/b"}) {
      CAPTURE(method);
      CAPTURE(target);
      const Answer answer = answer_of(page, method, target);
      CHECK(answer.status == 200);
      CHECK(answer.body == page.html);
      CHECK(field(answer, "Content-Type") == "text/html; charset=utf-8");
      CHECK(field(answer, "Content-Security-Policy") == page.policy);
      CHECK(field(answer, "X-Content-Type-Options") == "nosniff");
    }
  }
}

TEST_CASE("page: other targets are not found, other methods not allowed") {
  const Page page = make_page();
  for (const char* const target :
       {"", "*", "//", "/index.html", "/../", "/favicon.ico", "http://a/"}) {
    CAPTURE(target);
    const Answer answer = answer_of(page, "GET", target);
    CHECK(answer.status == 404);
    CHECK(field(answer, "Content-Type") == "text/plain; charset=utf-8");
  }
  for (const char* const method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "get", "", "X"}) {
    CAPTURE(method);
    const Answer answer = answer_of(page, method, "/");
    CHECK(answer.status == 405);
    CHECK(field(answer, "Allow") == "GET, HEAD");
  }
}

}  // namespace
}  // namespace vantage::foxglove
