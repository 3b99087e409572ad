// A self-contained HTML file with style sheet, figures and numbers. It can be mailed and printed, and needs neither
// network access nor scripts. The first page answers a question in words and at most three figures.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/report/plot.hpp"

namespace tandem::lab {

struct Column {
  std::string header;
  std::string unit = {};  ///< shown in brackets below the header; "" if the column has no unit
  bool is_text = false;   ///< true: the column is aligned left; numbers are aligned right
};

/// A table. Rows shorter than `columns` are padded with empty cells. The first cell of each row is its row header.
struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};

/// Command, version and input hashes with which a reader can repeat a result.
struct Origin {
  std::string command;
  std::string version;
  std::string date;                                ///< date of the run, UTC
  std::map<std::string, std::string> sha256 = {};  ///< maps the name of each result file to its SHA-256 hash
};

/// Builds the page from top to bottom. All text is escaped, so that input cannot become markup.
///
/// Out     deterministic: contains no date and no random id, except those of origin()
class HtmlReport {
 public:
  HtmlReport(std::string_view title, std::string_view subtitle);

  void question(std::string_view text);
  void answer(std::string_view text);
  /// Ends the first page. Elements that are added later belong to the appendix.
  void appendix();

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// Adds a banner that states whether all checks hold, followed by a table of the checks with values and bounds. If
  /// this table is too long for the first page, it is moved to the start of the appendix, and the first page lists only
  /// the failed checks.
  void verdict(std::span<const Check> checks);
  void table(const Table& table);
  void figure(const Plot& plot);
  /// Adds figures in rows of two. On a narrow page the figures are placed below each other.
  void side_by_side(std::span<const Plot> plots);
  void footer(std::string_view text);
  /// Adds the origin to the end of the first page.
  void origin(const Origin& origin);

  /// Returns the HTML text of the page.
  /// In      name  file name of the page; it determines the folder of the figures to which the page links
  std::string html(const std::string& name = "report.html") const;
  /// Returns the page, and each figure as SVG and CSV, by file name. The figures are in the folder figures/ for
  /// report.html, and in NAME-figures/ for a page NAME.html.
  std::map<std::string, std::string> files(const std::string& name = "report.html") const;

 private:
  std::string& body() { return is_appendix_ ? appendix_ : first_page_; }

  std::string title_;
  std::string header_;
  std::string first_page_;
  std::string appendix_;
  std::string origin_;
  std::string footer_;
  std::vector<Plot> figures_;
  bool is_appendix_ = false;
};

}  // namespace tandem::lab
