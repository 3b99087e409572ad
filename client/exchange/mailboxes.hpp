// Data that a client's io thread and haptic thread exchange by value, in three mailboxes that keep only the newest
// value. A local model is not copied but handed over as an object, because it owns memory
// (client/haptics/rendering.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/time.hpp"
#include "common/base/workspace.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/realtime/mailbox.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A server update with the time of its reception.
struct ReceivedUpdate {
  proto::ServerUpdate update;
  LocalTime received{};
  Duration clock_offset{0};  ///< server time − local time at the time of reception
};

/// Start of this user's simulated or recorded hand along its path.
struct HandStart {
  enum class Kind : std::uint8_t { kAtOnce, kAwaited, kAt };
  /// kAtOnce: at the first tick; kAwaited: not known yet, because the room waits for other users; kAt: at the time `at`
  Kind kind = Kind::kAtOnce;
  ServerTime at{};  ///< start time if kind is kAt
};

/// Settings of a scene for the haptic thread. They are published when the session joins, and after each change.
struct HapticScene {
  std::uint32_t generation = 0;  ///< incremented at each join; a new value resets the stages and restarts the ramp
  bool may_drive = false;        ///< true: joined as a manipulator: handle and buttons are sent to the server
  /// True: the scene's force may be displayed. False: zero force, for example because the coupling would be unstable on
  /// this device
  bool may_display = false;
  WorkspaceMapping workspace;
  std::size_t law = 0;  ///< index into haptics::coupling_laws()
  /// Target coefficients of the coupling of this user's tool; changes are ramped (CouplingRamp)
  haptics::CouplingParameters coupling;
  std::uint32_t tool = 0;  ///< index of this user's tool in the scene
  HandStart hand_start;
  std::uint32_t places_shown = 0;  ///< number of times that another user has pointed at a position
  Vec3 shown_W = Vec3::Zero();     ///< the position that another user pointed at last
  /// Bit i is set: the body with index i is currently absent from the scene (wire::GameState)
  std::uint64_t absent_bodies = 0;
  std::optional<Vec3> gravity_m_per_s2;  ///< gravity set by a game; empty: the scene's gravity
  /// Coupling bounds of each user's device, by tool index, in world units.
  std::array<haptics::CouplingParameters, proto::kMaxUsers> coupling_bounds = [] {
    std::array<haptics::CouplingParameters, proto::kMaxUsers> bounds;
    bounds.fill(haptics::kNoCouplingBounds);
    return bounds;
  }();
};

struct ClientMailboxes {
  /// Newest client update: written by the haptic thread, read by the io thread
  realtime::Mailbox<proto::ClientUpdate> outbox;
  /// Newest server update: written by the io thread, read by the haptic thread
  realtime::Mailbox<ReceivedUpdate> inbox;
  realtime::Mailbox<HapticScene> scene;  ///< newest scene: written by the io thread, read by the haptic thread
};

}  // namespace tandem::client
