#include "lab/results/reproduction.hpp"

#include <algorithm>
#include <span>
#include <sstream>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr std::size_t kTextWidth = 120;
constexpr std::size_t kFirstPageFigures = 3;

/// Wraps text at spaces into lines of at most kTextWidth.
std::string wrapped(const std::string& text) {
  std::istringstream words(text);
  std::string result, line;
  for (std::string word; words >> word;) {
    if (!line.empty() && text_width(line + ' ' + word) > kTextWidth) {
      result += line + '\n';
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return result + line + '\n';
}

Table rows_table(const std::vector<ReproductionRow>& rows) {
  Table table{"Published figures and those of this run",
              {{.header = "Figure", .is_text = true},
               {.header = "Published", .is_text = true},
               {.header = "Here", .is_text = true}},
              {}};
  for (const ReproductionRow& row : rows) table.rows.push_back({row.what, row.published, row.ours});
  return table;
}

}  // namespace

boost::json::object to_json(const Reproduction& reproduction) {
  boost::json::array rows;
  for (const ReproductionRow& row : reproduction.rows) {
    rows.push_back(boost::json::object{{"what", row.what}, {"published", row.published}, {"ours", row.ours}});
  }
  return {{"title", reproduction.title},
          {"summary", reproduction.summary},
          {"rows", rows},
          {"claims", to_json(reproduction.claims)},
          {"details", reproduction.details}};
}

HtmlReport to_report(const Reproduction& reproduction) {
  HtmlReport page(reproduction.title, "A published benchmark, repeated");
  page.question("Does the published result hold here? " + reproduction.question);
  page.verdict(reproduction.claims);
  const std::size_t first = std::min<std::size_t>(kFirstPageFigures, reproduction.figures.size());
  const std::span figures(reproduction.figures);
  for (const Plot& figure : figures.first(first)) page.figure(figure);
  page.appendix();
  page.heading("Method");
  page.paragraph(reproduction.summary);
  page.table(rows_table(reproduction.rows));
  for (const Plot& figure : figures.subspan(first)) page.figure(figure);
  page.footer("Times depend on the machine; everything else is the same on every run.");
  return page;
}

std::string to_text(const Reproduction& reproduction) {
  std::size_t what_width = 0, published_width = std::string("published").size();
  for (const ReproductionRow& row : reproduction.rows) {
    what_width = std::max(what_width, text_width(row.what));
    published_width = std::max(published_width, text_width(row.published));
  }
  const auto padded = [](const std::string& text, std::size_t width) {
    return text + std::string(width - text_width(text) + 2, ' ');
  };
  std::ostringstream text;
  text << reproduction.title << "\n\n" << wrapped(reproduction.summary) << '\n';
  text << padded("", what_width) << padded("published", published_width) << "here\n";
  for (const ReproductionRow& row : reproduction.rows) {
    text << padded(row.what, what_width) << padded(row.published, published_width) << row.ours << '\n';
  }
  text << '\n';
  print_checks(text, reproduction.claims);
  return text.str();
}

}  // namespace tandem::lab
