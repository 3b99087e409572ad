// A self-contained HTML file with style sheet, figures and numbers. It can be mailed and printed, and needs neither
// network access nor scripts. Its first page answers a question in words and at most three figures.
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
  std::string date;                                ///< UTC
  std::map<std::string, std::string> sha256 = {};  ///< of each file with results, by its name
};

/// Builds the page from top to bottom. It escapes all text, so that input cannot become markup.
///
/// Out     deterministic: contains no date and no random id, except those of origin()
class HtmlReport {
 public:
  HtmlReport(std::string_view title, std::string_view subtitle);

  void question(std::string_view text);
  void answer(std::string_view text);
  /// Ends the first page. Later elements are placed in the appendix.
  void appendix();

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// Adds a banner that states whether all checks hold. Below it follows a table of values and bounds. A table that
  /// would fill the first page begins the appendix, and only the checks that fail are on the first page.
  void verdict(std::span<const Check> checks);
  void table(const Table& table);
  void figure(const Plot& plot);
  /// Adds figures two by two if the page is wide enough; otherwise they are placed below each other.
  void side_by_side(std::span<const Plot> plots);
  void footer(std::string_view text);
  /// Adds the origin to the end of the first page.
  void origin(const Origin& origin);

  /// In      name  file name of the page; the links to its figures depend on it
  std::string html(const std::string& name = "report.html") const;
  /// Returns the page, and each figure as SVG and CSV, by file name. They are in the folder figures/ for report.html,
  /// and in NAME-figures/ for a page NAME.html.
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
