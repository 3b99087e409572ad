#include "lab/report/plot.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "lab/report/decimate.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

// Assumed width of a character in a 12 px sans-serif font: 0.6 em. Digits of common fonts have a width of 0.56 to 0.64
// em. The true width depends on the font of the reader's browser and cannot be measured here.
constexpr double kCharacterPx = 7.2;
constexpr double kTextPx = 12, kAxisLabelPx = 13;  ///< font sizes, as in kFigureStyle
constexpr double kLinePx = 18;
constexpr double kBandStripPx = 18;
constexpr double kRightPx = 22;
constexpr double kBottomPx = 46;
constexpr double kTickPx = 5;
constexpr double kAxisTitlePx = 30;
/// Minimum width of the tick labels: four characters. Figures placed one below the other then have aligned y axes.
constexpr double kMinLabelPx = 4 * kCharacterPx;
constexpr double kPixelsPerXTick = 56;
constexpr double kPixelsPerYTick = 34;
constexpr double kPixelsPerMarker = 110;
/// an axis that extends below 0 by less than this fraction of its length gets no tick below 0
constexpr double kSlightlyBelow = 0.05;
constexpr double kLimitRoom = 0.1;  ///< fraction of the axis that is kept free above a limit line for its label
/// Maximum number of points of a series that has a marker at each point.
constexpr std::size_t kFewPoints = 40;
/// Maximum number of points of a series that the data file of a figure contains in full. A longer series is reduced to
/// its visible samples.
constexpr std::size_t kManyPoints = 2000;

double text_px(std::string_view text) {
  return kCharacterPx * static_cast<double>(text_width(text));
}

std::string attribute(std::string_view name, double value) {
  return " " + std::string(name) + "=\"" + format_coordinate(value) + "\"";
}

std::string line_element(std::string_view css_class, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return "<line class=\"" + std::string(css_class) + "\"" + attribute("x1", a.x()) + attribute("y1", a.y()) +
         attribute("x2", b.x()) + attribute("y2", b.y()) + "/>\n";
}

std::string text_element(std::string_view css_class, const Eigen::Vector2d& at, std::string_view text) {
  return "<text class=\"" + std::string(css_class) + "\"" + attribute("x", at.x()) + attribute("y", at.y()) + ">" +
         escape_html(text) + "</text>\n";
}

int style_of(const Series& series) {
  return (series.style % kStyles + kStyles) % kStyles;
}

std::string series_class(const Series& series) {
  return "line s" + std::to_string(style_of(series));
}

/// SVG path of each style's marker, relative to its centre.
constexpr std::array<std::string_view, kStyles> kMarkers = {"m-4,0a4,4 0 1,0 8,0a4,4 0 1,0 -8,0z",
                                                            "m-3.5,-3.5h7v7h-7z",
                                                            "m0,-4.5l4.5,8h-9z",
                                                            "m0,-5l5,5l-5,5l-5,-5z",
                                                            "m0,4.5l4.5,-8h-9z",
                                                            "m-4,-4l8,8m0,-8l-8,8",
                                                            "m-5,0h10m-5,-5v10",
                                                            "m-2,-5h4v10h-4z"};

std::string marker_element(const Series& series, const Eigen::Vector2d& at) {
  const int style = style_of(series);
  return "<path class=\"marker s" + std::to_string(style) + "\" d=\"M" + format_coordinate(at.x()) + "," +
         format_coordinate(at.y()) + std::string(kMarkers[static_cast<std::size_t>(style)]) + "\"/>\n";
}

/// Widens a logarithmic range to whole powers of ten if it spans more than one, so that its ends have ticks.
Range whole_decades(Range range) {
  if (range.high / range.low <= 10) return range;
  return {std::pow(10.0, std::floor(std::log10(range.low))), std::pow(10.0, std::ceil(std::log10(range.high)))};
}

/// Widens a range to at least `span`. A range that begins at 0 keeps that limit.
Range widened(Range range, double span) {
  const double missing = span - (range.high - range.low);
  if (!(missing > 0)) return range;
  if (range.low >= 0 && range.low < missing / 2) return {0, span};
  return {range.low - missing / 2, range.high + missing / 2};
}

/// The smallest interval that contains all added values.
class Extent {
 public:
  void add(double value) {
    if (!std::isfinite(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  /// Returns the interval; it is infinite if no value was added.
  Range range() const { return {low_, high_}; }

 private:
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

/// Maps values on one axis to pixels.
struct Mapping {
  Range range;
  bool is_log = false;
  double px_low = 0;
  double px_high = 1;

  double fraction(double value) const {
    if (is_log) return (std::log(value) - std::log(range.low)) / (std::log(range.high) - std::log(range.low));
    return (value - range.low) / (range.high - range.low);
  }
  double px(double value) const { return px_low + (px_high - px_low) * fraction(value); }
  bool contains(double value) const { return value >= range.low && value <= range.high; }
};

Range sane(Range range, bool is_log) {
  return is_log ? sane_log(range) : sane_linear(range);
}

Range with_fixed_ends(Range range, const PlotAxis& axis) {
  return {axis.low.value_or(range.low), axis.high.value_or(range.high)};
}

bool can_show(double value, bool is_log) {
  return std::isfinite(value) && (!is_log || value > 0);
}

class Renderer {
 public:
  explicit Renderer(const Plot& plot) : plot_(plot) { lay_out(); }

  std::string svg() {
    open();
    draw_bands();
    draw_x_axis();
    draw_y_axis();
    for (const Series& series : plot_.series) draw_spread(series);
    for (const Series& series : plot_.series) draw_series(series);
    draw_limits();
    draw_legend();
    out_ += "</svg>\n";
    return std::move(out_);
  }

 private:
  struct LegendEntry {
    const Series* series;
    std::string label;
    Eigen::Vector2d at;
  };

  void lay_out();
  void place_legend();
  Range x_range() const;
  Range y_extent() const;
  void scale_y(double bottom_px, double top_px);
  void scale_x(double left_px, double right_px);

  void open();
  void draw_bands();
  void draw_x_axis();
  void draw_y_axis();
  void draw_spread(const Series& series);
  void draw_series(const Series& series);
  void draw_polyline(const Series& series, const Polyline& line);
  void draw_markers(const Series& series);
  Eigen::Vector2d pixel(double x, double y) const;
  std::string coordinates(double x, double y) const;
  void draw_limits();
  void draw_legend();

  const Plot& plot_;
  Mapping x_;
  Mapping y_;
  std::vector<AxisMark> x_ticks_;
  std::vector<AxisMark> y_ticks_;
  std::vector<LegendEntry> legend_;
  double top_px_ = 0;
  double height_px_ = 0;
  std::string out_;
};

Range Renderer::x_range() const {
  Extent extent;
  for (const Series& series : plot_.series) {
    for (const double value : series.x) {
      if (can_show(value, plot_.x.is_log)) extent.add(value);
    }
  }
  return sane(with_fixed_ends(extent.range(), plot_.x), plot_.x.is_log);
}

Range Renderer::y_extent() const {
  Extent extent;
  for (const Series& series : plot_.series) {
    for (const auto* values : {&series.y, &series.low, &series.high}) {
      for (const double value : *values) {
        if (can_show(value, plot_.y.is_log)) extent.add(value);
      }
    }
  }
  for (const AxisMark& limit : plot_.limits) {
    if (can_show(limit.value, plot_.y.is_log)) extent.add(limit.value);
  }
  if (plot_.y.is_log) return with_fixed_ends(whole_decades(sane_log(extent.range())), plot_.y);
  const Range range = widened(sane_linear(with_fixed_ends(extent.range(), plot_.y)), least_span(plot_.y.unit));
  for (const AxisMark& limit : plot_.limits) {
    // Leaves space for the label above the limit line.
    if (can_show(limit.value, false)) extent.add(limit.value + kLimitRoom * (range.high - range.low));
  }
  return sane_linear({range.low, std::max(range.high, plot_.y.high ? range.high : extent.range().high)});
}

void Renderer::scale_y(double bottom_px, double top_px) {
  const auto count = static_cast<std::size_t>(std::max(3.0, (bottom_px - top_px) / kPixelsPerYTick));
  y_ = {y_extent(), plot_.y.is_log, bottom_px, top_px};
  if (plot_.y.is_log) {
    y_ticks_ = log_ticks(y_.range, count);
    return;
  }
  // The y axis ends at its outermost ticks, except where the plot has a fixed axis limit.
  y_ticks_ = ticks_around(y_.range, count);
  const double low = y_.range.low;
  y_.range = with_fixed_ends({y_ticks_.front().value, y_ticks_.back().value}, plot_.y);
  // An axis that begins just below 0 gets no tick there.
  if (!plot_.y.low && low < 0 && -low < kSlightlyBelow * y_.range.high) y_.range.low = low;
  std::erase_if(y_ticks_, [this](const AxisMark& tick) { return !y_.contains(tick.value); });
}

void Renderer::scale_x(double left_px, double right_px) {
  const auto count = static_cast<std::size_t>(std::max(3.0, (right_px - left_px) / kPixelsPerXTick));
  x_ = {x_range(), plot_.x.is_log, left_px, right_px};
  x_ticks_ = plot_.x.is_log ? log_ticks(x_.range, count) : ticks_inside(x_.range, count);
}

void Renderer::lay_out() {
  place_legend();
  const double legend_bottom = legend_.empty() ? 4 : legend_.back().at.y() + 10;
  height_px_ = plot_.height_px + (legend_.empty() ? 0 : legend_.back().at.y() - legend_.front().at.y());
  top_px_ = legend_bottom + (plot_.bands.empty() ? 4 : kBandStripPx);
  // The rotated label of the y axis may extend into the margins above and below the plot.
  const double label_of_y_px = text_px(plot_.y.label()) * kAxisLabelPx / kTextPx;
  height_px_ = std::max(height_px_, top_px_ + kBottomPx + label_of_y_px - 2 * std::min(top_px_, kBottomPx));
  scale_y(height_px_ - kBottomPx, top_px_);
  double label_px = kMinLabelPx;
  for (const AxisMark& tick : y_ticks_) label_px = std::max(label_px, text_px(tick.label));
  scale_x(kAxisTitlePx + label_px + kTickPx, plot_.width_px - kRightPx);
}

void Renderer::place_legend() {
  constexpr double kSwatchPx = 34;
  constexpr double kBetweenPx = 22;
  const double left = kAxisTitlePx + kMinLabelPx + kTickPx;
  Eigen::Vector2d at{left, 12};
  for (const Series& series : plot_.series) {
    if (series.label.empty()) continue;
    const double room_px = plot_.width_px - kRightPx - left - kSwatchPx;
    LegendEntry entry{&series, shortened(series.label, static_cast<std::size_t>(room_px / kCharacterPx)), at};
    const double width = kSwatchPx + text_px(entry.label);
    if (at.x() > left && at.x() + width > plot_.width_px - kRightPx) {
      at = {left, at.y() + kLinePx};
      entry.at = at;
    }
    at.x() += width + kBetweenPx;
    legend_.push_back(std::move(entry));
  }
}

void Renderer::open() {
  const std::string width = std::to_string(plot_.width_px);
  const std::string height = format_coordinate(height_px_);
  out_ += "<svg class=\"plot\" viewBox=\"0 0 " + width + " " + height + "\" width=\"" + width + "\" height=\"" +
          height + "\" role=\"img\" aria-label=\"" + escape_html(plot_.description) + "\">\n";
}

void Renderer::draw_bands() {
  bool is_odd = false;
  for (const Band& band : plot_.bands) {
    const double begin = std::max(band.begin, x_.range.low);
    const double end = std::min(band.end, x_.range.high);
    if (!(begin < end)) continue;
    const double left = x_.px(begin);
    const double width = x_.px(end) - left;
    const double top = top_px_ - kBandStripPx;
    out_ += "<rect class=\"band" + std::string(is_odd ? " odd" : "") + "\"" + attribute("x", left) +
            attribute("y", top) + attribute("width", width) + attribute("height", y_.px_low - top) + "><title>" +
            escape_html(band.label) + "</title></rect>\n";
    // A label that does not fit appears only in the title element, which browsers show as a tooltip.
    if (text_px(band.label) + 4 <= width) {
      out_ += text_element("band-label", {left + width / 2, top_px_ - 5}, band.label);
    }
    is_odd = !is_odd;
  }
}

void Renderer::draw_x_axis() {
  const double bottom = y_.px_low;
  for (const AxisMark& tick : x_ticks_) {
    const double x = x_.px(tick.value);
    out_ += line_element("axis", {x, bottom}, {x, bottom + kTickPx});
    out_ += text_element("x-tick", {x, bottom + 18}, tick.label);
  }
  out_ += line_element("axis", {x_.px_low, bottom}, {x_.px_high, bottom});
  out_ += text_element("axis-label", {(x_.px_low + x_.px_high) / 2, bottom + 38}, plot_.x.label());
}

void Renderer::draw_y_axis() {
  for (const AxisMark& tick : y_ticks_) {
    const double y = y_.px(tick.value);
    const bool is_zero = !plot_.y.is_log && tick.value == 0;
    out_ += line_element(is_zero ? "grid zero" : "grid", {x_.px_low, y}, {x_.px_high, y});
    out_ += text_element("y-tick", {x_.px_low - kTickPx - 3, y + 4}, tick.label);
  }
  const double middle = (y_.px_low + y_.px_high) / 2;
  out_ += "<text class=\"axis-label\" transform=\"translate(14 " + format_coordinate(middle) + ") rotate(-90)\">" +
          escape_html(plot_.y.label()) + "</text>\n";
}

Eigen::Vector2d Renderer::pixel(double x, double y) const {
  // A value beyond a fixed axis limit is drawn at the edge of the plot.
  return {x_.px(x), std::clamp(y_.px(y), y_.px_high, y_.px_low)};
}

std::string Renderer::coordinates(double x, double y) const {
  const Eigen::Vector2d at = pixel(x, y);
  return format_coordinate(at.x()) + "," + format_coordinate(at.y()) + " ";
}

void Renderer::draw_spread(const Series& series) {
  if (series.low.empty() && series.high.empty()) return;
  if (series.low.size() != series.x.size() || series.high.size() != series.x.size()) {
    throw std::invalid_argument("the spread of \"" + series.label + "\" has not the size of its x");
  }
  std::string there, back;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool is_shown = can_show(series.x[i], plot_.x.is_log) && can_show(series.low[i], plot_.y.is_log) &&
                          can_show(series.high[i], plot_.y.is_log) && x_.contains(series.x[i]);
    if (!is_shown) continue;
    there += coordinates(series.x[i], series.low[i]);
    back.insert(0, coordinates(series.x[i], series.high[i]));
  }
  out_ += "<polygon class=\"spread s" + std::to_string(style_of(series)) + "\" points=\"" + there + back + "\"/>\n";
}

void Renderer::draw_series(const Series& series) {
  if (series.draw != Draw::kMarkers) {
    const auto columns = static_cast<std::size_t>(std::max(1.0, x_.px_high - x_.px_low));
    std::vector<double> x = series.x;
    std::vector<double> y = series.y;
    for (double& value : y) {
      if (!can_show(value, plot_.y.is_log)) value = std::numeric_limits<double>::quiet_NaN();
    }
    Range range = x_.range;
    if (plot_.x.is_log) {
      // Decimates in the logarithm of x, because pixel columns are equally spaced on the screen. Values that are not
      // positive are mapped to a value outside the range.
      for (double& value : x) value = value > 0 ? std::log(value) : std::numeric_limits<double>::lowest();
      range = {std::log(range.low), std::log(range.high)};
    }
    for (Polyline& line : decimate(x, y, range, columns)) {
      for (Eigen::Vector2d& point : line) {
        if (plot_.x.is_log) point.x() = std::exp(point.x());
      }
      draw_polyline(series, line);
    }
  }
  if (series.draw != Draw::kLine) draw_markers(series);
}

void Renderer::draw_polyline(const Series& series, const Polyline& line) {
  out_ += "<polyline class=\"" + series_class(series) + "\" points=\"";
  for (const Eigen::Vector2d& point : line) out_ += coordinates(point.x(), point.y());
  // A single point is drawn as a very short line, because renderers omit the round caps of a line without length.
  const Eigen::Vector2d end = pixel(line.back().x(), line.back().y());
  if (line.size() == 1) out_ += format_coordinate(end.x() + 0.01) + "," + format_coordinate(end.y());
  out_ += "\"/>\n";
}

/// Draws the markers of a series: at each point of a short series, otherwise about every kPixelsPerMarker pixels. In a
/// long series, the style of the series shifts its first marker. Therefore the markers of two coinciding curves do not
/// cover each other.
void Renderer::draw_markers(const Series& series) {
  const bool has_all = series.draw == Draw::kMarkers || series.x.size() <= kFewPoints;
  double next_px = has_all ? 0 : x_.px_low + kPixelsPerMarker * (0.5 + style_of(series)) / kStyles;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool is_shown = can_show(series.x[i], plot_.x.is_log) && can_show(series.y[i], plot_.y.is_log);
    if (!is_shown || !x_.contains(series.x[i]) || x_.px(series.x[i]) < next_px) continue;
    out_ += marker_element(series, pixel(series.x[i], series.y[i]));
    if (!has_all) next_px = x_.px(series.x[i]) + kPixelsPerMarker;
  }
}

void Renderer::draw_limits() {
  for (const AxisMark& limit : plot_.limits) {
    if (!can_show(limit.value, plot_.y.is_log) || !y_.contains(limit.value)) continue;
    const double y = y_.px(limit.value);
    out_ += line_element("limit", {x_.px_low, y}, {x_.px_high, y});
    const bool has_room_above = y - kLinePx > y_.px_high;
    out_ += text_element("limit-label", {x_.px_high - 6, has_room_above ? y - 6 : y + 14}, limit.label);
  }
}

void Renderer::draw_legend() {
  for (const LegendEntry& entry : legend_) {
    const Series& series = *entry.series;
    out_ += "<g class=\"key\">\n";
    if (series.draw != Draw::kMarkers) {
      out_ += line_element(series_class(series), entry.at, entry.at + Eigen::Vector2d(26, 0));
    }
    if (series.draw != Draw::kLine) out_ += marker_element(series, entry.at + Eigen::Vector2d(13, 0));
    out_ += text_element("legend", {entry.at.x() + 34, entry.at.y() + 4}, entry.label);
    out_ += "</g>\n";
  }
}

}  // namespace

// Style sheet of all figures. The colours are those of Okabe and Ito, "Color Universal Design", 2008, which
// colour-blind readers can distinguish; some are darkened for lines on white paper. Dashes repeat after five styles;
// markers and colours never do.
const std::string_view kFigureStyle = R"css(
.plot { background: #ffffff; font-family: system-ui, "Noto Sans", "Helvetica Neue", Arial, sans-serif; }
.plot text { fill: #1b1f24; font-size: 12px; font-variant-numeric: tabular-nums; }
.plot .x-tick, .plot .axis-label, .plot .band-label { text-anchor: middle; }
.plot .y-tick, .plot .limit-label { text-anchor: end; }
.plot .x-tick, .plot .y-tick, .plot .band-label { fill: #3d444d; }
.plot .axis-label { font-size: 13px; }
.plot .grid { stroke: #d5dbe2; }
.plot .grid.zero, .plot .axis { stroke: #57606a; }
.plot .band { fill: #f6f8fa; }
.plot .band.odd { fill: #ebeff4; }
.plot .line { fill: none; stroke-width: 1.6; stroke-linejoin: round; stroke-linecap: butt; }
.plot .marker { stroke-width: 1.6; fill-opacity: 0.85; }
.plot .limit { stroke: #b00020; stroke-dasharray: 9 4; stroke-width: 1.2; }
.plot .limit-label { fill: #b00020; paint-order: stroke; stroke: #ffffff; stroke-width: 4px; stroke-linejoin: round; }
.plot .s0 { stroke: #0072b2; } .plot .marker.s0, .plot .spread.s0 { fill: #0072b2; }
.plot .s1 { stroke: #d55e00; } .plot .marker.s1, .plot .spread.s1 { fill: #d55e00; }
.plot .s2 { stroke: #008060; } .plot .marker.s2, .plot .spread.s2 { fill: #008060; }
.plot .s3 { stroke: #a8568a; } .plot .marker.s3, .plot .spread.s3 { fill: #a8568a; }
.plot .s4 { stroke: #1b1f24; } .plot .marker.s4, .plot .spread.s4 { fill: #1b1f24; }
.plot .s5 { stroke: #b07800; } .plot .marker.s5, .plot .spread.s5 { fill: #b07800; }
.plot .s6 { stroke: #3a9bdc; } .plot .marker.s6, .plot .spread.s6 { fill: #3a9bdc; }
.plot .s7 { stroke: #6b5b00; } .plot .marker.s7, .plot .spread.s7 { fill: #6b5b00; }
.plot .spread { fill-opacity: 0.18; stroke: none; }
.plot .line.s1, .plot .line.s6 { stroke-dasharray: 7 3; }
.plot .line.s2, .plot .line.s7 { stroke-dasharray: 2 2.5; }
.plot .line.s3 { stroke-dasharray: 9 3 2 3; }
.plot .line.s4 { stroke-dasharray: 14 4; }
)css";

double least_span(std::string_view unit) {
  struct Least {
    std::string_view unit;
    double span;
  };
  constexpr std::array kLeast{Least{"N", 0.5},    Least{"mN·m", 5},    Least{"N·m", 0.005}, Least{"mm", 1},
                              Least{"mm/s", 1},   Least{"m/s", 0.001}, Least{"%", 2},       Least{"N/ms", 0.05},
                              Least{"kJ/mol", 1}, Least{"mJ", 1},      Least{"ms", 1},      Least{"µs", 1},
                              Least{"Å", 0.1},    Least{"mN", 1},      Least{"1", 0.05},    Least{"kcal/mol", 0.5}};
  const auto* const found = std::ranges::find(kLeast, unit, &Least::unit);
  return found == kLeast.end() ? 0 : found->span;
}

std::string render_svg(const Plot& plot) {
  return Renderer(plot).svg();
}

std::string svg_file(const Plot& plot) {
  std::string svg = render_svg(plot);
  svg.insert(4, " xmlns=\"http://www.w3.org/2000/svg\"");
  svg.insert(svg.find('>') + 1, "\n<style>" + std::string(kFigureStyle) + "</style>");
  return svg;
}

std::string plot_csv(const Plot& plot) {
  const auto quoted = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : printable(text)) out.append(c == '"' ? 2 : 1, c);
    return out + '"';
  };
  const auto number = [](double value) {
    if (!std::isfinite(value)) return std::string();
    std::array<char, 32> text;
    return std::string(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
  };
  std::string csv = "series," + quoted(plot.x.label()) + "," + quoted(plot.y.label()) + ",low,high\n";
  const auto add_line = [&](const Series& series, double x, double y, double low, double high) {
    csv += quoted(series.label) + "," + number(x) + "," + number(y) + "," + number(low) + "," + number(high) + "\n";
  };
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (const Series& series : plot.series) {
    if (series.low.empty() && series.x.size() > kManyPoints) {
      const auto columns = static_cast<std::size_t>(plot.width_px);
      for (const Polyline& line : decimate(series.x, series.y, {series.x.front(), series.x.back()}, columns)) {
        for (const Eigen::Vector2d& point : line) add_line(series, point.x(), point.y(), kNone, kNone);
      }
      continue;
    }
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const bool has_spread = i < series.low.size() && i < series.high.size();
      add_line(series, series.x[i], series.y[i], has_spread ? series.low[i] : kNone,
               has_spread ? series.high[i] : kNone);
    }
  }
  return csv;
}

}  // namespace tandem::lab
