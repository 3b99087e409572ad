#include "lab/session/trace.hpp"

#include <optional>

namespace tandem::lab {

TickSample sample_of(const client::TickRecord& record) {
  TickSample sample;
  sample.tick = record.tick;
  sample.handle_W = record.handle_W;
  sample.tool_W = record.tool_W.X;
  sample.stage_D = record.stage_wrench_on_hand_D;
  sample.requested_D = record.stage_wrench_on_hand_D * record.passivity_gain;
  sample.displayed_D = record.displayed_on_hand_D;
  sample.server_wrench_W = record.server_wrench_on_hand_W;
  sample.state_age = record.state_age;
  sample.held_body = record.held_body;
  const std::optional<RigidState>& view_W = record.local_body_W ? record.local_body_W : record.watched_body_W;
  sample.has_view = view_W.has_value();
  if (view_W) sample.view_W = view_W->X.p;
  sample.safety_faults = record.safety_faults;
  sample.server_tick_faults = record.server_tick_faults;
  sample.is_clamped = record.is_clamped;
  return sample;
}

double energy_taken_j(const physics::World& world, std::size_t tool) {
  const physics::ToolState state = world.tool(tool);
  return state.energy_into_world_j - state.energy_from_world_j + world.coupling_energy_j(tool);
}

void note_answer(const server::Room& room, std::size_t tool, Duration time, std::vector<AnsweredInput>& answered) {
  const Tick tick = room.answered(tool);
  if (answered.empty() || answered.back().tick != tick) answered.push_back({time, tick});
  answered.back().taken_j = energy_taken_j(room.world(), tool);
}

}  // namespace tandem::lab
