// Figures as SVG: axes, legend, curves with their spread, limits. All figures use the style sheet kFigureStyle. The
// output is deterministic.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

/// Number of styles. A style is a colour, a dash and a marker. Any two styles differ in colour and marker.
inline constexpr int kStyles = 8;

enum class Draw : std::uint8_t {
  kLineAndMarkers,  ///< only some points of a long series have a marker
  kLine,
  kMarkers
};

/// One curve of a plot. NaN and infinite values are gaps in the curve.
struct Series {
  std::string label;  ///< text in the legend; an empty label omits the series from the legend
  std::vector<double> x;
  std::vector<double> y;
  int style = 0;  ///< index of a style, taken modulo kStyles; a user has the same style in all figures
  Draw draw = Draw::kLineAndMarkers;
  /// Limits of the spread at each point, drawn as a band around the curve; empty: none.
  std::vector<double> low = {};
  std::vector<double> high = {};
};

/// A named interval of x, shaded in the background. The shades of successive intervals alternate.
struct Band {
  double begin = 0;
  double end = 0;
  std::string label;
};

struct PlotAxis {
  std::string quantity;
  std::string unit = "1";  ///< "1": the quantity is a ratio or a number
  bool is_log = false;
  /// Fixed axis limits. Without a value, the axis covers the data and the limit lines.
  std::optional<double> low = {};
  std::optional<double> high = {};

  /// Returns "quantity [unit]".
  std::string label() const { return quantity + " [" + unit + "]"; }
};

/// Returns the smallest range that an axis with this unit may show; 0 for an unknown unit. The limit prevents that a
/// figure magnifies irrelevant differences, for example between forces below the just-noticeable difference.
double least_span(std::string_view unit);

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
  int height_px = 300;  ///< height with one line of legend; each further line of the legend adds to it
};

/// Returns an <svg> element for a page that contains kFigureStyle.
///
/// Cost    O(samples); the output has at most 4 points for each pixel column and series
/// Fails   std::invalid_argument: x, y and spread of a series differ in size, or its x is not finite or decreases
std::string render_svg(const Plot& plot);
/// Returns the content of a stand-alone SVG file, which includes the style sheet.
std::string svg_file(const Plot& plot);
/// Returns the points of a plot as CSV, one point per line: series, x, y and the limits of the spread. A series with
/// thousands of points is reduced to the first, lowest, highest and last of each pixel column.
std::string plot_csv(const Plot& plot);

extern const std::string_view kFigureStyle;

}  // namespace tandem::lab
