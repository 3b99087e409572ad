// Performs those commands that need more than a request to the server (command.hpp). Each of these functions sends at
// most one request.
#include <utility>

#include "client/session/session_impl.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {

command::RequestPose pose_command(wire::AskPose::Kind kind, std::uint32_t number, const std::string& name,
                                  std::uint32_t tag) {
  command::RequestPose command;
  command.request.set_kind(kind);
  command.request.set_number(number);
  command.request.set_name(name);
  command.tag = tag;
  return command;
}

void ClientSession::send(const SessionCommand& command, LocalTime now) {
  std::visit([this, now](const auto& each) { impl_->perform(each, now); }, command);
}

void ClientSession::Impl::perform(const command::SetParameter& command, LocalTime /*now*/) {
  wire::SetParameter parameter;
  parameter.set_name(command.name);
  parameter.set_value(command.value);
  set(parameter);
}

void ClientSession::Impl::perform(const command::SetLaw& command, LocalTime /*now*/) {
  wire::SetParameter parameter;
  parameter.set_name(std::string(proto::kLawParameter));
  parameter.set_text(command.law);
  set(parameter);
}

/// Requests a change of a parameter or of the law. The number of the request is stored, so that a refusal of this
/// request can be recognised and counted.
void ClientSession::Impl::set(const wire::SetParameter& parameter) {
  request([&](wire::ClientControl& message) {
    *message.mutable_set_parameter() = parameter;
    settings_requested.push_back(last_request + 1);
  });
  if (settings_requested.size() > kRemembered) settings_requested.pop_front();
}

void ClientSession::Impl::perform(const command::RequestPose& command, LocalTime /*now*/) {
  const bool is_active = status.state == SessionState::kActive;
  request([&](wire::ClientControl& message) { *message.mutable_ask_pose() = command.request; });
  if (command.tag == 0) return;
  // Outside a room no request was sent, and last_request is the number of an earlier request. The pose request is noted
  // under that number and refused immediately below.
  poses.await(last_request, command.tag);
  if (!is_active) refuse_poses(status.why);
}

void ClientSession::Impl::perform(const command::ChangeRoom& command, LocalTime now) {
  if (status.state != SessionState::kActive || command.room == room) return;
  if (credentials.are_requested() && (credentials.are_for_one_room() || !credentials.can_return())) {
    return report("the invitation was for one room; ask for one for room " + printable(command.room));
  }
  room_left = room;
  enter_room(command.room, now);
}

void ClientSession::Impl::perform(const command::SetWorkspace& command, LocalTime /*now*/) {
  scene.set_workspace(command.workspace);
}

void ClientSession::Impl::perform(const command::SetNudges& command, LocalTime /*now*/) {
  settings.has_nudges = command.has_nudges;
  scene.set_nudges(command.has_nudges);
}

}  // namespace tandem::client
