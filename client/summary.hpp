// The one JSON object that a headless run ends with. Field names carry units; what is unknown is null.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "client/run_report.hpp"
#include "common/json/json.hpp"

namespace tandem {

/// The body that the run watched: the scene's first graspable one.
struct WatchedBody {
  BodyId id;
  std::string name;
};
std::optional<WatchedBody> first_graspable(const wire::Joined& joined);

/// Everything that a run leaves behind.
struct RunSummary {
  std::string stage;
  std::string room;  ///< as asked for; "": the server's only room
  std::string user;
  DeviceSpec device;
  std::vector<std::string> realtime_not_granted;
  HapticLoopReport loop;
  std::uint64_t trace_overflows = 0;
  HapticCounters counters;
  ClientIoSnapshot io;
  std::optional<WatchedBody> watched;
  RunReport run;
};

boost::json::object to_json(const RunSummary& summary);

/// "not_finite", "speed_limited", …: the bits of ServerUpdate::tick_faults by word, unknown ones by number.
std::vector<std::string> server_tick_fault_names(std::uint32_t faults);

}  // namespace tandem
