// Data that a client's io thread and haptic thread exchange by value: three newest-wins mailboxes. A local model owns
// memory and is handed over instead (client/haptics/rendering.hpp).
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

/// A server update with its time of reception.
struct ReceivedUpdate {
  proto::ServerUpdate update;
  LocalTime received{};
  Duration clock_offset{0};  ///< server − local at that instant
};

/// When this user's hand begins to follow its path, if it has one.
struct HandStart {
  enum class Kind : std::uint8_t { kAtOnce, kAwaited, kAt };
  Kind kind = Kind::kAtOnce;  ///< kAwaited: the room waits for other users
  ServerTime at{};            ///< kAt
};

/// Data of the scene for the haptic path; published when the session joins and when a parameter changes.
struct HapticScene {
  std::uint32_t generation = 0;  ///< incremented at each join; a new value resets the stages and restarts the ramp
  bool may_drive = false;        ///< joined as a manipulator: handle and buttons are sent to the server
  bool may_display = false;      ///< force is displayed; false: zero force, e.g. coupling unstable on this device
  WorkspaceMapping workspace;
  std::size_t law = 0;                   ///< index into coupling_laws()
  haptics::CouplingParameters coupling;  ///< target values for this user's tool (CouplingRamp)
  std::uint32_t tool = 0;                ///< index of this user's tool in the scene
  HandStart hand_start;
  std::uint32_t places_shown = 0;        ///< incremented for each place that another user points at
  Vec3 shown_W = Vec3::Zero();           ///< the last such place
  std::uint64_t absent_bodies = 0;       ///< bit i: the body with index i does not exist at present (wire::GameState)
  std::optional<Vec3> gravity_m_per_s2;  ///< gravity set by a game; none: that of the scene
  /// Coupling bounds of each user's device, by tool, in world units.
  std::array<haptics::CouplingParameters, proto::kMaxUsers> coupling_bounds = [] {
    std::array<haptics::CouplingParameters, proto::kMaxUsers> bounds;
    bounds.fill(haptics::kNoCouplingBounds);
    return bounds;
  }();
};

struct ClientMailboxes {
  realtime::Mailbox<proto::ClientUpdate> outbox;  ///< haptic writes, io reads
  realtime::Mailbox<ReceivedUpdate> inbox;        ///< io writes, haptic reads
  realtime::Mailbox<HapticScene> scene;           ///< io writes, haptic reads
};

}  // namespace tandem::client
