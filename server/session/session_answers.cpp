#include "server/session/session_answers.hpp"

#include <algorithm>

#include "proto/soft_shape.hpp"
#include "server/room/wire_role.hpp"
#include "server/session/user_name.hpp"

namespace tandem::server {
namespace {

wire::ErrorCode error_of(physics::GrabResult result) {
  switch (result) {
    case physics::GrabResult::kUnknownBody:
      return wire::ERROR_UNKNOWN_BODY;
    case physics::GrabResult::kNotGraspable:
      return wire::ERROR_NOT_GRASPABLE;
    case physics::GrabResult::kOutOfReach:
      return wire::ERROR_OUT_OF_REACH;
    case physics::GrabResult::kAlreadyHolding:
      return wire::ERROR_ALREADY_HOLDING;
    case physics::GrabResult::kBusy:
      return wire::ERROR_NOT_ALLOWED;
    case physics::GrabResult::kGrabbed:
      break;
  }
  return wire::ERROR_UNSPECIFIED;
}

const char* text_of(physics::GrabResult result) {
  switch (result) {
    case physics::GrabResult::kUnknownBody:
      return "there is no such body to grab";
    case physics::GrabResult::kNotGraspable:
      return "that body cannot be grabbed (graspable is false in the scene)";
    case physics::GrabResult::kOutOfReach:
      return "no graspable body within limits.grab_reach_m of the tool";
    case physics::GrabResult::kAlreadyHolding:
      return "the tool already holds a body; release it first";
    case physics::GrabResult::kBusy:
      return kRoomBusy;
    case physics::GrabResult::kGrabbed:
      break;
  }
  return "refused";
}

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

/// Shortens a long note at a code point boundary.
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
    const auto sent = static_cast<std::size_t>(joined.notes_size());
    if (sent + 1 == kMaxNotes && notes.size() > kMaxNotes) {
      joined.add_notes("and " + std::to_string(notes.size() - sent) + " more, which the server's log names");
      return;
    }
    joined.add_notes(shortened(note));
  }
}

/// Fills the fields that are equal for all new users.
void fill(const LoadedScene& scene, wire::Joined& joined) {
  *joined.mutable_scene() = scene.description;
  for (const Asset& asset : scene.assets) fill(asset, *joined.add_assets());
  for (const physics::BodyDescription& body : scene.world.bodies) fill(body.mass, *joined.add_body_masses());
  for (const physics::ToolDescription& tool : scene.world.tools) fill(tool.mass, *joined.add_tool_masses());
  fill_notes(scene.notes_for_users, joined);
}

}  // namespace

std::string quoted(const std::string& text) {
  return is_acceptable_user_name(text) ? "\"" + text + "\"" : std::string("(unprintable)");
}

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

std::size_t joined_answer_bound(const LoadedScene& scene) {
  // Room for a user's numbers, and for coefficients that are zero in the description; rounded up.
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

wire::ServerControl grab_answer(const RoomEvent& event) {
  if (event.kind == RoomEvent::Kind::kGrabRefused) {
    return error_answer(event.request, error_of(event.refusal), text_of(event.refusal));
  }
  wire::ServerControl answer;
  answer.set_request(event.request);
  if (event.kind == RoomEvent::Kind::kGrabbed) {
    answer.mutable_grabbed()->set_body(event.body.value);
  } else {
    answer.mutable_released()->set_body(event.body.value);
  }
  return answer;
}

wire::ServerControl body_returned(BodyId body) {
  wire::ServerControl message;
  message.mutable_body_returned()->set_body(body.value);
  return message;
}

wire::ServerControl kept_pose(const wire::KeptPose& pose) {
  wire::ServerControl message;
  *message.mutable_kept_pose() = pose;
  return message;
}

wire::ServerControl room_reset(std::uint32_t request, UserId by) {
  wire::ServerControl message;
  message.set_request(request);
  message.mutable_room_reset()->set_user(by.value);
  return message;
}

wire::ServerControl soft_shape(std::size_t soft_body, const std::vector<Vec3>& offsets_W) {
  wire::ServerControl message;
  proto::write_soft_shape(soft_body, offsets_W, *message.mutable_soft_shape());
  return message;
}

wire::ServerControl parameter_set(const proto::CouplingField& field, const haptics::CouplingParameters& in_force) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name(std::string(field.name));
  message.mutable_parameter_set()->set_value(in_force.*field.value);
  return message;
}

wire::ServerControl law_set(std::string_view law) {
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name(std::string(proto::kLawParameter));
  message.mutable_parameter_set()->set_text(std::string(law));
  return message;
}

wire::ServerControl asset_answer(std::uint32_t request, const wire::GetAsset& wanted, const LoadedScene& scene) {
  const auto asset = std::find_if(scene.assets.begin(), scene.assets.end(), [&wanted](const Asset& candidate) {
    const auto* hash = reinterpret_cast<const char*>(candidate.sha256.data());
    return wanted.sha256() == std::string_view(hash, candidate.sha256.size());
  });
  if (asset == scene.assets.end()) {
    return error_answer(request, wire::ERROR_UNKNOWN_ASSET, "this room has no asset of that hash");
  }
  const proto::Bytes& bytes = *asset->bytes;
  if (wanted.offset() > bytes.size()) {
    return error_answer(request, wire::ERROR_BAD_VALUE, "the offset is past the asset's end");
  }
  wire::ServerControl answer;
  answer.set_request(request);
  wire::AssetChunk& chunk = *answer.mutable_asset_chunk();
  chunk.set_sha256(wanted.sha256());
  chunk.set_offset(wanted.offset());
  chunk.set_total_bytes(bytes.size());
  const auto offset = static_cast<std::size_t>(wanted.offset());
  const std::size_t bound = wanted.max_bytes() > 0 ? wanted.max_bytes() : proto::kAssetChunkBytes;
  chunk.set_data(bytes.data() + offset, std::min({bound, proto::kAssetChunkBytes, bytes.size() - offset}));
  return answer;
}

}  // namespace tandem::server
