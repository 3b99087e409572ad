// A run of tandem-client that begins with the start screen: choice, preparation, session, and back to the choice.
#pragma once

#include "client/app/client_run.hpp"
#include "client/app/options.hpp"
#include "common/realtime/output.hpp"

namespace tandem::client {

/// Shows the start screen, and runs the sessions that the user opens from it in the same window. Returns the exit code
/// when the user closes the window or a signal arrives.
///
/// Fails   std::runtime_error: there is no display; nothing has been started yet
/// Thread  main
int run_from_start(const ClientOptions& options, realtime::Output& output);
/// Like run_from_start() above, but continues in the window of a session that has ended.
int run_from_start(const ClientOptions& options, realtime::Output& output, Screen& screen, RunEnd::Next next);

}  // namespace tandem::client
