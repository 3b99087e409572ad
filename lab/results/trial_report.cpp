#include "lab/results/trial_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/metrics/metrics.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr double kMilli = 1e3;
constexpr int kHalfHeight_px = 260;

/// Returns a series over one user's ticks. `value_of` returns the value of a tick; NaN if it is unknown.
template <class Of>
Series series_of(const UserTrace& user, std::string label, int style, const Of& value_of) {
  Series series;
  series.label = std::move(label);
  series.style = style;
  series.x.reserve(user.ticks.size());
  series.y.reserve(user.ticks.size());
  for (const TickSample& tick : user.ticks) {
    series.x.push_back(to_seconds(tick.time));
    series.y.push_back(value_of(tick));
  }
  return series;
}

/// Returns the phases of the first user's hand. All hands of an experiment run their phases at the same time.
std::vector<Band> phase_bands(const SessionTrace& trace) {
  std::vector<Band> bands;
  const UserTrace& user = trace.users.front();
  int phase = -1;
  for (const TickSample& tick : user.ticks) {
    const double now_s = to_seconds(tick.time);
    if (!bands.empty() && phase >= 0) bands.back().end = now_s;
    if (tick.phase == phase) continue;
    phase = tick.phase;
    if (phase >= 0) bands.push_back({now_s, now_s, user.user.hand.phases()[static_cast<std::size_t>(phase)]});
  }
  return bands;
}

class Figures {
 public:
  Figures(const Experiment& experiment, const SessionTrace& trace, ComparedTrace other)
      : trace_(trace), other_(std::move(other)), bands_(phase_bands(trace)), end_s_(to_seconds(experiment.duration)) {}

  Plot force() const {
    Plot plot = wide("Displayed force of each user over time", {"force on the hand", "N"});
    plot.y.low = 0;
    const auto force_n = [](const TickSample& tick) { return tick.displayed_D.f.norm(); };
    add_each_user(plot, force_n);
    add_other(plot, force_n);
    std::map<double, std::string> devices;  // names of the devices by limit; devices with equal limits share a line
    for (const UserTrace& user : trace_.users) devices[user.user.device.spec.force_limit_n] = user.user.device.name;
    for (const auto& [limit_n, name] : devices) plot.limits.push_back({limit_n, "limit of " + name});
    plot.caption =
        "Magnitude of the force that each device was given, after every safety stage. Shaded: the phases of the first "
        "user's hand path.";
    return plot;
  }

  Plot torque() const {
    Plot plot = half("Displayed torque of each user over time", {"torque on the hand", "mN·m"});
    plot.y.low = 0;
    add_each_user(plot, [](const TickSample& tick) { return kMilli * tick.displayed_D.t.norm(); });
    plot.caption = "Magnitude of the torque that each device was given.";
    return plot;
  }

  Plot deviation() const {
    Plot plot = half("Distance of each hand from its intended trajectory", {"deviation of the hand", "mm"});
    plot.y.low = 0;
    add_each_user(plot, [](const TickSample& tick) { return kMilli * (tick.hand_D.p - tick.intended_D).norm(); });
    plot.caption = "How far the force moved each hand from its intended path.";
    return plot;
  }

  Plot stretch() const {
    Plot plot = half("Distance between handle and tool of each user", {"handle to tool", "mm"});
    plot.y.low = 0;
    add_each_user(plot, [](const TickSample& tick) {
      const bool is_known = tick.state_age >= Duration{0};
      return is_known ? kMilli * (tick.handle_W.X.p - tick.tool_W.p).norm() : std::numeric_limits<double>::quiet_NaN();
    });
    plot.caption =
        "Between the handle now and the server's newest tool pose: the coupling's stretch and the "
        "delay together.";
    return plot;
  }

  Plot bodies() const {
    Plot plot = half("Displacement of the bodies", {"displacement", "mm"});
    plot.y.low = 0;
    int style = 2;
    for (std::size_t i = 0; i < trace_.body_names.size(); ++i) {
      if (!trace_.body_can_move[i]) continue;
      Series series{trace_.body_names[i], {}, {}, style++};
      for (const BodiesSample& sample : trace_.bodies) {
        series.x.push_back(to_seconds(sample.time));
        series.y.push_back(kMilli * (sample.X_WB[i].p - trace_.bodies.front().X_WB[i].p).norm());
      }
      plot.series.push_back(std::move(series));
    }
    plot.caption = "The moving bodies from where they were when the hands started; true poses, at the server.";
    return plot;
  }

  Plot field() const {
    Plot plot = half("Energy of the molecular field", {"Lennard-Jones energy", "kJ/mol"});
    Series series{"", {}, {}, 3};
    for (const BodiesSample& sample : trace_.bodies) {
      series.x.push_back(to_seconds(sample.time));
      series.y.push_back(sample.field_energy_kj_per_mol);
    }
    plot.series.push_back(std::move(series));
    plot.caption = "Of the whole scene, at the server.";
    return plot;
  }

  Plot round_trip() const {
    Plot plot = half("Round trip as each client measures it", {"round trip", "ms"});
    plot.y.low = 0;
    add_each_user(plot, [](const TickSample& tick) { return kMilli * to_seconds(tick.round_trip); });
    plot.caption = "As each client measures it from four time stamps.";
    return plot;
  }

 private:
  Plot wide(const std::string& what, const PlotAxis& y) const {
    Plot plot;
    plot.description = what;
    plot.x = {.quantity = "time", .unit = "s", .low = 0, .high = end_s_};
    plot.y = y;
    plot.bands = bands_;
    return plot;
  }
  Plot half(const std::string& what, const PlotAxis& y) const {
    Plot plot = wide(what, y);
    plot.width_px = kHalfWidth_px;
    plot.height_px = kHalfHeight_px;
    return plot;
  }
  template <class Of>
  void add_each_user(Plot& plot, const Of& value_of) const {
    int style = 0;
    for (const UserTrace& user : trace_.users)
      plot.series.push_back(series_of(user, user.user.name, style++, value_of));
  }
  template <class Of>
  void add_other(Plot& plot, const Of& value_of) const {
    if (other_.trace == nullptr) return;
    int style = static_cast<int>(trace_.users.size());
    for (const UserTrace& user : other_.trace->users)
      plot.series.push_back(series_of(user, user.user.name + ", " + other_.name, style++, value_of));
  }

  const SessionTrace& trace_;
  ComparedTrace other_;
  std::vector<Band> bands_;
  double end_s_;
};

Table metrics_table(const SessionTrace& trace) {
  Table table{"Metrics", {{.header = "Metric", .is_text = true}}, {}};
  for (const UserTrace& user : trace.users) table.columns.push_back({user.user.name, ""});
  table.columns.push_back({.header = "Meaning", .is_text = true});
  for (const UserMetric& metric : user_metrics()) {
    std::vector<std::string> row{std::string(metric.name)};
    for (const UserTrace& user : trace.users) row.push_back(format_significant(metric.value_of(user), 4));
    row.emplace_back(metric.meaning);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string link_words(const net::LinkParameters& link) {
  return format_significant(kMilli * to_seconds(link.delay), 4) + " ± " +
         format_significant(kMilli * to_seconds(link.jitter), 4) + " ms, " + format_significant(100 * link.loss, 3) +
         " % lost";
}

Table users_table(const SessionTrace& trace) {
  Table table{"Users",
              {{.header = "User", .is_text = true},
               {.header = "Hand", .is_text = true},
               {.header = "Stage", .is_text = true},
               {.header = "To the server", .is_text = true},
               {.header = "From the server", .is_text = true},
               {.header = "Outcome", .is_text = true}},
              {}};
  for (const UserTrace& user : trace.users) {
    table.rows.push_back({user.user.name, user.user.hand_name, user.user.pipeline.stage, link_words(user.user.up),
                          link_words(user.user.down),
                          user.stayed_connected ? "completed" : "lost: " + user.why_disconnected});
  }
  return table;
}

/// Returns a sentence for each user: the displayed force, and the error against the reference.
std::string answer_of(const Experiment& experiment, const SessionTrace& trace, const SessionTrace* reference) {
  std::string text;
  for (const UserTrace& user : trace.users) {
    text += user.user.name + " (" + user.user.pipeline.stage + ", round trip " +
            format_significant(user_metric(user, "round_trip_mean_ms"), 3) + " ms) feels up to " +
            format_significant(user_metric(user, "force_max_n"), 3) + " N. ";
  }
  if (reference == nullptr) return text + "There is no trial at zero delay to compare with.";
  const double error = trial_metric({experiment, trace, reference}, "path_error_of_peak");
  if (!std::isfinite(error)) return text + "At zero delay hardly any force is felt.";
  return text + "The error against the same hands at zero delay is " + format_significant(100 * error, 3) +
         " % of the greatest force there (RMS over the whole path).";
}

}  // namespace

std::vector<Plot> trial_figures(const Experiment& experiment, const SessionTrace& trace, const ComparedTrace& other) {
  const Figures figures(experiment, trace, other);
  std::vector<Plot> all{figures.force(),   figures.deviation(), figures.bodies(),
                        figures.stretch(), figures.torque(),    figures.round_trip()};
  if (!trace.field_kernel.empty()) all.push_back(figures.field());
  std::erase_if(all, [](const Plot& figure) { return figure.series.empty(); });
  return all;
}

void add_trial_tables(HtmlReport& page, const SessionTrace& trace) {
  page.table(users_table(trace));
  page.table(metrics_table(trace));
  page.footer(
      "SI units unless a label says otherwise; W is the world frame of the scene. Every figure keeps the extremes of "
      "each pixel column, so no peak is lost in drawing.");
}

HtmlReport trial_report(const Experiment& experiment, const SessionTrace& trace, const SessionTrace* reference) {
  HtmlReport page(experiment.name, "Scene " + experiment.scene.stem().string() + ", seed " +
                                       std::to_string(experiment.seed) + ", virtual time");
  page.question("What do the hands feel? " + experiment.description);
  page.answer(answer_of(experiment, trace, reference));
  const std::vector<Plot> figures = trial_figures(experiment, trace, {reference, "at zero delay"});
  const std::size_t first = std::min<std::size_t>(3, figures.size());
  page.figure(figures.front());
  page.side_by_side(std::span(figures).subspan(1, first - 1));
  page.appendix();
  page.side_by_side(std::span(figures).subspan(first));
  add_trial_tables(page, trace);
  return page;
}

}  // namespace tandem::lab
