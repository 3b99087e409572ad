#include "client/embed/c_structs.hpp"

#include <variant>

#include "client/embed/sized_struct.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client::embed {
namespace {

void copy(const Vec3& from, double (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

std::uint32_t c_state(SessionState state) {
  switch (state) {
    case SessionState::kActive:
      return TANDEM_JOINED;
    case SessionState::kEnded:
      return TANDEM_SESSION_ENDED;
    default:
      return TANDEM_CONNECTING;
  }
}

EventAndText of_kind(std::uint32_t kind, std::string text = {}) {
  EventAndText made;
  made.event.kind = kind;
  made.text = std::move(text);
  return made;
}

EventAndText converted(const event::StateChanged& event) {
  EventAndText made = of_kind(TANDEM_EVENT_STATE, event.why);
  made.event.code = c_state(event.state);
  return made;
}
EventAndText converted(const event::Joined& event) {
  EventAndText made = of_kind(TANDEM_EVENT_JOINED, event.answer->scene().name());
  made.event.user = event.answer->user();
  return made;
}
EventAndText converted(const event::UserJoined& event) {
  EventAndText made = of_kind(TANDEM_EVENT_USER_JOINED, event.user.name());
  made.event.user = event.user.user();
  made.event.code = static_cast<std::uint32_t>(event.user.role());
  return made;
}
EventAndText converted(const event::UserLeft& event) {
  EventAndText made = of_kind(TANDEM_EVENT_USER_LEFT);
  made.event.user = event.user.value;
  return made;
}
EventAndText converted(const event::Grabbed& event) {
  EventAndText made = of_kind(TANDEM_EVENT_GRABBED);
  made.event.body = event.body.value;
  return made;
}
EventAndText converted(const event::Released& event) {
  EventAndText made = of_kind(TANDEM_EVENT_RELEASED);
  made.event.body = event.body.value;
  return made;
}
EventAndText converted(const event::ParameterSet& event) {
  if (event.parameter.name() == proto::kLawParameter) return of_kind(TANDEM_EVENT_LAW_SET, event.parameter.text());
  EventAndText made = of_kind(TANDEM_EVENT_PARAMETER_SET, event.parameter.name());
  made.event.value = event.parameter.value();
  return made;
}
EventAndText converted(const event::Refused& event) {
  EventAndText made = of_kind(TANDEM_EVENT_REFUSED, event.error.text());
  made.event.code = static_cast<std::uint32_t>(event.error.code());
  return made;
}
EventAndText converted(const event::PoseAnswered& event) {
  EventAndText made = of_kind(TANDEM_EVENT_POSE_ANSWERED);
  made.event.tag = event.tag;
  made.event.code = event.answer.has_error() ? 0 : 1;
  if (event.answer.has_error()) made.text = event.answer.error().text();
  if (event.answer.has_pose_taken()) made.text = event.answer.pose_taken().text();
  if (event.answer.has_kept_pose()) made.text = event.answer.kept_pose().name();
  return made;
}
EventAndText converted(const event::News& event) {
  return of_kind(TANDEM_EVENT_NEWS, event.text);
}
EventAndText converted(const event::Log& event) {
  return of_kind(TANDEM_EVENT_LOG, event.text);
}

}  // namespace

tandem_pose c_pose(const Pose& X) {
  tandem_pose pose{};
  copy(X.p, pose.position_m);
  pose.rotation_wxyz[0] = X.q.w();
  pose.rotation_wxyz[1] = X.q.x();
  pose.rotation_wxyz[2] = X.q.y();
  pose.rotation_wxyz[3] = X.q.z();
  return pose;
}

tandem_twist c_twist(const Twist& V) {
  tandem_twist twist{};
  copy(V.v, twist.linear_m_per_s);
  copy(V.w, twist.angular_rad_per_s);
  return twist;
}

tandem_wrench c_wrench(const Wrench& F) {
  tandem_wrench wrench{};
  copy(F.f, wrench.force_n);
  copy(F.t, wrench.torque_n_m);
  return wrench;
}

tandem_tick c_tick(const TickRecord& record) {
  const RigidState& tool = record.is_local ? record.local_tool_W : record.tool_W;
  tandem_tick tick{};
  tick.safety = record.safety_faults;
  tick.number = record.tick.value;
  tick.time_ns = record.at.time_since_epoch().count();
  tick.server_step = record.newest_step.value;
  tick.state_age_s = to_seconds(record.state_age);
  tick.buttons = record.sample.buttons;
  tick.held_body = record.held_body.value;
  tick.is_sample_valid = record.sample.is_valid ? 1 : 0;
  tick.is_local = record.is_local ? 1 : 0;
  tick.device_D = c_pose(record.sample.X_DH);
  tick.handle_W = c_pose(record.handle_W.X);
  tick.handle_velocity_W = c_twist(record.handle_W.V);
  tick.tool_W = c_pose(tool.X);
  tick.tool_velocity_W = c_twist(tool.V);
  tick.on_hand_D = c_wrench(record.displayed_on_hand_D);
  return tick;
}

tandem_snapshot c_snapshot(const View& view) {
  tandem_snapshot snapshot{};
  snapshot.has_state = view.has_state ? 1 : 0;
  snapshot.step = view.record.newest_step.value;
  snapshot.server_faults = view.record.server_tick_faults;
  snapshot.body_count = static_cast<std::uint32_t>(view.bodies.size());
  snapshot.user_count = static_cast<std::uint32_t>(view.users.size());
  snapshot.field_energy_kj_per_mol = view.record.field_energy_kj_per_mol;
  return snapshot;
}

tandem_body c_body(const proto::BodyState& state, const wire::Scene& scene) {
  tandem_body body{};
  body.id = state.id.value;
  body.held_by = state.held_by.value;
  body.pose_W = c_pose(state.state.X);
  body.velocity_W = c_twist(state.state.V);
  const auto index = static_cast<int>(state.id.value) - 1;
  if (index >= 0 && index < scene.bodies_size()) cut_text(scene.bodies(index).name(), body.name);
  return body;
}

tandem_user c_user(const proto::OtherUserState& state, const wire::UserJoined& known) {
  tandem_user user{};
  user.id = state.id.value;
  user.role = static_cast<std::uint32_t>(known.role());
  user.holds = state.holds.value;
  user.tool_W = c_pose(state.tool.X);
  cut_text(known.name(), user.name);
  return user;
}

tandem_session c_session(const ClientIoSnapshot& io) {
  tandem_session session{};
  session.state = c_state(io.status.state);
  if (io.joined != nullptr) {
    session.user = io.joined->user();
    session.role = static_cast<std::uint32_t>(io.joined->role());
  }
  session.reconnects = static_cast<std::uint32_t>(io.counters.reconnects);
  session.lost_events = io.events_dropped;
  session.round_trip_s = io.clock.is_known ? to_seconds(io.clock.round_trip) : 0;
  cut_text(io.room, session.room);
  cut_text(std::string(io.law), session.law);
  cut_text(io.rendering.stage.name, session.stage);
  cut_text(io.status.why, session.reason);
  return session;
}

EventAndText c_event(const Event& event) {
  return std::visit([](const auto& each) { return converted(each); }, event);
}

}  // namespace tandem::client::embed
