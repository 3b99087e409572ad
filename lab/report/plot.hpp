// Line plots as inline SVG. The style sheet of the page (html_report.cpp) defines the colours, so that one figure suits
// light screens, dark screens and paper. Everything else is defined here and deterministic.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

enum class Dash : std::uint8_t { kSolid, kDashed, kDotted };

/// One line of a plot. NaN and infinite values cause gaps.
struct Series {
  std::string label;  ///< text in the legend; an empty label omits the series from the legend
  std::vector<double> x;
  std::vector<double> y;
  int color = 0;  ///< colour index 0..5, taken modulo the number of colours; a user has the same colour in all figures
  Dash dash = Dash::kSolid;
};

/// A named interval of x, shaded in the background. The shades of successive intervals alternate.
struct Band {
  double begin = 0;
  double end = 0;
  std::string label;
};

struct PlotAxis {
  std::string label;  ///< axis label with unit, e.g. "force [N]"
  bool is_log = false;
  /// Fixed axis limits. If they are not set, the axis covers the data and the limit lines.
  std::optional<double> low = {};
  std::optional<double> high = {};
};

/// Width of a plot that shares a row of the page with another plot.
inline constexpr int kHalfWidth_px = 464;

struct Plot {
  std::string description;  ///< one sentence for readers who cannot see the figure
  std::string caption;      ///< text below the figure in a report
  PlotAxis x;
  PlotAxis y;
  std::vector<Series> series;
  std::vector<AxisMark> limits;  ///< horizontal lines that mark bounds
  std::vector<Band> bands;
  int width_px = 960;
  int height_px = 300;
};

/// Returns an <svg> element that can be embedded in a page.
///
/// Cost    O(samples); the output has at most 4 points for each pixel column and series
/// Fails   std::invalid_argument: a series whose x and y differ in size, or whose x is not finite or decreases
std::string render_svg(const Plot& plot);

}  // namespace tandem::lab
