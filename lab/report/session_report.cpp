#include "lab/report/session_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr double kMilli = 1e3;
constexpr double kPercent = 100;
constexpr std::size_t kFirstPageFigures = 3;
constexpr int kHalfHeight_px = 260;
constexpr std::string_view kAxisNames = "xyz";

std::string user_list(const Session& session) {
  std::string list;
  for (const ClientRun& user : session.users) list += (list.empty() ? "" : ", ") + user.name;
  return list;
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

/// Subtracts the first finite value from all values.
std::vector<double> since_first(std::vector<double> values) {
  const auto first = std::find_if(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  const double origin = first == values.end() ? 0 : *first;
  for (double& value : values) value -= origin;
  return values;
}

double extent(const std::vector<double>& values) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return high > low ? high - low : 0;
}

/// Returns the axis of W along which the hands move most.
std::size_t main_axis(const Session& session) {
  std::array<double, 3> moved{};
  for (const ClientRun& user : session.users) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      moved[axis] = std::max(moved[axis], extent(user.trace.hand_m[axis]));
    }
  }
  return static_cast<std::size_t>(std::max_element(moved.begin(), moved.end()) - moved.begin());
}

double end_s(const Session& session) {
  double end = 0;
  for (const ClientRun& user : session.users) end = std::max(end, user.trace.time_s.back());
  return end;
}

Plot base_plot(const Session& session, const std::string& what, const PlotAxis& y) {
  Plot plot;
  plot.description = what + " over time, session " + session.name + ", users " + user_list(session);
  plot.x = {.quantity = "time", .unit = "s", .low = 0, .high = end_s(session)};
  plot.y = y;
  plot.bands = session.users.front().trace.phases;  // all hands run their phases at the same time
  return plot;
}

Plot half_plot(const Session& session, const std::string& what, const PlotAxis& y) {
  Plot plot = base_plot(session, what, y);
  plot.width_px = kHalfWidth_px;
  plot.height_px = kHalfHeight_px;
  return plot;
}

void add_per_user(Plot& plot, const Session& session, std::vector<double> Trace::*values, double factor) {
  int color = 0;
  for (const ClientRun& user : session.users) {
    plot.series.push_back({user.name, user.trace.time_s, scaled(user.trace.*values, factor), color++});
  }
}

/// Returns the largest finite value over all users, or 0 if there is none.
double largest(const Session& session, std::vector<double> Trace::*values) {
  double result = 0;
  for (const ClientRun& user : session.users) {
    for (const double value : user.trace.*values) {
      if (std::isfinite(value)) result = std::max(result, value);
    }
  }
  return result;
}

/// Adds the force or torque limits of the devices as lines. A limit that is much higher than all curves is not drawn,
/// because the curves would become unreadable. Returns a text for the caption that states such limits; empty if all
/// limits are drawn.
std::string add_limits(Plot& plot, const Session& session, double ClientRun::*limit, std::vector<double> Trace::*values,
                       double factor, const std::string& unit) {
  constexpr double kReadable = 5;
  const double largest_shown = largest(session, values) * factor;
  std::vector<double> seen;
  std::string words;
  for (const ClientRun& user : session.users) {
    const double value = user.*limit * factor;
    if (std::find(seen.begin(), seen.end(), value) != seen.end()) continue;
    seen.push_back(value);
    const std::string text = "device limit " + format_significant(value, 3) + " " + unit;
    if (value <= kReadable * largest_shown) {
      plot.limits.push_back({value, text});
    } else {
      words += " The " + text + " lies above the figure.";
    }
  }
  return words;
}

Plot force_figure(const Session& session) {
  Plot plot = base_plot(session, "Displayed force", {"force on the hand", "N"});
  plot.y.low = 0;
  add_per_user(plot, session, &Trace::force_n, 1);
  const std::string limit_words = add_limits(plot, session, &ClientRun::force_limit_n, &Trace::force_n, 1, "N");
  plot.caption =
      "Magnitude of the force that each device was given, after every safety stage. Shaded: the phases of the "
      "hands' path." +
      limit_words;
  return plot;
}

Plot torque_figure(const Session& session) {
  Plot plot = half_plot(session, "Displayed torque", {"torque on the hand", "mN·m"});
  plot.y.low = 0;
  add_per_user(plot, session, &Trace::torque_n_m, kMilli);
  const std::string limit_words =
      add_limits(plot, session, &ClientRun::torque_limit_n_m, &Trace::torque_n_m, kMilli, "mN·m");
  plot.caption = "Magnitude of the torque that each device was given." + limit_words;
  return plot;
}

Plot motion_figure(const Session& session) {
  const std::size_t axis = main_axis(session);
  const std::string name(1, kAxisNames[axis]);
  Plot plot = half_plot(session, "Hand and tool along " + name, {"position along " + name, "mm"});
  int style = 0;
  for (const ClientRun& user : session.users) {
    const Trace& trace = user.trace;
    const std::string& user_name = user.name;
    plot.series.push_back({user_name + ", hand", trace.time_s, scaled(trace.hand_m[axis], kMilli), style++});
    plot.series.push_back({user_name + ", tool", trace.time_s, scaled(trace.tool_m[axis], kMilli), style++});
  }
  plot.caption =
      "Hand (as the client sent it) and tool (as the server answered) along the axis of the "
      "largest motion. Their distance is the coupling's stretch and the delay.";
  return plot;
}

Plot body_figure(const Session& session) {
  const ClientRun& user = session.users.front();
  Plot plot = half_plot(session, "Displacement of the shared body", {"displacement", "mm"});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    plot.series.push_back({std::string(1, kAxisNames[axis]), user.trace.time_s,
                           scaled(since_first(user.trace.body_m[axis]), kMilli), static_cast<int>(axis) + 2});
  }
  plot.caption = "The shared body (" + user.watched_body + ") from where " + user.name + " first saw it.";
  return plot;
}

/// Returns the largest value in each interval of `width_s`, plotted at the start of the interval. Without this
/// reduction an oscillation with a period of 1 ms would fill the figure.
Series largest_each(double width_s, const std::vector<double>& time_s, const std::vector<double>& values) {
  Series series;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double begin_s = std::floor(time_s[i] / width_s) * width_s;
    if (series.x.empty() || series.x.back() != begin_s) {
      series.x.push_back(begin_s);
      series.y.push_back(values[i]);
    }
    series.y.back() = std::fmax(series.y.back(), values[i]);
  }
  return series;
}

Plot age_figure(const Session& session) {
  Plot plot = half_plot(session, "Age of the newest state", {"time since last arrival", "ms"});
  plot.y.low = 0;
  int color = 0;
  for (const ClientRun& user : session.users) {
    Series series = largest_each(0.050, user.trace.time_s, scaled(user.trace.state_age_s, kMilli));
    series.label = user.name;
    series.style = color++;
    plot.series.push_back(std::move(series));
  }
  plot.caption =
      "Time since the arrival of the newest server state, the largest in each 50 ms. It does not contain the transit "
      "time: see the round trip below.";
  return plot;
}

void add_users_table(HtmlReport& report, const Session& session) {
  Table table{"Force and torque displayed to each hand",
              {{.header = "User", .is_text = true},
               {.header = "Stage", .is_text = true},
               {"Force rms", "N"},
               {"Force max", "N"},
               {"Torque rms", "mN·m"},
               {"Torque max", "mN·m"},
               {"At the clamp", "%"},
               {"Body moved", "mm"}},
              {}};
  for (const ClientRun& user : session.users) {
    const ClientRun& s = user;
    table.rows.push_back({s.name, s.stage, format_fixed(s.force_rms_n, 2), format_fixed(s.force_max_n, 2),
                          format_fixed(s.torque_rms_n_m * kMilli, 1), format_fixed(s.torque_max_n_m * kMilli, 1),
                          format_fixed(s.clamped_fraction * kPercent, 2),
                          format_fixed(s.body_displacement_m * kMilli, 1)});
  }
  report.table(table);
}

void add_phases_table(HtmlReport& report, const Session& session) {
  Table table{"Phases of the hands' path, settled part",
              {{.header = "User", .is_text = true},
               {.header = "Phase", .is_text = true},
               {"Lasts", "s"},
               {"Mean force", "N"},
               {"Largest hand speed", "mm/s"}},
              {}};
  for (const ClientRun& user : session.users) {
    for (const PhaseSummary& phase : user.phases) {
      table.rows.push_back({user.name, phase.name, format_fixed(phase.duration_s, 2),
                            format_fixed(phase.settled_force_mean_n, 2),
                            format_fixed(phase.settled_hand_speed_max_m_per_s * kMilli, 1)});
    }
  }
  report.table(table);
}

void add_timing_table(HtmlReport& report, const Session& session) {
  Table table{"The haptic loop: lateness of its ticks behind their deadlines, and the way to the server",
              {{.header = "User", .is_text = true},
               {"Ticks run", ""},
               {"Missed", ""},
               {"Rate", "Hz"},
               {"p50", "µs"},
               {"p99", "µs"},
               {"p99.9", "µs"},
               {"Max", "µs"},
               {"Round trip", "ms"},
               {"Least", "ms"}},
              {}};
  for (const ClientRun& user : session.users) {
    const ClientRun& s = user;
    table.rows.push_back({s.name, std::to_string(s.loop.ticks_run), std::to_string(s.loop.missed),
                          format_fixed(s.loop.tick_rate_hz, 2), format_fixed(s.loop.lateness_p50_us, 0),
                          format_fixed(s.loop.lateness_p99_us, 0), format_fixed(s.loop.lateness_p999_us, 0),
                          format_fixed(s.loop.lateness_max_us, 0), format_fixed(s.link.round_trip_newest_ms, 1),
                          format_fixed(s.link.round_trip_minimum_ms, 1)});
  }
  report.table(table);
}

std::uint64_t count_of(const Drops& drops, std::string_view reason) {
  const auto found = std::find_if(drops.begin(), drops.end(), [&](const auto& drop) { return drop.first == reason; });
  return found == drops.end() ? 0 : found->second;
}

/// Returns the drop reasons of all users, in the order of their first occurrence.
std::vector<std::string> reasons_seen(const Session& session) {
  std::vector<std::string> reasons;
  for (const ClientRun& user : session.users) {
    for (const Drops* drops : {&user.link.received_drops, &user.link.sent_drops}) {
      for (const auto& [reason, count] : *drops) {
        const bool is_new = std::find(reasons.begin(), reasons.end(), reason) == reasons.end();
        if (count > 0 && is_new) reasons.push_back(reason);
      }
    }
  }
  return reasons;
}

void add_drops_table(HtmlReport& report, const Session& session) {
  const auto reasons = reasons_seen(session);
  if (reasons.empty()) {
    report.paragraph("No datagram was dropped.");
    return;
  }
  Table table{"Datagrams dropped, by reason", {{.header = "Reason", .is_text = true}}, {}};
  for (const ClientRun& user : session.users) {
    table.columns.push_back({user.name + ", received", ""});
    table.columns.push_back({user.name + ", sent", ""});
  }
  for (const std::string& reason : reasons) {
    std::vector<std::string> row = {reason};
    for (const ClientRun& user : session.users) {
      row.push_back(std::to_string(count_of(user.link.received_drops, reason)));
      row.push_back(std::to_string(count_of(user.link.sent_drops, reason)));
    }
    table.rows.push_back(std::move(row));
  }
  report.table(table);
}

/// Adds the tables and figures of one session.
/// In      has_force  whether the figure of the forces is added; false if the first page has it
void add_session(HtmlReport& report, const Session& session, bool has_force) {
  const ClientRun& first = session.users.front();
  report.heading("Session " + session.name);
  report.paragraph("Scene " + first.scene + ", users " + user_list(session) +
                   "; shared body: " + (first.watched_body.empty() ? "none seen" : first.watched_body) + ".");
  add_users_table(report, session);
  if (has_force) report.figure(force_figure(session));
  report.side_by_side(std::vector{motion_figure(session), body_figure(session)});
  report.side_by_side(std::vector{torque_figure(session), age_figure(session)});
  add_phases_table(report, session);
  add_timing_table(report, session);
  add_drops_table(report, session);
}

std::string subtitle(std::span<const Session> sessions) {
  std::string text;
  for (const Session& session : sessions) {
    text += (text.empty() ? "" : " · ") + session.name + " (" + user_list(session) + ")";
  }
  return text;
}

}  // namespace

HtmlReport session_report(std::span<const Session> sessions, std::span<const Check> checks) {
  HtmlReport report("Forces on the hands", subtitle(sessions));
  report.question("Did the users feel and move the shared bodies, at rest where the hands rest, within the limits?");
  report.verdict(checks);
  for (const Session& session : sessions.first(std::min(kFirstPageFigures, sessions.size())))
    report.figure(force_figure(session));
  report.appendix();
  report.paragraph("Settled: without the first second of the phase, in which the hand swings in.");
  for (std::size_t i = 0; i < sessions.size(); ++i) add_session(report, sessions[i], i >= kFirstPageFigures);
  report.footer(
      "SI units; W is the world frame of the scene. Displayed force and torque are those on the hand, in the device's "
      "base frame. Every figure keeps the extremes of each pixel column, so no peak is lost in drawing.");
  return report;
}

}  // namespace tandem::lab
