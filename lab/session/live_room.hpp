// The server of a live trial: the live server's transport, hub and room thread, and what the world holds after each
// step.
//
//   room thread                             io thread
//   Room::step() ──mailboxes, rings──▶      SessionHub::poll(): updates and answers go out
//   what the world holds → samples          SessionHub::on_…: what the sockets bring
//        └──────── eventfd ─────────▶       wakes at once after each step
//
// Why not LiveServer: nobody else may look at a world while its room thread steps it, and LiveServer has no hook there.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"
#include "server/net/room_scheduler.hpp"

namespace tandem::lab {

/// Serves one room on a loopback port of its own choice until stop().
class LiveRoom {
 public:
  /// Fails   std::runtime_error, std::system_error: no port, no thread
  LiveRoom(std::shared_ptr<const server::LoadedScene> scene, const Experiment& experiment, int realtime_priority);
  /// Stops.
  ~LiveRoom();
  LiveRoom(const LiveRoom&) = delete;
  LiveRoom& operator=(const LiveRoom&) = delete;

  std::uint16_t port() const;
  /// Samples are taken from then on, for the experiment's duration at most.
  void record_from(LocalTime start);
  /// Idempotent. Everything below is for afterwards.
  void stop();

  /// Every sample_period, and after every step.
  std::vector<BodiesSample>& bodies();
  std::vector<StoredEnergySample>& stored();
  const server::HubCounters& counters() const;
  std::uint64_t steps() const;
  server::RoomTiming timing() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab
