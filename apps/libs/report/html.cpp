#include "report/html.hpp"

#include <fmt/format.h>

#include "report/assets.hpp"

namespace vantage::report {
namespace {

std::string data_of(const Cell& cell) {
  std::string text;
  for (const auto& [name, value] : cell.data) {
    text += fmt::format(" data-{}=\"{}\"", name, escaped(value));
  }
  return text;
}

std::string group_row(const std::vector<HeadGroup>& groups) {
  std::string html = "<tr class=\"groups\">";
  for (const HeadGroup& group : groups) {
    html += fmt::format("<th colspan=\"{}\"{}>{}</th>", group.columns,
                        group.text.empty() ? "" : " scope=\"colgroup\" class=\"group\"",
                        escaped(group.text));
  }
  return html + "</tr>\n";
}

std::string header_row(const Table& table) {
  std::string html = "<tr>";
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    html += fmt::format("<th scope=\"col\"{}>{}</th>",
                        c < table.name_columns ? " class=\"name\"" : "", escaped(table.header[c]));
  }
  return html + "</tr>\n";
}

std::string body_row(const Table& table, const TableRow& row) {
  if (row.heading) {
    return fmt::format("<tr class=\"heading\"><th scope=\"rowgroup\" colspan=\"{}\">{}</th></tr>\n",
                       table.header.size(), escaped(row.cells.front().text));
  }
  std::string html = row.beneath ? "<tr class=\"beneath\">" : "<tr>";
  for (std::size_t c = 0; c < row.cells.size(); ++c) {
    const Cell& cell = row.cells[c];
    const bool name = c < table.name_columns;
    const char* const look = name ? " class=\"name\"" : cell.best ? " class=\"best\"" : "";
    const bool heads_row = c == 0 && name;
    html +=
        fmt::format("<{}{}{}{}>{}</{}>", heads_row ? "th" : "td", heads_row ? " scope=\"row\"" : "",
                    look, data_of(cell), escaped(cell.text), heads_row ? "th" : "td");
  }
  return html + "</tr>\n";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '&': out += "&amp;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      case '\n': out += c; break;
      default: out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
  }
  return out;
}

std::string to_html(const Table& table) {
  std::string html = "<div class=\"table\"><div class=\"scroll\"><table>\n";
  if (!table.caption.empty()) html += "<caption>" + escaped(table.caption) + "</caption>\n";
  html += "<thead>\n";
  if (!table.groups.empty()) html += group_row(table.groups);
  html += header_row(table) + "</thead>\n<tbody>\n";
  for (const TableRow& row : table.rows) html += body_row(table, row);
  return html +
         "</tbody></table></div>\n<p class=\"tools\"><button type=\"button\" "
         "data-act=\"csv\">Copy as CSV</button></p></div>\n";
}

std::string badge(bool good, std::string_view words) {
  return fmt::format("<span class=\"badge {}\">{}</span>", good ? "good" : "bad", escaped(words));
}

std::string figure(const std::vector<std::string>& svg, std::string_view caption,
                   std::string_view file) {
  std::string html =
      fmt::format("<figure{}><div class=\"panels{}\">\n", svg.size() == 1 ? "" : " class=\"wide\"",
                  svg.size() == 1 ? " single" : "");
  for (std::size_t i = 0; i < svg.size(); ++i) {
    const std::string name =
        svg.size() == 1 ? std::string(file) : fmt::format("{}-{}", file, i + 1);
    html += fmt::format(
        "<div class=\"panel\" data-file=\"{}\">\n{}<p class=\"tools\"><button type=\"button\" "
        "data-act=\"svg\">Save SVG</button> <button type=\"button\" data-act=\"png\">Save "
        "PNG</button></p></div>\n",
        escaped(name), svg[i]);
  }
  return html + fmt::format("</div><figcaption>{}</figcaption></figure>\n", caption);
}

std::string side_by_side(const std::string& figures) {
  return "<div class=\"figures\">\n" + figures + "</div>\n";
}

std::string to_html(const Page& page) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>{0}</title>\n<style>\n{1}{3}</style>\n</head>\n"
      "<body>\n<header><div><h1>{0}</h1><p>{2}</p></div>"
      "<button type=\"button\" id=\"theme\">Dark</button></header>\n<nav><ul>\n",
      escaped(page.title), asset("base.css"), escaped(page.subtitle), asset("style.css"));
  for (const Section& section : page.sections) {
    html += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", section.id, escaped(section.title));
  }
  html += "</ul></nav>\n<main>\n";
  for (const Section& section : page.sections) {
    html += fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", section.id,
                        escaped(section.title), section.body);
  }
  html += fmt::format(
      "</main>\n<div id=\"tip\" role=\"tooltip\" hidden></div>\n<script>\n{}{}</script>\n",
      asset("theme.js"), asset("page.js"));
  return html + page.scripts + "</body>\n</html>\n";
}

}  // namespace vantage::report
