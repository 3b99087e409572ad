// Final report of a server as JSON, for other programs (--json).
#pragma once

#include "common/base/json.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_recorder.hpp"

namespace tandem::server {

/// Returns the report of a stopped server. The names of its fields end with the unit of the value. Latencies are given
/// as quantiles in microseconds.
/// In      recorder  already finished; null: no recording
boost::json::object report_json(const LiveServer& server, const ServerRecorder* recorder = nullptr);

}  // namespace tandem::server
