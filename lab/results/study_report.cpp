#include "lab/results/study_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/report/format.hpp"
#include "lab/results/study_results.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr int kFigureHeight_px = 260;
constexpr std::size_t kFirstPageFigures = 3;
/// Metrics that show whether a stage hides the delay, the most important first.
constexpr std::array<std::string_view, 8> kHeadline{
    "path_error_of_peak",      "contact_force_ratio", "free_drag_rms_n",      "limit_cycle_m_per_s",
    "force_step_max_n_per_ms", "felt_mass_ratio",     "felt_stiffness_ratio", "view_divergence_max_m"};

std::string compact_text(const json::object& row, const char* name, double factor = 1) {
  return format_significant(factor * number_in(row, name), 3);
}

/// A quantity of the link or the client that a study varies, as the x axis of its figures.
struct Sweep {
  const char* field;
  PlotAxis axis;
  double factor = 1;
  std::string shared = {};  ///< settings of --set that all trials have in common; the names of the curves omit them

  double of(const json::object& row) const { return factor * number_in(row, field); }
  std::string text(double value) const { return format_significant(value, 3) + " " + axis.unit + " " + axis.quantity; }
};

/// Returns the settings of --set as text; empty if there are none.
std::string overrides_of(const json::object& row) {
  const json::value* const overrides = row.if_contains("overrides");
  std::string text;
  if (overrides == nullptr || !overrides->is_object()) return text;
  for (const auto& [name, value] : overrides->get_object())
    text += (text.empty() ? "" : ", ") + std::string(name) + "=" + compact_json(value);
  return text;
}

/// Returns the quantity for the x axis of the figures: the first one that has several values in the study. If all
/// quantities have a single value, it is the round trip.
Sweep sweep_of(std::span<const TrialResult> results) {
  std::set<std::string> overrides;
  for (const TrialResult& result : results) overrides.insert(overrides_of(result.row));
  const std::string shared = overrides.size() == 1 ? *overrides.begin() : "";
  std::array sweeps{Sweep{"rtt_ms", {"round trip", "ms"}}, Sweep{"jitter_ms", {"jitter", "ms"}},
                    Sweep{"loss", {"loss", "%"}, 100}, Sweep{"deadband", {"deadband", "%"}, 100}};
  for (Sweep& sweep : sweeps) {
    sweep.shared = shared;
    std::set<double> values;
    for (const TrialResult& result : results) values.insert(sweep.of(result.row));
    if (values.size() > 1) return sweep;
  }
  return sweeps.front();
}

/// Returns the settings of the client that differ from the default, as text; empty if there are none.
std::string variant_of(const json::object& row, const Sweep& sweep) {
  std::string text;
  if (const std::string predictor = text_in(row, "predictor"); predictor != client::StageSettings{}.predictor)
    text += " + " + predictor;
  if (row.at("passivity") != json::value(true)) text += ", no passivity control";
  if (number_in(row, "deadband") > 0 && sweep.field != std::string("deadband"))
    text += ", deadband " + compact_text(row, "deadband", 100) + " %";
  const std::string overrides = overrides_of(row);
  return overrides == sweep.shared ? text : text + ", " + overrides;
}

/// Returns jitter and loss of the link as text; empty if both are zero or swept.
std::string link_text(const json::object& row, const Sweep& sweep) {
  std::string text;
  const auto add = [&](const char* field, double factor, const std::string& unit) {
    if (!(number_in(row, field) > 0) || sweep.field == std::string(field)) return;
    text += (text.empty() ? "" : ", ") + compact_text(row, field, factor) + unit;
  };
  add("jitter_ms", 1, " ms jitter");
  add("loss", 100, " % lost");
  return text;
}

/// Disturbances of a link, ordered from the least to the greatest. The swept quantity is excluded.
struct Disturbance {
  double loss = 0, jitter_ms = 0;
  bool is_after_silence = false;
  std::string text = {};  ///< description; empty: no disturbance

  auto operator<=>(const Disturbance&) const = default;
};

Disturbance disturbance_of(const json::object& row, const Sweep& sweep) {
  const auto unless_swept = [&](const char* field) {
    const double value = number_in(row, field);
    return sweep.field == std::string(field) || !(value > 0) ? 0.0 : value;
  };
  Disturbance result{unless_swept("loss"), unless_swept("jitter_ms"), was_silent(row), link_text(row, sweep)};
  if (result.is_after_silence) result.text += (result.text.empty() ? "" : ", ") + std::string("after a silence");
  return result;
}

/// Trials under one disturbance of the link, grouped by the name of their curve. The first `mains` curves are those of
/// clients with default settings.
struct Curves {
  std::vector<std::pair<std::string, std::vector<SeedGroup>>> curves;
  std::size_t mains = 0;
};

Curves curves_of(const std::vector<SeedGroup>& groups, const Sweep& sweep) {
  std::map<std::pair<bool, std::string>, std::vector<SeedGroup>> by_name;
  for (const SeedGroup& group : groups) {
    const std::string variant = variant_of(*group.front(), sweep);
    by_name[{!variant.empty(), text_in(*group.front(), "stage") + variant}].push_back(group);
  }
  Curves result;
  for (auto& [name, members] : by_name) {
    result.mains += name.first ? 0 : 1;
    result.curves.emplace_back(name.second, std::move(members));
  }
  if (result.mains == 0) result.mains = result.curves.size();
  return result;
}

/// Returns the finite values of a metric at each x.
std::map<double, std::vector<double>> values_of(const std::vector<SeedGroup>& groups, const Sweep& sweep,
                                                std::string_view metric) {
  std::map<double, std::vector<double>> values;
  for (const SeedGroup& group : groups) {
    for (const json::object* row : group) {
      const double value = number_in(*row, metric);
      if (std::isfinite(value)) values[sweep.of(*row)].push_back(value);
    }
  }
  return values;
}

double mean_over(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

Series series_of(const std::string& name, const std::map<double, std::vector<double>>& values, double factor) {
  Series series{name, {}, {}};
  for (const auto& [x, of_seeds] : values) {
    const auto [least, greatest] = std::ranges::minmax(of_seeds);
    series.x.push_back(x);
    series.y.push_back(factor * mean_over(of_seeds));
    series.low.push_back(factor * least);
    series.high.push_back(factor * greatest);
  }
  return series;
}

Plot empty_figure(std::string_view metric, const Sweep& sweep) {
  Plot figure;
  figure.description = std::string(metric) + " of each stage over the " + sweep.axis.quantity;
  figure.width_px = kHalfWidth_px;
  figure.height_px = kFigureHeight_px;
  figure.x = sweep.axis;
  figure.y = axis_of_metric(metric).axis;
  figure.caption = std::string(metric) + ": " + std::string(trial_metric_called(metric).definition) +
                   " Lines: means over the seeds; bands: least to greatest.";
  return figure;
}

/// Returns figures of a metric with the curves from `begin` to `end`. There are none if no curve has two points. A
/// figure has at most kStyles curves.
std::vector<Plot> figures_of(const Curves& all, std::size_t begin, std::size_t end, std::string_view metric,
                             const Sweep& sweep) {
  std::vector<Plot> figures;
  bool has_curve = false;
  for (std::size_t i = begin; i < end; ++i) {
    if ((i - begin) % kStyles == 0) figures.push_back(empty_figure(metric, sweep));
    Series series =
        series_of(all.curves[i].first, values_of(all.curves[i].second, sweep, metric), axis_of_metric(metric).factor);
    series.style = static_cast<int>((i - begin) % kStyles);
    has_curve = has_curve || series.x.size() > 1;
    if (!series.x.empty()) figures.back().series.push_back(std::move(series));
  }
  std::erase_if(figures, [](const Plot& figure) { return figure.series.empty(); });
  return has_curve ? figures : std::vector<Plot>();
}

/// Returns whether all values of a figure lie within the minimum range of its axis (least_span()), so that the
/// differences are irrelevant.
bool is_flat(const Plot& figure) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Series& series : figure.series) {
    for (const double value : series.y) low = std::min(low, value), high = std::max(high, value);
  }
  return high - low < least_span(figure.y.unit);
}

using ByDisturbance = std::map<Disturbance, std::vector<SeedGroup>>;

ByDisturbance by_disturbance(const std::vector<SeedGroup>& groups, const Sweep& sweep) {
  ByDisturbance result;
  for (const SeedGroup& group : groups) result[disturbance_of(*group.front(), sweep)].push_back(group);
  return result;
}

std::map<std::string, std::vector<SeedGroup>> by_experiment(std::span<const TrialResult> results) {
  std::map<std::string, std::vector<SeedGroup>> experiments;
  for (SeedGroup& group : seed_groups(results)) experiments[text_in(*group.front(), "experiment")].push_back(group);
  return experiments;
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

/// Returns the row of a group in the table of results, with one cell for each metric. `of` combines the values of the
/// group's seeds to one value (mean or worst).
std::vector<std::string> results_row(const SeedGroup& group, const Sweep& sweep, const std::string& seeds,
                                     double (*of)(const SeedGroup& group, std::string_view metric)) {
  const json::object& row = *group.front();
  const std::string disturbance = disturbance_of(row, sweep).text;
  std::vector<std::string> cells{
      text_in(row, "stage") + variant_of(row, sweep) + (disturbance.empty() ? "" : ", ") + disturbance,
      format_significant(sweep.of(row), 3), seeds};
  for (const TrialMetric& metric : trial_metrics()) cells.push_back(format_significant(of(group, metric.name), 3));
  cells.push_back(outcomes_of(group));
  return cells;
}

Table results_table(const std::vector<SeedGroup>& groups, const Sweep& sweep) {
  Table table{"Means over seeds, and the worst",
              {{.header = "Trial", .is_text = true},
               {sweep.axis.quantity, sweep.axis.unit},
               {.header = "Seeds", .is_text = true}},
              {}};
  for (const TrialMetric& metric : trial_metrics()) table.columns.push_back({std::string(metric.name), ""});
  table.columns.push_back({.header = "Outcome", .is_text = true});
  for (const SeedGroup& group : groups) {
    const std::string seeds = std::to_string(group.size());
    table.rows.push_back(results_row(group, sweep, group.size() == 1 ? seeds : "mean of " + seeds, mean_of));
    if (group.size() > 1) table.rows.push_back(results_row(group, sweep, "worst of " + seeds, worst_of));
  }
  return table;
}

/// The comparison of stages on the first page: curves under the least disturbance of the link, and the metrics that are
/// defined for these curves.
struct Headline {
  Sweep sweep;
  std::string disturbance;
  Curves curves;
  std::vector<std::string_view> metrics = {};
  double at = 0;  ///< greatest x with a value of the first metric
  bool is_of_several_experiments = false;
};

Headline headline_of(const std::vector<SeedGroup>& groups, const Sweep& sweep) {
  const ByDisturbance all = by_disturbance(groups, sweep);
  const auto& [disturbance, least] = *all.begin();
  Headline result{sweep, disturbance.text, curves_of(least, sweep)};
  std::set<std::string> experiments;
  for (const SeedGroup& group : least) experiments.insert(text_in(*group.front(), "experiment"));
  result.is_of_several_experiments = experiments.size() > 1;
  for (const std::string_view metric : kHeadline) {
    std::optional<double> greatest;
    for (std::size_t i = 0; i < result.curves.mains; ++i) {
      const auto values = values_of(result.curves.curves[i].second, sweep, metric);
      if (!values.empty()) greatest = std::max(greatest.value_or(values.rbegin()->first), values.rbegin()->first);
    }
    if (!greatest || result.metrics.size() == kFirstPageFigures) continue;
    if (result.metrics.empty()) result.at = *greatest;
    result.metrics.push_back(metric);
  }
  return result;
}

/// Returns the text " (k of n trials)" if only k of the n trials at the compared x (Headline::at) have a value of the
/// metric. Returns an empty text if all of them have one.
std::string share_with_value(const Headline& headline, const std::vector<SeedGroup>& groups, std::size_t with_value) {
  std::size_t all = 0;
  for (const SeedGroup& group : groups) all += headline.sweep.of(*group.front()) == headline.at ? group.size() : 0;
  return with_value == all ? "" : " (" + std::to_string(with_value) + " of " + std::to_string(all) + " trials)";
}

/// Returns the mean and the range of a metric over the trials at the compared x (Headline::at), or a dash if there is
/// no value.
std::string headline_text(const Headline& headline, const std::vector<SeedGroup>& groups, std::string_view metric) {
  const auto values = values_of(groups, headline.sweep, metric);
  const auto found = values.find(headline.at);
  if (found == values.end()) return "–";
  const double factor = axis_of_metric(metric).factor;
  const auto [least, greatest] = std::ranges::minmax(found->second);
  std::string text = format_significant(factor * mean_over(found->second), 3);
  const std::string low = format_significant(factor * least, 3), high = format_significant(factor * greatest, 3);
  if (low != high) text += " (" + low + " to " + high + ")";
  return text + share_with_value(headline, groups, found->second.size());
}

Table headline_table(const Headline& headline) {
  Table table{"At " + headline.sweep.text(headline.at) + ": mean (least to greatest of the " +
                  (headline.is_of_several_experiments ? "trials of all experiments)" : "seeds)"),
              {{.header = "Stage", .is_text = true}},
              {}};
  for (const std::string_view metric : headline.metrics) {
    const PlotAxis axis = axis_of_metric(metric).axis;
    table.columns.push_back({axis.quantity, axis.unit});
  }
  table.columns.push_back({.header = "Outcome", .is_text = true});
  for (std::size_t i = 0; i < headline.curves.mains; ++i) {
    const auto& [name, groups] = headline.curves.curves[i];
    std::vector<std::string> row{name};
    for (const std::string_view metric : headline.metrics) row.push_back(headline_text(headline, groups, metric));
    SeedGroup last;
    for (const SeedGroup& group : groups) {
      if (headline.sweep.of(*group.front()) == headline.at) last.insert(last.end(), group.begin(), group.end());
    }
    row.push_back(outcomes_of(last));
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Returns a sentence that ranks the stages by the first metric. The stage nearest to the metric's ideal value comes
/// first.
std::string ranking(const Headline& headline) {
  if (headline.metrics.empty()) return "No metric that compares stages is defined in these trials.";
  const std::string_view metric = headline.metrics.front();
  const MetricAxis axis = axis_of_metric(metric);
  const double ideal = metric.ends_with("_ratio") ? 1 : 0;
  struct Stage {
    double value;
    std::string name, share;
  };
  std::vector<Stage> stages;
  for (std::size_t i = 0; i < headline.curves.mains; ++i) {
    const auto& [name, groups] = headline.curves.curves[i];
    const auto values = values_of(groups, headline.sweep, metric);
    if (const auto found = values.find(headline.at); found != values.end())
      stages.push_back({mean_over(found->second), name, share_with_value(headline, groups, found->second.size())});
  }
  std::ranges::sort(stages, {}, [ideal](const Stage& stage) { return std::abs(stage.value - ideal); });
  std::string text;
  for (const auto& [value, name, share] : stages) {
    text += (text.empty() ? "" : ", ") + name + " " + format_significant(axis.factor * value, 3) +
            (axis.axis.unit == "1" ? "" : " " + axis.axis.unit) + share;
  }
  return "At " + headline.sweep.text(headline.at) + ", " + axis.axis.quantity + " from best to worst: " + text + ".";
}

void add_first_page(HtmlReport& page, const std::vector<SeedGroup>& groups, const Sweep& sweep,
                    const std::string& of_what) {
  const Headline headline = headline_of(groups, sweep);
  page.question("How closely does each stage reproduce the force at zero delay as the " + sweep.axis.quantity +
                " grows, in " + of_what + (headline.disturbance.empty() ? "" : " (" + headline.disturbance + ")") +
                (sweep.shared.empty() ? "" : ", with " + sweep.shared) + "?");
  page.answer(ranking(headline));
  page.table(headline_table(headline));
  std::vector<Plot> figures;
  for (const std::string_view metric : headline.metrics) {
    for (Plot& figure :
         figures_of(headline.curves, 0, std::min<std::size_t>(headline.curves.mains, kStyles), metric, sweep))
      figures.push_back(std::move(figure));
  }
  page.side_by_side(figures);
}

/// Adds the figures of one experiment under one disturbance of the link. If `has_all` is true, every metric gets a
/// figure, otherwise only the metrics in kHeadline. It is true for the least disturbance.
void add_figures(HtmlReport& page, const std::vector<SeedGroup>& groups, const Sweep& sweep, bool has_all) {
  const Curves curves = curves_of(groups, sweep);
  std::vector<Plot> figures;
  std::string flat;
  for (const TrialMetric& metric : trial_metrics()) {
    if (!has_all && std::ranges::find(kHeadline, metric.name) == kHeadline.end()) continue;
    for (Plot& figure : figures_of(curves, 0, curves.curves.size(), metric.name, sweep)) {
      if (!is_flat(figure)) {
        figures.push_back(std::move(figure));
      } else if (!flat.ends_with(metric.name)) {
        flat += (flat.empty() ? "" : ", ") + std::string(metric.name);
      }
    }
  }
  page.side_by_side(figures);
  if (!flat.empty())
    page.paragraph("Not drawn, because the curves differ by less than the smallest range of interest: " + flat + ".");
}

void add_experiment(HtmlReport& page, const std::string& experiment, const std::vector<SeedGroup>& groups,
                    const Sweep& sweep) {
  page.heading(experiment);
  bool is_first = true;
  for (const auto& [disturbance, members] : by_disturbance(groups, sweep)) {
    page.paragraph("Link: " + (disturbance.text.empty() ? "delay alone" : disturbance.text) + ".");
    add_figures(page, members, sweep, is_first);
    is_first = false;
  }
  page.table(results_table(groups, sweep));
}

}  // namespace

MetricAxis axis_of_metric(std::string_view metric) {
  struct Suffix {
    std::string_view suffix, unit;
    double factor;
  };
  constexpr std::array kSuffixes{Suffix{"_n_m_per_ms", "mN·m/ms", 1e3},
                                 Suffix{"_n_per_ms", "N/ms", 1},
                                 Suffix{"_rad_per_s", "rad/s", 1},
                                 Suffix{"_m_per_s", "mm/s", 1e3},
                                 Suffix{"bytes_per_s", "kB/s", 1e-3},
                                 Suffix{"_per_s", "1/s", 1},
                                 Suffix{"_n_m", "mN·m", 1e3},
                                 Suffix{"_ms", "ms", 1},
                                 Suffix{"_kg", "kg", 1},
                                 Suffix{"_j", "mJ", 1e3},
                                 Suffix{"_m", "mm", 1e3},
                                 Suffix{"_n", "N", 1},
                                 Suffix{"_fraction", "%", 100},
                                 Suffix{"_of_peak", "%", 100}};
  MetricAxis result{{std::string(metric)}};
  for (const Suffix& each : kSuffixes) {
    if (!metric.ends_with(each.suffix)) continue;
    const bool is_word = each.unit == "%" || each.suffix.front() != '_';
    if (!is_word) result.axis.quantity.resize(metric.size() - each.suffix.size());
    result.axis.unit = each.unit;
    result.factor = each.factor;
    break;
  }
  std::ranges::replace(result.axis.quantity, '_', ' ');
  if (result.axis.unit == "kB/s") result.axis.quantity = "data rate";
  return result;
}

std::string curve_of(const json::object& row) {
  const Sweep over_delay{"rtt_ms", {"round trip", "ms"}};
  const std::string link = link_text(row, over_delay);
  return text_in(row, "stage") + variant_of(row, over_delay) + (link.empty() ? "" : ", ") + link;
}

void add_study(HtmlReport& page, std::span<const TrialResult> results) {
  const Sweep sweep = sweep_of(results);
  page.paragraph(
      "Simulated hands repeat the same movements over simulated links. Each trial is compared with the reference: the "
      "same hands at zero delay on the server's own touch. A stage without another predictor or setting has that of a "
      "client by default.");
  for (const auto& [experiment, groups] : by_experiment(results)) add_experiment(page, experiment, groups, sweep);
  page.heading("Definitions");
  page.table(definitions_table());
  page.footer(
      "SI units unless a label says otherwise. The numbers of single trials are in results.json, results.csv and "
      "results.h5.");
}

HtmlReport study_report(std::span<const TrialResult> results) {
  HtmlReport page("Latency bridged, stage by stage",
                  std::to_string(results.size()) + (results.size() == 1 ? " trial" : " trials") + " in virtual time");
  const auto experiments = by_experiment(results);
  std::string names;
  for (const auto& [name, groups] : experiments) names += (names.empty() ? "" : ", ") + name;
  add_first_page(page, seed_groups(results), sweep_of(results),
                 (experiments.size() == 1 ? "the experiment " : "the means over the experiments ") + names);
  page.appendix();
  page.heading("Method");
  add_study(page, results);
  return page;
}

}  // namespace tandem::lab
