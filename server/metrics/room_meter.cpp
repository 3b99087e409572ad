#include "server/metrics/room_meter.hpp"

namespace tandem::server {

void RoomMeter::on_step(const Room& room, ServerTime /*now*/, TickFaults faults) noexcept {
  for (std::size_t bit = 0; faults != 0 && bit < kTickFaultBits; ++bit) {
    if ((faults & (TickFaults{1} << bit)) != 0) fault_steps_[bit].fetch_add(1, std::memory_order_relaxed);
  }
  braked_j_.store(room.braked_j(), std::memory_order_relaxed);
  events_lost_.store(room.events_lost(), std::memory_order_relaxed);
  is_awake_.store(!room.is_idle(), std::memory_order_relaxed);
}

}  // namespace tandem::server
