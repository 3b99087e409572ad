#include <algorithm>
#include <cmath>
#include <utility>

#include "client/session/session_impl.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/placement.hpp"
#include "proto/soft_shape.hpp"

namespace tandem::client {
namespace {

/// Returns true for refusals after which a retry may succeed: the room or server is full, possibly because the user's
/// previous connection still occupies a seat.
bool may_pass(wire::ErrorCode code) {
  return code == wire::ERROR_ROOM_FULL || code == wire::ERROR_SERVER_FULL;
}

}  // namespace

void ClientSession::Impl::receive_control_bytes(std::span<const std::byte> bytes, LocalTime now) {
  if (status.state == SessionState::kEnded || status.state == SessionState::kWaiting) return;
  counters.bytes_received += bytes.size();
  if (!reader.feed(bytes)) {
    lose(now, "protocol error: the server announced a control message that is too long");
    return;
  }
  wire::ServerControl message;
  while (status.state != SessionState::kEnded && status.state != SessionState::kWaiting) {
    const auto payload = reader.next();
    if (!payload) return;
    if (!proto::parse_control(*payload, message)) {
      lose(now, "protocol error: a control message of the server could not be read");
      return;
    }
    handle(message, now);
  }
}

void ClientSession::Impl::handle(const wire::ServerControl& message, LocalTime now) {
  if (message.has_welcome() && status.state == SessionState::kGreeting) {
    receive_welcome(message.welcome(), now);
  } else if (message.has_joined() && status.state == SessionState::kJoining) {
    receive_joined(message.joined(), now);
  } else if (message.has_goodbye()) {
    receive_goodbye(message.goodbye(), now);
  } else if (message.has_error()) {
    receive_error(message, now);
  } else if (!handle_active(message, now)) {
    lose(now, "protocol error: the server sent a message that is not allowed in state " +
                  std::string(name_of(status.state)));
  }
  if (const auto answered = poses.answer(message)) emit(*answered);
}

/// Reports an error for each unanswered pose request, because the connection has ended.
void ClientSession::Impl::refuse_poses(const std::string& why) {
  for (const event::PoseAnswered& refused : poses.refuse_all(why)) emit(refused);
}

bool ClientSession::Impl::handle_active(const wire::ServerControl& message, LocalTime now) {
  if (status.state != SessionState::kActive) return false;
  switch (message.message_case()) {
    case wire::ServerControl::kGrabbed:
      scene.hold(BodyId{message.grabbed().body()}, now);
      emit(event::Grabbed{BodyId{message.grabbed().body()}});
      return true;
    case wire::ServerControl::kReleased:
      scene.hold(BodyId{}, now);
      emit(event::Released{BodyId{message.released().body()}});
      return true;
    case wire::ServerControl::kUserJoined:
      scene.meet(message.user_joined());
      if (users.size() < proto::kMaxUsers) users.push_back(message.user_joined());
      emit(event::UserJoined{message.user_joined()});
      return true;
    case wire::ServerControl::kUserLeft:
      std::erase_if(users, [&message](const auto& user) { return user.user() == message.user_left().user(); });
      emit(event::UserLeft{UserId{message.user_left().user()}});
      return true;
    case wire::ServerControl::kBodyReturned:
      log(scene.name_of(BodyId{message.body_returned().body()}) + " is back at its start");
      return true;
    case wire::ServerControl::kAssetChunk:
      note_assets(assets.receive(message.request(), message.asset_chunk(), now));
      request_assets(now);
      return true;
    case wire::ServerControl::kParameterSet:
      receive_parameter(message.parameter_set(), now);
      return true;
    case wire::ServerControl::kRoomReset:
      report("the operator has reset the room");
      return true;
    case wire::ServerControl::kSoftShape:
      receive_soft_shape(message.soft_shape());
      return true;
    case wire::ServerControl::kKeptPose:
      report(poses.receive(message.kept_pose()));
      return true;
    case wire::ServerControl::kPoseDeleted:
      report(poses.receive(message.pose_deleted()));
      return true;
    case wire::ServerControl::kPoseProgress:
      poses.receive(message.pose_progress(), scene.joined()->user());
      return true;
    case wire::ServerControl::kPointed:
      receive_pointed(message.pointed(), now);
      return true;
    case wire::ServerControl::kRoomStart:
      receive_start(message.room_start());
      return true;
    case wire::ServerControl::kGameState:
      if (!scene.play(message.game_state())) log("ignored a state of the game that does not fit the scene");
      return true;
    case wire::ServerControl::kGameEvent:
      report(scene.play(message.game_event()));
      return true;
    case wire::ServerControl::kPoseTaken:
      report(printable(message.pose_taken().text()));
      return true;
    case wire::ServerControl::kStateDatagram:
      owner.on_datagram(std::as_bytes(std::span(message.state_datagram())), now);
      return true;
    case wire::ServerControl::kPong:
      return true;
    default:
      return false;
  }
}

/// Handles a position that a user points at. The message is ignored unless that user is in the room and the position is
/// valid.
void ClientSession::Impl::receive_pointed(const wire::Pointed& message, LocalTime now) {
  const wire::Point& point = message.point();
  const bool is_own = message.user() == scene.joined()->user();
  const auto user = std::ranges::find(users, message.user(), &wire::UserJoined::user);
  if ((!is_own && user == users.end()) || !proto::is_place(point.place()) || !proto::is_place(point.place_w()) ||
      point.body() > std::size_t(scene.joined()->scene().bodies_size())) {
    return;
  }
  std::erase_if(pointed, [&](const auto& other) {
    return other.second.user() == message.user() || now - other.first > kPointed;
  });
  pointed.emplace_back(now, message);
  if (is_own) return;
  const std::string at = point.body() == 0 ? "a place" : scene.name_of(BodyId{point.body()});
  report(printable(user->name()) + " points at " + at);
  scene.show({point.place_w(0), point.place_w(1), point.place_w(2)}, now);
}

void ClientSession::Impl::receive_start(const wire::RoomStart& start) {
  if (!scene.set_start(start)) return log("ignored a start of the room that is neither awaited nor at a time");
  report(start.awaited() == 0   ? "all users are here: the hands begin together"
         : start.awaited() == 1 ? "the hands begin when 1 more user is here"
                                : "the hands begin when " + std::to_string(start.awaited()) + " more users are here");
}

void ClientSession::Impl::receive_parameter(const wire::ParameterSet& parameter, LocalTime now) {
  // A changed parameter of the game needs no further action: it takes effect with the next received state of the game.
  if (parameter.name().starts_with("game.")) return emit(event::ParameterSet{parameter});
  const haptics::CouplingLawInfo& before = scene.law();
  if (!scene.set_parameter(parameter, now)) return;
  emit(event::ParameterSet{parameter});
  if (&before != &scene.law()) report("the room's law is now " + std::string(scene.law().name));
}

void ClientSession::Impl::receive_welcome(const wire::Welcome& welcome, LocalTime now) {
  if (welcome.protocol_version() != proto::kProtocolVersion) {
    lose(now,
         "the server speaks protocol version " + std::to_string(welcome.protocol_version()) + ", this client " +
             std::to_string(proto::kProtocolVersion) + "; use programs of the same version",
         true);
    return;
  }
  if (welcome.connection_id() == 0 || welcome.epoch() > proto::kMaxEpoch || welcome.datagram_port() > 65535) {
    lose(now, "protocol error: the server's welcome has a field out of range");
    return;
  }
  connection = ConnectionId{welcome.connection_id()};
  epoch = static_cast<std::uint8_t>(welcome.epoch());
  room = settings.room;
  if (room.empty() && welcome.rooms_size() == 1) room = printable(welcome.rooms(0));
  rooms.clear();
  for (const std::string& name : welcome.rooms()) rooms.push_back(printable(name));
  transport.set_datagram_port(static_cast<std::uint16_t>(welcome.datagram_port()));
  enter(SessionState::kJoining, now);
  wire::ClientControl message;
  message.mutable_join()->set_room(settings.room);
  message.mutable_join()->set_user_name(settings.user_name);
  message.mutable_join()->set_role(settings.role);
  message.mutable_join()->set_deadband(settings.deadband);
  message.mutable_join()->set_wants_soft_shapes(settings.wants_soft_shapes);
  proto::write_bounds(settings.coupling_bounds, *message.mutable_join()->mutable_coupling_bounds());
  credentials.fill(*message.mutable_join(), transport, connection);
  send_request(message);
}

void ClientSession::Impl::receive_joined(const wire::Joined& answer, LocalTime now) {
  std::string problem = scene.accept(answer, settings.role, now);
  if (problem.empty() && owner.find_scene_problem) problem = owner.find_scene_problem(answer);
  if (!problem.empty() && room_left) return come_back("its scene cannot be used: " + problem, now);
  if (!problem.empty()) {
    wire::ClientControl message;
    message.mutable_leave();
    send(message);
    lose(now, "the server's scene cannot be used: " + problem, true);
    return;
  }
  auto secret = transport.exported(secure::kDatagramExport, proto::seal_context(connection));
  if (credentials.are_requested() && !secret) return lose(now, "there are no keys for datagrams");
  if (has_joined) ++counters.reconnects;
  has_joined = true;
  room_left.reset();
  poses.clear();
  pointed.clear();
  soft_offsets.assign(std::size_t(scene.joined()->scene().soft_bodies_size()), nullptr);
  credentials.accept(answer);
  stream.begin(connection, epoch, secret, now);
  retry_delay = settings.reconnect_delay;
  status.why.clear();
  enter(SessionState::kActive, now);
  scene.publish();
  const wire::Joined& joined = *scene.joined();
  emit(event::Joined{std::make_shared<const wire::Joined>(joined)});
  if (joined.start().awaited() > 0) receive_start(joined.start());
  users.clear();
  assets.reconnect();
  note_assets(assets.begin(joined.assets()));
  request_assets(now);
}

void ClientSession::Impl::receive_error(const wire::ServerControl& message, LocalTime now) {
  const wire::Error& error = message.error();
  if (status.state != SessionState::kActive && room_left) return come_back(error.text(), now);
  if (status.state != SessionState::kActive) {
    lose(now, "the server refused: " + error.text(), !(has_joined && may_pass(error.code())));
    return;
  }
  note_assets(assets.refuse(message.request(), now));
  if (std::erase(settings_requested, message.request()) > 0) ++counters.refused_settings;
  emit(event::Refused{error});
  report("refused: " + printable(error.text()));
}

void ClientSession::Impl::receive_goodbye(const wire::Goodbye& goodbye, LocalTime now) {
  const bool is_final = goodbye.reason() == wire::DISCONNECT_WRONG_VERSION ||
                        goodbye.reason() == wire::DISCONNECT_KICKED || goodbye.reason() == wire::DISCONNECT_RESUMED;
  lose(now, "the server ended the connection: " + goodbye.text(), is_final);
}

/// Stores the shape of a soft body. The message is ignored if the scene has no such body.
void ClientSession::Impl::receive_soft_shape(const wire::SoftShape& message) {
  auto offsets = proto::read_soft_shape(message);
  if (!offsets || message.soft_body() >= soft_offsets.size()) return log("ignored the shape of a soft body");
  soft_offsets[message.soft_body()] = std::make_shared<const std::vector<Vec3>>(std::move(*offsets));
}

/// Returns to the previous room after the new room has refused the user.
void ClientSession::Impl::come_back(const std::string& why, LocalTime now) {
  report("room " + printable(settings.room) + ": " + printable(why));
  enter_room(*std::exchange(room_left, std::nullopt), now);
}

void ClientSession::Impl::enter_room(const std::string& wanted, LocalTime now) {
  stop_state();
  if (status.state == SessionState::kJoining || status.state == SessionState::kActive) {
    wire::ClientControl message;
    message.mutable_leave()->set_to_return(credentials.can_return());
    send(message);
  }
  transport.close();
  settings.room = wanted;
  status.why = "going to room " + printable(wanted);
  connect(now);
  refuse_poses(status.why);
}

void ClientSession::Impl::send(wire::ClientControl& message) {
  frame_out.clear();
  proto::append_frame(message, frame_out);
  counters.bytes_sent += frame_out.size();
  transport.send_control(frame_out);
}

void ClientSession::Impl::send_request(wire::ClientControl& message) {
  message.set_request(++last_request);
  send(message);
}

void ClientSession::leave(LocalTime) {
  const SessionState state = impl_->status.state;
  if (state == SessionState::kEnded) return;
  if (state == SessionState::kGreeting || state == SessionState::kJoining || state == SessionState::kActive) {
    wire::ClientControl message;
    message.mutable_leave();
    impl_->send(message);
  }
  impl_->end("left", false);
}

}  // namespace tandem::client
