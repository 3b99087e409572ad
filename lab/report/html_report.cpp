#include "lab/report/html_report.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

// Style of the page around the figures. Figures have a white background even on a dark screen, so that they look as in
// print.
constexpr std::string_view kStyle = R"css(
:root {
  color-scheme: light dark;
  --page: #ffffff; --text: #1b1f24; --quiet: #57606a; --rule: #d5dae0; --soft: #f4f6f8;
  --good: #1a7f37; --good-soft: #e9f7ec; --bad: #c62828; --bad-soft: #fdeceb;
}
@media screen and (prefers-color-scheme: dark) {
  :root {
    --page: #14171b; --text: #e4e8ed; --quiet: #9aa5b1; --rule: #363d46; --soft: #1c2127;
    --good: #57c26f; --good-soft: #16291b; --bad: #ff7b72; --bad-soft: #341a1a;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--text); line-height: 1.5;
  font-family: system-ui, "Segoe UI", Roboto, "Noto Sans", "Helvetica Neue", Arial, sans-serif; font-size: 15px; }
main, header, footer { max-width: 1024px; margin: 0 auto; padding: 0 32px; overflow-wrap: break-word; }
header { padding-top: 40px; }
h1 { font-size: 28px; line-height: 1.2; margin: 0; letter-spacing: -0.01em; }
.subtitle { color: var(--quiet); margin: 6px 0 28px; font-size: 16px; }
h2 { font-size: 20px; margin: 44px 0 12px; padding-bottom: 6px; border-bottom: 1px solid var(--rule); }
p { margin: 0 0 14px; max-width: 76ch; }
.verdict { border-left: 6px solid var(--bad); background: var(--bad-soft); padding: 14px 20px; margin: 0 0 18px;
  border-radius: 4px; font-size: 18px; font-weight: 600; max-width: none; }
.verdict.good { border-color: var(--good); background: var(--good-soft); }
table { border-collapse: collapse; margin: 0 0 24px; font-variant-numeric: tabular-nums; font-size: 14px; }
caption { text-align: left; font-weight: 600; padding: 0 0 8px; }
th, td { padding: 5px 12px; text-align: right; vertical-align: baseline; }
th:first-child, td:first-child { padding-left: 8px; }
.left { text-align: left; }
thead th { border-bottom: 2px solid var(--rule); vertical-align: bottom; font-weight: 600; line-height: 1.25; }
thead .unit { display: block; color: var(--quiet); font-weight: 400; }
tbody th { font-weight: 400; }
tbody td, tbody th { border-bottom: 1px solid var(--rule); }
.number { white-space: nowrap; }
.checks { width: 100%; }
.mark { font-weight: 700; color: var(--good); margin-left: 2px; }
td.failed { background: var(--bad-soft); font-weight: 600; }
.failed .mark { color: var(--bad); }
figure { margin: 0 0 28px; min-width: 0; }
figcaption { color: var(--quiet); font-size: 13.5px; margin-top: 4px; max-width: 90ch; }
figcaption b { color: var(--text); }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 0 32px; }
.scroll { overflow-x: auto; }
.plot { display: block; width: 100%; height: auto; }
.pair .plot, .alone .plot { max-width: 680px; }
.question { font-size: 17px; } .answer { font-size: 17px; font-weight: 600; }
.origin { color: var(--quiet); font-size: 13px; max-width: none; border-top: 1px solid var(--rule); padding-top: 10px; }
.origin code { overflow-wrap: anywhere; }
footer { color: var(--quiet); font-size: 13px; border-top: 1px solid var(--rule); margin-top: 40px; padding-top: 14px;
  padding-bottom: 40px; }
@media print {
  body { font-size: 9.5pt; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  main, header, footer { max-width: none; padding-left: 0; padding-right: 0; }
  figure, tr, .verdict { break-inside: avoid; }
  h2, caption { break-after: avoid; }
  .pair { grid-template-columns: 1fr 1fr; }
  .scroll { overflow: visible; }
  table { font-size: 8.5pt; }
  figcaption { font-size: 8.5pt; }
  th, td { padding: 3px 7px; }
  .appendix { break-before: page; }
}
@page { size: A4; margin: 16mm; }
)css";

std::string element(std::string_view tag, std::string_view text) {
  const std::string name(tag);
  return "<" + name + ">" + escape_html(text) + "</" + name + ">\n";
}

std::string classed(std::string_view css_class, std::string_view text) {
  return "<p class=\"" + std::string(css_class) + "\">" + escape_html(text) + "</p>\n";
}

std::string header_cell(const Column& column) {
  std::string cell = column.is_text ? "<th scope=\"col\" class=\"left\">" : "<th scope=\"col\">";
  cell += escape_html(column.header);
  if (!column.unit.empty()) cell += "<span class=\"unit\">[" + escape_html(column.unit) + "]</span>";
  return cell + "</th>";
}

std::string body_cell(const Column& column, std::string_view text, bool is_first) {
  const std::string css_class = column.is_text ? "left" : "number";
  const std::string tag = is_first ? "th" : "td";
  return "<" + tag + (is_first ? " scope=\"row\"" : "") + " class=\"" + css_class + "\">" + escape_html(text) + "</" +
         tag + ">";
}

constexpr std::size_t kMaxChecks = 10;  ///< maximum number of rows of a table on the first page

std::string check_cell(const Check& check) {
  const bool holds = check.holds();
  return std::string(holds ? "<td class=\"number\">" : "<td class=\"number failed\">") +
         escape_html(check.value_text()) +
         (holds ? " <span class=\"mark\" role=\"img\" aria-label=\"holds\">\u2713</span></td>"
                : " <span class=\"mark\" role=\"img\" aria-label=\"fails\">\u2717</span></td>");
}

std::string check_table(std::span<const Check> checks) {
  std::string out = "<div class=\"scroll\"><table class=\"checks\">\n<thead><tr>";
  for (const Column& column : {Column{"Of", "", true}, {"Claim", "", true}, {"Bound", "", true}, {"Value"}})
    out += header_cell(column);
  out += "</tr></thead>\n<tbody>\n";
  const Column text{"", "", true};
  for (const Check& check : checks) {
    out += "<tr>" + body_cell(text, check.scope, true) + body_cell(text, check.claim, false) +
           body_cell(text, check.bound_text(), false) + check_cell(check) + "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string verdict_text(std::span<const Check> checks) {
  const auto failed = std::count_if(checks.begin(), checks.end(), [](const Check& check) { return !check.holds(); });
  if (failed == 0) return "Passed: all " + std::to_string(checks.size()) + " checks hold.";
  return "Failed: " + std::to_string(failed) + " of " + std::to_string(checks.size()) +
         (failed == 1 ? " checks does not hold." : " checks do not hold.");
}

/// Placeholder in links for the folder of the figures. The folder depends on the name of the page, which is not known
/// when the links are written. The placeholder cannot occur in the text of the page, because escape_html() replaces
/// control characters.
constexpr char kFolderMark = '\x01';

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// Returns the folder of the figures of a page: "figures/" for report.html, otherwise a folder with the page's name.
/// Two pages in one folder therefore do not overwrite each other's data.
std::string figure_folder(const std::string& page) {
  std::string stem = std::filesystem::path(page).stem().string();
  if (stem == "report") return "figures/";
  std::ranges::replace_if(
      stem, [](char c) { return !is_letter_or_digit(c); }, '-');
  return stem + "-figures/";
}

/// Returns the file name of the last figure without extension: the figure's number and the quantity of its y axis.
std::string figure_name(std::span<const Plot> figures) {
  std::string name = std::to_string(figures.size()) + "-";
  for (const char c : figures.back().y.quantity) {
    if (is_letter_or_digit(c) || name.back() != '-') name += is_letter_or_digit(c) ? c : '-';
  }
  return name.back() == '-' ? name.substr(0, name.size() - 1) : name;
}

std::string file_links(const std::string& figure) {
  const std::string path = kFolderMark + figure;
  return " <a href=\"" + path + ".csv\">Data</a>, <a href=\"" + path + ".svg\">SVG</a>";
}

std::string with_folder(const std::string& text, const std::string& folder) {
  std::string out;
  for (const char c : text) c == kFolderMark ? out += folder : out += c;
  return out;
}

}  // namespace

HtmlReport::HtmlReport(std::string_view title, std::string_view subtitle)
    : title_(escape_html(title)),
      header_("<header>\n<h1>" + title_ + "</h1>\n<p class=\"subtitle\">" + escape_html(subtitle) +
              "</p>\n</header>\n") {}

void HtmlReport::question(std::string_view text) {
  body() += classed("question", text);
}

void HtmlReport::answer(std::string_view text) {
  body() += classed("answer", text);
}

void HtmlReport::appendix() {
  is_appendix_ = true;
}

void HtmlReport::heading(std::string_view text) {
  body() += element("h2", text);
}

void HtmlReport::paragraph(std::string_view text) {
  body() += element("p", text);
}

void HtmlReport::verdict(std::span<const Check> checks) {
  body() += std::string("<p class=\"verdict") + (all_hold(checks) ? " good" : "") + "\" role=\"status\">" +
            verdict_text(checks) + "</p>\n";
  if (checks.size() <= kMaxChecks) {
    body() += check_table(checks);
    return;
  }
  appendix_ += element("h2", "Checks") + check_table(checks);
  std::vector<Check> failed;
  std::ranges::copy_if(checks, std::back_inserter(failed), [](const Check& check) { return !check.holds(); });
  if (!failed.empty()) body() += check_table(failed);
}

void HtmlReport::table(const Table& table) {
  std::string& out = body();
  out += "<div class=\"scroll\"><table>\n" + element("caption", table.caption) + "<thead><tr>";
  for (const Column& column : table.columns) out += header_cell(column);
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      out += body_cell(table.columns[i], i < row.size() ? row[i] : "", i == 0);
    }
    out += "</tr>\n";
  }
  out += "</tbody></table></div>\n";
}

void HtmlReport::figure(const Plot& plot) {
  figures_.push_back(plot);
  const std::string name = figure_name(figures_);
  body() += std::string("<figure") + (plot.width_px <= kHalfWidth_px ? " class=\"alone\"" : "") + ">\n" +
            render_svg(plot) + "<figcaption><b>Figure " + std::to_string(figures_.size()) + ".</b> " +
            escape_html(plot.caption) + file_links(name) + "</figcaption>\n</figure>\n";
}

void HtmlReport::side_by_side(std::span<const Plot> plots) {
  body() += "<div class=\"pair\">\n";
  for (const Plot& each : plots) figure(each);
  body() += "</div>\n";
}

void HtmlReport::footer(std::string_view text) {
  footer_ += element("p", text);
}

void HtmlReport::origin(const Origin& origin) {
  origin_ = "<p class=\"origin\"><code>" + escape_html(origin.command) + "</code><br>" + escape_html(origin.version) +
            ", " + escape_html(origin.date);
  for (const auto& [name, hash] : origin.sha256) {
    origin_ += "<br>SHA-256 of " + escape_html(name) + ": <code>" + escape_html(hash) + "</code>";
  }
  origin_ += "</p>\n";
}

std::string HtmlReport::html(const std::string& name) const {
  std::string page = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" + title_ + "</title>\n";
  page += "<style>" + std::string(kStyle) + std::string(kFigureStyle) + "</style>\n</head>\n<body>\n" + header_ +
          "<main>\n" + first_page_ + origin_;
  if (!appendix_.empty()) page += "<section class=\"appendix\">\n" + appendix_ + "</section>\n";
  page += "</main>\n";
  if (!footer_.empty()) page += "<footer>\n" + footer_ + "</footer>\n";
  return with_folder(page + "</body>\n</html>\n", figure_folder(name));
}

std::map<std::string, std::string> HtmlReport::files(const std::string& name) const {
  std::map<std::string, std::string> files{{name, html(name)}};
  for (std::size_t i = 0; i < figures_.size(); ++i) {
    const std::string stem = figure_folder(name) + figure_name(std::span(figures_).first(i + 1));
    files[stem + ".svg"] = svg_file(figures_[i]);
    files[stem + ".csv"] = plot_csv(figures_[i]);
  }
  return files;
}

}  // namespace tandem::lab
