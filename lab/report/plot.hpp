// Line plots as inline SVG. Colours are defined by the style sheet of the page (html_report.cpp), so one figure serves
// light and dark screens and paper. Everything else is fixed here and deterministic.
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
  std::string label;  ///< in the legend; "" omits the series there
  std::vector<double> x;
  std::vector<double> y;
  int color = 0;  ///< 0..5, modulo the number of colours; a user keeps its colour in all figures
  Dash dash = Dash::kSolid;
};

/// A named interval of x; intervals are shaded alternately.
struct Band {
  double begin = 0;
  double end = 0;
  std::string label;
};

struct PlotAxis {
  std::string label;  ///< with unit: "force [N]"
  bool is_log = false;
  /// Fixed axis limits. Without them the axis fits data and limit lines.
  std::optional<double> low = {};
  std::optional<double> high = {};
};

/// Width of a plot with another one beside it on the page.
inline constexpr int kHalfWidth_px = 464;

struct Plot {
  std::string description;  ///< one sentence, for readers who cannot see it
  std::string caption;      ///< below the figure in a report
  PlotAxis x;
  PlotAxis y;
  std::vector<Series> series;
  std::vector<AxisMark> limits;  ///< horizontal lines for the bounds of values
  std::vector<Band> bands;
  int width_px = 960;
  int height_px = 300;
};

/// An <svg> element without a document around it.
///
/// Cost    O(samples); output at most 4 points for each pixel column and series
/// Fails   std::invalid_argument: a series whose x and y differ in size, or whose x is not finite or decreases
std::string render_svg(const Plot& plot);

}  // namespace tandem::lab
