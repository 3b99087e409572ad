// Comparison of a published result with our own: compared figures, checked claims, and plots.
#pragma once

#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/report/check.hpp"
#include "lab/report/html_report.hpp"

namespace tandem::lab {

/// One compared figure. An empty text means that the source does not report the figure.
struct ReproductionRow {
  std::string what;
  std::string published;
  std::string ours;
};

struct Reproduction {
  std::string title;
  std::string question = {};  ///< the question that the first page of the report answers
  std::string summary;        ///< settings of the run and its differences from the published source
  std::vector<ReproductionRow> rows;
  std::vector<Check> claims;
  std::vector<Plot> figures;
  boost::json::value details;  ///< settings and all measured numbers
};

/// Returns {"title", "summary", "rows", "claims", "details"}.
boost::json::object to_json(const Reproduction& reproduction);
HtmlReport to_report(const Reproduction& reproduction);
std::string to_text(const Reproduction& reproduction);

}  // namespace tandem::lab
