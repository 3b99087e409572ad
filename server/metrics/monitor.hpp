// Interfaces through which other programs monitor a server:
//
//   /metrics  Prometheus text    /healthz  do all loops run?    /readyz  can users join?    Agones' sidecar
//
//   room threads ──mailbox every 0.1 s, atomics──┐
//   io thread ─────mailbox every 0.1 s, atomics──┴▶ threads of the port and of the sidecar, of normal priority
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/metrics/agones.hpp"
#include "server/metrics/http_port.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_checkpoint.hpp"
#include "server/recording/server_recorder.hpp"

namespace tandem::server {

/// Monitors one server. It exists before the rooms are loaded, so that its port answers during the loading.
class Monitor {
 public:
  /// In      metrics  [ADDRESS:]PORT with a local address; none: no port
  ///         agones   port of the sidecar; none: no sidecar
  ///         on_news  receives messages for the operator; called on the threads of the port and of the sidecar
  /// Fails   see HttpPort
  Monitor(const std::optional<std::string>& metrics, std::optional<std::uint16_t> agones,
          std::function<void(const std::string&)> on_news);
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Starts to monitor the server. Call it once, after its rooms are loaded and before run(). It adds a service to the
  /// server. When that service finishes, the sidecar is notified within about a second that the server has ended.
  /// In      recorder, checkpoint  services that have been added to that server; null: none
  void watch(LiveServer& server, const ServerRecorder* recorder = nullptr,
             const ServerCheckpoint* checkpoint = nullptr);
  /// Address of the port; empty: no port is open.
  std::string address() const;

 private:
  struct Impl;
  class Watch;
  std::shared_ptr<Impl> impl_;  ///< shared with the service, because either of the two may be destroyed first
};

}  // namespace tandem::server
