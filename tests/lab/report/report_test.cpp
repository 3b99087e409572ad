// Tests the report writer, from the digits of a number to the whole page. Fails if the report shows other values than
// the measured ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "lab/report/check.hpp"
#include "lab/report/csv.hpp"
#include "lab/report/decimate.hpp"
#include "lab/report/format.hpp"
#include "lab/report/html_report.hpp"
#include "lab/report/plot.hpp"
#include "lab/report/ticks.hpp"

namespace tandem::lab {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t count_of(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

std::vector<std::string> labels(const std::vector<AxisMark>& ticks) {
  std::vector<std::string> out;
  for (const AxisMark& tick : ticks) out.push_back(tick.label);
  return out;
}

using Labels = std::vector<std::string>;

TEST(FormatFixed, RoundsAndNeverShowsNegativeZero) {
  EXPECT_EQ(format_fixed(1.005, 1), "1.0");
  EXPECT_EQ(format_fixed(-0.004, 2), "0.00");
  EXPECT_EQ(format_fixed(-0.0, 0), "0");
  EXPECT_EQ(format_fixed(-1.5, 2), "−1.50");
  EXPECT_EQ(format_fixed(kNan, 2), "–");
  EXPECT_EQ(format_fixed(-kInfinity, 2), "−∞");
}

TEST(FormatFixed, FormatsTheLargestDouble) {
  EXPECT_EQ(format_fixed(-std::numeric_limits<double>::max(), 17).size(), 309 + 18 + std::string("−").size());
}

TEST(FormatSignificant, KeepsDigitsNotDecimals) {
  EXPECT_EQ(format_significant(0.00012345, 3), "0.000123");
  EXPECT_EQ(format_significant(123456, 3), "123456");
  EXPECT_EQ(format_significant(9.996, 3), "10");
  EXPECT_EQ(format_significant(2.50, 3), "2.5");
  EXPECT_EQ(format_significant(-1.5e-9, 3), "−1.5e−9");
  EXPECT_EQ(format_significant(3e12, 2), "3e12");
  EXPECT_EQ(format_significant(0, 3), "0");
}

TEST(FormatCoordinate, IsNeverSomethingThatSvgCannotRead) {
  EXPECT_EQ(format_coordinate(-1.005), "-1");
  EXPECT_EQ(format_coordinate(12.5), "12.5");
  EXPECT_EQ(format_coordinate(kNan), "0");
  EXPECT_EQ(format_coordinate(kInfinity), "0");
}

TEST(EscapeHtml, LeavesNoMarkupOfAHostileName) {
  EXPECT_EQ(escape_html("<script>alert('x')</script>"), "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;");
  EXPECT_EQ(escape_html("a\" onload=\"b&c"), "a&quot; onload=&quot;b&amp;c");
}

TEST(EscapeHtml, ReplacesInvalidCharactersAndKeepsText) {
  EXPECT_EQ(escape_html("Zoë 日本 😀"), "Zoë 日本 😀");
  EXPECT_EQ(escape_html(std::string_view("a\0b\x1b[31m", 8)), "a\uFFFDb\uFFFD[31m");
  EXPECT_EQ(escape_html("\u202Egpj.exe"), "\uFFFDgpj.exe");
  EXPECT_EQ(escape_html("\xC0\xAF"), "\uFFFD\uFFFD") << "an over-long slash";
  EXPECT_EQ(escape_html("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "a surrogate";
  EXPECT_EQ(escape_html("ab\xE2\x82"), "ab\uFFFD\uFFFD") << "cut off in the middle";
}

TEST(Shortened, CutsBetweenCharacters) {
  EXPECT_EQ(shortened("Zoë", 3), "Zoë");
  EXPECT_EQ(shortened("Zoë Müller", 4), "Zoë…");
  EXPECT_EQ(shortened("日本語", 5), "日本…");
  EXPECT_EQ(shortened("日本語", 4), "日…");
  EXPECT_EQ(shortened("a\xFF\xFF\xFF", 3), "a\xFF…");
  EXPECT_EQ(text_width("Zoë…"), 4U);
  EXPECT_EQ(text_width("日本 −😀"), 8U);
}

TEST(TicksInside, AreOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_EQ(labels(ticks_inside({0, 10}, 6)), (Labels{"0", "2", "4", "6", "8", "10"}));
  EXPECT_EQ(labels(ticks_inside({-0.1, 0.1}, 5)), (Labels{"−0.10", "−0.05", "0.00", "0.05", "0.10"}));
  EXPECT_EQ(labels(ticks_inside({0.3, 6.7}, 4)), (Labels{"2", "4", "6"}));
  EXPECT_EQ(labels(ticks_inside({0, 3e-9}, 4)), (Labels{"0", "1e−9", "2e−9", "3e−9"}));
}

TEST(TicksInside, AreFewForAnyRange) {
  Random random(7);
  const auto any = [&random] { return random.normal() * std::pow(10, 500 * random.uniform() - 250); };
  for (int i = 0; i < 5000; ++i) {
    const Range range{any(), any()};
    const auto ticks = ticks_inside(range, 7);
    ASSERT_GE(ticks.size(), 1U) << range.low << " " << range.high;
    ASSERT_LE(ticks.size(), 7U) << range.low << " " << range.high;
  }
}

TEST(TicksInside, HandleInvalidRanges) {
  for (const Range range : {Range{5, 5}, Range{0, 0}, Range{kNan, 1}, Range{-kInfinity, kInfinity}, Range{1, -1},
                            Range{-1.7e308, 1.7e308}, Range{1e15, 1e15 + 1}, Range{5e-324, 5e-324}}) {
    const auto ticks = ticks_inside(range, 5);
    EXPECT_GE(ticks.size(), 1U) << range.low << " " << range.high;
    EXPECT_LE(ticks.size(), 5U) << range.low << " " << range.high;
  }
}

TEST(TicksAround, EncloseTheRangeWithLessThanAStepExtra) {
  Random random(11);
  for (int i = 0; i < 5000; ++i) {
    const Range range = sane_linear({10 * random.normal(), 10 * random.normal()});
    const std::size_t count = 3 + random.next_u32() % 8;
    const auto ticks = ticks_around(range, count);
    ASSERT_GE(ticks.size(), 2U) << range.low << " " << range.high << " " << count;
    ASSERT_LE(ticks.size(), count) << range.low << " " << range.high << " " << count;
    const double step = ticks[1].value - ticks[0].value;
    const double slack = 1e-5 * step;
    ASSERT_LE(ticks.front().value, range.low + slack);
    ASSERT_GT(ticks.front().value, range.low - step);
    ASSERT_GE(ticks.back().value, range.high - slack);
    ASSERT_LT(ticks.back().value, range.high + step);
  }
}

TEST(LogTicks, AreDecadesAndFillUpWhereThereIsRoom) {
  EXPECT_EQ(labels(log_ticks({1, 1e6}, 7)), (Labels{"1", "10", "100", "1000", "10000", "100000", "1000000"}));
  EXPECT_EQ(labels(log_ticks({1, 10}, 7)), (Labels{"1", "2", "5", "10"}));
  EXPECT_LE(log_ticks({1e-200, 1e200}, 6).size(), 6U);
  EXPECT_GE(log_ticks({-1, 0}, 6).size(), 1U);
}

struct Wave {
  std::vector<double> x;
  std::vector<double> y;
};

Wave noise(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Wave wave;
  for (std::size_t i = 0; i < count; ++i) {
    wave.x.push_back(static_cast<double>(i));
    wave.y.push_back(random.normal());
  }
  return wave;
}

TEST(Decimate, KeepsASingleSamplePeakWhereverItIs) {
  for (std::size_t peak = 0; peak < 20000; peak += 37) {
    Wave wave = noise(20000, 1);
    wave.y[peak] = 50;
    const auto lines = decimate(wave.x, wave.y, {0, 19999}, 300);
    ASSERT_EQ(lines.size(), 1U);
    const bool is_kept = std::any_of(lines[0].begin(), lines[0].end(), [&](const Eigen::Vector2d& p) {
      return p.x() == static_cast<double>(peak) && p.y() == 50;
    });
    ASSERT_TRUE(is_kept) << peak;
    ASSERT_LE(lines[0].size(), 4U * 300U);
  }
}

TEST(Decimate, KeepsEveryColumnsExtremesAndEndsInOrder) {
  const Wave wave = noise(10000, 2);
  constexpr std::size_t kColumns = 100;
  const auto lines = decimate(wave.x, wave.y, {0, 10000}, kColumns);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(std::is_sorted(lines[0].begin(), lines[0].end(),
                             [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() < b.x(); }));
  for (std::size_t column = 0; column < kColumns; ++column) {
    const auto begin = wave.y.begin() + static_cast<std::ptrdiff_t>(column * 100);
    double low = kInfinity;
    double high = -kInfinity;
    for (const Eigen::Vector2d& point : lines[0]) {
      if (static_cast<std::size_t>(point.x()) / 100 != column) continue;
      low = std::min(low, point.y());
      high = std::max(high, point.y());
    }
    ASSERT_EQ(low, *std::min_element(begin, begin + 100)) << column;
    ASSERT_EQ(high, *std::max_element(begin, begin + 100)) << column;
  }
}

TEST(Decimate, LeavesAGapWhereSamplesAreMissing) {
  Wave wave = noise(1000, 3);
  for (std::size_t i = 400; i < 500; ++i) wave.y[i] = i % 2 == 0 ? kNan : kInfinity;
  const auto lines = decimate(wave.x, wave.y, {0, 999}, 100);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_LT(lines[0].back().x(), 400);
  EXPECT_EQ(lines[1].front().x(), 500);
}

TEST(Decimate, StaysBoundedWhenEverySecondSampleIsMissing) {
  Wave wave = noise(100000, 4);
  for (std::size_t i = 0; i < wave.y.size(); i += 2) wave.y[i] = kNan;
  std::size_t points = 0;
  for (const Polyline& line : decimate(wave.x, wave.y, {0, 99999}, 50)) points += line.size();
  EXPECT_LE(points, 200U);
}

TEST(Decimate, RefusesInvalidSeries) {
  EXPECT_THROW(decimate(std::vector{1.0, 0.0}, std::vector{1.0, 1.0}, {0, 1}, 10), std::invalid_argument);
  EXPECT_THROW(decimate(std::vector{kNan}, std::vector{1.0}, {0, 1}, 10), std::invalid_argument);
  EXPECT_THROW(decimate(std::vector{1.0}, std::vector<double>{}, {0, 1}, 10), std::invalid_argument);
  EXPECT_THROW(decimate(std::vector{1.0}, std::vector{1.0}, {0, 1}, 0), std::invalid_argument);
}

Plot sample_plot() {
  const Wave wave = noise(5000, 5);
  Plot plot;
  plot.description = "noise <over> \"time\"";
  plot.x = {"time", "s"};
  plot.y = {"force", "N"};
  plot.series = {{"<b>anna</b>", wave.x, wave.y}};
  plot.limits = {{3.3, "limit 3.3 N"}};
  plot.bands = {{0, 2000, "approach"}, {2000, 5000, "hold & press"}};
  return plot;
}

TEST(RenderSvg, EscapesEveryText) {
  const std::string svg = render_svg(sample_plot());
  EXPECT_EQ(svg.find("<b>"), std::string::npos);
  EXPECT_EQ(count_of(svg, "&lt;b&gt;anna&lt;/b&gt;"), 1U);
  EXPECT_EQ(count_of(svg, "aria-label=\"noise &lt;over&gt; &quot;time&quot;\""), 1U);
  EXPECT_EQ(count_of(svg, "hold &amp; press"), 2U) << "the label and the title";
}

TEST(RenderSvg, ContainsOnlyFiniteNumbers) {
  Plot plot = sample_plot();
  plot.series[0].y[7] = kNan;
  plot.series[0].y[9] = 1e308;
  plot.limits.push_back({kNan, "none"});
  plot.bands.push_back({kNan, 3, "none"});
  const std::string svg = render_svg(plot);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_EQ(svg.find(">none<"), std::string::npos);
}

TEST(RenderSvg, DrawsAnEmptyPlotAndASinglePoint) {
  Plot plot;
  EXPECT_EQ(count_of(render_svg(plot), "<polyline"), 0U);
  plot.series = {{"", {1.0}, {2.0}}};
  const std::string svg = render_svg(plot);
  const std::size_t points = svg.find("points=\"");
  ASSERT_NE(points, std::string::npos);
  EXPECT_NE(svg.substr(points, svg.find('"', points + 8) - points).find(' '), std::string::npos);
}

TEST(RenderSvg, OmitsNonPositiveValuesFromALogarithmicAxis) {
  Plot plot;
  plot.x.is_log = true;
  plot.y.is_log = true;
  plot.series = {{"", {-1.0, 0.0, 1.0, 10.0, 100.0, 1000.0}, {1.0, 1.0, 1.0, 0.0, 100.0, 1000.0}}};
  const std::string svg = render_svg(plot);
  EXPECT_EQ(count_of(svg, "<polyline"), 2U) << "zero is a gap between 1 and 100";
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(RenderSvg, StaysSmallForAnHourAtOneKilohertz) {
  Wave wave = noise(3'600'000, 6);
  Plot plot;
  plot.series = {{"force", std::move(wave.x), std::move(wave.y)}};
  EXPECT_LT(render_svg(plot).size(), 100'000U);
}

TEST(RenderSvg, ShowsTheSpreadAndRefusesOneOfAnotherSize) {
  Plot plot;
  plot.series = {{"mean", {0.0, 1.0}, {2.0, 3.0}, 0, Draw::kLineAndMarkers, {1.0, 2.5}, {2.5, 9.0}}};
  const std::string svg = render_svg(plot);
  EXPECT_EQ(count_of(svg, "class=\"spread s0\""), 1U);
  EXPECT_EQ(count_of(svg, "class=\"marker s0\""), 3U) << "two points and the legend";
  EXPECT_NE(svg.find(">10</text>"), std::string::npos) << "the axis holds the spread";
  plot.series[0].high.pop_back();
  EXPECT_THROW(render_svg(plot), std::invalid_argument);
}

/// Returns the largest number beside the y axis.
double greatest_y_tick(const std::string& svg) {
  double greatest = 0;
  const std::string_view mark = "<text class=\"y-tick\"";
  for (std::size_t at = svg.find(mark); at != std::string::npos; at = svg.find(mark, at + 1)) {
    greatest = std::max(greatest, std::stod(svg.substr(svg.find('>', at) + 1)));
  }
  return greatest;
}

TEST(RenderSvg, DoesNotMagnifyImperceptibleDifferences) {
  Plot plot;
  plot.y = {"torque", "mN·m"};
  plot.series = {{"", {0.0, 1.0}, {0.0, 0.03}}};
  EXPECT_GE(greatest_y_tick(render_svg(plot)), least_span("mN·m"));
  plot.series[0].y[1] = 80;
  EXPECT_EQ(greatest_y_tick(render_svg(plot)), 80);
}

TEST(RenderSvg, GrowsWithItsLegendInsteadOfShrinkingThePlot) {
  Plot plot;
  plot.width_px = kHalfWidth_px;
  const auto height = [&plot] {
    const std::string svg = render_svg(plot);
    return std::stod(svg.substr(svg.find("height=\"") + 8));
  };
  const double before = height();
  for (int i = 0; i < kStyles; ++i) plot.series.push_back({"a rather long name of a curve", {0.0}, {1.0}, i});
  EXPECT_GT(height(), before + 100);
}

TEST(SvgFile, HasItsOwnStyleAndNameSpace) {
  const std::string svg = svg_file(sample_plot());
  EXPECT_EQ(svg.find("<svg xmlns=\"http://www.w3.org/2000/svg\""), 0U);
  EXPECT_EQ(count_of(svg, "<style>"), 1U);
}

TEST(PlotCsv, HasEveryPointOfAShortSeriesAndThePeaksOfALongOne) {
  Plot plot = sample_plot();
  plot.series[0].y[1234] = 77;
  plot.series.push_back({"short, \"quoted\"", {0.5}, {kNan}, 1, Draw::kMarkers, {1.0}, {2.0}});
  const std::string csv = plot_csv(plot);
  EXPECT_EQ(csv.find("series,\"time [s]\",\"force [N]\",low,high\n"), 0U);
  EXPECT_NE(csv.find("\"<b>anna</b>\",1234,77,,\n"), std::string::npos);
  EXPECT_NE(csv.find("\"short, \"\"quoted\"\"\",0.5,,1,2\n"), std::string::npos);
  EXPECT_LT(count_of(csv, "\n"), 4U * 960U);
}

Check check_of(double value, Relation relation, double bound) {
  return {"anna", "claim", value, relation, bound, "N", 2};
}

TEST(Check, HoldsByItsRelationAndNeverForNan) {
  EXPECT_TRUE(check_of(0.3, Relation::kAtLeast, 0.3).holds());
  EXPECT_FALSE(check_of(0.29, Relation::kAtLeast, 0.3).holds());
  EXPECT_TRUE(check_of(0.3, Relation::kAtMost, 0.3).holds());
  EXPECT_FALSE(check_of(0.31, Relation::kAtMost, 0.3).holds());
  EXPECT_FALSE(check_of(0.3, Relation::kBelow, 0.3).holds());
  EXPECT_TRUE(check_of(0.29, Relation::kBelow, 0.3).holds());
  for (const Relation relation : {Relation::kAtLeast, Relation::kAtMost, Relation::kBelow}) {
    EXPECT_FALSE(check_of(kNan, relation, 0.3).holds());
    EXPECT_FALSE(check_of(0.3, relation, kNan).holds());
  }
}

HtmlReport sample_report() {
  HtmlReport report("Sharing <a> peg", "two users & \"one\" peg");
  const std::vector<Check> checks = {check_of(1, Relation::kAtLeast, 0.3),
                                     {"<img onerror>", "<i>claim</i>", 5, Relation::kAtMost, 3, "<u>", 1}};
  report.verdict(checks);
  report.heading("</h2><h1>");
  report.paragraph("</p><script>");
  report.table({"</caption>", {{"<th>", "<unit>", true}, {"value", "N"}}, {{"<td>"}, {"a", "1"}}});
  Plot markup_below = sample_plot();
  markup_below.caption = "</figcaption>";
  report.side_by_side(std::vector{markup_below, sample_plot()});
  report.footer("</footer>");
  return report;
}

TEST(HtmlReport, EscapesEveryText) {
  const std::string html = sample_report().html();
  for (const char* markup : {"<a>", "<img", "<i>", "<u>", "<script", "<unit>", "</h2><h1>", "</caption></caption>",
                             "</footer></p>", "</figcaption></figcaption>"}) {
    EXPECT_EQ(html.find(markup), std::string::npos) << markup;
  }
}

TEST(HtmlReport, NeedsNeitherNetworkNorScript) {
  const std::string html = sample_report().html();
  for (const char* word : {"<script", "<link", "http://", "https://", "url(", "@import", " src="}) {
    EXPECT_EQ(html.find(word), std::string::npos) << word;
  }
}

TEST(HtmlReport, ShowsFewChecksOnTheFirstPageAndOfManyThoseThatFail) {
  std::vector<Check> checks(12, check_of(1, Relation::kAtLeast, 0.3));
  checks.push_back(check_of(0.1, Relation::kAtLeast, 0.3));
  HtmlReport report("t", "s");
  report.verdict(checks);
  report.appendix();
  const std::string html = report.html();
  const std::size_t appendix = html.find("class=\"appendix\"");
  ASSERT_NE(appendix, std::string::npos);
  EXPECT_EQ(count_of(html.substr(0, appendix), "aria-label=\"holds\""), 0U);
  EXPECT_EQ(count_of(html.substr(0, appendix), "aria-label=\"fails\""), 1U);
  EXPECT_EQ(count_of(html.substr(appendix), "aria-label=\"holds\""), 12U);
}

TEST(HtmlReport, NamesItsOriginOnTheFirstPageAndItsFiles) {
  HtmlReport report = sample_report();
  report.appendix();
  report.paragraph("behind");
  report.origin({"tandem-lab <run>", "Tandem 1.2", "2026-01-02", {{"results.json", "abc"}}});
  const auto files = report.files("page.html");
  const std::string& html = files.at("page.html");
  EXPECT_LT(html.find("tandem-lab &lt;run&gt;"), html.find("class=\"appendix\""));
  EXPECT_NE(html.find("SHA-256 of results.json: <code>abc"), std::string::npos);
  ASSERT_EQ(files.size(), 5U) << "a page, two figures and their data";
  for (const auto& [name, text] : files) {
    if (name == "page.html") continue;
    EXPECT_NE(html.find("href=\"" + name + "\""), std::string::npos) << name;
  }
}

TEST(HtmlReport, TwoPagesInAFolderShareNoFile) {
  HtmlReport other("other", "s");
  other.figure(sample_plot());
  std::map<std::string, std::string> files = sample_report().files();
  EXPECT_TRUE(std::ranges::any_of(files, [](const auto& file) { return file.first.starts_with("figures/"); }));
  for (const char* name : {"a.html", "b c.html"}) {
    const auto more = other.files(name);
    const std::string& html = more.at(name);
    for (const auto& [file, text] : more) {
      EXPECT_TRUE(files.emplace(file, text).second) << file;
      if (file == name) continue;
      EXPECT_TRUE(file.starts_with(name[0] == 'a' ? "a-figures/" : "b-c-figures/")) << file;
      EXPECT_NE(html.find("href=\"" + file + "\""), std::string::npos) << file;
    }
  }
}

TEST(HtmlReport, IsTheSameToTheByte) {
  EXPECT_EQ(sample_report().html(), sample_report().html());
}

TEST(HtmlReport, StatesInWordsHowManyChecksFail) {
  HtmlReport report("t", "s");
  report.verdict(std::vector<Check>{check_of(1, Relation::kAtLeast, 0.3)});
  EXPECT_NE(report.html().find("Passed: all 1 checks hold."), std::string::npos);
  EXPECT_NE(sample_report().html().find("Failed: 1 of 2 checks does not hold."), std::string::npos);
}

std::string csv_complaint(std::string_view text) {
  try {
    parse_csv(text, "bob.csv");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ParseCsv, ReadsNumbersMissingFieldsAndWindowsLines) {
  const CsvTable table = parse_csv("t_s,force_n\r\n0,1.5\r\n0.001,\r\n2e-3,-inf", "bob.csv");
  EXPECT_EQ(table.row_count(), 3U);
  EXPECT_EQ(table.column("t_s"), (std::vector{0.0, 0.001, 0.002}));
  EXPECT_EQ(table.column("force_n")[0], 1.5);
  EXPECT_TRUE(std::isnan(table.column("force_n")[1]));
  EXPECT_EQ(table.column("force_n")[2], -kInfinity);
}

TEST(ParseCsv, NamesFileLineAndColumnOfAnError) {
  EXPECT_EQ(csv_complaint("t_s,force_n\n0,1\n1,x1\n"),
            "bob.csv: line 3, column 2 (force_n) is \"x1\"; it must be a number");
  EXPECT_EQ(csv_complaint("t_s,force_n\n0,1 \n"), "bob.csv: line 2, column 2 (force_n) is \"1 \"; it must be a number");
  EXPECT_EQ(csv_complaint("t_s,force_n\n0\n"), "bob.csv: line 2 has 1 fields; the header names 2");
  EXPECT_EQ(csv_complaint("t_s,force n\n"),
            "bob.csv: line 1, column 2 is named \"force n\"; a name must be of letters, digits and _");
  EXPECT_EQ(csv_complaint("t_s,t_s\n"), "bob.csv: line 1, column 2 is named \"t_s\" a second time");
  EXPECT_EQ(csv_complaint(""), "bob.csv is empty; its first line must name the columns");
  EXPECT_EQ(csv_complaint("t_s\n1e999\n"), "bob.csv: line 2, column 1 (t_s) is \"1e999\"; it must be a number");
}

TEST(ParseCsv, RefusesMoreThanItsLimits) {
  std::string names = "c0";
  for (std::size_t i = 1; i < kMaxCsvColumns; ++i) names += ",c" + std::to_string(i);
  EXPECT_EQ(csv_complaint(names), "accepted");
  EXPECT_EQ(csv_complaint(names + ",more"), "bob.csv: line 1 names 257 columns; at most 256 are read");
  std::string rows = "a\n";
  for (std::size_t i = 0; i < kMaxCsvRows; ++i) rows += "1\n";
  EXPECT_EQ(csv_complaint(rows), "accepted");
  EXPECT_EQ(csv_complaint(rows + "1\n"), "bob.csv: line 2000002 is one row too many; at most 2000000 are read");
}

TEST(ReadCsv, RefusesAFileThatIsTooLarge) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "large.csv";
  std::ofstream(file) << "a\n";
  std::filesystem::resize_file(file, kMaxCsvBytes + 1);  // a sparse file, which occupies no blocks on disk
  EXPECT_THAT([&] { read_csv(file); }, testing::ThrowsMessage<std::invalid_argument>(
                                           testing::HasSubstr("has 536870913 bytes; at most 536870912 are read")));
  std::filesystem::remove(file);
}

TEST(ParseCsv, NamesAMissingColumn) {
  const CsvTable table = parse_csv("t_s\n", "bob.csv");
  EXPECT_EQ(table.find("force_n"), nullptr);
  EXPECT_THROW(table.column("force_n"), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::lab
