// Who watches over a server from outside, and what he is told:
//
//   /metrics  Prometheus' text    /healthz  does all go on?    /readyz  can somebody join?    Agones' sidecar
//
//   room threads ──mailbox each 0.1 s, atomics──┐
//   io thread ─────mailbox each 0.1 s, atomics──┴▶ thread of the port; thread of the sidecar: both of normal priority
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/metrics/agones.hpp"
#include "server/metrics/http_port.hpp"
#include "server/metrics/metrics_text.hpp"
#include "server/metrics/room_meter.hpp"
#include "server/recording/server_checkpoint.hpp"
#include "server/recording/server_recorder.hpp"

namespace tandem::server {

/// Made before the rooms are loaded, so that who waits for them is answered. It outlives them.
class Monitor {
 public:
  /// In      metrics  [ADDRESS:]PORT of this machine's own; none: no port
  ///         agones   port of the sidecar; none: nobody is told
  ///         on_news  for people; called on threads of its own
  /// Fails   as HttpPort
  Monitor(const std::optional<std::string>& metrics, std::optional<std::uint16_t> agones,
          std::function<void(const std::string&)> on_news);
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Rooms are loaded; before run(), once. All that is given stays until what is returned goes, which is when the server has
  /// ended: the sidecar is told then, within about a second. What is null is not there.
  [[nodiscard]] std::shared_ptr<void> watch(LiveServer& server, const ServerRecorder* recorder = nullptr,
                                            const ServerCheckpoint* checkpoint = nullptr);
  /// Where it is asked, with the address; empty: nowhere.
  std::string address() const;

 private:
  void finish();
  std::optional<HttpAnswer> answer(const std::string& path);
  AgonesPlan::Seen seen();
  // With the lock.
  std::string standing_still() const;
  std::string not_ready() const;
  MetricsSnapshot snapshot();

  std::mutex mutex_;  ///< between the threads here and that of the calls above; neither io nor rooms take it
  LiveServer* server_ = nullptr;
  const ServerRecorder* recorder_ = nullptr;
  const ServerCheckpoint* checkpoint_ = nullptr;
  bool has_ended_ = false;
  std::vector<std::string> rooms_;
  std::vector<std::unique_ptr<RoomMeter>> meters_;
  std::unique_ptr<HttpPort> port_;
  std::unique_ptr<Agones> agones_;
};

}  // namespace tandem::server
