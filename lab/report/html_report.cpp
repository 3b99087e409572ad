#include "lab/report/html_report.hpp"

#include <algorithm>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

// The line colours are those of Okabe and Ito, "Color Universal Design", 2008, which colour-blind readers can
// distinguish. They are lightened on a dark background. Print always uses the colours for a light background.
constexpr std::string_view kStyle = R"css(
:root {
  color-scheme: light dark;
  --page: #ffffff; --text: #1b1f24; --quiet: #57606a; --rule: #d5dae0; --soft: #f4f6f8;
  --grid: #d5dbe2; --band: #f6f8fa; --band-odd: #ebeff4;
  --good: #1a7f37; --good-soft: #e9f7ec; --bad: #c62828; --bad-soft: #fdeceb;
  --c0: #0072b2; --c1: #d55e00; --c2: #009e73; --c3: #a8568a; --c4: #7a5c00; --c5: #4c4c9d;
}
@media screen and (prefers-color-scheme: dark) {
  :root {
    --page: #14171b; --text: #e4e8ed; --quiet: #9aa5b1; --rule: #363d46; --soft: #1c2127;
    --grid: #39424d; --band: #191d23; --band-odd: #21272f;
    --good: #57c26f; --good-soft: #16291b; --bad: #ff7b72; --bad-soft: #341a1a;
    --c0: #4db2ee; --c1: #ff9a4d; --c2: #3ecfa3; --c3: #e3a0c8; --c4: #e3c04f; --c5: #a9a9f5;
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
.checks th:first-child { min-width: 210px; }
.mark { font-weight: 700; color: var(--good); margin-left: 2px; }
td.failed { background: var(--bad-soft); font-weight: 600; }
.failed .mark { color: var(--bad); }
figure { margin: 0 0 28px; min-width: 0; }
figcaption { color: var(--quiet); font-size: 13.5px; margin-top: 4px; max-width: 90ch; }
figcaption b { color: var(--text); }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 0 32px; }
.scroll { overflow-x: auto; }
.plot { display: block; width: 100%; height: auto; }
.plot text { fill: var(--text); font-size: 12px; font-variant-numeric: tabular-nums; }
.plot .x-tick, .plot .axis-label, .plot .band-label { text-anchor: middle; }
.plot .y-tick, .plot .limit-label { text-anchor: end; }
.plot .x-tick, .plot .y-tick, .plot .band-label { fill: var(--quiet); }
.plot .axis-label { font-size: 13px; }
.plot .grid { stroke: var(--grid); }
.plot .grid.zero, .plot .axis { stroke: var(--quiet); }
.plot .band { fill: var(--band); }
.plot .band.odd { fill: var(--band-odd); }
.plot .line { fill: none; stroke-width: 1.6; stroke-linejoin: round; stroke-linecap: round; }
.plot .key { stroke-width: 2.5; }
.plot .dashed { stroke-dasharray: 7 4; stroke-linecap: butt; }
.plot .dotted { stroke-dasharray: 2 3; stroke-linecap: butt; }
.plot .limit { stroke: var(--bad); stroke-dasharray: 9 4; stroke-width: 1.2; }
.plot .limit-label { fill: var(--bad); paint-order: stroke; stroke: var(--page); stroke-width: 4px;
  stroke-linejoin: round; }
.c0 { stroke: var(--c0); } .c1 { stroke: var(--c1); } .c2 { stroke: var(--c2); }
.c3 { stroke: var(--c3); } .c4 { stroke: var(--c4); } .c5 { stroke: var(--c5); }
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
  .checks th:first-child { min-width: 0; }
}
@page { size: A4; margin: 16mm; }
)css";

std::string element(std::string_view tag, std::string_view text) {
  const std::string name(tag);
  return "<" + name + ">" + escape_html(text) + "</" + name + ">\n";
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

template <class T>
void add_if_new(std::vector<T>& list, const T& value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

/// A row for checks that have the same claim and bound but different scopes.
struct ClaimRow {
  std::string claim;
  std::string bound;
  bool operator==(const ClaimRow&) const = default;
};

std::string check_cell(const Check* check) {
  if (check == nullptr) return "<td></td>";
  const bool holds = check->holds();
  return std::string(holds ? "<td class=\"number\">" : "<td class=\"number failed\">") +
         escape_html(check->value_text()) +
         (holds ? " <span class=\"mark\" role=\"img\" aria-label=\"holds\">\u2713</span></td>"
                : " <span class=\"mark\" role=\"img\" aria-label=\"fails\">\u2717</span></td>");
}

/// Returns a table with claims as rows and scopes as columns.
std::string check_table(std::span<const Check> checks) {
  std::vector<std::string> scopes;
  std::vector<ClaimRow> rows;
  for (const Check& check : checks) {
    add_if_new(scopes, check.scope);
    add_if_new(rows, {check.claim, check.bound_text()});
  }
  std::string out =
      "<div class=\"scroll\"><table class=\"checks\">\n<thead><tr><th scope=\"col\" class=\"left\">Claim</th>"
      "<th scope=\"col\" class=\"left\">Bound</th>";
  for (const std::string& scope : scopes) out += "<th scope=\"col\">" + escape_html(scope) + "</th>";
  out += "</tr></thead>\n<tbody>\n";
  for (const ClaimRow& row : rows) {
    out += "<tr><th scope=\"row\" class=\"left\">" + escape_html(row.claim) + "</th><td class=\"left number\">" +
           escape_html(row.bound) + "</td>";
    for (const std::string& scope : scopes) {
      const auto found = std::find_if(checks.begin(), checks.end(), [&](const Check& check) {
        return check.scope == scope && ClaimRow{check.claim, check.bound_text()} == row;
      });
      out += check_cell(found == checks.end() ? nullptr : &*found);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string verdict_text(std::span<const Check> checks) {
  const auto failed = std::count_if(checks.begin(), checks.end(), [](const Check& check) { return !check.holds(); });
  if (failed == 0) return "Passed: all " + std::to_string(checks.size()) + " checks hold.";
  return "Failed: " + std::to_string(failed) + " of " + std::to_string(checks.size()) +
         (failed == 1 ? " checks does not hold." : " checks do not hold.");
}

}  // namespace

HtmlReport::HtmlReport(std::string_view title, std::string_view subtitle) : title_(escape_html(title)) {
  body_ =
      "<header>\n<h1>" + title_ + "</h1>\n<p class=\"subtitle\">" + escape_html(subtitle) + "</p>\n</header>\n<main>\n";
}

void HtmlReport::heading(std::string_view text) {
  body_ += element("h2", text);
}

void HtmlReport::paragraph(std::string_view text) {
  body_ += element("p", text);
}

void HtmlReport::verdict(std::span<const Check> checks) {
  body_ += std::string("<p class=\"verdict") + (all_hold(checks) ? " good" : "") + "\" role=\"status\">" +
           verdict_text(checks) + "</p>\n";
  body_ += check_table(checks);
}

void HtmlReport::table(const Table& table) {
  body_ += "<div class=\"scroll\"><table>\n" + element("caption", table.caption) + "<thead><tr>";
  for (const Column& column : table.columns) body_ += header_cell(column);
  body_ += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    body_ += "<tr>";
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      body_ += body_cell(table.columns[i], i < row.size() ? row[i] : "", i == 0);
    }
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void HtmlReport::figure(const Plot& plot) {
  body_ += "<figure>\n" + render_svg(plot) + "<figcaption><b>Figure " + std::to_string(++figure_count_) + ".</b> " +
           escape_html(plot.caption) + "</figcaption>\n</figure>\n";
}

void HtmlReport::side_by_side(std::span<const Plot> plots) {
  body_ += "<div class=\"pair\">\n";
  for (const Plot& each : plots) figure(each);
  body_ += "</div>\n";
}

void HtmlReport::footer(std::string_view text) {
  footer_ += element("p", text);
}

std::string HtmlReport::html() const {
  std::string page = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" + title_ + "</title>\n";
  page += "<style>" + std::string(kStyle) + "</style>\n</head>\n<body>\n" + body_ + "</main>\n";
  if (!footer_.empty()) page += "<footer>\n" + footer_ + "</footer>\n";
  return page + "</body>\n</html>\n";
}

}  // namespace tandem::lab
