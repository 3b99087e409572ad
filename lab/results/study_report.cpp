#include "lab/results/study_report.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/report/format.hpp"
#include "lab/report/html_report.hpp"
#include "lab/results/study_results.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr int kColors = 6;
constexpr int kFigureHeight_px = 260;

/// Attributes that distinguish the curves of a figure.
struct CurveName {
  std::string stage;
  bool is_disturbed = false;  ///< the link has jitter or loss
  std::string text;
  bool operator<(const CurveName& other) const { return text < other.text; }
};

std::string compact_text(const json::object& row, const char* name) {
  return format_significant(number_in(row, name), 3);
}

CurveName curve_of(const json::object& row) {
  CurveName name;
  name.stage = text_in(row, "stage");
  name.text = name.stage;
  if (const std::string predictor = text_in(row, "predictor"); predictor != client::StageSettings{}.predictor)
    name.text += " + " + predictor;
  if (row.at("passivity") == json::value(true)) name.text += ", passivity";
  if (number_in(row, "deadband") > 0) name.text += ", deadband " + compact_text(row, "deadband");
  const double jitter_ms = number_in(row, "jitter_ms");
  const double loss = number_in(row, "loss");
  if (jitter_ms > 0) name.text += ", " + compact_text(row, "jitter_ms") + " ms jitter";
  if (loss > 0) name.text += ", " + format_significant(100 * loss, 3) + " % lost";
  name.is_disturbed = jitter_ms > 0 || loss > 0;
  if (const json::value* overrides = row.if_contains("overrides")) {
    if (overrides->is_object() && !overrides->get_object().empty()) name.text += ", " + compact_json(*overrides);
  }
  return name;
}

/// Returns the curves of one experiment and metric over the round-trip delay. The points are means over the seeds.
std::map<CurveName, std::map<double, double>> curves_of(const std::vector<SeedGroup>& groups, std::string_view metric) {
  std::map<CurveName, std::map<double, double>> curves;
  for (const SeedGroup& group : groups) {
    const double value = mean_of(group, metric);
    if (std::isfinite(value)) curves[curve_of(*group.front())][number_in(*group.front(), "rtt_ms")] = value;
  }
  return curves;
}

/// Assigns a colour to each stage, the same in all figures.
std::map<std::string, int> stage_colors(std::span<const TrialResult> results) {
  std::map<std::string, int> colors;
  for (const TrialResult& result : results) {
    colors.emplace(text_in(result.row, "stage"), static_cast<int>(colors.size()));
  }
  return colors;
}

Dash dash_of(const CurveName& name, int color) {
  if (name.is_disturbed) return Dash::kDotted;
  return color >= kColors ? Dash::kDashed : Dash::kSolid;
}

Plot figure_of(const TrialMetric& metric, const std::map<CurveName, std::map<double, double>>& curves,
               const std::map<std::string, int>& colors) {
  Plot figure;
  figure.description = std::string(metric.name) + " of each stage over the round trip";
  figure.width_px = kHalfWidth_px;
  figure.height_px = kFigureHeight_px;
  figure.x.label = "round trip [ms]";
  figure.y.label = std::string(metric.name);
  for (const auto& [name, points] : curves) {
    const int color = colors.at(name.stage);
    Series series{name.text, {}, {}, color % kColors, dash_of(name, color)};
    for (const auto& [rtt_ms, value] : points) {
      series.x.push_back(rtt_ms);
      series.y.push_back(value);
    }
    figure.series.push_back(std::move(series));
  }
  figure.caption = std::string(metric.name) + ": " + std::string(metric.definition) + " Means over seeds.";
  return figure;
}

/// Returns a figure for every metric that has a curve.
std::vector<Plot> figures_of(const std::vector<SeedGroup>& groups, const std::map<std::string, int>& colors) {
  std::vector<Plot> figures;
  for (const TrialMetric& metric : trial_metrics()) {
    const auto curves = curves_of(groups, metric.name);
    const bool is_a_curve =
        std::any_of(curves.begin(), curves.end(), [](const auto& curve) { return curve.second.size() > 1; });
    if (is_a_curve) figures.push_back(figure_of(metric, curves, colors));
  }
  return figures;
}

Table definitions_table() {
  Table table{"Metrics",
              {{.header = "Metric", .is_text = true},
               {.header = "Of several users", .is_text = true},
               {.header = "Definition", .is_text = true}},
              {}};
  for (const TrialMetric& metric : trial_metrics()) {
    table.rows.push_back({std::string(metric.name),
                          metric.of_user != nullptr ? std::string(name_of(metric.combine)) : "of the trial",
                          std::string(metric.definition)});
  }
  return table;
}

/// Returns a row of the table: every metric of a group. `of` combines the values of the seeds.
std::vector<std::string> results_row(const SeedGroup& group, const std::string& seeds,
                                     double (*of)(const SeedGroup& group, std::string_view metric)) {
  std::vector<std::string> row{curve_of(*group.front()).text, compact_text(*group.front(), "rtt_ms"), seeds};
  for (const TrialMetric& metric : trial_metrics()) row.push_back(format_significant(of(group, metric.name), 3));
  row.push_back(outcomes_of(group));
  return row;
}

Table results_table(const std::vector<SeedGroup>& groups) {
  Table table{"Means over seeds, and the worst",
              {{.header = "Trial", .is_text = true}, {"Round trip", "ms"}, {.header = "Seeds", .is_text = true}},
              {}};
  for (const TrialMetric& metric : trial_metrics()) table.columns.push_back({std::string(metric.name), ""});
  table.columns.push_back({.header = "Outcome", .is_text = true});
  for (const SeedGroup& group : groups) {
    const std::string seeds = std::to_string(group.size());
    table.rows.push_back(results_row(group, group.size() == 1 ? seeds : "mean of " + seeds, mean_of));
    if (group.size() > 1) table.rows.push_back(results_row(group, "worst of " + seeds, worst_of));
  }
  return table;
}

std::map<std::string, std::vector<SeedGroup>> by_experiment(std::span<const TrialResult> results) {
  std::map<std::string, std::vector<SeedGroup>> experiments;
  for (SeedGroup& group : seed_groups(results)) experiments[text_in(*group.front(), "experiment")].push_back(group);
  return experiments;
}

}  // namespace

std::string study_report_html(std::span<const TrialResult> results) {
  HtmlReport page("Latency bridged, stage by stage", std::to_string(results.size()) + " trials in virtual time");
  page.paragraph(
      "Simulated hands repeat the same movements over simulated links. Each trial is compared with the reference: the "
      "same hands at zero delay on the server's own touch. Solid or dashed: an undisturbed link; dotted: with jitter "
      "or loss.");
  const auto colors = stage_colors(results);
  for (const auto& [experiment, groups] : by_experiment(results)) {
    page.heading(experiment);
    const std::vector<Plot> figures = figures_of(groups, colors);
    for (std::size_t i = 0; i < figures.size(); i += 2) {
      page.side_by_side(std::span(figures).subspan(i, std::min<std::size_t>(2, figures.size() - i)));
    }
    page.table(results_table(groups));
  }
  page.heading("Definitions");
  page.table(definitions_table());
  page.footer("SI units. The numbers of single trials are in results.json, results.csv and results.h5.");
  return page.html();
}

}  // namespace tandem::lab
