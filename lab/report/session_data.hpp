// Results of one session: the JSON summary and the trace of each client. Only session_data.cpp contains the names of
// keys and columns; the rest of the report uses numbers in SI units.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/json.hpp"
#include "lab/report/csv.hpp"
#include "lab/report/plot.hpp"

namespace tandem::lab {

/// A client's summary of one phase of a hand's path. "Settled" values exclude the transient at the start of the phase.
struct PhaseSummary {
  std::string name;
  double duration_s = 0;
  double settled_hand_speed_max_m_per_s = 0;
  double settled_force_mean_n = 0;
};

/// Number of dropped messages by reason (proto/drop_reason.hpp), in the order of the file.
using Drops = std::vector<std::pair<std::string, std::uint64_t>>;

/// A position over time in W: one vector each for x, y and z.
using Axes = std::array<std::vector<double>, 3>;

/// A client's trace with one entry for each tick. A value that the client had not received yet is NaN.
struct Trace {
  /// time of each tick on the server's clock, counted from the first tick of the client that started first
  std::vector<double> time_s;
  std::vector<double> force_n;  ///< displayed force
  std::vector<double> torque_n_m;
  Axes hand_m;  ///< position of the handle, p_WH
  Axes tool_m;  ///< position of the tool, p_WT
  Axes body_m;  ///< position of the watched body's origin
  std::vector<double> state_age_s;
  std::vector<double> energy_kj_per_mol;  ///< energy of the molecular field; 0 if the scene has none
  std::vector<Band> phases;               ///< intervals of the phases in ClientRun::phases [s]
};

/// Summary of a client's haptic loop: ticks, and their lateness [µs].
struct LoopSummary {
  std::uint64_t ticks_run = 0;
  std::uint64_t ticks_expected = 0;
  double tick_rate_hz = 0;
  double lateness_p50_us = 0;
  double lateness_p99_us = 0;
  double lateness_p999_us = 0;
  double lateness_max_us = 0;
  std::uint64_t missed = 0;  ///< number of deadlines that were skipped
};

/// Summary of a client's connection.
struct ConnectionSummary {
  double round_trip_newest_ms = 0;
  double round_trip_minimum_ms = 0;
  double clock_offset_ms = 0;
  Drops received_drops;
  Drops sent_drops;
};

/// Results of one client: its JSON summary, with NaN for unknown values (null), and its trace.
struct ClientRun {
  std::string name;  ///< name of the user
  std::string scene;
  std::string stage;

  LoopSummary loop;
  ConnectionSummary link;

  double force_rms_n = 0;
  double force_max_n = 0;
  double torque_rms_n_m = 0;
  double torque_max_n_m = 0;
  double force_limit_n = 0;
  double torque_limit_n_m = 0;
  double clamped_fraction = 0;
  bool all_forces_finite = false;

  std::vector<PhaseSummary> phases;
  std::string watched_body;  ///< empty if the client received no watched body
  double body_displacement_m = std::numeric_limits<double>::quiet_NaN();

  Trace trace;

  /// Returns the phase with this name, or null if there is none.
  const PhaseSummary* phase(std::string_view phase_name) const;
};

struct Session {
  std::string name;
  std::vector<ClientRun> users;  ///< results of the users, at least two, in the order of the file names
};

/// Reads a summary. The trace of the result is empty. Unknown keys are ignored.
/// Fails   std::invalid_argument naming file, key, value and remedy
ClientRun parse_client_summary(const boost::json::value& json, const std::string& origin);

/// Extracts the columns that the report needs from a client's CSV file. time_s is on the server's clock.
/// Fails   std::invalid_argument: a column is missing, there is no row, time decreases, or a phase is not in `summary`
Trace make_trace(const CsvTable& table, const ClientRun& summary);

/// Reads the summary USER.json and the trace USER.csv of each user in `folder`.
/// Fails   std::invalid_argument: a file is missing or invalid (the message names it), or there are fewer than 2 or
///         more than 16 users
Session load_session(const std::string& name, const std::filesystem::path& folder);

}  // namespace tandem::lab
