// Writes the seeds of hostile_server_fuzz: the messages of a real hub with a real room, in their order. The client
// joins, presses on objects and sends the usual requests of a user. Writes the seeds of signal_source_fuzz as well,
// from a session with a source of signals.
#include <filesystem>
#include <iostream>
#include <map>
#include <string>

#include "client/client.hpp"
#include "client/haptics/stages/stage.hpp"
#include "client/signals/signal_session.hpp"
#include "common/base/random.hpp"
#include "proto/control_framing.hpp"
#include "server/assets/scene_file.hpp"
#include "server/docking/pose_keeper.hpp"
#include "server/session/session_hub.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/fuzz/seed_file.hpp"
#include "tests/fuzz/server_script.hpp"
#include "tests/fuzz/timeline.hpp"

namespace {

using namespace tandem;

constexpr server::ConnectionHandle kUser = 1;
constexpr int kReportMilliseconds = 40;

/// A hub and a client, connected by a transport without delay. The messages of the hub are recorded.
class Session final : public server::ServerTransport, public client::ClientTransport {
 public:
  explicit Session(const std::shared_ptr<const server::LoadedScene>& scene, const std::string& stage = "local-model")
      : rooms_(one_room(scene)),
        room_(*rooms_.front()),
        poses_({}, rooms_, [] { return 1'700'000'000'000; }),
        hub_(hub_settings(), {&room_}, *this),
        client_({.haptics = {.stage = {.name = stage}}, .session = {.wants_soft_shapes = true}}, device_, *this) {
    client_.session().start(now_);
    hub_.on_connected(kUser, now_, "127.0.0.1");
    client_.session().on_connected(now_);
  }

  std::vector<std::byte> script() {
    for (int ms = 0; ms < kReportMilliseconds; ++ms) {
      now_ += std::chrono::milliseconds(1);
      device_.sample.X_DH.p.z() = -0.001 * ms;
      if (ms == 10) send(client::command::Grab{BodyId{1}});
      if (ms == 20) send(client::command::ResetRoom{});
      if (ms == 25) send(client::command::SetParameter{"coupling.stiffness", 250});
      if (ms == 30) send(client::command::Release{});
      if (ms == 15 || ms == 35) ask_pose(wire::AskPose::KEEP);
      if (ms == 18) point();
      if (ms == 22) ask_pose(wire::AskPose::MINIMISE);
      if (ms == 28) ask_pose(wire::AskPose::UNDO);
      if (ms == 36) ask_pose(wire::AskPose::RENAME, 1, "renamed");
      if (ms == 37) ask_pose(wire::AskPose::DELETE, 1);
      if (ms == 38) ask_pose(wire::AskPose::CANCEL);
      room_.step(server_time_of_own_clock(now_));
      poses_.work();
      hub_.poll(VirtualClock(now_));
      client_.haptics().tick(now_);
      client_.poll(now_);
      deliver();
      fuzz::append_act(fuzz::ServerAct::kTime, std::vector<std::byte>(1), script_);
    }
    client_.session().leave(now_);
    deliver();
    fuzz::append_act(fuzz::ServerAct::kHangUp, {}, script_);
    return script_;
  }

  // The following functions are the transport of the hub.
  void send_control(server::ConnectionHandle, std::span<const std::byte> bytes) override {
    reader_.feed(bytes);
    while (const auto payload = reader_.next()) fuzz::append_act(fuzz::ServerAct::kMessage, *payload, script_);
    down_.emplace_back(true, proto::Bytes(bytes.begin(), bytes.end()));
  }
  bool send_datagram(server::ConnectionHandle, std::span<const std::byte> datagram) override {
    const auto act = ++datagrams_ % 2 == 0 ? fuzz::ServerAct::kDatagram : fuzz::ServerAct::kState;
    fuzz::append_act(act, act == fuzz::ServerAct::kState ? proto::payload_of(datagram) : datagram, script_);
    down_.emplace_back(false, proto::Bytes(datagram.begin(), datagram.end()));
    return true;
  }
  std::size_t queued_control_bytes(server::ConnectionHandle) const override { return 0; }
  void close(server::ConnectionHandle) override {}

  // The following functions are the transport of the client.
  void connect(LocalTime) override {}
  void send_control(std::span<const std::byte> bytes) override {
    up_.emplace_back(true, proto::Bytes(bytes.begin(), bytes.end()));
  }
  bool send_datagram(std::span<const std::byte> bytes) override {
    up_.emplace_back(false, proto::Bytes(bytes.begin(), bytes.end()));
    return true;
  }
  void set_datagram_port(std::uint16_t) override {}
  std::size_t queued_control_bytes() const override { return 0; }
  void close() override {}

 private:
  using Messages = std::vector<std::pair<bool, proto::Bytes>>;  ///< the flag is true on the control stream

  static std::vector<std::unique_ptr<server::Room>> one_room(const std::shared_ptr<const server::LoadedScene>& scene) {
    std::vector<std::unique_ptr<server::Room>> rooms;
    rooms.push_back(std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene));
    return rooms;
  }

  server::HubSettings hub_settings() {
    server::HubSettings settings;
    settings.poses = &poses_;
    settings.connection_ids = [ids = Random(1)]() mutable { return ids.next_u64(); };
    return settings;
  }

  void ask_pose(wire::AskPose::Kind kind, std::uint32_t number = 0, const char* name = "") {
    send(client::pose_command(kind, number, name));
  }

  void send(const client::SessionCommand& command) { client_.session().send(command, now_); }

  void point() {
    wire::Point place;
    place.set_body(1);
    for (int i = 0; i < 3; ++i) {
      place.add_place(0.01 * i);
      place.add_place_w(0.02 * i);
    }
    send(client::command::Point{place});
  }

  void deliver() {
    for (const auto& [is_control, bytes] : std::exchange(up_, {})) {
      if (is_control) hub_.on_control_bytes(kUser, bytes, now_);
      if (!is_control) hub_.on_datagram(bytes, now_, {});
    }
    for (const auto& [is_control, bytes] : std::exchange(down_, {})) {
      if (is_control) client_.session().on_control_bytes(bytes, now_);
      if (!is_control) client_.session().on_datagram(bytes, now_);
    }
  }

  LocalTime now_{std::chrono::seconds(10)};
  Messages up_, down_;
  proto::FrameReader reader_;
  std::vector<std::byte> script_;
  std::size_t datagrams_ = 0;
  std::vector<std::unique_ptr<server::Room>> rooms_;
  server::Room& room_;
  server::PoseKeeper poses_;
  server::SessionHub hub_;
  client::ScriptedDevice device_{Vec3::Constant(0.2)};
  client::Client client_;
};

/// A hub with a room whose game has a signal, and a source of signals. The messages of the hub are recorded.
class SourceSession final : public server::ServerTransport, public client::ClientTransport {
 public:
  explicit SourceSession(const std::shared_ptr<const server::LoadedScene>& scene)
      : room_(RoomId{1}, "r", scene), hub_(hub_settings(), {&room_}, *this), source_({}, *this) {
    source_.start(now_);
    hub_.on_connected(kUser, now_, "127.0.0.1");
    source_.on_connected(now_);
  }
  std::vector<std::byte> script() {
    for (int ms = 0; ms < 2 * kReportMilliseconds; ++ms) {
      now_ += std::chrono::milliseconds(1);
      if (ms % 8 == 0) source_.set({ms % 16 == 0 ? "valence" : "unknown", 0.01 * ms, 0.9, now_});
      if (ms == kReportMilliseconds) source_.hasten_confirmation();
      source_.poll(now_);
      room_.step(server_time_of_own_clock(now_));
      hub_.poll(VirtualClock(now_));
      deliver();
      fuzz::append_act(fuzz::ServerAct::kTime, std::vector<std::byte>(8), script_);
    }
    hub_.stop(now_);
    deliver();
    return script_;
  }

  void send_control(server::ConnectionHandle, std::span<const std::byte> bytes) override {
    reader_.feed(bytes);
    while (const auto payload = reader_.next()) fuzz::append_act(fuzz::ServerAct::kMessage, *payload, script_);
    down_.emplace_back(bytes.begin(), bytes.end());
  }
  bool send_datagram(server::ConnectionHandle, std::span<const std::byte>) override { return true; }
  std::size_t queued_control_bytes(server::ConnectionHandle) const override { return 0; }
  void close(server::ConnectionHandle) override {}
  void connect(LocalTime) override {}
  void send_control(std::span<const std::byte> bytes) override { up_.emplace_back(bytes.begin(), bytes.end()); }
  bool send_datagram(std::span<const std::byte>) override { return true; }
  void set_datagram_port(std::uint16_t) override {}
  std::size_t queued_control_bytes() const override { return 0; }
  void close() override {}

 private:
  static server::HubSettings hub_settings() {
    server::HubSettings settings;
    settings.connection_ids = [ids = Random(1)]() mutable { return ids.next_u64(); };
    return settings;
  }
  void deliver() {
    for (const proto::Bytes& bytes : std::exchange(up_, {})) hub_.on_control_bytes(kUser, bytes, now_);
    for (const proto::Bytes& bytes : std::exchange(down_, {})) source_.on_control_bytes(bytes, now_);
  }

  LocalTime now_{std::chrono::seconds(10)};
  std::vector<proto::Bytes> up_, down_;
  proto::FrameReader reader_;
  std::vector<std::byte> script_;
  server::Room room_;
  server::SessionHub hub_;
  client::SignalSession source_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " FOLDER SCENES\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]), scenes(argv[2]);
  // A small scene, because the client builds a world for each scene that it receives.
  const std::string small = R"({"name": "small",
    "bodies": [{"name": "box", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.1, "graspable": true}],
    "tools": [{"name": "a", "placement": {"position_m": [0, 0, 0.02]}}, {"name": "b"}],
    "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}})";
  const auto small_scene = server::load_scene_text(small, "small.json", ".");
  fuzz::write_seed(folder / "small", Session(small_scene).script());
  const std::string game = R"({"name": "game", "tools": [{"name": "a"}],
    "bodies": [{"name": "box", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.1, "graspable": true}],
    "game": {"signals": [{"name": "valence"}], "levels": [{"name": "a", "goals": [
      {"name": "g", "conditions": [{"held": {"body": "box"}}]}]}]}})";
  fuzz::write_seed(folder / "sources" / "session",
                   SourceSession(server::load_scene_text(game, "game.json", ".")).script());
  const std::string line = "valence -0.5 0.9 1.25";
  fuzz::write_seed(folder / "sources" / "line", std::as_bytes(std::span(line)));
  // Writes the sessions that client_stages_fuzz replays, and the timelines that are its seeds.
  for (const std::string_view stage : client::stage_names())
    fuzz::write_seed(folder / "stages" / stage, Session(small_scene, std::string(stage)).script());
  fuzz::write_timeline_seeds(folder / "timelines");
  for (const std::string name : {"wall", "soft_pad", "docking_helices"})
    fuzz::write_seed(folder / name, Session(server::load_scene(scenes / (name + ".json"))).script());
  return 0;
}
