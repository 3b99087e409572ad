#include "lab/studies/prediction/reproduce_prediction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/haptics/prediction/ar_model.hpp"
#include "common/haptics/prediction/force_stream.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/prediction/ar_of_series.hpp"
#include "lab/studies/prediction/force_series.hpp"
#include "lab/studies/prediction/prediction_trial.hpp"

namespace tandem::lab {
namespace {

constexpr std::array kMethods{"hold", "linear", "ar", "ar-spline", "literal"};
constexpr std::string_view kDefault = "ar-spline";
constexpr std::array kWindows{50, 75, 100, 150, 200, 250, 300, 400, 500, 600};
constexpr std::array kBlends_ms{0, 2, 3, 4, 5};
constexpr std::size_t kMaxOrder = 16;
/// Minimum gains that the claims require. kMinGain_percent is the reduction of the error compared with linear
/// extrapolation; the thesis reports this value. kMinOnlineGain_percent is the further reduction by fitting the
/// coefficients online; it is smaller than the value of the thesis.
constexpr double kMinGain_percent = 6.8;
constexpr double kMinOnlineGain_percent = 11;
constexpr double kFitBudget_us = 200;
constexpr double kChatter_kg = 0.1;
/// Mass of a lighter peg. This peg bounces, so the noise of its force is ten times as large.
constexpr double kLightChatter_kg = 0.02;

/// Returns the interval at which samples are sent. An uneven series is sent at the times of its samples, an even one
/// every 5 ms.
Duration sample_period_of(const ForceSeries& series) {
  return series.name == "chatter" ? Duration(0) : std::chrono::milliseconds(5);
}

PredictionErrors errors_of(const ForceSeries& series, const haptics::ForceStreamSettings& settings) {
  haptics::ForceStream stream(settings);
  return predict_series(series, stream, sample_period_of(series));
}

struct Comparison {
  std::string series;
  std::string what;
  double noise_n = 0;
  std::array<PredictionErrors, kMethods.size()> errors;  ///< errors of the methods, in the order of kMethods

  const PredictionErrors& errors_by(std::string_view method) const {
    return errors[static_cast<std::size_t>(std::ranges::find(kMethods, method) - kMethods.begin())];
  }
  double least_mean() const { return std::min(errors_by("hold").force.mean, errors_by("linear").force.mean); }
  double least_variance() const {
    return std::min(errors_by("hold").force.variance, errors_by("linear").force.variance);
  }
};

Comparison compared(const ForceSeries& series) {
  Comparison result{series.name, series.what, noise_n(series), {}};
  for (std::size_t i = 0; i < kMethods.size(); ++i) {
    result.errors[i] = errors_of(series, haptics::force_stream_settings(kMethods[i]));
  }
  return result;
}

double percent_below(double value, double reference) {
  return 100 * (1 - value / reference);
}

std::string listed_errors(const Comparison& comparison) {
  std::string text;
  for (std::size_t i = 0; i < kMethods.size(); ++i) {
    const ErrorFigures& force = comparison.errors[i].force;
    text += (i == 0 ? "" : "; ") + std::string(kMethods[i]) + " " + format_significant(1e3 * force.mean, 3) + " mN, " +
            format_significant(1e6 * force.variance, 3) + " mN²";
  }
  return text;
}

boost::json::object to_json(const ErrorFigures& figures) {
  return {{"mean", figures.mean}, {"variance", figures.variance}, {"rms", figures.rms}, {"largest", figures.largest}};
}

boost::json::object to_json(const Comparison& comparison) {
  boost::json::object methods;
  for (std::size_t i = 0; i < kMethods.size(); ++i) {
    const PredictionErrors& errors = comparison.errors[i];
    methods[kMethods[i]] = {{"force_n", to_json(errors.force)},
                            {"torque_n_m", to_json(errors.torque)},
                            {"step_max_n_per_ms", errors.step_max_n},
                            {"fits", errors.stream.fits},
                            {"resets", errors.stream.resets}};
  }
  return {{"series", comparison.series},
          {"what", comparison.what},
          {"noise_n", comparison.noise_n},
          {"methods", std::move(methods)}};
}

/// Adds the claims that the default predictor is not worse than the predictors "hold" and "linear". If "hold" or
/// "linear" has no error in a series, the default predictor must have none either.
void add_shipped(Reproduction& result, const Comparison& comparison) {
  const PredictionErrors& ours = comparison.errors_by(kDefault);
  result.claims.push_back({comparison.series,
                           "mean error of " + std::string(kDefault) + ", of the lesser of hold's and linear's",
                           100 * ours.force.mean / comparison.least_mean(), Relation::kAtMost, 100, "%", 2});
  result.claims.push_back({comparison.series, "variance of its error, alike",
                           100 * ours.force.variance / comparison.least_variance(), Relation::kAtMost, 100, "%", 2});
  result.rows.push_back({comparison.series + ": mean error, variance", "", listed_errors(comparison)});
}

void add_chatter(Reproduction& result, const Comparison& comparison) {
  const std::string noise = "noise " + format_significant(comparison.noise_n, 3) + " N";
  const double gain =
      percent_below(comparison.errors_by(kDefault).force.mean, comparison.errors_by("linear").force.mean);
  result.claims.push_back(
      {"chatter, " + noise, "mean error below linear's", gain, Relation::kAtLeast, kMinGain_percent, "%", 1});
  result.claims.push_back(
      {"chatter, " + noise, "variance of the error, of linear's",
       100 * comparison.errors_by(kDefault).force.variance / comparison.errors_by("linear").force.variance,
       Relation::kAtMost, 100, "%", 1});
  result.rows.push_back({"AR and spline below linear on chattering contact", "6.77 %, lower variance",
                         format_significant(gain, 3) + " % with " + noise});
  result.rows.push_back({"chatter: mean error, variance", "linear 31 mN", listed_errors(comparison)});
  const double literal =
      percent_below(comparison.errors_by("literal").force.mean, comparison.errors_by("linear").force.mean);
  result.rows.push_back({"the thesis's own (Yule–Walker, late spline) below linear, here", "6.77 %",
                         format_significant(literal, 3) + " %"});
}

/// Returns the settings of the pure AR model, as in the thesis. The default predictor has two additions, which are off
/// here: a smaller weight of an uncertain model, and a reset at contact changes.
haptics::ForceStreamSettings model_alone() {
  haptics::ForceStreamSettings settings = haptics::force_stream_settings(kDefault);
  settings.shrinks = false;
  settings.resets_at_contact = false;
  return settings;
}

boost::json::object add_online(Reproduction& result, const ForceSeries& chatter, const std::vector<ForceSeries>& others,
                               const ForceSeries& other_chatter) {
  haptics::ForceStreamSettings settings = model_alone();
  const double online = errors_of(chatter, settings).force.rms;
  settings.updates_online = false;
  boost::json::object details{{"online_rms_n", online}};
  double least = 100;
  std::string listed;
  const auto gain_over = [&](const ForceSeries& other, const std::string& name) {
    haptics::ForceStream stream(settings);
    stream.adopt(models_of(other, settings));
    const double fixed = predict_series(chatter, stream, sample_period_of(chatter)).force.rms;
    details["fixed_of_" + name + "_rms_n"] = fixed;
    return percent_below(online, fixed);
  };
  for (const ForceSeries& other : others) {
    const double gain = gain_over(other, other.name);
    listed += (listed.empty() ? "" : ", ") + other.name + " " + format_significant(gain, 3) + " %";
    least = std::min(least, gain);
  }
  result.claims.push_back({"chatter",
                           "RMS error with online coefficients below fixed ones of any of the shipped contacts", least,
                           Relation::kAtLeast, kMinOnlineGain_percent, "%", 1});
  result.rows.push_back(
      {"online coefficients below fixed ones fitted on another contact", "12.36 %; 11.3 % with spline", listed});
  result.rows.push_back({"the same, fitted on chattering contact of another mass", "",
                         format_significant(gain_over(other_chatter, "light_chatter"), 3) + " %"});
  return details;
}

Plot window_figure(const ForceSeries& chatter, boost::json::object& details) {
  Plot figure;
  figure.caption =
      "RMS error on chattering contact against the window N of a fit. Model alone: no fall-back, no reset.";
  figure.description = figure.caption;
  figure.x = {.quantity = "window", .unit = "samples"};
  figure.y = {.quantity = "RMS error", .unit = "N", .low = 0};
  const std::array<std::pair<std::string, haptics::ForceStreamSettings>, 3> kinds{
      {{"model alone", model_alone()},
       {"default", haptics::force_stream_settings(kDefault)},
       {"literal", haptics::force_stream_settings("literal")}}};
  int color = 0;
  for (const auto& [name, kind] : kinds) {
    Series series{name, {}, {}, color++};
    for (const int window : kWindows) {
      haptics::ForceStreamSettings settings = kind;
      settings.window = static_cast<std::size_t>(window);
      series.x.push_back(window);
      series.y.push_back(errors_of(chatter, settings).force.rms);
    }
    details[name] = boost::json::value_from(series.y);
    figure.series.push_back(std::move(series));
  }
  details["windows"] = boost::json::value_from(std::vector<int>(kWindows.begin(), kWindows.end()));
  return figure;
}

Plot order_figure(const std::vector<const ForceSeries*>& all, Reproduction& result, boost::json::object& details) {
  Plot figure;
  figure.caption =
      "Akaike's final prediction error against the order, least squares on differences of the force axis that varies "
      "most, relative to order 0.";
  figure.description = figure.caption;
  figure.x.quantity = "order p";
  figure.y = {.quantity = "FPE(p) / FPE(0)", .is_log = true};
  int color = 0;
  std::string listed;
  for (const ForceSeries* series : all) {
    const auto axes = even_axes(*series, haptics::ForceStreamSettings{}.series_rate_hz);
    std::vector<haptics::ArOrder> best;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto orders = haptics::fpe_of_orders(differences(axes[axis]), kMaxOrder, haptics::ArFit::kLeastSquares, false);
      if (!orders.empty() && (best.empty() || orders[0].error_variance > best[0].error_variance)) best = orders;
    }
    if (best.empty()) continue;
    Series line{series->name, {}, {}, color++};
    boost::json::array fpe;
    for (const haptics::ArOrder& row : best) {
      line.x.push_back(static_cast<double>(row.order));
      line.y.push_back(row.fpe / best[0].fpe);
      fpe.emplace_back(row.fpe);
    }
    listed += (listed.empty() ? "" : ", ") + series->name + " " + std::to_string(haptics::best_order(best));
    details[series->name] = std::move(fpe);
    figure.series.push_back(std::move(line));
  }
  result.rows.push_back({"order of the least FPE", "5", listed});
  return figure;
}

/// Adds rows for several blending times. A longer blend gives a smoother curve but displays corrections later.
void add_blends(Reproduction& result, const ForceSeries& smooth, const ForceSeries& chatter,
                boost::json::object& details) {
  for (const ForceSeries* series : {&smooth, &chatter}) {
    const double reference = errors_of(*series, haptics::force_stream_settings("linear")).force.mean;
    std::string listed;
    boost::json::array rows;
    for (const int blend_ms : kBlends_ms) {
      haptics::ForceStreamSettings settings = haptics::force_stream_settings(kDefault);
      settings.blend = std::chrono::milliseconds(blend_ms);
      const PredictionErrors errors = errors_of(*series, settings);
      listed += (listed.empty() ? "" : "; ") + std::to_string(blend_ms) + " ms " +
                format_significant(100 * errors.force.mean / reference, 3) + " %, " +
                format_significant(errors.step_max_n, 3) + " N";
      rows.push_back({{"blend_ms", blend_ms}, {"mean_n", errors.force.mean}, {"step_max_n_per_ms", errors.step_max_n}});
    }
    result.rows.push_back(
        {series->name + ": corrections blended in over …: mean error of linear's, largest step in a ms", "", listed});
    details[series->name] = std::move(rows);
  }
}

/// Median and p99 of the time for a fit of six axes.
struct FitCost {
  double median_us = 0;
  double p99_us = 0;
};
FitCost measured_fit(const ForceSeries& series, const Clock& clock) {
  haptics::ForceStream stream;
  std::vector<double> times_us;
  Duration sent{-1};
  for (const ForceSample& sample : series.samples) {
    if (sent >= Duration(0) && sample.at < sent + std::chrono::milliseconds(5)) continue;
    sent = sample.at;
    stream.push(LocalTime(sample.at), sample.on_hand_W);
    if (!stream.fit_pending()) continue;
    const LocalTime begin = clock.now();
    stream.fit();
    times_us.push_back(1e6 * to_seconds(clock.now() - begin));
  }
  std::ranges::sort(times_us);
  if (times_us.empty()) return {};
  return {times_us[times_us.size() / 2], times_us[times_us.size() * 99 / 100]};
}

void add_fit_cost(Reproduction& result, const ForceSeries& series, const Clock& clock, boost::json::object& details) {
  const FitCost cost = measured_fit(series, clock);
  result.claims.push_back({"a fit of six axes", "median time on this machine, one core", cost.median_us,
                           Relation::kAtMost, kFitBudget_us, "µs", 1});
  result.rows.push_back({"time of a fit, p 5, N 300, six axes", "",
                         format_significant(cost.median_us, 3) + " µs, p99 " + format_significant(cost.p99_us, 3) +
                             " µs, off the 1 kHz path"});
  details["fit_us"] = {{"median", cost.median_us}, {"p99", cost.p99_us}};
}

/// Returns a plot of half a second around the largest error of the predictor "hold".
Plot trace_figure(const ForceSeries& series) {
  constexpr std::size_t kTicks = 250;
  Plot figure;
  std::size_t from = 0;
  int axis = 0;
  int color = 0;
  for (const char* method : {"hold", "linear", "ar-spline", "literal"}) {
    haptics::ForceStream stream(haptics::force_stream_settings(method));
    const PredictionErrors errors = predict_series(series, stream, sample_period_of(series));
    const std::vector<Vec3>& is = errors.true_n;
    if (figure.series.empty()) {
      std::size_t worst = 0;
      for (std::size_t i = 0; i < is.size(); ++i) {
        if ((errors.shown_n[i] - is[i]).norm() > (errors.shown_n[worst] - is[worst]).norm()) worst = i;
      }
      (errors.shown_n[worst] - is[worst]).cwiseAbs().maxCoeff(&axis);
      from = worst > kTicks / 2 ? worst - kTicks / 2 : 0;
    }
    const std::size_t to = std::min(from + kTicks, is.size());
    const auto line = [&](const std::string& name, const std::vector<Vec3>& forces) {
      Series one{name, {}, {}, color++};
      for (std::size_t i = from; i < to; ++i) {
        one.x.push_back(static_cast<double>(i - from));
        one.y.push_back(forces[i][axis]);
      }
      figure.series.push_back(std::move(one));
    };
    if (figure.series.empty()) line("true", is);
    line(method, errors.shown_n);
  }
  figure.caption = series.what + ": a quarter of a second around the largest error of hold, the axis that has it.";
  figure.description = figure.caption;
  figure.x = {.quantity = "time", .unit = "ms"};
  figure.y = {.quantity = "force on the hand", .unit = "N"};
  return figure;
}

boost::json::object settings_json() {
  const haptics::ForceStreamSettings s = haptics::force_stream_settings(kDefault);
  return {{"series_rate_hz", s.series_rate_hz},
          {"order", s.order},
          {"window", s.window},
          {"fit_period", s.fit_period},
          {"fit", haptics::name_of(s.ar_fit)},
          {"on_differences", s.is_on_differences},
          {"error_memory", s.error_memory},
          {"sharpness", s.sharpness},
          {"jump_factor", s.jump_factor},
          {"range_factor", s.range_factor},
          {"blend_ms", 1e3 * to_seconds(s.blend)},
          {"chatter_mass_kg", kChatter_kg},
          {"light_chatter_mass_kg", kLightChatter_kg}};
}

}  // namespace

Reproduction reproduce_prediction(const Clock& clock) {
  Reproduction result;
  result.title = "Prediction of a force from 200 to 1000 Hz";
  result.summary =
      "Each series is made here by the simulation that also runs elsewhere, at 1 kHz; every fifth sample is sent, "
      "without delay, and the value of each prediction at each millisecond is compared with the truth. Error: length "
      "of the force's difference; variance: of the difference about its mean. Chatter is the peg and the box in stock "
      "Bullet (GImpact) with a step of 2 to 10 ms that follows the number of contacts; between its steps the truth is "
      "the straight line. The thesis's own force was of its own peg, hand and machine, and is not published.";
  const std::vector<ForceSeries> shipped = shipped_series();
  const ForceSeries chatter = chatter_series(kChatter_kg);
  boost::json::object details{{"settings", settings_json()}};
  boost::json::array comparisons;
  for (const ForceSeries& series : shipped) {
    const Comparison comparison = compared(series);
    add_shipped(result, comparison);
    comparisons.push_back(to_json(comparison));
  }
  const ForceSeries light = chatter_series(kLightChatter_kg);
  for (const ForceSeries* series : {&chatter, &light}) {
    const Comparison comparison = compared(*series);
    add_chatter(result, comparison);
    comparisons.push_back(to_json(comparison));
  }
  details["series"] = std::move(comparisons);
  details["online"] = add_online(result, chatter, shipped, light);
  boost::json::object windows, orders, blends;
  result.figures.push_back(trace_figure(chatter));
  result.figures.push_back(trace_figure(shipped.front()));
  result.figures.push_back(window_figure(chatter, windows));
  std::vector<const ForceSeries*> all{&chatter};
  for (const ForceSeries& series : shipped) all.push_back(&series);
  result.figures.push_back(order_figure(all, result, orders));
  add_blends(result, shipped.front(), chatter, blends);
  add_fit_cost(result, chatter, clock, details);
  details["windows_rms_n"] = std::move(windows);
  details["fpe"] = std::move(orders);
  details["blends"] = std::move(blends);
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
