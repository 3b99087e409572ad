// One user's client: owns all parts between a haptic device and the connection to a server. It is called by two
// threads, the haptic thread and the io thread. It contains no threads, sockets or clock, so the lab can run it in
// virtual time. A live client combines it with client_io.hpp and haptic_loop.hpp.
//
//   device ◀──▶ haptics().tick(now) ── mailboxes (mailboxes.hpp) ──▶ session() ◀──▶ transport
//               1 kHz, haptic thread ◀────── local model ─────────── poll(now), io thread
//
// 1. Each join starts a new generation of the scene.
// 2. Once the assets have arrived, the io thread, or a thread that it starts, builds the model that the stage
//    (rendering method) needs: a local model, or the scene geometry for the proxy of stage "god-object". This takes up
//    to a second for a large mesh.
// 3. The model is handed over to the haptic thread together with its stage (client/haptics/rendering.hpp).
// 4. Large assets arrive first at a coarse level. A model is built from them at once. When the full assets have
//    arrived, it is replaced by a model built from them, which continues from the same state.
// 5. A newly selected stage is built in the same way. The previous stage is displayed until then.
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
  /// True: local models and proxy worlds are built on a separate thread. False: the io thread builds them within its
  /// call, which is needed in virtual time.
  bool makes_models_aside = false;
  /// Called by the building thread at each point where the build can be cancelled; for tests only.
  std::function<void(const std::stop_token& stop)> at_point_of_making{};
};

class Client {
 public:
  /// In      device, transport  must outlive the client
  /// Fails   std::invalid_argument: see the constructor of HapticCore
  Client(const ClientSettings& settings, devices::Device& device, ClientTransport& transport);
  /// Cancels a running build of a local model or proxy world. Waits for the end of the current step of the build, about
  /// 10 ms.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Returns the haptic core. The caller must call tick() of the core every millisecond. Client::poll() calls service()
  /// of the core.
  /// Thread  haptic
  HapticCore& haptics() { return core_; }
  const HapticCore& haptics() const { return core_; }
  /// Returns the session. The transport must call the session's on_… functions. Client::poll() calls poll() of the
  /// session. The callback on_assets of the session is used by this class, so it must not be set.
  /// Thread  io
  ClientSession& session() { return session_; }
  const ClientSession& session() const { return session_; }
  /// Hands over a finished model, sends the newest client update, checks time-outs, and runs the stage's work outside
  /// the haptic tick. Must be called after every tick, and every few milliseconds if no ticks run.
  /// Thread  io
  void poll(LocalTime now);
  /// Performs a command, or passes it to session().
  /// Fails   std::invalid_argument: see set_stage()
  /// Thread  io
  void send(const ClientCommand& command, LocalTime now);
  /// Selects a stage and a predictor, and switches the passivity controller, all without a step of the force. The new
  /// stage is used once its assets are fetched and its model is built. If the stage cannot display the current scene,
  /// the previous stage remains in use, and stage_note() gives the reason.
  /// Fails   std::invalid_argument: see the constructor of HapticCore; in this case nothing changes
  /// Thread  io
  void set_stage(const StageSettings& stage);
  /// Returns the stage that was requested last. It may not be in use yet.
  /// Thread  io
  const StageSettings& stage() const { return settings_.haptics.stage; }
  /// Returns the reason why the last build of a local model or proxy world failed; empty if it succeeded. After a
  /// failure, a stage that needs a local model displays "late-pose", and the stage that needs a proxy world displays no
  /// force.
  /// Thread  io
  const std::string& model_problem() const { return model_problem_; }
  /// Returns a line of text for the user about how the current scene is displayed; may be empty.
  /// Thread  io
  const std::string& stage_note() const { return stage_note_; }
  /// Returns the time from the last join until a local model of its scene was first displayed; empty if none was
  /// displayed yet.
  /// Thread  io
  std::optional<Duration> local_after() const { return local_after_; }
  /// Returns the time from the last join until a model built from all full-resolution assets was first displayed; empty
  /// if none was displayed yet.
  /// Thread  io
  std::optional<Duration> full_local_after() const { return full_local_after_; }

 private:
  struct Made;
  bool makes_something() const;
  void begin_rendering();
  void begin_when_possible();
  std::string problem_of_stage(const wire::Joined& joined) const;
  void accept_made();
  void note_problem();
  void hand_over();
  void note_join(LocalTime now);
  void note_local(LocalTime now);

  ClientSettings settings_;
  ClientMailboxes mailboxes_;
  HapticCore core_;
  ClientSession session_;
  std::stop_source call_off_making_;
  std::uint32_t making_generation_ = 0;  ///< generation of the scene for which the running build is made
  std::future<std::unique_ptr<Made>> making_;
  std::unique_ptr<Made> made_;    ///< finished build that is not yet handed over
  ContactShapes shapes_;          ///< shapes of the last local model; the next local model reuses equal shapes
  bool is_stage_wanted_ = false;  ///< true: a new stage is requested; it is built once the assets have arrived
  std::string model_problem_;
  std::string stage_note_;
  std::uint32_t joined_generation_ = 0;   ///< generation of the last joined scene
  LocalTime joined_at_{};                 ///< time of the last join
  std::uint32_t offered_ = 0;             ///< number of the last offered rendering with a local model
  std::uint32_t offered_generation_ = 0;  ///< scene generation of the last offered rendering
  AssetLevel offered_level_ = AssetLevel::kNone;
  std::string offered_stage_;
  std::optional<Duration> local_after_;
  std::optional<Duration> full_local_after_;
};

}  // namespace tandem::client
