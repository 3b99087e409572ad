// One run of tandem-client, with a window or headless. It owns all parts of the program, and starts and stops them in
// order.
//
//   main thread (client_run)           haptic thread (haptic_loop.hpp)     io thread (net/client_io.hpp)
//   join, then every 10 ms:            1 kHz: read, compute, write         sockets, session, simulated links
//   read tick records ◀──── ring ───── record
//   trace, report, status line         outbox ─────────── mailbox ───────▶ send
//                                      ◀───────────────── mailboxes ────── state, scene
//                                      ◀─ request_stop() ── signal thread (stop_signals.hpp)
//
// Separate threads write the output of the main thread and of the io thread (realtime/output.hpp), because a terminal
// may block. The main thread may still block when it writes its trace, so ending the force must not depend on the main
// thread. The haptic thread ends by itself after the duration, or when the signal thread stops it. In both cases it
// ramps the force down.
//
// The haptic thread starts when the room is joined. So the hand's path and the session have the same time zero. At the
// end of a run, the haptic thread stops first, because the session must still be open while the force is ramped down.
#pragma once

#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "common/realtime/output.hpp"

namespace tandem::client {

class Screen;

/// End of a run: exit code and request for a next session.
struct RunEnd {
  enum class Next { kQuit, kOpen, kHost, kGuide };
  int code = 0;
  Next next = Next::kQuit;  ///< other values: return to the start screen for another scene or the guide
};

/// Runs until the duration is over, a signal arrives, or the session ends. Returns the exit code. The caller must have
/// called block_stop_signals().
///
/// Fails   std::invalid_argument, std::runtime_error or std::system_error if the set-up is wrong. This is detected
///         before any force is displayed
/// Thread  main
int run_client(const ClientOptions& options, realtime::Output& output);
/// Like run_client() above, but in a window that is already open.
/// In      invitations  shown in the window, so that the user can pass them on to other users
/// Out     has_begun    set to true when the haptic loop starts; valid even if the call throws later
RunEnd run_client(const ClientOptions& options, realtime::Output& output, Screen& screen,
                  const std::vector<std::string>& invitations, bool& has_begun);

}  // namespace tandem::client
