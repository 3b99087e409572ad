// What a server did, for programs to read (--json).
#pragma once

#include "common/base/json.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_recorder.hpp"

namespace tandem::server {

/// Units are in the names; latencies as quantiles in microseconds.
/// In      recorder  finished; null: nothing was recorded
boost::json::object report_json(const LiveServer& server, const ServerRecorder* recorder = nullptr);

}  // namespace tandem::server
