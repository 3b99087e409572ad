// What programs outside read of a server:
//
//   /metrics  Prometheus' text    /healthz  does all go on?    /readyz  can somebody join?    Agones' sidecar
//
//   room threads ──mailbox each 0.1 s, atomics──┐
//   io thread ─────mailbox each 0.1 s, atomics──┴▶ thread of the port; thread of the sidecar: both of normal priority
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

/// Made before the rooms are loaded, so that its port answers meanwhile.
class Monitor {
 public:
  /// In      metrics  [ADDRESS:]PORT of this machine's own; none: no port
  ///         agones   port of the sidecar; none: there is none
  ///         on_news  for people; called on threads of its own
  /// Fails   as HttpPort
  Monitor(const std::optional<std::string>& metrics, std::optional<std::uint16_t> agones,
          std::function<void(const std::string&)> on_news);
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Rooms are loaded; before run(), once. Adds a service to the server. When that finishes the server has ended, and the sidecar
  /// receives so, within about a second.
  /// In      recorder, checkpoint  services of that server, added before; null: it has none
  void watch(LiveServer& server, const ServerRecorder* recorder = nullptr,
             const ServerCheckpoint* checkpoint = nullptr);
  /// Of the port; empty: there is none.
  std::string address() const;

 private:
  struct Impl;
  class Watch;
  std::shared_ptr<Impl> impl_;  ///< the service has it too: either may be destroyed first
};

}  // namespace tandem::server
