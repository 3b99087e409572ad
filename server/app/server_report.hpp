// What a server did, for programs to read (--json).
#pragma once

#include "common/base/json.hpp"
#include "server/net/live_server.hpp"

namespace tandem::server {

/// Units are in the names; latencies as quantiles in microseconds.
boost::json::object report_json(const LiveServer& server);

}  // namespace tandem::server
