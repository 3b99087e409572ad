#include "lab/report/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "lab/report/decimate.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

// The size of text cannot be measured here. Therefore boxes assume this advance width for a 12 px sans-serif font. It
// is rather wide: 0.6 em, while digits of common fonts have 0.56 to 0.64.
constexpr double kCharacterPx = 7.2;
constexpr double kLinePx = 18;
constexpr double kBandStripPx = 18;
constexpr double kRightPx = 14;
constexpr double kBottomPx = 46;
constexpr double kTickPx = 5;
constexpr double kAxisTitlePx = 30;
/// Minimum width of the tick labels: four characters, so that figures above one another are aligned.
constexpr double kMinLabelPx = 4 * kCharacterPx;
constexpr double kPixelsPerXTick = 56;
constexpr double kPixelsPerYTick = 34;
constexpr std::size_t kLegendCharacters = 40;
constexpr int kColors = 6;

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

std::string series_class(const Series& series) {
  constexpr std::array<std::string_view, 3> kDashClass = {"", " dashed", " dotted"};
  const int color = (series.color % kColors + kColors) % kColors;
  return "line c" + std::to_string(color) + std::string(kDashClass[static_cast<std::size_t>(series.dash)]);
}

/// The smallest interval that contains all added values.
class Extent {
 public:
  void add(double value) {
    if (!std::isfinite(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  /// Returns an infinite range if no value was added.
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
    draw_series();
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
  void draw_series();
  void draw_polyline(const Series& series, const Polyline& line);
  void draw_limits();
  void draw_legend();

  const Plot& plot_;
  Mapping x_;
  Mapping y_;
  std::vector<AxisMark> x_ticks_;
  std::vector<AxisMark> y_ticks_;
  std::vector<LegendEntry> legend_;
  double top_px_ = 0;
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
    for (const double value : series.y) {
      if (can_show(value, plot_.y.is_log)) extent.add(value);
    }
  }
  for (const AxisMark& limit : plot_.limits) {
    if (can_show(limit.value, plot_.y.is_log)) extent.add(limit.value);
  }
  return sane(with_fixed_ends(extent.range(), plot_.y), plot_.y.is_log);
}

void Renderer::scale_y(double bottom_px, double top_px) {
  const auto count = static_cast<std::size_t>(std::max(3.0, (bottom_px - top_px) / kPixelsPerYTick));
  y_ = {y_extent(), plot_.y.is_log, bottom_px, top_px};
  if (plot_.y.is_log) {
    y_ticks_ = log_ticks(y_.range, count);
    return;
  }
  // The axis ends at ticks, except where a limit is fixed.
  y_ticks_ = ticks_around(y_.range, count);
  y_.range = with_fixed_ends({y_ticks_.front().value, y_ticks_.back().value}, plot_.y);
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
  top_px_ = legend_bottom + (plot_.bands.empty() ? 4 : kBandStripPx);
  scale_y(plot_.height_px - kBottomPx, top_px_);
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
    LegendEntry entry{&series, shortened(series.label, kLegendCharacters), at};
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
  const std::string height = std::to_string(plot_.height_px);
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
    // If a label does not fit, it appears only in the title element, which browsers show as a tooltip.
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
  out_ += text_element("axis-label", {(x_.px_low + x_.px_high) / 2, bottom + 38}, plot_.x.label);
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
          escape_html(plot_.y.label) + "</text>\n";
}

void Renderer::draw_series() {
  const auto columns = static_cast<std::size_t>(std::max(1.0, x_.px_high - x_.px_low));
  for (const Series& series : plot_.series) {
    std::vector<double> x = series.x;
    std::vector<double> y = series.y;
    for (double& value : y) {
      if (!can_show(value, plot_.y.is_log)) value = std::numeric_limits<double>::quiet_NaN();
    }
    Range range = x_.range;
    if (plot_.x.is_log) {
      // Pixel columns are equally spaced on the screen, so decimation works on the logarithm. Values that are not
      // positive are mapped to a value out of range.
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
}

void Renderer::draw_polyline(const Series& series, const Polyline& line) {
  out_ += "<polyline class=\"" + series_class(series) + "\" points=\"";
  for (const Eigen::Vector2d& point : line) {
    // If a fixed axis limit excludes a value, the line follows the edge of the plot.
    const double y = std::clamp(y_.px(point.y()), y_.px_high, y_.px_low);
    if (out_.back() != '"') out_ += ' ';
    out_ += format_coordinate(x_.px(point.x())) + "," + format_coordinate(y);
  }
  // A single point is drawn as a short line, because the round caps of a line without length are not drawn.
  if (line.size() == 1) {
    const double y = std::clamp(y_.px(line[0].y()), y_.px_high, y_.px_low);
    out_ += " " + format_coordinate(x_.px(line[0].x()) + 0.01) + "," + format_coordinate(y);
  }
  out_ += "\"/>\n";
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
    out_ += "<polyline class=\"" + series_class(*entry.series) + " key\" points=\"" + format_coordinate(entry.at.x()) +
            "," + format_coordinate(entry.at.y()) + " " + format_coordinate(entry.at.x() + 26) + "," +
            format_coordinate(entry.at.y()) + "\"/>\n";
    out_ += text_element("legend", {entry.at.x() + 34, entry.at.y() + 4}, entry.label);
  }
}

}  // namespace

std::string render_svg(const Plot& plot) {
  return Renderer(plot).svg();
}

}  // namespace tandem::lab
