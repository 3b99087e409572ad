#include "lab/therapy/therapy_report.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <vector>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr double kMilli = 1e3;
constexpr double kPercent = 100;
constexpr int kHalfHeight_px = 260;
constexpr std::size_t kFirstPageLevels = 8;
constexpr double kMinSessionsShown = 5;

std::string date_of(const SessionMeasures& session) {
  return session.begun_utc.substr(0, session.begun_utc.find('T'));
}

std::string outcome_words(PartOutcome outcome) {
  constexpr std::array<const char*, 4> kWords{"\u2013", "reached", "failed", "not finished"};
  return kWords.at(static_cast<std::size_t>(outcome));
}

std::string size_words(const std::optional<MotionRange>& range) {
  if (!range) return "\u2013";
  const Vec3 mm = range->size_m() * kMilli;
  return format_fixed(mm.x(), 0) + " × " + format_fixed(mm.y(), 0) + " × " + format_fixed(mm.z(), 0);
}

std::string plural(std::size_t count, const std::string& word) {
  return std::to_string(count) + " " + word + (count == 1 ? "" : "s");
}

// Text of the first page.

std::string game_words(const SessionMeasures& session) {
  if (session.whole().outcome == PartOutcome::kNone) return {};
  const std::size_t reached = session.count(PartKind::kLevel, PartOutcome::kReached);
  return " " + plural(reached, "level") + " reached, score " + format_significant(session.whole().score, 6) + ".";
}

/// Returns a sentence about the change of the smoothness since the first session in which it is known.
std::string change_words(std::span<const StoredSession> sessions, std::size_t index) {
  const auto first = std::ranges::find_if(
      sessions, [](const StoredSession& session) { return std::isfinite(session.measures.whole().smoothness); });
  const double now = sessions[index].measures.whole().smoothness;
  if (first == sessions.end() || first->number == sessions[index].number || !std::isfinite(now)) return {};
  const double change = now - first->measures.whole().smoothness;
  return " Since session " + std::to_string(first->number) + " the smoothness changed by " + (change > 0 ? "+" : "") +
         format_fixed(change, 2) + ".";
}

std::string answer(std::span<const StoredSession> sessions, std::size_t index) {
  const SessionMeasures& session = sessions[index].measures;
  const PartMeasures& whole = session.whole();
  return plural(whole.movements, "movement") + " in " + format_fixed(whole.time_s, 0) + " s, median smoothness " +
         format_fixed(whole.smoothness, 2) + ", range of motion " + size_words(whole.range) + " mm." +
         game_words(session) + change_words(sessions, index);
}

// Tables of the report.

const std::vector<Column> kMeasureColumns{{"Time", "s"},
                                          {"Movements", "1"},
                                          {"Smoothness", "SPARC"},
                                          {"Path", "m"},
                                          {"Force mean / peak", "N"},
                                          {"Range x × y × z", "mm"},
                                          {"Grasps / objects", "1"},
                                          {"Score", "points"}};

std::vector<std::string> measure_cells(const PartMeasures& part) {
  return {format_fixed(part.time_s, 1),
          std::to_string(part.movements),
          format_fixed(part.smoothness, 2),
          format_fixed(part.path_m, 2),
          format_fixed(part.force_mean_n, 2) + " / " + format_fixed(part.force_peak_n, 2),
          size_words(part.range),
          std::to_string(part.grasps) + " / " + std::to_string(part.objects),
          format_significant(part.score, 6)};
}

/// Returns an empty table with `columns`, followed by the columns of the measures. add_row() fills it.
Table measures_table(const std::string& caption, std::vector<Column> columns) {
  columns.insert(columns.end(), kMeasureColumns.begin(), kMeasureColumns.end());
  return {caption, std::move(columns), {}};
}

void add_row(Table& table, std::vector<std::string> first_cells, const PartMeasures& part) {
  for (std::string& cell : measure_cells(part)) first_cells.push_back(std::move(cell));
  table.rows.push_back(std::move(first_cells));
}

Column text_column(const std::string& header) {
  return {.header = header, .is_text = true};
}

Table levels_table(const std::string& caption, std::span<const PartMeasures* const> parts) {
  Table table = measures_table(caption, {text_column("Part"), text_column("Outcome")});
  for (const PartMeasures* part : parts) add_row(table, {part->name, outcome_words(part->outcome)}, *part);
  return table;
}

/// Returns the table of the goals. In the list of parts, the goals of a level follow the level.
Table goals_table(const SessionMeasures& session) {
  Table table = measures_table("Goals", {text_column("Level"), text_column("Goal"), text_column("Outcome")});
  std::string level;
  for (const PartMeasures& part : session.parts) {
    if (part.kind == PartKind::kLevel) level = part.name;
    if (part.kind == PartKind::kGoal) add_row(table, {level, part.name, outcome_words(part.outcome)}, part);
  }
  return table;
}

std::vector<const PartMeasures*> parts_of(const SessionMeasures& session, std::initializer_list<PartKind> kinds) {
  std::vector<const PartMeasures*> parts;
  for (const PartMeasures& part : session.parts) {
    if (std::ranges::find(kinds, part.kind) != kinds.end()) parts.push_back(&part);
  }
  return parts;
}

Table sessions_table(std::span<const StoredSession> sessions) {
  Table table = measures_table(
      "All sessions", {text_column("Session"), text_column("Date"), text_column("Scene"), {"Levels reached", "1"}});
  for (const StoredSession& session : sessions) {
    const std::size_t reached = session.measures.count(PartKind::kLevel, PartOutcome::kReached);
    add_row(
        table,
        {std::to_string(session.number), date_of(session.measures), session.measures.scene, std::to_string(reached)},
        session.measures.whole());
  }
  return table;
}

Table reach_table(const SessionMeasures& session) {
  Table table{"Range of motion: reach from the position at the start, along the axes of the scene",
              {{.header = "Of", .is_text = true},
               {"\u2212x", "mm"},
               {"+x", "mm"},
               {"\u2212y", "mm"},
               {"+y", "mm"},
               {"\u2212z", "mm"},
               {"+z", "mm"},
               {"Size x × y × z", "mm"}},
              {}};
  const auto add = [&table](const std::string& name, const std::optional<MotionRange>& range) {
    if (!range) return;
    std::vector<std::string> row{name};
    for (const double reach_m : range->reach_m()) row.push_back(format_fixed(reach_m * kMilli, 0));
    row.push_back(size_words(range));
    table.rows.push_back(std::move(row));
  };
  add("Calibration", session.calibration);
  add("Session", session.whole().range);
  return table;
}

/// Returns a sentence about the used fraction of the calibrated range along each axis.
std::string used_words(const SessionMeasures& session) {
  if (!session.calibration || !session.whole().range) return {};
  const Vec3 used = session.whole().range->size_m(), able = session.calibration->size_m();
  std::string text = "Of the calibrated range of motion the session used";
  for (int axis = 0; axis < 3; ++axis) {
    const double share = able[axis] > 0 ? kPercent * used[axis] / able[axis] : PartMeasures::kUnknown;
    text += std::string(axis == 0 ? " " : ", ") + format_fixed(share, 0) + " % along " + "xyz"[axis];
  }
  return text + ".";
}

// Figures of the report.

using MeasureOf = std::function<double(const SessionMeasures&)>;

/// Returns a plot of measures as a function of the session number.
Plot progress_plot(std::span<const StoredSession> sessions, const std::string& what, const PlotAxis& y) {
  Plot plot;
  plot.description = what + " over the sessions";
  const double last = sessions.back().number;
  plot.x = {.quantity = "number of the session", .low = 0, .high = std::max(kMinSessionsShown, last) + 1};
  plot.y = y;
  plot.width_px = kHalfWidth_px;
  plot.height_px = kHalfHeight_px;
  return plot;
}

void add_series(Plot& plot, std::span<const StoredSession> sessions, const std::string& label, const MeasureOf& measure,
                const MeasureOf& low = {}, const MeasureOf& high = {}) {
  Series series{.label = label, .x = {}, .y = {}, .style = static_cast<int>(plot.series.size())};
  for (const StoredSession& session : sessions) {
    series.x.push_back(session.number);
    series.y.push_back(measure(session.measures));
    if (low) series.low.push_back(low(session.measures));
    if (high) series.high.push_back(high(session.measures));
  }
  plot.series.push_back(std::move(series));
}

bool has_data(const Plot& plot) {
  return std::ranges::any_of(plot.series, [](const Series& series) {
    return std::ranges::any_of(series.y, [](double value) { return std::isfinite(value); });
  });
}

MeasureOf of_whole(double PartMeasures::*member) {
  return [member](const SessionMeasures& session) { return session.whole().*member; };
}

Plot smoothness_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Smoothness of the movements", {"smoothness, SPARC"});
  add_series(plot, sessions, "median", of_whole(&PartMeasures::smoothness), of_whole(&PartMeasures::smoothness_low),
             of_whole(&PartMeasures::smoothness_high));
  plot.caption =
      "Smoothness of the movements: median, and quartiles as a band. Nearer to 0 is smoother; a single movement of "
      "minimum jerk has \u22121.41.";
  return plot;
}

Plot range_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Range of motion", {"range of motion", "mm"});
  plot.y.low = 0;
  const auto size_mm = [](const std::optional<MotionRange>& range, int axis) {
    return range ? range->size_m()[axis] * kMilli : PartMeasures::kUnknown;
  };
  for (int axis = 0; axis < 3; ++axis) {
    add_series(plot, sessions, "along " + std::string(1, "xyz"[axis]),
               [=](const SessionMeasures& session) { return size_mm(session.whole().range, axis); });
  }
  plot.caption = "Size of the box in which the hand was for 98 % of the time, without long rests.";
  return plot;
}

Plot force_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Force on the hand", {"force on the hand", "N"});
  plot.y.low = 0;
  add_series(plot, sessions, "mean", of_whole(&PartMeasures::force_mean_n));
  add_series(plot, sessions, "peak", of_whole(&PartMeasures::force_peak_n));
  plot.caption = "Mean and peak of the magnitude of the coupling's force on the hand.";
  return plot;
}

Plot time_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Duration", {"time", "s"});
  plot.y.low = 0;
  add_series(plot, sessions, "session", of_whole(&PartMeasures::time_s));
  add_series(plot, sessions, "moving", of_whole(&PartMeasures::moving_s));
  plot.caption = "Duration of each session, and of the movements in it.";
  return plot;
}

Plot path_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Path of the hand", {"path of the hand", "m"});
  plot.y.low = 0;
  add_series(plot, sessions, "", of_whole(&PartMeasures::path_m));
  plot.caption = "Length of the hand's path in each session.";
  return plot;
}

Plot score_progress(std::span<const StoredSession> sessions) {
  Plot plot = progress_plot(sessions, "Score", {"score", "points"});
  add_series(plot, sessions, "", of_whole(&PartMeasures::score));
  plot.caption = "Score of each session with a game. Compare sessions of the same scene.";
  return plot;
}

Plot movements_plot(const SessionMeasures& session) {
  Plot plot;
  plot.description = "Smoothness of each movement over the time of the session";
  plot.caption =
      "Smoothness of each movement of this session. Shaded: the levels of the game. A movement of more than 60 s "
      "without "
      "a rest is not shown.";
  plot.x = {.quantity = "time", .unit = "s", .low = 0, .high = std::max(1.0, session.whole().time_s)};
  plot.y = {"smoothness, SPARC"};
  Series series{.label = "", .x = {}, .y = {}, .style = 0, .draw = Draw::kMarkers};
  for (const Movement& movement : session.movements) {
    series.x.push_back(movement.begin_s);
    series.y.push_back(movement.smoothness);
  }
  plot.series.push_back(std::move(series));
  for (const PartMeasures* level : parts_of(session, {PartKind::kLevel})) {
    plot.bands.push_back({level->begin_s, level->begin_s + level->time_s, level->name});
  }
  return plot;
}

void add_figures(HtmlReport& report, std::vector<Plot> plots) {
  std::erase_if(plots, [](const Plot& plot) { return !has_data(plot); });
  if (!plots.empty()) report.side_by_side(plots);
}

void add_definitions(HtmlReport& report) {
  report.heading("Definitions");
  report.paragraph(
      "Hand: position of the handle as the program sent it to the server, in metres of the scene, after the device's "
      "scale and clutch. Compare sessions with the same device, scale and scene. It is converted to 100 samples a "
      "second.");
  report.paragraph(
      "Movement: the hand exceeds 20 mm/s, moves for 0.2 s or more, and then stays below 5 mm/s for 0.2 s. A goal "
      "begins "
      "with its level or, if the goals are in order, with the end of the goal before.");
  report.paragraph(
      "Smoothness: spectral arc length (SPARC) of the speed of a movement, up to 10 Hz, amplitude threshold 0.05, "
      "padding "
      "level 4. Source: Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet, \u201cOn the analysis of movement "
      "smoothness\u201d, J. NeuroEng. Rehabil. 12:112, 2015. It does not depend on the amplitude or the duration of a "
      "movement; tremor and corrections lower it.");
  report.paragraph(
      "Range of motion: percentiles 1 and 99 of the position along each axis of the scene, so that short outliers do "
      "not "
      "count. Of a rest only the first 0.2 s count. The start is the median position of the first second.");
  report.paragraph(
      "Force: magnitude of the force of the server's coupling on the hand, 50 values a second, before the limits of "
      "the "
      "device. Shorter peaks can be missed. Grasps and objects count bodies that the tool held.");
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return {};
  std::array<char, 32> text;
  return std::string(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

/// Returns text in quotes for CSV. If a spreadsheet would evaluate the text as a formula, an apostrophe precedes it.
std::string quoted(const std::string& text) {
  const std::string clean = printable(text);
  const bool is_formula = !clean.empty() && std::string_view("=+-@\t\r").find(clean.front()) != std::string_view::npos;
  std::string out = is_formula ? "\"'" : "\"";
  for (const char c : clean) out.append(c == '"' ? 2 : 1, c);
  return out + '"';
}

void add_lines(std::string& csv, const StoredSession& session, const PartMeasures& part) {
  const std::string begin = std::to_string(session.number) + "," + quoted(date_of(session.measures)) + "," +
                            text_of(part.kind) + "," + quoted(part.name) + ",";
  const auto line = [&](const char* measure, const char* unit, const std::string& value) {
    csv += begin + measure + "," + unit + "," + value + "\n";
  };
  line("outcome", "", text_of(part.outcome));
  line("begin", "s", number_text(part.begin_s));
  line("time", "s", number_text(part.time_s));
  line("time_moving", "s", number_text(part.moving_s));
  line("path", "m", number_text(part.path_m));
  line("movements", "1", std::to_string(part.movements));
  line("smoothness_median", "SPARC", number_text(part.smoothness));
  line("smoothness_lower_quartile", "SPARC", number_text(part.smoothness_low));
  line("smoothness_upper_quartile", "SPARC", number_text(part.smoothness_high));
  line("force_mean", "N", number_text(part.force_mean_n));
  line("force_peak", "N", number_text(part.force_peak_n));
  line("grasps", "1", std::to_string(part.grasps));
  line("objects", "1", std::to_string(part.objects));
  line("score", "points", number_text(part.score));
  if (!part.range) return;
  const Vec3 size_m = part.range->size_m();
  line("range_x", "m", number_text(size_m.x()));
  line("range_y", "m", number_text(size_m.y()));
  line("range_z", "m", number_text(size_m.z()));
}

void add_range(std::string& csv, const StoredSession& session, const std::string& kind,
               const std::optional<MotionRange>& range) {
  if (!range) return;
  constexpr std::array kDirections{"reach_minus_x", "reach_plus_x",  "reach_minus_y",
                                   "reach_plus_y",  "reach_minus_z", "reach_plus_z"};
  const std::vector<double> reach_m = range->reach_m();
  for (std::size_t i = 0; i < kDirections.size(); ++i) {
    csv += std::to_string(session.number) + "," + quoted(date_of(session.measures)) + "," + kind + ",\"\"," +
           kDirections.at(i) + ",m," + number_text(reach_m[i]) + "\n";
  }
}

}  // namespace

HtmlReport therapy_report(std::string_view pseudonym, std::span<const StoredSession> sessions, std::size_t index) {
  const StoredSession& stored = sessions[index];
  const SessionMeasures& session = stored.measures;
  HtmlReport report("Session report", std::string(pseudonym) + " · session " + std::to_string(stored.number) + " of " +
                                          std::to_string(sessions.size()) + " · " + date_of(session) + " · scene " +
                                          session.scene);
  report.paragraph(kNotMedicalDevice);
  report.question("How did the hand move in this session, and how does it change over the sessions?");
  report.answer(answer(sessions, index));
  if (session.is_cut) report.paragraph("The recording is cut or damaged; only its readable part was measured.");
  const auto parts = parts_of(session, {PartKind::kSession, PartKind::kLevel});
  report.table(
      levels_table("Session and levels", std::span(parts).first(std::min(parts.size(), 1 + kFirstPageLevels))));
  add_figures(report, {smoothness_progress(sessions), range_progress(sessions)});
  const Plot movements = movements_plot(session);
  if (has_data(movements)) report.figure(movements);

  report.appendix();
  if (parts.size() > 1 + kFirstPageLevels) report.table(levels_table("All levels", parts));
  const Table goals = goals_table(session);
  if (!goals.rows.empty()) report.table(goals);
  report.table(reach_table(session));
  if (const std::string used = used_words(session); !used.empty()) report.paragraph(used);
  report.heading("Progress");
  report.table(sessions_table(sessions));
  add_figures(report, {force_progress(sessions), time_progress(sessions)});
  add_figures(report, {path_progress(sessions), score_progress(sessions)});
  add_definitions(report);
  report.footer(std::string(kNotMedicalDevice) +
                " This file has the pseudonym. The deletion of the person does not remove it; delete it yourself.");
  return report;
}

std::string measures_csv(std::span<const StoredSession> sessions) {
  std::string csv =
      "session,date,kind,name,measure,unit,value\n,,notice,,,," + quoted(std::string(kNotMedicalDevice)) + "\n";
  for (const StoredSession& session : sessions) {
    for (const PartMeasures& part : session.measures.parts) add_lines(csv, session, part);
    add_range(csv, session, "session", session.measures.whole().range);
    add_range(csv, session, "calibration", session.measures.calibration);
  }
  return csv;
}

std::string movements_csv(const SessionMeasures& session) {
  std::string csv = "begin_s,duration_s,path_m,peak_speed_m_per_s,smoothness_sparc\n";
  for (const Movement& movement : session.movements) {
    csv += number_text(movement.begin_s) + "," + number_text(movement.duration_s) + "," + number_text(movement.path_m) +
           "," + number_text(movement.peak_speed_m_per_s) + "," + number_text(movement.smoothness) + "\n";
  }
  return csv;
}

}  // namespace tandem::lab
