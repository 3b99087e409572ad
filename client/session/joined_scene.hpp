// The checked scene of the last join; each change is published to the haptic thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/coupling_check.hpp"
#include "client/haptics/hand_workspace.hpp"

namespace tandem::client {

/// Thread  io
class JoinedScene {
 public:
  /// In      device     device with which the coupling is checked; none: no check
  ///         mailboxes  must outlive this
  ///         log        receives one line for the user
  JoinedScene(std::optional<devices::DeviceProfile> device, ClientMailboxes& mailboxes,
              std::function<void(const std::string&)> log)
      : watch_(std::move(device)), mailboxes_(mailboxes), log_(std::move(log)) {}

  /// Stores `answer` as a new generation; publish() passes it to the haptic thread.
  /// Fails   returns the first unusable field; nothing changes
  std::string accept(const wire::Joined& answer, wire::Role role, LocalTime now);
  void publish() { mailboxes_.scene.publish(scene_); }
  /// Stops driving and displaying of the scene on the haptic thread.
  void hide();

  /// Adds another user of the room. Invalid coupling bounds are ignored.
  void meet(const wire::UserJoined& user);
  /// Minimum time between two nudges of the hand, over all other users. A nudge lasts 0.75 s, so the hand is free of
  /// nudges for at least 85 % of the time.
  static constexpr Duration kNudgeEvery = std::chrono::seconds(5);
  /// Shows a place that another user points at: nudges the hand towards it, unless nudges are off or the last one was
  /// less than kNudgeEvery ago.
  void show(const Vec3& place_W, LocalTime now);
  void set_nudges(bool has_nudges) { has_nudges_ = has_nudges; }
  /// Sets the common start of the room's hands. Returns false, without a change, if the message is invalid.
  bool set_start(const wire::RoomStart& start);
  /// Sets the body that this user's tool holds according to the server. Its coefficients may change with it.
  void hold(BodyId body, LocalTime now);
  /// Notes the tool's pose on the body that it holds.
  void note_grip(const proto::ServerUpdate& update, LocalTime now) {
    watch_.note_grip(update.held_body, update.X_BT.p, now);
  }
  /// Sets the law or a coefficient. Returns false, without a change, for an unknown name, a value out of range, or a
  /// law that cannot replace the current one.
  bool set_parameter(const wire::ParameterSet& parameter, LocalTime now);
  /// Sets the user's changes of the scene's mapping.
  void set_workspace(const WorkspaceSettings& workspace);
  /// Checks the coupling again once a burst of changes has ended.
  void check_when_due(LocalTime now);

  /// Message of the last join, updated with the coupling in use once it is checked. Null before the first.
  const wire::Joined* joined() const { return joined_.get(); }
  /// Name of a body for messages; "body 7" if the scene has no body of that number.
  std::string name_of(BodyId body) const;
  const HandStart& hand_start() const { return scene_.hand_start; }
  std::uint32_t generation() const { return scene_.generation; }
  /// Coupling last received from the server, checked or not.
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
  WorkspaceMapping received_workspace_;  ///< received from the server
  WorkspaceSettings own_workspace_;
  haptics::CouplingParameters received_;  ///< received from the server; copied to scene_.coupling when checked
  std::size_t received_law_ = 0;          ///< received from the server; index into coupling_laws()
  BodyId held_;
  bool has_nudges_ = true;
  std::optional<LocalTime> nudged_;  ///< time of the last nudge
};

}  // namespace tandem::client
