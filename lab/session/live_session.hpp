// A trial in real time. It uses the server's sockets and room thread, and a haptic thread and an io thread for each
// user, over loopback and simulated links. Its trace has the same form as that of run_virtual_session(), so that the
// same metrics apply.
//
//   the caller's thread      per user: haptic thread           per user: io thread        server: room, io thread
//   join, in order           HapticLoop, 1 kHz                 ClientIo                   LiveServer
//   sets the start time ───▶ hand starts on its path
//   every 10 ms: empties     ── ring: tick and true hand ──▶
//   the rings
//   at the end: rows at whole milliseconds
//
// Alignment with the virtual trial: all hands start at the same whole millisecond, which is time 0 of their paths. Row
// k of a user contains the newest tick before k + 1 ms. If the machine skipped a tick, the row repeats the previous
// tick and is counted.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/haptics/haptic_loop.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"
#include "server/net/live_server.hpp"

namespace tandem::lab {

/// Timing quality of one client.
struct LiveUserTiming {
  std::uint64_t ticks = 0;  ///< ticks of the haptic thread since the hands started
  /// Number of rows of the trace that repeat the previous tick. A row stands for one millisecond; it repeats the
  /// previous tick if no tick ran in that millisecond.
  std::uint64_t skipped = 0;
  std::uint64_t lost = 0;  ///< number of records lost because the ring buffer was full
  client::HapticLoopReport loop;
};

struct LiveTiming {
  std::vector<LiveUserTiming> users;
  server::RoomTiming room;
  std::vector<std::string> realtime_not_granted;
};

/// Runs one trial of an experiment in real time.
///
/// Limits an experiment with model errors is refused, because tandem-client has no setting for them. The client's check
/// of the coupling against the device is off, because a virtual trial has no such check
/// In      beside   trace of the virtual trial of the same experiment, from which seeds, names and the watched body are
///         copied
///         on_tick  called on the caller's thread for each haptic tick of a moving hand, about 10 ms after the tick at
///         the latest
/// Out     timing   timing quality of the clients and of the room
/// Fails   std::invalid_argument: the experiment has model errors; CouldNotJoin (names user and reason);
///         std::runtime_error, std::system_error: a port or a thread cannot be created
SessionTrace run_live_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                              const SessionTrace& beside, int realtime_priority, LiveTiming& timing,
                              const OnTick& on_tick = {});

}  // namespace tandem::lab
