// Final report of a server for programs (--json).
#pragma once

#include "common/base/json.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_recorder.hpp"

namespace tandem::server {

/// Units are in the names; latencies are quantiles in microseconds.
/// In      recorder  finished; null: no recording
boost::json::object report_json(const LiveServer& server, const ServerRecorder* recorder = nullptr);

}  // namespace tandem::server
