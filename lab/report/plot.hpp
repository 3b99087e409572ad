// Line plots as inline SVG. Colours come from the page's style sheet (html_report.cpp), so that one figure
// serves light and dark screens and paper; everything else is fixed here, to the byte.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

enum class Dash : std::uint8_t { kSolid, kDashed, kDotted };

/// One line. NaN and infinite values are gaps.
struct Series {
  std::string label;  ///< in the legend; "" leaves it out there
  std::vector<double> x;
  std::vector<double> y;
  int color = 0;  ///< 0..5: a user keeps its colour through all figures; more wrap round
  Dash dash = Dash::kSolid;
};

/// A stretch of x with a name, shaded in turn.
struct Band {
  double begin = 0;
  double end = 0;
  std::string label;
};

struct PlotAxis {
  std::string label;  ///< with unit: "force [N]"
  bool is_log = false;
  /// Ends that the data does not decide; without them the axis fits data and limit lines.
  std::optional<double> low = {};
  std::optional<double> high = {};
};

/// Of a plot with another one beside it on the page.
inline constexpr int kHalfWidth_px = 464;

struct Plot {
  std::string description;  ///< one sentence for those who cannot see it
  std::string caption;      ///< below it in a report
  PlotAxis x;
  PlotAxis y;
  std::vector<Series> series;
  std::vector<AxisMark> limits;  ///< horizontal lines that values are held against
  std::vector<Band> bands;
  int width_px = 960;
  int height_px = 300;
};

/// An <svg> element without a document around it.
///
/// Cost    O(samples); output at most 4 points a pixel column and series
/// Fails   std::invalid_argument: a series whose x and y differ in size, or whose x is not finite or decreases
std::string render_svg(const Plot& plot);

}  // namespace tandem::lab
