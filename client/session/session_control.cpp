#include <algorithm>
#include <cmath>
#include <utility>

#include "client/session/session_impl.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/placement.hpp"
#include "proto/soft_shape.hpp"

namespace tandem::client {
namespace {

/// True for refusals that may pass with time: the user's own old connection may still occupy the place.
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
  answer_pose(message);
}

/// Only message types that can answer a pose request do so; the request number of others is ignored.
void ClientSession::Impl::answer_pose(const wire::ServerControl& message) {
  const bool is_answer = message.has_kept_pose() || message.has_pose_taken() || message.has_pose_deleted() ||
                         message.has_pose_progress() || message.has_error();
  const auto found = is_answer ? pose_requests.find(message.request()) : pose_requests.end();
  if (found == pose_requests.end()) return;
  const PoseReply on_answer = std::move(found->second);
  pose_requests.erase(found);
  on_answer(message, own_progress);
}

/// Answers all open pose requests with an error, because their connection has ended.
void ClientSession::Impl::refuse_poses(const std::string& why) {
  wire::ServerControl answer;
  answer.mutable_error()->set_code(wire::ERROR_NOT_ALLOWED);
  answer.mutable_error()->set_text("not in a room: " + printable(why));
  for (const auto& [request, on_answer] : std::exchange(pose_requests, {})) on_answer(answer, own_progress);
}

bool ClientSession::Impl::handle_active(const wire::ServerControl& message, LocalTime now) {
  if (status.state != SessionState::kActive) return false;
  switch (message.message_case()) {
    case wire::ServerControl::kGrabbed:
      scene.hold(BodyId{message.grabbed().body()}, now);
      log("grabbed body " + std::to_string(message.grabbed().body()));
      return true;
    case wire::ServerControl::kReleased:
      scene.hold(BodyId{}, now);
      log("released body " + std::to_string(message.released().body()));
      return true;
    case wire::ServerControl::kUserJoined:
      scene.meet(message.user_joined());
      if (users.size() < proto::kMaxUsers) users.push_back(message.user_joined());
      log("user " + std::to_string(message.user_joined().user()) + " \"" + message.user_joined().name() + "\" is here");
      return true;
    case wire::ServerControl::kUserLeft:
      std::erase_if(users, [&message](const auto& user) { return user.user() == message.user_left().user(); });
      log("user " + std::to_string(message.user_left().user()) + " left");
      return true;
    case wire::ServerControl::kBodyReturned:
      log(scene.name_of(BodyId{message.body_returned().body()}) + " is back at its start");
      return true;
    case wire::ServerControl::kAssetChunk:
      receive_asset_chunk(message, now);
      return true;
    case wire::ServerControl::kParameterSet:
      receive_parameter(message.parameter_set(), now);
      return true;
    case wire::ServerControl::kRoomReset:
      news = "the operator has reset the room";
      log(news);
      return true;
    case wire::ServerControl::kSoftShape:
      receive_soft_shape(message.soft_shape());
      return true;
    case wire::ServerControl::kKeptPose:
      receive_kept_pose(message.kept_pose());
      return true;
    case wire::ServerControl::kPoseDeleted:
      receive_pose_deleted(message.pose_deleted());
      return true;
    case wire::ServerControl::kPoseProgress:
      receive_pose_progress(message.pose_progress());
      return true;
    case wire::ServerControl::kPointed:
      receive_pointed(message.pointed(), now);
      return true;
    case wire::ServerControl::kRoomStart:
      receive_start(message.room_start());
      return true;
    case wire::ServerControl::kPoseTaken:
      news = printable(message.pose_taken().text());
      log(news);
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

/// Accepts poses in ascending order from number 0. A known number is a new name. An invalid pose is dropped.
void ClientSession::Impl::receive_kept_pose(const wire::KeptPose& message) {
  constexpr std::size_t kMaxPoses = 256;
  auto poses = kept_poses ? std::make_shared<std::vector<wire::KeptPose>>(*kept_poses)
                          : std::make_shared<std::vector<wire::KeptPose>>();
  const auto& numbers = message.in_first();
  const bool is_pose =
      numbers.size() == 7 && std::abs(Quat(numbers[3], numbers[4], numbers[5], numbers[6]).norm() - 1) < 1e-6;
  if (!is_pose) return;
  const auto known = std::ranges::find(*poses, message.number(), &wire::KeptPose::number);
  if (known != poses->end()) {
    if (message.number() == 0) return;
    known->set_name(printable(message.name()));
    kept_poses = std::move(poses);
    return;
  }
  const bool is_next = poses->empty() ? message.number() == 0 : message.number() > poses->back().number();
  if (!is_next || poses->size() == kMaxPoses) return;
  wire::KeptPose& pose = poses->emplace_back(message);
  pose.set_name(printable(message.name()));
  pose.set_user_name(printable(message.user_name()));
  if (message.is_news()) {
    news = pose.user_name() + " kept \"" + pose.name() + "\"";
    log(news);
  }
  kept_poses = std::move(poses);
}

/// The pose of the files, number 0, cannot be deleted.
void ClientSession::Impl::receive_pose_deleted(const wire::PoseDeleted& message) {
  if (!kept_poses || message.number() == 0) return;
  auto poses = std::make_shared<std::vector<wire::KeptPose>>(*kept_poses);
  const auto deleted = std::ranges::find(*poses, message.number(), &wire::KeptPose::number);
  if (deleted == poses->end()) return;
  news = "\"" + deleted->name() + "\" was deleted";
  log(news);
  poses->erase(deleted);
  kept_poses = std::move(poses);
}

void ClientSession::Impl::receive_pose_progress(const wire::PoseProgress& message) {
  const bool is_sound = message.max_steps() > 0 && std::isfinite(message.energy_kj_per_mol());
  if (is_sound && message.user() == scene.joined()->user()) own_progress = message;
  if (message.is_over() || !is_sound) return pose_progress.reset();
  pose_progress = message;
}

/// Accepts pointers of users in the room at valid places only.
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
  news = printable(user->name()) + " points at " + at;
  log(news);
  scene.show({point.place_w(0), point.place_w(1), point.place_w(2)}, now);
}

void ClientSession::Impl::receive_start(const wire::RoomStart& start) {
  if (!scene.set_start(start)) return log("ignored a start of the room that is neither awaited nor at a time");
  news = start.awaited() == 0   ? "all users are here: the hands begin together"
         : start.awaited() == 1 ? "the hands begin when 1 more user is here"
                                : "the hands begin when " + std::to_string(start.awaited()) + " more users are here";
  log(news);
}

void ClientSession::Impl::receive_parameter(const wire::ParameterSet& parameter, LocalTime now) {
  const haptics::CouplingLawInfo& before = scene.law();
  if (!scene.set_parameter(parameter, now)) return;
  if (&before != &scene.law()) news = "the room's law is now " + std::string(scene.law().name);
  if (owner.on_parameter) owner.on_parameter(parameter);
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
  kept_poses.reset();
  pose_progress.reset();
  own_progress.Clear();
  pointed.clear();
  soft_offsets.assign(std::size_t(scene.joined()->scene().soft_bodies_size()), nullptr);
  credentials.accept(answer);
  stream.begin(connection, epoch, secret, now);
  retry_delay = settings.reconnect_delay;
  enter(SessionState::kActive, now);
  status.why.clear();
  scene.publish();
  const wire::Joined& joined = *scene.joined();
  log("joined \"" + joined.scene().name() + "\" as user " + std::to_string(joined.user()));
  if (owner.on_joined) owner.on_joined(joined);
  if (joined.start().awaited() > 0) receive_start(joined.start());
  users.clear();
  asset_level = AssetLevel::kNone;
  fetch_rate.reset();
  fetch(true);
  request_assets(now);
}

void ClientSession::Impl::receive_error(const wire::ServerControl& message, LocalTime now) {
  const wire::Error& error = message.error();
  if (status.state != SessionState::kActive && room_left) return come_back(error.text(), now);
  if (status.state != SessionState::kActive) {
    lose(now, "the server refused: " + error.text(), !(has_joined && may_pass(error.code())));
    return;
  }
  if (assets.is_next(message.request())) {
    fetch_rate.answered(now);
    assets.on_refused(message.request());
    announce_assets();
  }
  if (std::erase(settings_requested, message.request()) > 0) ++counters.refused_settings;
  news = "refused: " + printable(error.text());
  log(news);
  if (owner.on_refused) owner.on_refused(error);
}

void ClientSession::Impl::receive_goodbye(const wire::Goodbye& goodbye, LocalTime now) {
  const bool is_final = goodbye.reason() == wire::DISCONNECT_WRONG_VERSION ||
                        goodbye.reason() == wire::DISCONNECT_KICKED || goodbye.reason() == wire::DISCONNECT_RESUMED;
  lose(now, "the server ended the connection: " + goodbye.text(), is_final);
}

/// Ignored if the scene has no such body.
void ClientSession::Impl::receive_soft_shape(const wire::SoftShape& message) {
  auto offsets = proto::read_soft_shape(message);
  if (!offsets || message.soft_body() >= soft_offsets.size()) return log("ignored the shape of a soft body");
  soft_offsets[message.soft_body()] = std::make_shared<const std::vector<Vec3>>(std::move(*offsets));
}

/// Returns to the previous room after another one refused.
void ClientSession::Impl::come_back(const std::string& why, LocalTime now) {
  news = "room " + printable(settings.room) + ": " + printable(why);
  log(news);
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

/// Marks the last request as one to set something, so that its refusal is counted.
void ClientSession::Impl::remember_setting() {
  if (status.state != SessionState::kActive) return;
  settings_requested.push_back(last_request);
  if (settings_requested.size() > kRemembered) settings_requested.pop_front();
}

void ClientSession::grab(BodyId body) {
  impl_->request([body](wire::ClientControl& message) { message.mutable_grab()->set_body(body.value); });
}

void ClientSession::release() {
  impl_->request([](wire::ClientControl& message) { message.mutable_release(); });
}

void ClientSession::set_parameter(const std::string& name, double value) {
  impl_->request([&](wire::ClientControl& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
  });
  impl_->remember_setting();
}

void ClientSession::set_law(const std::string& law) {
  impl_->request([&](wire::ClientControl& message) {
    message.mutable_set_parameter()->set_name(std::string(proto::kLawParameter));
    message.mutable_set_parameter()->set_text(law);
  });
  impl_->remember_setting();
}

void ClientSession::reset_room() {
  impl_->request([](wire::ClientControl& message) { message.mutable_reset_room(); });
}

void ClientSession::ask_pose(const wire::AskPose& request, PoseReply on_answer) {
  const bool is_active = impl_->status.state == SessionState::kActive;
  impl_->request([&request](wire::ClientControl& message) { *message.mutable_ask_pose() = request; });
  if (!on_answer) return;
  // Without a room nothing was sent, and the number is that of an earlier request; the answer follows at once.
  impl_->pose_requests.insert_or_assign(impl_->last_request, std::move(on_answer));
  if (!is_active) impl_->refuse_poses(impl_->status.why);
}

void ClientSession::point(const wire::Point& place) {
  impl_->request([&place](wire::ClientControl& message) { *message.mutable_point() = place; });
}

void ClientSession::kick(UserId user) {
  impl_->request([user](wire::ClientControl& message) { message.mutable_kick()->set_user(user.value); });
}

void ClientSession::change_room(const std::string& room, LocalTime now) {
  if (impl_->status.state != SessionState::kActive || room == impl_->room) return;
  const Credentials& credentials = impl_->credentials;
  if (credentials.are_requested() && (credentials.are_for_one_room() || !credentials.can_return())) {
    impl_->news = "the invitation was for one room; ask for one for room " + printable(room);
    return;
  }
  impl_->room_left = impl_->room;
  impl_->enter_room(room, now);
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
