#include "lab/report/session_data.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <system_error>

#include "common/base/json_fields.hpp"

namespace tandem::lab {
namespace {

constexpr std::size_t kMinUsers = 2;
constexpr std::size_t kMaxUsers = 16;
constexpr std::size_t kMaxPhases = 256;
/// Upper limits of numbers in a summary. They refuse only values that no client can measure.
constexpr double kMaxNumber = 1e12;
constexpr std::uint64_t kMaxCount = 1'000'000'000'000;

std::uint64_t required_count(JsonFields& fields, std::string_view name) {
  if (!fields.has(name)) fields.fail(name, "it must be a whole number");
  return fields.whole_number(name, 0, kMaxCount);
}

double at_least_zero(JsonFields& fields, std::string_view name) {
  return fields.required_number(name, 0, kMaxNumber);
}

bool required_boolean(JsonFields& fields, std::string_view name) {
  if (!fields.has(name)) fields.fail(name, "it must be true or false");
  return fields.boolean(name, false);
}

/// Reads a number. A null, which a summary has for an unknown value, becomes NaN. `pointer` is the JSON pointer of the
/// object that contains the number.
double measured(const boost::json::value& root, const std::string& pointer, JsonFields& fields, std::string_view name) {
  boost::json::error_code error;
  const auto* value = root.find_pointer(pointer + "/" + std::string(name), error);
  if (value != nullptr && value->is_null()) return std::numeric_limits<double>::quiet_NaN();
  return fields.required_number(name, -kMaxNumber, kMaxNumber);
}

Drops parse_drops(const boost::json::value& counts, const std::string& origin, const std::string& path) {
  JsonFields fields(counts, origin, path);
  Drops drops;
  for (const auto& entry : counts.get_object()) drops.emplace_back(entry.key(), required_count(fields, entry.key()));
  return drops;
}

void read_drops(const boost::json::value& json, const std::string& origin, ClientRun& out) {
  const auto* drops = json.get_object().if_contains("drops");
  JsonFields fields(drops == nullptr ? boost::json::value(nullptr) : *drops, origin, "drops");
  for (const auto& [name, target] :
       {std::pair{"received", &out.link.received_drops}, std::pair{"sent", &out.link.sent_drops}}) {
    if (!fields.has(name)) fields.fail(name, "it must be an object of counts by reason");
    *target = parse_drops(drops->get_object().at(name), origin, std::string("drops.") + name);
  }
}

void read_timing(const boost::json::value& json, JsonFields& root, ClientRun& out) {
  out.loop.ticks_run = required_count(root, "ticks_run");
  out.loop.ticks_expected = required_count(root, "ticks_expected");
  out.loop.tick_rate_hz = at_least_zero(root, "tick_rate_hz");
  out.loop.missed = required_count(root, "missed");
  JsonFields lateness = root.object("lateness_us");
  out.loop.lateness_p50_us = at_least_zero(lateness, "p50");
  out.loop.lateness_p99_us = at_least_zero(lateness, "p99");
  out.loop.lateness_p999_us = at_least_zero(lateness, "p999");
  out.loop.lateness_max_us = at_least_zero(lateness, "max");
  JsonFields round_trip = root.object("round_trip_ms");
  out.link.round_trip_newest_ms = measured(json, "/round_trip_ms", round_trip, "newest");
  out.link.round_trip_minimum_ms = measured(json, "/round_trip_ms", round_trip, "minimum");
  out.link.clock_offset_ms = measured(json, "", root, "clock_offset_ms");
}

void read_forces(JsonFields& root, ClientRun& out) {
  JsonFields force = root.object("force_n");
  out.force_rms_n = at_least_zero(force, "rms");
  out.force_max_n = at_least_zero(force, "max");
  JsonFields torque = root.object("torque_n_m");
  out.torque_rms_n_m = at_least_zero(torque, "rms");
  out.torque_max_n_m = at_least_zero(torque, "max");
  out.force_limit_n = at_least_zero(root, "force_limit_n");
  out.torque_limit_n_m = at_least_zero(root, "torque_limit_n_m");
  out.clamped_fraction = root.required_number("clamped_fraction", 0, 1);
  out.all_forces_finite = required_boolean(root, "all_forces_finite");
}

void read_phases(const boost::json::value& json, JsonFields& root, ClientRun& out) {
  if (!root.has("phases")) root.fail("phases", "it must be a list of objects");
  for (JsonFields& fields : root.objects("phases", 0, kMaxPhases)) {
    const std::string pointer = "/phases/" + std::to_string(out.phases.size());
    PhaseSummary phase;
    phase.name = fields.required_text("name");
    phase.duration_s = at_least_zero(fields, "duration_s");
    phase.settled_hand_speed_max_m_per_s = measured(json, pointer, fields, "settled_hand_speed_max_m_per_s");
    phase.settled_force_mean_n = measured(json, pointer, fields, "settled_force_mean_n");
    out.phases.push_back(std::move(phase));
  }
}

void read_watched_body(const boost::json::value& json, JsonFields& root, ClientRun& out) {
  if (!root.has("watched_body")) root.fail("watched_body", "it must be an object, or null when no body was seen");
  if (json.get_object().at("watched_body").is_null()) return;
  JsonFields body = root.object("watched_body");
  out.watched_body = body.required_text("name");
  out.body_displacement_m = at_least_zero(body, "displacement_m");
}

std::vector<double> magnitude(const CsvTable& table, const std::string& before, const std::string& after) {
  const auto& x = table.column(before + "x" + after);
  const auto& y = table.column(before + "y" + after);
  const auto& z = table.column(before + "z" + after);
  std::vector<double> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = std::hypot(x[i], y[i], z[i]);
  return out;
}

Axes extract_axes(const CsvTable& table, const std::string& before) {
  return {table.column(before + "p_x_m"), table.column(before + "p_y_m"), table.column(before + "p_z_m")};
}

[[noreturn]] void fail_at_row(const CsvTable& table, std::size_t row, const std::string& what) {
  // Rows are counted from 0 and lines from 1; line 1 is the header.
  throw std::invalid_argument(table.origin + ": line " + std::to_string(row + 2) + ": " + what);
}

/// Converts the time of each row to the server's clock [s]. If the client measured no clock offset, the
/// offset is assumed to be 0, as on the server's machine.
std::vector<double> server_time_s(const CsvTable& table, const ClientRun& summary) {
  std::vector<double> time_s = table.column("local_ns");
  if (time_s.empty()) throw std::invalid_argument(table.origin + " has no row; the client must have ticked");
  const double offset_s = std::isfinite(summary.link.clock_offset_ms) ? summary.link.clock_offset_ms * 1e-3 : 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    time_s[i] = time_s[i] * 1e-9 + offset_s;
    if (!std::isfinite(time_s[i])) fail_at_row(table, i, "local_ns is not finite; it must be a time");
    if (i > 0 && time_s[i] < time_s[i - 1])
      fail_at_row(table, i, "local_ns is less than before; time must not run back");
  }
  return time_s;
}

/// Returns the intervals of the phases. The column `phase` contains the index of the phase, or −1 between phases.
std::vector<Band> phase_bands(const CsvTable& table, const ClientRun& summary, const std::vector<double>& time_s) {
  const std::vector<double>& phase = table.column("phase");
  std::vector<Band> bands;
  for (std::size_t i = 0; i < phase.size(); ++i) {
    const bool is_known = phase[i] >= -1 && phase[i] < static_cast<double>(summary.phases.size());
    if (!is_known) fail_at_row(table, i, "phase is not the index of one of the summary's phases, nor -1");
    const bool is_new = i == 0 || phase[i] != phase[i - 1];
    if (!bands.empty() && phase[i - 1] >= 0) bands.back().end = time_s[i];
    if (!is_new || phase[i] < 0) continue;
    bands.push_back({time_s[i], time_s[i], summary.phases[static_cast<std::size_t>(phase[i])].name});
  }
  return bands;
}

ClientRun load_user(const std::filesystem::path& summary_file) {
  const std::string origin = summary_file.string();
  ClientRun run = parse_client_summary(parse_json(read_text_file(summary_file), origin), origin);
  std::filesystem::path trace_file = summary_file;
  run.trace = make_trace(read_csv(trace_file.replace_extension(".csv")), run);
  return run;
}

/// Returns the summary files in sorted order, because the order within a directory is arbitrary.
std::set<std::filesystem::path> summary_files(const std::filesystem::path& folder) {
  std::set<std::filesystem::path> files;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".json") files.insert(entry.path());
    }
  } catch (const std::filesystem::filesystem_error& error) {
    throw std::invalid_argument(folder.string() + " cannot be read (" + error.code().message() +
                                "); a session is a folder of USER.json and USER.csv");
  }
  if (files.size() < kMinUsers || files.size() > kMaxUsers) {
    throw std::invalid_argument(folder.string() + " has " + std::to_string(files.size()) +
                                " files USER.json; a shared session has " + std::to_string(kMinUsers) + " to " +
                                std::to_string(kMaxUsers) + " users");
  }
  return files;
}

void move_start_to_zero(Session& session) {
  double start_s = std::numeric_limits<double>::infinity();
  for (const ClientRun& user : session.users) start_s = std::min(start_s, user.trace.time_s.front());
  for (ClientRun& user : session.users) {
    for (double& time_s : user.trace.time_s) time_s -= start_s;
    for (Band& phase : user.trace.phases) {
      phase.begin -= start_s;
      phase.end -= start_s;
    }
  }
}

}  // namespace

const PhaseSummary* ClientRun::phase(std::string_view phase_name) const {
  const auto found =
      std::find_if(phases.begin(), phases.end(), [&](const PhaseSummary& phase) { return phase.name == phase_name; });
  return found == phases.end() ? nullptr : &*found;
}

ClientRun parse_client_summary(const boost::json::value& json, const std::string& origin) {
  JsonFields root(json, origin);
  ClientRun summary;
  summary.name = root.required_text("user");
  summary.scene = root.required_text("scene");
  summary.stage = root.required_text("stage");
  read_timing(json, root, summary);
  read_drops(json, origin, summary);
  read_forces(root, summary);
  read_phases(json, root, summary);
  read_watched_body(json, root, summary);
  return summary;
}

Trace make_trace(const CsvTable& table, const ClientRun& summary) {
  Trace trace;
  trace.time_s = server_time_s(table, summary);
  trace.phases = phase_bands(table, summary, trace.time_s);
  trace.force_n = magnitude(table, "displayed_force_", "_n");
  trace.torque_n_m = magnitude(table, "displayed_torque_", "_n_m");
  trace.hand_m = extract_axes(table, "handle_");
  trace.tool_m = extract_axes(table, "tool_");
  trace.body_m = extract_axes(table, "body_");
  trace.state_age_s = table.column("state_age_s");
  // Traces of older clients lack this column. In this case the energy is unknown.
  const std::vector<double>* const energy = table.find("field_energy_kj_per_mol");
  trace.energy_kj_per_mol =
      energy != nullptr ? *energy : std::vector(table.row_count(), std::numeric_limits<double>::quiet_NaN());
  return trace;
}

Session load_session(const std::string& name, const std::filesystem::path& folder) {
  Session session{name, {}};
  for (const auto& file : summary_files(folder)) session.users.push_back(load_user(file));
  move_start_to_zero(session);
  return session;
}

}  // namespace tandem::lab
