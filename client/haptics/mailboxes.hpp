// What passes between a client's io thread and its haptic thread by value: three newest-wins mailboxes. Local models,
// which own memory, are handed over (rendering.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"
#include "common/base/workspace.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "common/realtime/mailbox.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A server update with the instant it came in.
struct ReceivedUpdate {
  proto::ServerUpdate update;
  LocalTime received{};
  Duration clock_offset{0};  ///< server − local at that instant
};

/// When this user's hand begins to follow its path, where it has one.
struct HandStart {
  enum class Kind : std::uint8_t { kAtOnce, kAwaited, kAt };
  Kind kind = Kind::kAtOnce;  ///< kAwaited: the room waits for other users
  ServerTime at{};            ///< kAt
};

/// What the haptic path needs of the scene; published when the session joins, and when a parameter changes.
struct HapticScene {
  std::uint32_t generation = 0;  ///< one more for each join; a new one resets stages and restarts the ramp
  bool may_drive = false;        ///< joined as a manipulator: handle and buttons are told to the server
  bool may_display =
      false;  ///< and what that does is felt; false: zero force, as for a coupling unstable on this device
  WorkspaceMapping workspace;
  std::size_t law = 0;                   ///< index into coupling_laws()
  haptics::CouplingParameters coupling;  ///< in force for this user's tool, where it is going (CouplingRamp)
  std::uint32_t tool = 0;                ///< this user's, index into the scene's
  HandStart hand_start;
  std::uint32_t places_shown = 0;  ///< one more for each place that somebody else points at …
  Vec3 shown_W = Vec3::Zero();     ///< … which is the last
  /// Of the coupling, that the users' devices bear, by tool; in the world.
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
