#include "client/recording/tick_codec.hpp"

#include <algorithm>

#include "proto/recording/exact_state.hpp"

namespace tandem::client {
namespace {

using proto::read_exact;
using proto::write_exact;

void write(const Wrench& from, google::protobuf::RepeatedField<double>& to) {
  for (const double number : from.f) to.Add(number);
  for (const double number : from.t) to.Add(number);
}

Wrench read(const google::protobuf::RepeatedField<double>& from) {
  if (from.size() != 6) return {};
  return {{from[0], from[1], from[2]}, {from[3], from[4], from[5]}};
}

std::uint64_t ns_of(LocalTime time) {
  return static_cast<std::uint64_t>(time.time_since_epoch().count());
}

LocalTime time_of(std::uint64_t ns) {
  return LocalTime(Duration(static_cast<Duration::rep>(ns)));
}

}  // namespace

wire::RecordedTick recorded(const TickRecord& tick, int phase) {
  wire::RecordedTick out;
  out.set_tick(tick.tick.value);
  out.set_at_ns(ns_of(tick.at));
  wire::RecordedSample& sample = *out.mutable_sample();
  sample.set_taken_ns(ns_of(tick.sample.taken));
  sample.set_device_state(static_cast<std::uint32_t>(tick.sample.state));
  sample.set_is_valid(tick.sample.is_valid);
  write_exact(RigidState{tick.sample.X_DH, tick.sample.V_DH}, *sample.mutable_hand());
  sample.set_buttons(tick.sample.buttons);
  write_exact(tick.handle_W, *out.mutable_handle());
  write_exact(tick.tool_W, *out.mutable_tool());
  write(tick.stage_wrench_on_hand_D, *out.mutable_stage_wrench());
  write(tick.displayed_on_hand_D, *out.mutable_displayed());
  write(tick.server_wrench_on_hand_W, *out.mutable_server_wrench());
  out.set_state_age_ns(tick.state_age.count());
  out.set_newest_step(tick.newest_step.value);
  out.set_server_tick_faults(tick.server_tick_faults);
  out.set_held_body(tick.held_body.value);
  if (tick.watched_body_W) write_exact(*tick.watched_body_W, *out.mutable_watched_body());
  if (tick.is_local) write_exact(tick.local_tool_W, *out.mutable_local_tool());
  if (tick.local_body_W) write_exact(*tick.local_body_W, *out.mutable_local_body());
  out.set_is_predicting(tick.is_predicting);
  out.set_passivity_gain(tick.passivity_gain);
  out.set_passivity_withheld_j(tick.passivity_withheld_j);
  out.set_scene_generation(tick.scene_generation);
  out.set_safety_faults(tick.safety_faults);
  out.set_is_clamped(tick.is_clamped);
  out.set_phase(phase);
  return out;
}

TickRecord tick_of(const wire::RecordedTick& in) {
  TickRecord tick;
  tick.tick = Tick{in.tick()};
  tick.at = time_of(in.at_ns());
  tick.sample.taken = time_of(in.sample().taken_ns());
  tick.sample.state = static_cast<devices::DeviceState>(
      std::min(in.sample().device_state(), static_cast<std::uint32_t>(devices::DeviceState::kLost)));
  tick.sample.is_valid = in.sample().is_valid();
  const RigidState hand = read_exact(in.sample().hand());
  tick.sample.X_DH = hand.X;
  tick.sample.V_DH = hand.V;
  tick.sample.buttons = in.sample().buttons();
  tick.handle_W = read_exact(in.handle());
  tick.tool_W = read_exact(in.tool());
  tick.stage_wrench_on_hand_D = read(in.stage_wrench());
  tick.displayed_on_hand_D = read(in.displayed());
  tick.server_wrench_on_hand_W = read(in.server_wrench());
  tick.state_age = Duration(in.state_age_ns());
  tick.newest_step = Step{in.newest_step()};
  tick.server_tick_faults = in.server_tick_faults();
  tick.held_body = BodyId{in.held_body()};
  if (in.has_watched_body()) tick.watched_body_W = read_exact(in.watched_body());
  tick.is_local = in.has_local_tool();
  if (tick.is_local) tick.local_tool_W = read_exact(in.local_tool());
  if (in.has_local_body()) tick.local_body_W = read_exact(in.local_body());
  tick.is_predicting = in.is_predicting();
  tick.passivity_gain = in.passivity_gain();
  tick.passivity_withheld_j = in.passivity_withheld_j();
  tick.scene_generation = in.scene_generation();
  tick.safety_faults = static_cast<haptics::SafetyFaults>(in.safety_faults());
  tick.is_clamped = in.is_clamped();
  return tick;
}

}  // namespace tandem::client
