// The scene of the last join as the haptic thread may have it: checked, and published anew when any of it changes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/haptics/coupling_check.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "client/haptics/mailboxes.hpp"

namespace tandem::client {

/// Thread  io
class JoinedScene {
 public:
  /// In      device     what the coupling is checked with; none: it is not checked
  ///         mailboxes  must outlive this
  ///         log        one line for people
  JoinedScene(std::optional<devices::DeviceProfile> device, ClientMailboxes& mailboxes,
              std::function<void(const std::string&)> log)
      : watch_(std::move(device)), mailboxes_(mailboxes), log_(std::move(log)) {}

  /// Keeps what `answer` says, as a new generation; publish() gives it to the haptic thread.
  /// Fails   the first field that cannot be used; nothing changes
  std::string take(const wire::Joined& answer, wire::Role role, LocalTime now);
  void publish() { mailboxes_.scene.publish(scene_); }
  /// The haptic thread drives and displays nothing of it any more.
  void hide();

  /// Another user is in the room. Bounds that are not sound are left out.
  void meet(const wire::UserJoined& user);
  /// Least time between two nudges of the hand, of all other users together. A nudge lasts 0.75 s: with this limit the hand
  /// is free of nudges for at least 85 % of the time.
  static constexpr Duration kNudgeEvery = std::chrono::seconds(5);
  /// Another user points at a place. The hand is nudged towards it, unless that is muted or the last nudge was less than
  /// kNudgeEvery ago.
  void show(const Vec3& place_W, LocalTime now);
  void set_nudges(bool has_nudges) { has_nudges_ = has_nudges; }
  /// When the hands of the room begin. False: neither awaited nor at a time; nothing changes.
  bool set_start(const wire::RoomStart& start);
  /// The server says what this user's tool holds, and what a coefficient is for it.
  void hold(BodyId body, LocalTime now);
  /// Where the tool is on the body that it holds.
  void note_grip(const proto::ServerUpdate& update, LocalTime now) {
    watch_.note_grip(update.held_body, update.X_BT.p, now);
  }
  /// Of the law or a coefficient. False: there is none of that name, it is out of its range, or no law that can take the
  /// place of the one before; nothing changes.
  bool set_parameter(const wire::ParameterSet& parameter, LocalTime now);
  /// What the user changes of the scene's mapping.
  void set_workspace(const WorkspaceSettings& workspace);
  /// Checks the coupling again once a burst of changes is over.
  void check_when_due(LocalTime now);

  /// With the coupling in force, once it has been checked. Null before the first.
  const wire::Joined* joined() const { return joined_.get(); }
  /// Of a body, for people; "body 7" where the scene has none of that number.
  std::string name_of(BodyId body) const;
  const HandStart& hand_start() const { return scene_.hand_start; }
  std::uint32_t generation() const { return scene_.generation; }
  /// The server's, checked or not.
  const haptics::CouplingParameters& coupling() const { return told_; }
  const haptics::CouplingLawInfo& law() const { return haptics::coupling_laws()[told_law_]; }
  const CouplingCheck& last_check() const { return watch_.last(); }

 private:
  bool set_law(const std::string& name, LocalTime now);
  void check();

  CouplingWatch watch_;
  ClientMailboxes& mailboxes_;
  std::function<void(const std::string&)> log_;
  std::unique_ptr<wire::Joined> joined_;
  HapticScene scene_;
  WorkspaceMapping told_workspace_;  ///< by the server
  WorkspaceSettings own_workspace_;
  haptics::CouplingParameters told_;  ///< by the server; scene_.coupling once it has been checked
  std::size_t told_law_ = 0;          ///< likewise
  BodyId held_;
  bool has_nudges_ = true;
  std::optional<LocalTime> nudged_;  ///< last
};

}  // namespace tandem::client
