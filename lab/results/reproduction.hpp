// A published result beside ours: figures side by side, claims that are checked, and figures to look at.
#pragma once

#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/report/check.hpp"
#include "lab/report/html_report.hpp"

namespace tandem::lab {

/// One figure; empty texts where one of the two does not say.
struct ReproductionRow {
  std::string what;
  std::string published;
  std::string ours;
};

struct Reproduction {
  std::string title;
  std::string summary;  ///< what was run, and where it differs from the source
  std::vector<ReproductionRow> rows;
  std::vector<Check> claims;
  std::vector<Plot> figures;
  boost::json::value details;  ///< the settings and every measured number
};

/// {"title", "summary", "rows", "claims", "details"}
boost::json::object to_json(const Reproduction& reproduction);
std::string to_html(const Reproduction& reproduction);
std::string to_text(const Reproduction& reproduction);

}  // namespace tandem::lab
