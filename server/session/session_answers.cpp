#include "server/session/session_answers.hpp"

#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "server/room/wire_role.hpp"

namespace tandem::server {
namespace {

void fill(const Asset& asset, wire::AssetInfo& info) {
  info.set_sha256(asset.sha256.data(), asset.sha256.size());
  info.set_size_bytes(asset.bytes->size());
  info.set_kind(asset.kind);
  info.set_name(asset.name);
  if (asset.coarse_of) info.set_coarse_of(asset.coarse_of->data(), asset.coarse_of->size());
}

void fill(const MassProperties& mass, wire::MassProperties& out) {
  out.set_mass_kg(mass.mass_kg);
  if (!(mass.mass_kg > 0)) return;
  const Pose& X_BC = mass.X_BC;
  for (const double number : X_BC.p) out.add_centre(number);
  for (const double number : {X_BC.q.w(), X_BC.q.x(), X_BC.q.y(), X_BC.q.z()}) out.add_centre(number);
  for (const double number : mass.principal_inertia_kg_m2) out.add_principal_inertia_kg_m2(number);
}

/// Shortens a note to kMaxNoteBytes, at the boundary of a code point.
std::string shortened(std::string note) {
  constexpr std::size_t kMaxNoteBytes = 400;
  if (note.size() <= kMaxNoteBytes) return note;
  std::size_t end = kMaxNoteBytes - std::string_view("…").size();
  while (end > 0 && (static_cast<unsigned char>(note[end]) >> 6U) == 0x2) --end;
  return note.substr(0, end) + "…";
}

void fill_notes(const std::vector<std::string>& notes, wire::Joined& joined) {
  constexpr std::size_t kMaxNotes = 20;
  for (const std::string& note : notes) {
    const auto listed = static_cast<std::size_t>(joined.notes_size());
    if (listed + 1 == kMaxNotes && notes.size() > kMaxNotes) {
      joined.add_notes("and " + std::to_string(notes.size() - listed) + " more, which the server's log names");
      return;
    }
    joined.add_notes(shortened(note));
  }
}

/// Sets the fields that are the same for every new user.
void fill(const LoadedScene& scene, wire::Joined& joined) {
  *joined.mutable_scene() = scene.description;
  for (const Asset& asset : scene.assets) fill(asset, *joined.add_assets());
  for (const physics::BodyDescription& body : scene.world.bodies) fill(body.mass, *joined.add_body_masses());
  for (const physics::ToolDescription& tool : scene.world.tools) fill(tool.mass, *joined.add_tool_masses());
  fill_notes(scene.notes_for_users, joined);
}

}  // namespace

wire::ServerControl error_answer(std::uint32_t request, wire::ErrorCode code, const std::string& text) {
  wire::ServerControl answer;
  answer.set_request(request);
  answer.mutable_error()->set_code(code);
  answer.mutable_error()->set_text(text);
  return answer;
}

wire::ServerControl goodbye(std::uint32_t request, wire::DisconnectReason reason, const std::string& text) {
  wire::ServerControl message;
  message.set_request(request);
  message.mutable_goodbye()->set_reason(reason);
  message.mutable_goodbye()->set_text(text);
  return message;
}

wire::ServerControl welcome_answer(std::uint32_t request, const HubSettings& settings) {
  wire::ServerControl answer;
  answer.set_request(request);
  wire::Welcome& welcome = *answer.mutable_welcome();
  welcome.set_protocol_version(proto::kProtocolVersion);
  welcome.set_program("tandem-server");
  welcome.add_capabilities(proto::kCapabilityStateUdp);
  welcome.add_capabilities(proto::kCapabilityStateTcp);
  welcome.set_datagram_port(settings.datagram_port);
  welcome.set_silence_timeout_ms(static_cast<std::uint32_t>(settings.silence_timeout / std::chrono::milliseconds(1)));
  return answer;
}

wire::ServerControl joined_answer(std::uint32_t request, const RoomSeats& seats, const Seat& seat) {
  const LoadedScene& scene = seats.room().scene();
  wire::ServerControl answer;
  answer.set_request(request);
  wire::Joined& joined = *answer.mutable_joined();
  joined.set_user(seat.user.value);
  joined.set_role(wire_role(seat.role));
  fill(scene, joined);
  joined.mutable_scene()->mutable_coupling()->set_law(std::string(seats.coupling().law));
  const haptics::CouplingParameters coupling = seats.coupling_in_force(seat);
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    (joined.mutable_scene()->mutable_coupling()->*field.set)(coupling.*field.value);
  }
  joined.set_tool(seat.tool);
  if (seats.start().is_used()) *joined.mutable_start() = seats.start().message();
  return answer;
}

wire::ServerControl joined_source_answer(std::uint32_t request, const LoadedScene& scene, const Seat& source) {
  wire::ServerControl answer;
  answer.set_request(request);
  wire::Joined& joined = *answer.mutable_joined();
  joined.set_user(source.user.value);
  joined.set_role(wire::ROLE_SIGNAL);
  for (const wire::GameSignal& signal : scene.description.game().signals()) joined.add_signals(signal.name());
  return answer;
}

std::size_t joined_answer_bound(const LoadedScene& scene) {
  // Allowance, rounded up, for the fields that depend on the user and for coefficients that the scene description omits
  // [bytes].
  constexpr std::size_t kBesides = 256;
  wire::Joined joined;
  fill(scene, joined);
  return joined.ByteSizeLong() + kBesides;
}

wire::ServerControl room_start(const RoomStart& start) {
  wire::ServerControl message;
  *message.mutable_room_start() = start.message();
  return message;
}

wire::ServerControl user_joined(const Seat& seat, const std::string& name) {
  wire::ServerControl message;
  message.mutable_user_joined()->set_user(seat.user.value);
  message.mutable_user_joined()->set_name(name);
  message.mutable_user_joined()->set_role(wire_role(seat.role));
  if (!seat.is_manipulator()) return message;
  message.mutable_user_joined()->set_tool(seat.tool);
  proto::write_bounds(seat.coupling_bounds, *message.mutable_user_joined()->mutable_coupling_bounds());
  return message;
}

wire::ServerControl user_left(const Seat& seat, wire::DisconnectReason reason) {
  wire::ServerControl message;
  message.mutable_user_left()->set_user(seat.user.value);
  message.mutable_user_left()->set_reason(reason);
  return message;
}

}  // namespace tandem::server
