// One HTML file that holds everything: style, figures, numbers. It opens from a mail, prints, and needs
// neither network nor script, so that a result can be read as long as there are browsers.
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
  std::string unit = {};  ///< shown in brackets below the header; "" for none
  bool is_text = false;   ///< to the left; numbers are to the right
};

/// Rows shorter than `columns` are filled up with empty cells; the first cell of a row names it.
struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};

/// Builds the page from top to bottom. All text is escaped here; nothing that is passed in can become markup.
///
/// Out     the same bytes for the same calls: no date, no random id
class HtmlReport {
 public:
  HtmlReport(std::string_view title, std::string_view subtitle);

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// A banner that says whether all hold, then a table: claims with their bounds down, scopes across.
  void verdict(std::span<const Check> checks);
  void table(const Table& table);
  void figure(const Plot& plot);
  /// Figures next to each other where the page is wide enough, else below each other.
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
