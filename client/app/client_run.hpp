// One headless run of tandem-client: everything that main() puts together, in the order in which it lives and dies.
//
//   main thread (client_run)           haptic thread (haptic_loop.hpp)     io thread (net/client_io.hpp)
//   join, then every 10 ms:            1 kHz: read, compute, write         sockets, session, simulated links
//   take tick records ◀──── ring ───── record
//   trace, report, status line         outbox ─────────── mailbox ───────▶ send
//                                      ◀───────────────── mailboxes ────── state, scene
//                                      ◀─ request_stop() ── signal thread (stop_signals.hpp)
//
// What main and io say is written by threads of their own (realtime/output.hpp), because a terminal may hang. Main may still
// hang where it writes its trace, so nothing that ends the force depends on it: the signal thread stops the haptic thread,
// which knows its duration and shows the hand out by itself.
//
// The haptic thread starts when the room is joined, so that the hand's path and the session share their zero, and
// stops first, so that the hand is let go while the session still stands.
#pragma once

#include "client/app/options.hpp"
#include "common/realtime/output.hpp"

namespace tandem::client {

/// Runs until the duration is over, a signal comes, or the session ends. Returns the exit code. block_stop_signals()
/// must come before.
///
/// Fails   std::invalid_argument, std::runtime_error or std::system_error: bad set-up, found before anything was
///         displayed
/// Thread  main
int run_client(const ClientOptions& options, realtime::Output& output);

}  // namespace tandem::client
