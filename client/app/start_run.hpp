// A run of tandem-client that begins with the start screen: choose, prepare, session, and back.
#pragma once

#include "client/app/client_run.hpp"
#include "client/app/options.hpp"
#include "common/realtime/output.hpp"

namespace tandem::client {

/// Shows the start screen until the user closes the window or a signal arrives, and runs the sessions that the user
/// opens in the same window. Returns the exit code.
///
/// Fails   std::runtime_error: there is no display; nothing has been started
/// Thread  main
int run_from_start(const ClientOptions& options, realtime::Output& output);
/// The same after a session, in a window that is open already.
int run_from_start(const ClientOptions& options, realtime::Output& output, Screen& screen, RunEnd::Next next);

}  // namespace tandem::client
