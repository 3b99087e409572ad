// Summary of a run: the JSON object that a headless run prints at its end. Field names contain the units. Unknown
// values are null.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/app/run_report.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "common/base/json.hpp"

namespace tandem::client {

/// Returns the body that a run watches. It is the body that the user's tool holds at the start. If the tool holds none,
/// it is the first graspable body; if there is none, the id is invalid.
BodyId watched_body(const wire::Joined& joined);
/// Returns the server's notes about problems in the scene's files, limited in number and printable on a terminal.
std::vector<std::string> shown_notes(const wire::Joined& joined);

/// Returns a line of text with the scene, user id and tool. The tool is named because it depends on the order in which
/// users join.
std::string joined_line(const wire::Joined& joined);
/// Returns a text with the quantities (forces or torques) that the device cannot display; empty if it can display both.
std::string missing_of(const devices::DeviceSpec& device);

/// Returns the line that is printed every second: time of the run, session state, delays, displayed force.
std::string status_line(const ClientIoSnapshot& io, Duration length, const TickRecord& newest);

/// Returns the reason why a session is unusable at the end of its run; empty if the session is in a room and receives
/// states.
std::string problem_at_end(const ClientIoSnapshot& io, const SessionSettings& session);

/// Settings and results of a run: the input of to_json().
struct RunSummary {
  ClientOptions options;  ///< a run with these options repeats this run
  devices::DeviceSpec device;
  std::vector<std::string> realtime_not_granted;
  HapticLoopReport loop;
  std::uint64_t trace_overflows = 0;
  HapticCounters counters;
  ClientIoSnapshot io;
  std::vector<haptics::StabilityFinding> coupling_findings;  ///< findings for the current coupling
  BodyId watched;                                            ///< watched body; invalid if there is none
  std::string watched_name;
  RunReport run;
};

boost::json::object to_json(const RunSummary& summary);

}  // namespace tandem::client
