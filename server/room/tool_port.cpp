#include "server/room/tool_port.hpp"

#include <utility>

#include "proto/state.hpp"

namespace tandem::server {

void ToolPort::open(std::size_t tool, const haptics::CouplingParameters& bounds) noexcept {
  tool_ = tool;
  has_handle_ = false;
  passivity_.reset();
  world_.set_coupling_bounds(tool_, bounds);
  world_.activate_tool(tool_);
}

void ToolPort::close() noexcept {
  clear_handle();
  world_.deactivate_tool(tool_);
}

bool ToolPort::squeezes() const noexcept {
  const std::uint32_t own = 1U << tool_;
  for (std::size_t i = 0; i < proto::kMaxBodies; ++i) {
    const std::uint32_t hands = world_.hands_on(body_id_at(i));
    if ((hands & own) != 0 && (hands & ~own) != 0) return !state().held.is_valid();
  }
  return false;
}

void ToolPort::set_handle(const RigidState& handle) noexcept {
  world_.set_handle(tool_, handle);
  if (std::exchange(has_handle_, true)) return;
  passivity_.restart_handle(world_.energy_of_tool_j(tool_));
}

void ToolPort::clear_handle() noexcept {
  has_handle_ = false;
  world_.brake(tool_, 0);
  world_.clear_handle(tool_);
}

void ToolPort::report(double from_hand_j, double to_hand_j, double elapsed_s) noexcept {
  passivity_.hand_reported(from_hand_j, to_hand_j, elapsed_s);
}

TickFaults ToolPort::limit(double step_s) noexcept {
  if (!is_limited_) return 0;
  const physics::TouchSummary touch = world_.touch(tool_);
  const bool acts = state().held.is_valid() || touch.contacts > 0 || touch.soft_force_n > 0;
  const double brake_n_s_per_m = passivity_.brake_n_s_per_m(step_s, acts);
  world_.brake(tool_, brake_n_s_per_m);
  return brake_n_s_per_m > 0 ? TickFaults{kFaultToolEnergyLimited} : 0;
}

void ToolPort::settle() noexcept {
  if (!is_limited_) return;
  const physics::ToolState tool = state();
  const double net_into_world_j = tool.energy_into_world_j - tool.energy_from_world_j;
  passivity_.stepped(tool.tool.X, tool.pull_on_tool_W, net_into_world_j);
}

}  // namespace tandem::server
