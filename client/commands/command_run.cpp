// See command_run.hpp.
#include "client/commands/command_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "client/commands/command.hpp"
#include "client/commands/command_pipe.hpp"
#include "client/commands/scripted_hand.hpp"
#include "common/base/json.hpp"

namespace tandem::client {
namespace {

namespace json = boost::json;

// Interval between pose requests. The server accepts four per second from a user (proto/WIRE.md).
constexpr Duration kBetweenPoses = std::chrono::milliseconds(260);
// Delay of the first command after the join. Within this time the saved poses arrive (right after the join), and the
// first states (a round trip later).
constexpr Duration kReadyFor = std::chrono::milliseconds(300);
constexpr Duration kMaxReadyWait = std::chrono::seconds(5);
constexpr Duration kMaxMove = std::chrono::seconds(60);
constexpr Duration kGrabPatience = std::chrono::milliseconds(1500);  // time-out of a grab, as in the window
// Shortest time for which a button is pressed. It is long enough that at least one datagram contains the pressed
// button, even if datagrams are lost.
constexpr Duration kPress = std::chrono::milliseconds(100);

/// The remaining work of a command. It is called at each poll until it returns the fields of the answer. If it throws,
/// the command fails.
using Step = std::function<std::optional<json::object>()>;
using Describe = std::function<json::object(const event::PoseAnswered& event)>;

/// Returns the remaining work of a command that completes at once.
Step done(json::object fields) {
  return [fields = std::move(fields)] { return std::optional(fields); };
}

/// Makes the current command fail with the message `why`.
[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error(why);
}

json::value number_or_null(double value) {
  return std::isfinite(value) ? json::value(value) : json::value();
}

json::array to_json(const Vec3& a) {
  return {number_or_null(a.x()), number_or_null(a.y()), number_or_null(a.z())};
}

json::object to_json(const Pose& X) {
  const json::array orientation{number_or_null(X.q.w()), number_or_null(X.q.x()), number_or_null(X.q.y()),
                                number_or_null(X.q.z())};
  return {{"position_m", to_json(X.p)}, {"orientation_wxyz", orientation}};
}

/// Formats a time, e.g. "2026-01-31T12:00:00Z". Returns null for the pose of the scene file, which has no time.
json::value utc_of(std::uint64_t unix_ms) {
  const auto seconds = static_cast<std::time_t>(unix_ms / 1000);
  std::tm parts{};
  char text[40];
  const bool is_time = unix_ms > 0 && gmtime_r(&seconds, &parts) != nullptr &&
                       std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) > 0;
  return is_time ? json::value(text) : json::value();
}

json::object to_json(const wire::KeptPose& pose) {
  json::object out{{"number", pose.number()}, {"name", printable(pose.name())}, {"user", printable(pose.user_name())}};
  out["energy_kj_per_mol"] = number_or_null(pose.lj_kj_per_mol() + pose.coulomb_kj_per_mol());
  out["lennard_jones_kj_per_mol"] = number_or_null(pose.lj_kj_per_mol());
  out["coulomb_kj_per_mol"] = number_or_null(pose.coulomb_kj_per_mol());
  out["rmsd_angstrom"] = number_or_null(pose.rmsd_angstrom());
  out["contacts"] = pose.contacts();
  out["hydrogen_bonds"] = pose.hydrogen_bonds();
  out["kept_utc"] = utc_of(pose.kept_ms());
  return out;
}

std::string name_of_body(const ClientIoSnapshot& io, BodyId body) {
  const wire::Scene& scene = io.joined->scene();
  const auto index = static_cast<int>(body.value) - 1;
  return index >= 0 && index < scene.bodies_size() ? printable(scene.bodies(index).name()) : std::string();
}

json::value holding(const ClientIoSnapshot& io, const View& view) {
  const BodyId held = view.record.held_body;
  return held.is_valid() ? json::value(name_of_body(io, held)) : json::value();
}

Step help() {
  json::array commands;
  for (const auto& [usage, purpose] : command_usages()) {
    commands.emplace_back(json::object{{"usage", usage}, {"purpose", purpose}});
  }
  return done({{"commands", commands}});
}

/// Returns the server's text in its answer to a request that has moved the molecules.
json::object text_of_answer(const event::PoseAnswered& event) {
  return {{"text", printable(event.answer.pose_taken().text())}};
}

json::object pose_of_answer(const event::PoseAnswered& event) {
  return to_json(event.answer.kept_pose());
}

}  // namespace

struct CommandRun::Impl {
  Impl(ClientIo& client_io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers)
      : io(client_io), pipe(lines, answers) {
    if (pointer != nullptr) hand.emplace(std::move(pointer));
  }

  void begin_next();
  void continue_step();
  bool await_room();
  void answer(json::object fields);
  void fail(const std::string& why);
  Step begun(const CommandLine& command);

  const View& seen() const;
  const std::vector<wire::KeptPose>& kept() const;
  ScriptedHand& own_hand();
  Pose goal_W() { return seen().workspace.world_pose(own_hand().target().X_DH); }

  Step request(wire::AskPose::Kind kind, std::uint32_t number, const std::string& name, Describe describe,
               std::optional<Duration> cancel_after = {});
  Step poses() const;
  Step visit(const CommandLine& command);
  Step rename(const CommandLine& command);
  Step delete_pose(const CommandLine& command);
  Step minimise(const CommandLine& command);
  Step energy() const;
  Step state() const;
  Step move_to(const Pose& X_WH);
  Step turn(const CommandLine& command);
  Step grab();
  Step release();
  Step wait(double seconds);

  ClientIo& io;
  CommandPipe pipe;
  std::optional<ScriptedHand> hand;
  // Arguments of the poll() in progress.
  const ClientIoSnapshot* snapshot = nullptr;
  const View* view = nullptr;
  LocalTime now{};

  Step step;  ///< remaining work of the current command; empty if no command runs
  std::string word;
  std::size_t lines_taken = 0;
  std::size_t failures = 0;
  bool has_quit = false;
  bool is_ready = false;
  std::optional<LocalTime> first_poll, joined_since;
  LocalTime next_request{};                     ///< earliest time of the next pose request
  std::uint32_t last_tag = 0;                   ///< tag of the last pose request
  std::optional<event::PoseAnswered> answered;  ///< answer to the last pose request; empty until it has arrived
};

/// Returns true once the states and saved poses of the room have arrived, or the time limit has passed. In the second
/// case the commands report which data are missing.
bool CommandRun::Impl::await_room() {
  if (!first_poll) first_poll = now;
  const bool is_complete = snapshot->has_state && view != nullptr && view->has_state;
  if (!is_complete) joined_since.reset();
  if (is_complete && !joined_since) joined_since = now;
  is_ready = is_ready || (joined_since && now - *joined_since >= kReadyFor) || now - *first_poll >= kMaxReadyWait;
  return is_ready;
}

void CommandRun::Impl::begin_next() {
  if (!await_room()) return;
  const std::optional<std::string> line = pipe.pop_line();
  if (!line) return;
  ++lines_taken;
  word = command_word(*line);
  try {
    step = begun(parse_command(*line));
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void CommandRun::Impl::continue_step() {
  try {
    if (const std::optional<json::object> fields = step()) answer(*fields);
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void CommandRun::Impl::answer(json::object fields) {
  json::object line{{"line", lines_taken}, {"command", word}, {"ok", !fields.contains("error")}};
  for (auto& [name, value] : fields) line[name] = std::move(value);
  step = nullptr;
  pipe.answer(json::serialize(line));
}

void CommandRun::Impl::fail(const std::string& why) {
  ++failures;
  answer({{"error", why}});
}

Step CommandRun::Impl::begun(const CommandLine& command) {
  using Kind = wire::AskPose;
  const std::vector<double>& numbers = command.numbers;
  const auto place = [&numbers] { return Vec3(numbers[0], numbers[1], numbers[2]); };
  const std::map<std::string_view, std::function<Step()>> actions{
      {"help", help},
      {"keep",
       [&] {
         return request(Kind::KEEP, 0, command.texts.empty() ? std::string() : command.texts[0], pose_of_answer);
       }},
      {"poses", [&] { return poses(); }},
      {"visit", [&] { return visit(command); }},
      {"rename", [&] { return rename(command); }},
      {"delete", [&] { return delete_pose(command); }},
      {"undo", [&] { return request(Kind::UNDO, 0, "", text_of_answer); }},
      {"redo", [&] { return request(Kind::REDO, 0, "", text_of_answer); }},
      {"minimise", [&] { return minimise(command); }},
      {"energy", [&] { return energy(); }},
      {"state", [&] { return state(); }},
      {"move",
       [&] {
         return move_to({place(), goal_W().q});
       }},
      {"move-by",
       [&] {
         return move_to({goal_W().p + place(), goal_W().q});
       }},
      {"turn", [&] { return turn(command); }},
      {"grab", [&] { return grab(); }},
      {"release", [&] { return release(); }},
      {"wait", [&] { return wait(numbers[0]); }},
      {"quit",
       [&] {
         has_quit = true;
         return done({});
       }},
  };
  return actions.at(command.verb)();
}

/// Returns the newest state of the room. Without a state, the command fails.
const View& CommandRun::Impl::seen() const {
  const SessionStatus& status = snapshot->status;
  if (status.state != SessionState::kActive) refuse("not in a room: " + status.why);
  if (view == nullptr || !view->has_state) refuse("no state has been received from the server yet; wait 1");
  return *view;
}

const std::vector<wire::KeptPose>& CommandRun::Impl::kept() const {
  seen();
  if (snapshot->kept_poses == nullptr) {
    refuse("poses are kept in rooms of exactly two molecules; this one has none");
  }
  return *snapshot->kept_poses;
}

ScriptedHand& CommandRun::Impl::own_hand() {
  if (!hand) refuse("commands move the hand of the device mouse without a window: use --headless --device mouse");
  return *hand;
}

Step CommandRun::Impl::request(wire::AskPose::Kind kind, std::uint32_t number, const std::string& name,
                               Describe describe, std::optional<Duration> cancel_after) {
  const LocalTime sent = std::max(now, next_request);
  next_request = sent + kBetweenPoses;
  answered.reset();
  return [=, this, is_sent = false, is_cancelled = false]() mutable -> std::optional<json::object> {
    if (!is_sent && now >= sent) {
      is_sent = true;
      io.send(pose_command(kind, number, name, ++last_tag));
    }
    if (cancel_after && !is_cancelled && now >= std::max(sent + *cancel_after, next_request)) {
      is_cancelled = true;
      next_request = now + kBetweenPoses;
      io.send(pose_command(wire::AskPose::CANCEL));
    }
    if (!answered) {
      // After the session has ended, no answer can arrive.
      if (snapshot->status.state == SessionState::kEnded) refuse("not in a room: " + snapshot->status.why);
      return std::nullopt;
    }
    if (answered->answer.has_error()) refuse(printable(answered->answer.error().text()));
    return describe(*answered);
  };
}

Step CommandRun::Impl::poses() const {
  json::array list;
  for (const wire::KeptPose& pose : kept()) list.emplace_back(to_json(pose));
  return done({{"poses", list}});
}

Step CommandRun::Impl::visit(const CommandLine& command) {
  const wire::KeptPose pose = find_pose(kept(), command.texts[0]);
  return request(wire::AskPose::GO_TO, pose.number(), "", [pose](const auto&) { return to_json(pose); });
}

Step CommandRun::Impl::rename(const CommandLine& command) {
  return request(wire::AskPose::RENAME, find_pose(kept(), command.texts[0]).number(), command.texts[1], pose_of_answer);
}

Step CommandRun::Impl::delete_pose(const CommandLine& command) {
  const wire::KeptPose pose = find_pose(kept(), command.texts[0]);
  return request(wire::AskPose::DELETE, pose.number(), "", [pose](const auto&) {
    return json::object{{"number", pose.number()}, {"name", pose.name()}};
  });
}

Step CommandRun::Impl::minimise(const CommandLine& command) {
  std::optional<Duration> cancel_after;
  if (!command.numbers.empty()) cancel_after = from_seconds(command.numbers[0]);
  const auto describe = [](const event::PoseAnswered& event) {
    json::object out = text_of_answer(event);
    out["energy_kj_per_mol"] = number_or_null(event.minimising.energy_kj_per_mol());
    out["steps"] = event.minimising.steps();
    return out;
  };
  return request(wire::AskPose::MINIMISE, 0, "", describe, cancel_after);
}

Step CommandRun::Impl::energy() const {
  const View& newest = seen();
  if (!snapshot->joined->scene().has_molecular_field()) refuse("this scene has no molecules");
  return done({{"energy_kj_per_mol", number_or_null(newest.newest.update.field_energy_kj_per_mol)}});
}

Step CommandRun::Impl::state() const {
  const View& newest = seen();
  const TickRecord& record = newest.record;
  const Quat q_WD = newest.workspace.X_WD.q;
  json::object out{{"hand", to_json(record.handle_W.X)}, {"tool", to_json(record.tool_W.X)}};
  out["holds"] = holding(*snapshot, newest);
  out["force_on_hand_n"] = to_json(Vec3(q_WD * record.displayed_on_hand_D.f));
  out["torque_on_hand_n_m"] = to_json(Vec3(q_WD * record.displayed_on_hand_D.t));
  if (snapshot->joined->scene().has_molecular_field()) {
    out["energy_kj_per_mol"] = number_or_null(newest.newest.update.field_energy_kj_per_mol);
  }
  json::array bodies;
  for (const proto::BodyState& body : newest.received_bodies) {
    json::object each{{"name", name_of_body(*snapshot, body.id)}};
    for (auto& [name, value] : to_json(body.state.X)) each[name] = value;
    bodies.emplace_back(std::move(each));
  }
  out["bodies"] = std::move(bodies);
  return done(std::move(out));
}

Step CommandRun::Impl::move_to(const Pose& X_WH) {
  const WorkspaceMapping& workspace = seen().workspace;
  const double way_m = device_pose(workspace, X_WH).p.norm();
  if (way_m > devices::kPointerReach_m) {
    const Vec3& middle = workspace.X_WD.p;
    char why[256];
    std::snprintf(
        why, sizeof why,
        "the place is out of reach: %g m from the middle of the device's, which reaches %g m; its middle is at "
        "%g %g %g in the world, where %g m are 1 m of the device",
        way_m, devices::kPointerReach_m, middle.x(), middle.y(), middle.z(), workspace.position_scale);
    refuse(why);
  }
  own_hand().move_to(X_WH, now);
  const LocalTime begun_at = now;
  return [=, this]() -> std::optional<json::object> {
    const View& newest = seen();
    if (now - begun_at > kMaxMove)
      refuse("the hand has not come to rest within 60 s; see its place by the command state");
    if (!hand->is_at_rest(now)) return std::nullopt;
    const Pose& X = newest.record.handle_W.X;
    const double off_rad = rotation_vector(X.q * X_WH.q.conjugate()).norm();
    return json::object{{"hand", to_json(X)},
                        {"off_m", (X.p - X_WH.p).norm()},
                        {"off_degrees", off_rad * 180 / std::numbers::pi},
                        {"is_held_up", !hand->has_arrived()}};
  };
}

Step CommandRun::Impl::turn(const CommandLine& command) {
  const std::vector<double>& numbers = command.numbers;
  const Vec3 axis(numbers[0], numbers[1], numbers[2]);
  if (axis.norm() < 1e-3) refuse("AX AY AZ: at least one must not be 0");
  const Pose goal = goal_W();
  const Quat turn(Eigen::AngleAxisd(numbers[3] * std::numbers::pi / 180, axis.normalized()));
  return move_to({goal.p, (turn * goal.q).normalized()});
}

// Grabs a body within reach, by the grab button of the handle, as a mouse click in the window does.
Step CommandRun::Impl::grab() {
  seen();
  own_hand().press(kButtonGrab, true);
  const LocalTime pressed = now;
  return [=, this]() -> std::optional<json::object> {
    const View& newest = seen();
    if (newest.record.held_body.is_valid()) return json::object{{"holds", holding(*snapshot, newest)}};
    if (now - pressed < kGrabPatience) return std::nullopt;
    hand->press(kButtonGrab, false);
    refuse("nothing is within reach to grab; move the hand nearer");
  };
}

Step CommandRun::Impl::release() {
  if (!seen().record.held_body.is_valid()) refuse("the hand holds nothing");
  const json::value held = holding(*snapshot, seen());
  // A body that the scene attaches to the hand is held without a pressed button. Only the release of a button makes the
  // tool release a body, so the button is pressed and then released.
  own_hand().press(kButtonGrab, true);
  const LocalTime pressed = now;
  return [=, this]() -> std::optional<json::object> {
    const View& newest = seen();
    if (now - pressed >= kPress) hand->press(kButtonGrab, false);
    if (now - pressed >= kPress && !newest.record.held_body.is_valid()) return json::object{{"released", held}};
    if (now - pressed < kGrabPatience) return std::nullopt;
    refuse("the server has not released the body within 1.5 s; try again");
  };
}

/// Waits for the given time. The command fails if there is no connection at the end.
Step CommandRun::Impl::wait(double seconds) {
  const LocalTime until = now + from_seconds(seconds);
  return [=, this]() -> std::optional<json::object> {
    if (now < until && snapshot->status.state != SessionState::kEnded) return std::nullopt;
    seen();
    return json::object{};
  };
}

CommandRun::CommandRun(ClientIo& io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers)
    : impl_(std::make_unique<Impl>(io, std::move(pointer), lines, answers)) {}

CommandRun::~CommandRun() {
  finish();
}

void CommandRun::receive(const Event& event) {
  const auto* const answer = std::get_if<event::PoseAnswered>(&event);
  if (answer != nullptr && answer->tag == impl_->last_tag) impl_->answered = *answer;
}

void CommandRun::poll(const ClientIoSnapshot& io, const View* view, LocalTime now) {
  Impl& self = *impl_;
  self.snapshot = &io;
  self.view = view;
  self.now = now;
  if (self.hand && view != nullptr) self.hand->follow(*view, now);
  if (!self.step) self.begin_next();
  if (self.step) self.continue_step();
}

bool CommandRun::is_over() const {
  // The program ends only after joining, even if there are no commands, so that its exit code shows whether joining
  // succeeded.
  return impl_->has_quit || (impl_->is_ready && !impl_->step && impl_->pipe.is_over());
}

void CommandRun::finish() {
  if (impl_->step) impl_->fail("the program ends before this is done");
  impl_->pipe.finish();
}

std::string CommandRun::problem() const {
  const std::string why = impl_->pipe.problem();
  if (!why.empty()) return "--commands: an answer could not be written: " + why;
  if (impl_->failures == 0) return {};
  return "--commands: " + std::to_string(impl_->failures) + " of " + std::to_string(impl_->lines_taken) +
         " commands failed; see their answers";
}

}  // namespace tandem::client
