// Formats the counters of a server as text for Prometheus (exposition format 0.0.4).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "server/net/live_server.hpp"

namespace tandem::server {

struct RoomFigures {
  std::string name;
  Duration period{0};
  bool is_awake = false;
  RoomTiming timing;
  std::array<std::uint64_t, kTickFaultBits> fault_steps{};
  double braked_j = 0;
  std::uint64_t events_lost = 0;
  bool is_recorded = false;  ///< if false, the next three members have no meaning
  std::uint64_t recorded_bytes = 0;
  std::uint64_t recorded_messages_lost = 0;
  std::uint64_t recorded_steps_lost = 0;
};

/// Values of all metrics at one moment. Counters never decrease while the server runs.
struct MetricsSnapshot {
  bool is_ready = false;
  bool is_healthy = false;
  ServerFigures server;
  std::vector<RoomFigures> rooms;  ///< values of the rooms, in the order of ServerFigures::users
  bool has_checkpoint = false;     ///< if false, the next two members have no meaning
  std::uint64_t checkpoint_writes = 0;
  std::uint64_t checkpoint_failures = 0;
};

/// Formats the metrics. Labels have values from fixed sets, except the names of rooms, which the operator chooses.
std::string metrics_text(const MetricsSnapshot& snapshot);

/// Returns processor time, memory and descriptors of this process, with the names that Prometheus' client libraries
/// use.
std::string process_metrics_text();

}  // namespace tandem::server
