// One user's client: everything between a device and a connection to the server, in one object that owns it. Two
// threads call it; neither they nor sockets nor a clock are in here, so the lab drives it in virtual time, and
// client_io.hpp with haptic_loop.hpp drives it live.
//
//   device ◀──▶ haptics().tick(now) ── mailboxes (mailboxes.hpp) ──▶ session() ◀──▶ transport
//               1 kHz, haptic thread ◀────── local model ─────────── poll(now), io thread
//
// Each join is a new generation of the scene. When its assets are here and the stage shows a local model, or touches
// with a ball, the model or the ball's world is made (up to a second for a large mesh) and handed over to the haptic
// thread (common/realtime/handover.hpp).
#pragma once

#include <future>
#include <memory>
#include <string>

#include "client/haptics/haptic_core.hpp"
#include "client/model/local_model.hpp"
#include "client/session/session.hpp"

namespace tandem::client {

struct ClientSettings {
  HapticSettings haptics{};
  SessionSettings session{};
  LocalModelSettings local_model{};
  /// Local models and balls' worlds are made by a thread of their own. False, for virtual time: at once, on the io
  /// thread.
  bool makes_models_aside = false;
};

class Client {
 public:
  /// In      device, transport  must outlive the client
  /// Fails   std::invalid_argument: as HapticCore
  Client(const ClientSettings& settings, devices::Device& device, ClientTransport& transport);
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
  /// Why the last scene whose local model, or ball's world, was to be made has none; empty when it has one. Instead of
  /// a local model the late pose is shown, instead of what a ball touches nothing.
  /// Thread  io
  const std::string& model_problem() const { return model_problem_; }
  /// What a user should know of how the scene in force is shown: one line, or empty.
  /// Thread  io
  const std::string& stage_note() const { return stage_note_; }

 private:
  struct MadeModel;
  void begin_model();
  void take_made_model();
  void hand_over_model();

  ClientSettings settings_;
  ClientMailboxes mailboxes_;
  HapticCore core_;
  ClientSession session_;
  std::future<std::unique_ptr<MadeModel>> making_;
  std::unique_ptr<MadeModel> made_;  ///< not handed over yet
  std::string model_problem_;
  std::string stage_note_;
};

}  // namespace tandem::client
