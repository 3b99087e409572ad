// Reads scenes and server states from the mailboxes, for the haptic thread.
#pragma once

#include "client/exchange/mailboxes.hpp"

namespace tandem::client {

/// Changes found by one SceneInbox::poll(). At most one of is_entered and is_changed is true.
struct SceneNews {
  bool is_entered = false;      ///< true: a new scene was received
  bool is_changed = false;      ///< true: a changed version of the current scene was received
  bool is_place_shown = false;  ///< true: another user has pointed at HapticScene::shown_W
};

/// Stores the newest scene and the newest server state of that scene. The scene is validated again here; an unusable
/// scene displays no force.
///
/// Invariants  newest() belongs to scene(): a state that arrived before its scene is discarded.
/// Thread      haptic: no allocation, no throw
class SceneInbox {
 public:
  /// In      mailboxes      must outlive this
  ///         device_bounds  limits of this user's device for the coupling, in the device's units
  SceneInbox(ClientMailboxes& mailboxes, const haptics::CouplingParameters& device_bounds) noexcept;

  /// Reads the newest scene and state from the mailboxes. Must be called once a tick.
  SceneNews poll() noexcept;

  /// Returns the newest scene, with the coupling bounds of this user's device.
  const HapticScene& scene() const noexcept { return scene_; }
  /// Returns true if the scene can be rendered: its law, coefficients and mapping are in range.
  bool is_usable() const noexcept { return is_usable_; }
  /// Returns true if handle and buttons are sent to the server.
  bool is_driving() const noexcept { return is_usable_ && scene_.may_drive; }
  /// Returns true if the scene's force may be displayed.
  bool is_displaying() const noexcept { return is_driving() && scene_.may_display; }

  /// Returns the newest server state of the scene; null if none was received.
  const ReceivedUpdate* newest() const noexcept { return has_state_ ? &mailboxes_.inbox.front() : nullptr; }
  /// Returns true if newest() arrived with the last poll().
  bool has_new_state() const noexcept { return has_new_state_; }
  /// Returns the age of newest(): time since reception plus its age at the server when sent. The result is negative if
  /// no state was received.
  Duration state_age(LocalTime now) const noexcept;

 private:
  SceneNews take_scene(const HapticScene& scene) noexcept;

  ClientMailboxes& mailboxes_;
  haptics::CouplingParameters device_bounds_;
  HapticScene scene_;
  bool is_usable_ = false;
  bool has_state_ = false;
  bool has_new_state_ = false;
};

}  // namespace tandem::client
