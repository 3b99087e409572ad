// Figures as SVG: axes, legend, curves with their spread, limits. The style sheet of all figures is kFigureStyle.
// Everything is deterministic.
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
  kLineAndMarkers,  ///< of a long series, only some points have a marker
  kLine,
  kMarkers
};

/// One curve of a plot. NaN and infinite values cause gaps.
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
  /// Fixed axis limits. If they are not set, the axis covers the data and the limit lines.
  std::optional<double> low = {};
  std::optional<double> high = {};

  /// Returns "quantity [unit]".
  std::string label() const { return quantity + " [" + unit + "]"; }
};

/// Returns the least range of an axis in this unit, 0 for an unknown unit. A smaller range would magnify differences
/// that are of no interest, for example below the just-noticeable difference of a force.
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
  int height_px = 300;  ///< without the second and further lines of the legend
};

/// Returns an <svg> element for a page that contains kFigureStyle.
///
/// Cost    O(samples); the output has at most 4 points for each pixel column and series
/// Fails   std::invalid_argument: a series whose x, y and spread differ in size, or whose x is not finite or decreases
std::string render_svg(const Plot& plot);
/// Returns the content of an SVG file, which contains its style.
std::string svg_file(const Plot& plot);
/// Returns the points of a plot, one a line: series, x, y and the limits of the spread. Of a series with thousands of
/// points, these are the first, lowest, highest and last of each pixel column.
std::string plot_csv(const Plot& plot);

extern const std::string_view kFigureStyle;

}  // namespace tandem::lab
