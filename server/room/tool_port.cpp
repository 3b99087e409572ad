#include "server/room/tool_port.hpp"

#include <cmath>
#include <utility>

#include "common/physics/tool_hand.hpp"
#include "proto/state.hpp"

namespace tandem::server {
namespace {

/// Factor by which the reported hand force may exceed the force limits of the coupling. Prediction and damping at the
/// client exceed these limits for a short time. The value is an assumption.
constexpr double kOverLimit = 2.0;

}  // namespace

void ToolPort::open(std::size_t tool, const haptics::CouplingParameters& bounds) noexcept {
  tool_ = tool;
  has_handle_ = false;
  reported_at_.reset();
  passivity_.reset();
  world_.set_coupling_bounds(tool_, bounds);
  world_.activate_tool(tool_);
}

void ToolPort::close() noexcept {
  clear_handle();
  world_.deactivate_tool(tool_);
}

bool ToolPort::runs_on() const noexcept {
  const std::uint32_t own = 1U << tool_;
  if (const BodyId held = state().held; held.is_valid()) {
    const physics::TouchSummary touch = world_.touch(tool_);
    return (touch.contacts == 0 && touch.soft_force_n == 0) || (world_.hands_on(held) & ~own) != 0;
  }
  for (std::size_t i = 0; i < proto::kMaxBodies; ++i) {
    const std::uint32_t hands = world_.hands_on(body_id_at(i));
    if ((hands & own) != 0 && (hands & ~own) != 0) return true;
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
  reported_at_.reset();
  brake_n_s_per_m_ = 0;
  world_.brake(tool_, 0);
  world_.clear_handle(tool_);
}

void ToolPort::report(const Pose& X_WH, double from_hand_j, double to_hand_j, double elapsed_s) noexcept {
  const Pose before = std::exchange(reported_at_, X_WH).value_or(X_WH);
  const haptics::CouplingParameters& limits = coupling();
  const double could_do_j = kOverLimit * (limits.force_limit_n * (X_WH.p - before.p).norm() +
                                          limits.torque_limit_n_m * X_WH.q.angularDistance(before.q));
  passivity_.hand_reported(from_hand_j, to_hand_j, elapsed_s, could_do_j);
}

TickFaults ToolPort::limit(double step_s) noexcept {
  if (!is_limited_) return 0;
  const physics::TouchSummary touch = world_.touch(tool_);
  const bool acts = state().held.is_valid() || touch.contacts > 0 || touch.soft_force_n > 0;
  step_s_ = step_s;
  brake_n_s_per_m_ = passivity_.brake_n_s_per_m(step_s, acts);
  world_.brake(tool_, brake_n_s_per_m_);
  return brake_n_s_per_m_ > 0 ? TickFaults{kFaultToolEnergyLimited} : 0;
}

void ToolPort::settle() noexcept {
  if (!is_limited_) return;
  const physics::ToolState tool = state();
  const double net_into_world_j = tool.energy_into_world_j - tool.energy_from_world_j;
  passivity_.stepped(tool.tool.X, tool.pull_on_tool_W, net_into_world_j);
  // The solver applies the brake of damping b at the velocities at the end of the step of length h. The dissipated
  // energy is therefore E = b (v² + (kBrakeLever_m ω)²) h with these velocities.
  const double lever_speed_m_per_s = physics::kBrakeLever_m * tool.tool.V.w.norm();
  const double speed_squared = tool.tool.V.v.squaredNorm() + lever_speed_m_per_s * lever_speed_m_per_s;
  const double braked_j = brake_n_s_per_m_ * speed_squared * step_s_;
  if (std::isfinite(braked_j)) braked_j_ += braked_j;
}

}  // namespace tandem::server
