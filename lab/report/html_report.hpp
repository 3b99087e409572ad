// A self-contained HTML file with style sheet, figures and numbers. It can be mailed and printed, and needs neither
// network access nor scripts.
#pragma once

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

/// Builds the page from top to bottom. It escapes all text, so that input cannot become markup.
///
/// Out     deterministic: contains no date and no random id
class HtmlReport {
 public:
  HtmlReport(std::string_view title, std::string_view subtitle);

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// Adds a banner that states whether all checks hold. Below it follows a table of values and bounds, with claims as
  /// rows and scopes as columns.
  void verdict(std::span<const Check> checks);
  void table(const Table& table);
  void figure(const Plot& plot);
  /// Adds figures side by side if the page is wide enough; otherwise they are placed below each other.
  void side_by_side(std::span<const Plot> plots);
  void footer(std::string_view text);

  std::string html() const;

 private:
  std::string title_;
  std::string body_;
  std::string footer_;
  int figure_count_ = 0;
};

}  // namespace tandem::lab
