// A trial in real time: the server's sockets and room thread, and for each user a client's haptic and io threads, over
// loopback and the live simulated links. It leaves the same trace as run_virtual_session(), so the same metrics can
// be had of it.
//
//   the caller's thread      per user: haptic thread           per user: io thread        server: room, io thread
//   join, one after another  HapticLoop, 1 kHz                 ClientIo                   LiveServer
//   says when hands start ──▶ hand starts on its path
//   every 10 ms: takes       ── ring: tick and true hand ──▶
//   what the rings hold
//   afterwards: rows at whole milliseconds
//
// What lines up with the virtual trial: all hands start at one whole millisecond, path time is counted from there, and
// row k of a user is its newest tick before k + 1 ms. A tick that the machine skipped repeats the one before it, which
// is what the hand felt; how many there were is counted.
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

/// How well the machine kept the time of one client.
struct LiveUserTiming {
  std::uint64_t ticks = 0;    ///< of the haptic thread since the hands started
  std::uint64_t skipped = 0;  ///< milliseconds without a tick of their own
  std::uint64_t lost = 0;     ///< records that this thread did not take in time
  client::HapticLoopReport loop;
};

struct LiveTiming {
  std::vector<LiveUserTiming> users;
  server::RoomTiming room;
  std::vector<std::string> realtime_not_granted;
};

/// Runs one trial of an experiment in real time.
///
/// Limits  errors of the local model and the coupling's check against the device are left out: tandem-client has no
///         setting for the first, and a virtual trial no check
/// In      beside   the virtual trial of the same experiment: seeds, names and the watched body are taken from it
///         on_tick  called on this thread for each haptic tick of a moving hand, at most some ten milliseconds late
/// Out     timing
/// Fails   std::invalid_argument: errors of the model; CouldNotJoin (says who and why); std::runtime_error,
///         std::system_error: no port, no thread
SessionTrace run_live_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                              const SessionTrace& beside, int realtime_priority, LiveTiming& timing,
                              const OnTick& on_tick = {});

}  // namespace tandem::lab
