// Stores the validated scene of the last join, and publishes each change to the haptic thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/coupling_check.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "client/session/game_book.hpp"

namespace tandem::client {

/// Thread  io
class JoinedScene {
 public:
  /// In      device     device on which the coupling must be stable; without a device the coupling is not checked
  ///         mailboxes  must outlive this
  ///         log        called with a line of text for the user
  JoinedScene(std::optional<devices::DeviceProfile> device, ClientMailboxes& mailboxes,
              std::function<void(const std::string&)> log)
      : watch_(std::move(device)), mailboxes_(mailboxes), log_(std::move(log)) {}

  /// Stores the scene of `answer` as a new generation; publish() passes it to the haptic thread.
  /// Fails   returns the first unusable field of the message and changes nothing; empty text if the scene was stored
  std::string accept(const wire::Joined& answer, wire::Role role, LocalTime now);
  void publish() { mailboxes_.scene.publish(scene_); }
  /// Makes the haptic thread display no force and no longer drive the tool.
  void hide();

  /// Stores the coupling bounds of a user who has joined the room. Invalid bounds are ignored.
  void meet(const wire::UserJoined& user);
  /// Minimum time between the starts of two nudges of the hand, by any users. A nudge lasts 0.75 s, so the hand is free
  /// of nudges for at least 85 % of the time.
  static constexpr Duration kNudgeEvery = std::chrono::seconds(5);
  /// Nudges the hand towards a position that another user points at. Does nothing if nudges are off, or if the last
  /// nudge was less than kNudgeEvery ago.
  void show(const Vec3& place_W, LocalTime now);
  void set_nudges(bool has_nudges) { has_nudges_ = has_nudges; }
  /// Sets the common start time of the room's hands. Returns false and changes nothing if the message is invalid.
  bool set_start(const wire::RoomStart& start);
  /// Sets the body that this user's tool holds at the server. The coupling is then checked again, because its stability
  /// depends on the mass of the held body.
  void hold(BodyId body, LocalTime now);
  /// Notes the pose of the tool relative to the held body.
  void note_grip(const proto::ServerUpdate& update, LocalTime now) {
    watch_.note_grip(update.held_body, update.X_BT.p, now);
  }
  /// Sets the law or a coefficient. Returns false and changes nothing in these cases: the name is unknown, the value is
  /// out of range, or the new law cannot replace the current law.
  bool set_parameter(const wire::ParameterSet& parameter, LocalTime now);
  /// Stores the state of the room's game. Publishes the gravity and the absent bodies. Returns false and changes
  /// nothing if the state does not fit the scene.
  bool play(const wire::GameState& state);
  /// Stores an event of the game. Returns its text, or an empty text if the event does not fit the scene.
  std::string play(const wire::GameEvent& event) { return game_.receive(event); }
  const GameBook& game() const { return game_; }
  /// Sets the user's scale and rotation of the scene's mapping.
  void set_workspace(const WorkspaceSettings& workspace);
  /// Checks the coupling once a burst of changes has ended.
  void check_when_due(LocalTime now);

  /// Returns the message of the last join; null before the first join. Later changes of the coupling are included once
  /// they have been checked.
  const wire::Joined* joined() const { return joined_.get(); }
  /// Returns the name of a body for messages: its name in the scene, or "body" and the id if there is no name (e.g.
  /// "body 7").
  std::string name_of(BodyId body) const;
  const HandStart& hand_start() const { return scene_.hand_start; }
  std::uint32_t generation() const { return scene_.generation; }
  /// Returns the coupling coefficients that were last received from the server, even if they have not been checked yet.
  const haptics::CouplingParameters& coupling() const { return received_; }
  const haptics::CouplingLawInfo& law() const { return haptics::coupling_laws()[received_law_]; }
  const CouplingCheck& last_check() const { return watch_.last(); }

 private:
  bool set_law(const std::string& name, LocalTime now);
  void check();

  CouplingWatch watch_;
  ClientMailboxes& mailboxes_;
  std::function<void(const std::string&)> log_;
  std::unique_ptr<wire::Joined> joined_;
  HapticScene scene_;
  GameBook game_;
  WorkspaceMapping received_workspace_;  ///< mapping received from the server
  WorkspaceSettings own_workspace_;
  /// Coefficients received from the server. They are copied to scene_.coupling when they are checked
  haptics::CouplingParameters received_;
  std::size_t received_law_ = 0;  ///< law received from the server, as an index into coupling_laws()
  BodyId held_;
  bool has_nudges_ = true;
  std::optional<LocalTime> nudged_;  ///< time of the last nudge
};

}  // namespace tandem::client
