// Results of one session from several clients: JSON summary and trace of each. Only session_data.cpp contains the names
// of keys and columns; the rest of the report uses SI numbers.
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

/// Summary of one phase of a hand's path by the client. "Settled" excludes the transient at the start.
struct PhaseSummary {
  std::string name;
  double duration_s = 0;
  double settled_hand_speed_max_m_per_s = 0;
  double settled_force_mean_n = 0;
};

/// Counts by the reasons of proto/drop_reason.hpp, in the file's order.
using Drops = std::vector<std::pair<std::string, std::uint64_t>>;

/// A position over time: x, y, z in W.
using Axes = std::array<std::vector<double>, 3>;

/// A client's trace, one entry for each tick; NaN for values not known yet.
struct Trace {
  std::vector<double> time_s;   ///< since the first tick of the session's first client, on the server's clock
  std::vector<double> force_n;  ///< displayed
  std::vector<double> torque_n_m;
  Axes hand_m;  ///< p_WH
  Axes tool_m;  ///< p_WT
  Axes body_m;  ///< origin of the watched body
  std::vector<double> state_age_s;
  std::vector<double> energy_kj_per_mol;  ///< energy of the molecular field; 0 if the scene has none
  std::vector<Band> phases;               ///< times of the phases in ClientRun::phases [s]
};

/// The haptic loop of a client: ticks, and their lateness [µs].
struct LoopSummary {
  std::uint64_t ticks_run = 0;
  std::uint64_t ticks_expected = 0;
  double tick_rate_hz = 0;
  double lateness_p50_us = 0;
  double lateness_p99_us = 0;
  double lateness_p999_us = 0;
  double lateness_max_us = 0;
  std::uint64_t missed = 0;  ///< deadlines that were skipped
};

/// The connection of a client.
struct ConnectionSummary {
  double round_trip_newest_ms = 0;
  double round_trip_minimum_ms = 0;
  double clock_offset_ms = 0;
  Drops received_drops;
  Drops sent_drops;
};

/// Results of one client: its JSON summary, with NaN for null (not known), and its trace.
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
  std::string watched_body;  ///< "" if none was seen
  double body_displacement_m = std::numeric_limits<double>::quiet_NaN();

  Trace trace;

  /// Returns null if there is no such phase.
  const PhaseSummary* phase(std::string_view phase_name) const;
};

struct Session {
  std::string name;
  std::vector<ClientRun> users;  ///< in the order of the file names, at least two
};

/// Reads a summary; the trace is empty. Ignores unknown keys.
/// Fails   std::invalid_argument naming file, key, value and remedy
ClientRun parse_client_summary(const boost::json::value& json, const std::string& origin);

/// Extracts the columns that the report needs from a client's CSV; time_s is the server's clock since its start.
/// Fails   std::invalid_argument: a column is missing, there is no row, time decreases, or a phase is not in `summary`
Trace make_trace(const CsvTable& table, const ClientRun& summary);

/// Reads every USER.json of `folder` with its USER.csv.
/// Fails   std::invalid_argument naming the file that is missing or bad; fewer than 2 users, or more than 16
Session load_session(const std::string& name, const std::filesystem::path& folder);

}  // namespace tandem::lab
