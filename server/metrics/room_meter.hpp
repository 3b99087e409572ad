// Fault and energy counters of a room's steps, readable from any thread.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "server/room/room.hpp"

namespace tandem::server {

/// Counters of one room. Only the room's thread writes them; any thread may read them.
class RoomMeter final : public RoomWatcher {
 public:
  void on_command(const RoomCommand& /*command*/) noexcept override {}
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& room, ServerTime now, TickFaults faults) noexcept override;

  /// Returns the number of steps in which this bit of TickFault was set.
  std::uint64_t fault_steps(std::size_t bit) const { return fault_steps_[bit].load(std::memory_order_relaxed); }
  double braked_j() const { return braked_j_.load(std::memory_order_relaxed); }
  std::uint64_t events_lost() const { return events_lost_.load(std::memory_order_relaxed); }
  /// Returns whether the room was awake after the last step (see Room::is_idle()).
  bool is_awake() const { return is_awake_.load(std::memory_order_relaxed); }

 private:
  std::array<std::atomic<std::uint64_t>, kTickFaultBits> fault_steps_{};
  std::atomic<double> braked_j_{0};
  std::atomic<std::uint64_t> events_lost_{0};
  std::atomic<bool> is_awake_{false};
};

}  // namespace tandem::server
