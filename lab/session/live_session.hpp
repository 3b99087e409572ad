// A trial in real time: the server's sockets and room thread, and for each user a client's haptic and io threads, over
// loopback and the live simulated links. It produces the same trace as run_virtual_session(), and thus the same
// metrics.
//
//   the caller's thread      per user: haptic thread           per user: io thread        server: room, io thread
//   join, in order           HapticLoop, 1 kHz                 ClientIo                   LiveServer
//   sets the start time ───▶ hand starts on its path
//   every 10 ms: empties     ── ring: tick and true hand ──▶
//   the rings
//   afterwards: rows at whole milliseconds
//
// Alignment with the virtual trial: all hands start at the same whole millisecond, path time counts from there, and row
// k of a user is its newest tick before k + 1 ms. A tick that the machine skipped repeats the previous one, as for the
// hand; skipped ticks are counted.
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
  std::uint64_t ticks = 0;    ///< ticks of the haptic thread since the hands started
  std::uint64_t skipped = 0;  ///< milliseconds without their own tick
  std::uint64_t lost = 0;     ///< records lost because the ring was full
  client::HapticLoopReport loop;
};

struct LiveTiming {
  std::vector<LiveUserTiming> users;
  server::RoomTiming room;
  std::vector<std::string> realtime_not_granted;
};

/// Runs one trial of an experiment in real time.
///
/// Limits  errors of the local model and the check of the coupling against the device are excluded: tandem-client has
///         no setting for the first, and a virtual trial has no check
/// In      beside   the virtual trial of the same experiment: source of seeds, names and the watched body
///         on_tick  called on this thread for each haptic tick of a moving hand, at most some ten milliseconds late
/// Out     timing
/// Fails   std::invalid_argument: errors of the model; CouldNotJoin (names user and reason); std::runtime_error,
///         std::system_error: no port, no thread
SessionTrace run_live_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                              const SessionTrace& beside, int realtime_priority, LiveTiming& timing,
                              const OnTick& on_tick = {});

}  // namespace tandem::lab
