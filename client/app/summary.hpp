// The one JSON object that a headless run ends with. Field names carry units; what is unknown is null.
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

/// The body that a run watches: the one that the user's tool holds from the start, else the first that can be grasped;
/// the invalid id when there is none.
BodyId watched_body(const wire::Joined& joined);
/// What the server says of the scene's files, fit for a terminal and bounded.
std::vector<std::string> shown_notes(const wire::Joined& joined);

/// What a user got: two that join together may get each other's tool.
std::string joined_line(const wire::Joined& joined);
/// What of a scene with forces and torques this device cannot show; empty: nothing.
std::string missing_of(const devices::DeviceSpec& device);

/// For a person, each second: time of the run, session, delays, what the hand feels.
std::string status_line(const ClientIoSnapshot& io, Duration length, const TickRecord& newest);

/// Why a session is of no use at the end of its run; empty: it is in a room, and states arrive.
std::string problem_at_end(const ClientIoSnapshot& io, const SessionSettings& session);

/// Everything that a run leaves behind.
struct RunSummary {
  ClientOptions options;  ///< as given: what it takes to repeat the run
  devices::DeviceSpec device;
  std::vector<std::string> realtime_not_granted;
  HapticLoopReport loop;
  std::uint64_t trace_overflows = 0;
  HapticCounters counters;
  ClientIoSnapshot io;
  std::vector<haptics::StabilityFinding> coupling_findings;  ///< of the coupling in force
  BodyId watched;                                            ///< invalid: none
  std::string watched_name;
  RunReport run;
};

boost::json::object to_json(const RunSummary& summary);

}  // namespace tandem::client
