// One user's client: everything between a device and a connection to the server, in one object that owns it. Two
// threads call it; neither they nor sockets nor a clock are in here, so the lab drives it in virtual time, and
// client_io.hpp with haptic_loop.hpp drives it live.
//
//   device ◀──▶ haptics().tick(now) ── mailboxes (mailboxes.hpp) ──▶ session() ◀──▶ transport
//               1 kHz, haptic thread ◀────── local model ─────────── poll(now), io thread
//
// Each join is a new generation of the scene. When its assets are here and the stage shows a local model, or touches
// with a ball, the model or the ball's world is made (up to a second for a large mesh) and handed over to the haptic
// thread with its stage (client/haptics/rendering.hpp). Of large assets coarse ones are here first: the model made of them
// is replaced by that of the whole ones, which goes on where it is. Likewise when another stage is asked for; until then
// the hand is shown the old one.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "client/haptics/haptic_core.hpp"
#include "client/model/local_model.hpp"
#include "client/model/local_world.hpp"
#include "client/session/session.hpp"

namespace tandem::client {

struct ClientSettings {
  HapticSettings haptics{};
  SessionSettings session{};
  LocalModelSettings local_model{};
  /// Local models and balls' worlds are made by a thread of their own. False, for virtual time: at once, on the io
  /// thread.
  bool makes_models_aside = false;
  /// Called where the making of a model can be called off, by its thread; for tests.
  std::function<void(const std::stop_token& stop)> at_point_of_making{};
};

class Client {
 public:
  /// In      device, transport  must outlive the client
  /// Fails   std::invalid_argument: as HapticCore
  Client(const ClientSettings& settings, devices::Device& device, ClientTransport& transport);
  /// Calls off a local model or ball's world that is being made, and waits for one piece of its work, about 10 ms.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// tick() is to be called every millisecond; service() is called by poll().
  /// Thread  haptic
  HapticCore& haptics() { return core_; }
  const HapticCore& haptics() const { return core_; }
  /// Its on_… functions are for the transport, its poll() is called by the client's; on_assets is taken.
  /// Thread  io
  ClientSession& session() { return session_; }
  const ClientSession& session() const { return session_; }
  /// After every tick and every few milliseconds without: hands a made model over, sends the newest haptic update,
  /// keeps time-outs and does what the stage leaves to this thread.
  /// Thread  io
  void poll(LocalTime now);
  /// Another stage, predictor or passivity controller, without a step of the force. What the stage needs of the scene is
  /// fetched and made first. A scene that it cannot show leaves the old one, and stage_note() says why.
  /// Fails   std::invalid_argument: as HapticCore; nothing changes
  /// Thread  io
  void set_stage(const StageSettings& stage);
  /// What was asked for last, in use or on its way.
  /// Thread  io
  const StageSettings& stage() const { return settings_.haptics.stage; }
  /// Why the last scene whose local model, or ball's world, was to be made has none; empty when it has one. Instead of
  /// a local model the late pose is shown, instead of what a ball touches nothing.
  /// Thread  io
  const std::string& model_problem() const { return model_problem_; }
  /// What a user should know of how the scene in force is shown: one line, or empty.
  /// Thread  io
  const std::string& stage_note() const { return stage_note_; }
  /// From the last join until the hand was first shown a local model of its scene; none: not yet.
  /// Thread  io
  std::optional<Duration> local_after() const { return local_after_; }
  /// Likewise a model that all of the scene's assets are in, and none that stands for another.
  /// Thread  io
  std::optional<Duration> full_local_after() const { return full_local_after_; }

 private:
  struct Made;
  bool makes_something() const;
  void begin_rendering();
  void begin_when_possible();
  std::string problem_of_stage(const wire::Joined& joined) const;
  void take_made();
  void note_problem();
  void hand_over();
  void note_join(LocalTime now);
  void note_local(LocalTime now);

  ClientSettings settings_;
  ClientMailboxes mailboxes_;
  HapticCore core_;
  ClientSession session_;
  std::stop_source call_off_making_;
  std::uint32_t making_generation_ = 0;  ///< of the scene that is being made
  std::future<std::unique_ptr<Made>> making_;
  std::unique_ptr<Made> made_;    ///< not handed over yet
  ContactShapes shapes_;          ///< of the local model that was made last: the next may need the same
  bool is_stage_wanted_ = false;  ///< another one: begun once the scene's assets are here
  std::string model_problem_;
  std::string stage_note_;
  std::uint32_t joined_generation_ = 0;   ///< of the last scene that was joined …
  LocalTime joined_at_{};                 ///< … then
  std::uint32_t offered_ = 0;             ///< number of the last rendering with a local model …
  std::uint32_t offered_generation_ = 0;  ///< … of this scene
  AssetLevel offered_level_ = AssetLevel::kNone;
  std::string offered_stage_;
  std::optional<Duration> local_after_;
  std::optional<Duration> full_local_after_;
};

}  // namespace tandem::client
